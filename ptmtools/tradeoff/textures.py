"""What the profiles of the textures buy.

All of them give the pixels back as exactly as was asked for (the profile raw always to the bit), so
what matters is few bytes. The error of a setting is the bytes of all levels over those of the
uncompressed finest level.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from ptmtools.errors import MissingComponentError
from ptmtools.pipeline.stages import SCENE, TEXTURES
from ptmtools.scene.model import SourceImage
from ptmtools.texture import EncodeOptions, encode, read_image
from ptmtools.texture.profiles import PROFILES
from ptmtools.tradeoff.experiment import Measured, Setting, timed
from ptmtools.tradeoff.experiments import Subject

#: So many images stand for all of them, each by a corner of so many texels a side.
TRIED, CORNER = 4, 512


def prepare(subject: Subject) -> TexturesTrade:
    """See `EXPERIMENTS`."""
    return TexturesTrade(subject.artifacts[SCENE].images, subject.options(TEXTURES))


class TexturesTrade:
    """The experiment of the texture profiles."""

    work = "texels"
    error = "bytes of all levels, as a share of the uncompressed finest"
    reference_error = 0.0

    def __init__(self, images: Sequence[SourceImage], options: EncodeOptions) -> None:
        chosen = np.linspace(0, len(images) - 1, min(TRIED, len(images))).astype(int)
        whole = [read_image(images[i].load()) for i in np.unique(chosen)]
        self._pixels = [pixels[:CORNER, :CORNER] for pixels in whole]
        tried = sum(pixels.size for pixels in self._pixels)
        part = tried / max(sum(pixels.size for pixels in whole), 1)
        self._times = len(images) / max(len(whole), 1) / (part or 1)
        self._options = options
        self._settings: list[Setting] = []
        for name, profile in PROFILES.items():
            knobs: dict[str, Any] = (
                {"profile": name} if profile.lossy else {"profile": name, "max_error": 0}
            )
            with suppress(MissingComponentError):
                if self._pixels:  # compiles what is compiled
                    encode(self._pixels[0][:8, :8], replace(options, **knobs))
                self._settings.append(Setting(f"--profile {name}", knobs))

    def settings(self) -> Sequence[Setting]:
        """See `Experiment.settings`."""
        return self._settings

    def measure(self, setting: Setting) -> Measured:
        """See `Experiment.measure`."""
        options = replace(self._options, **setting.knobs)
        files, seconds = timed(lambda: [encode(pixels, options) for pixels in self._pixels])
        raw = np.array([pixels.nbytes for pixels in self._pixels])
        stored = np.array([len(data) for data in files])
        return Measured(
            seconds=seconds * self._times,
            work=float(sum(pixels.shape[0] * pixels.shape[1] for pixels in self._pixels)),
            error=float(stored.sum() / max(raw.sum(), 1)),
            worst=float((stored / raw).max(initial=0.0)),
        )
