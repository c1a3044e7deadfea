"""What a database means for a visitor, beside the model that it was made of; from what its stages
have recorded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ptmtools.pipeline.stages import EMIT, SCENE
from ptmtools.quantities import size
from ptmtools.store.manifest import Manifest

#: What takes at least this many times the bytes of the model is called heavier.
HEAVIER = 1.05


@dataclass(frozen=True)
class Visitor:
    """
    Attributes
    ----------
    model: bytes of the model's files but for its images; None where they were not recorded.
    images: bytes of the files of its images, not of those inside the model's; likewise.
    visit: the fields of `ptmtools.database.visit.Visit`.
    """

    model: int | None
    images: int | None
    visit: Mapping[str, Any]

    @staticmethod
    def of(manifest: Manifest) -> Visitor | None:
        """Of what a manifest says; None if nothing is served, or by an earlier release."""
        emitted, read = manifest.stages.get(EMIT.name), manifest.stages.get(SCENE.name)
        visit = emitted.counts.get("visit") if emitted else None
        if not isinstance(visit, Mapping):
            return None
        counts = read.counts if read else {}
        return Visitor(counts.get("model_bytes"), counts.get("image_bytes"), visit)

    def lines(self) -> list[str]:
        """What there is to say, a line each; of a manifest that makes no sense nothing."""
        try:
            return self._lines()
        except (ArithmeticError, LookupError, TypeError, ValueError):
            return []

    def _lines(self) -> list[str]:
        visit, whole = self.visit, None
        lines = []
        if self.model is not None and self.images is not None:
            whole = self.model + self.images
            parts = f" ({size(self.model)}, and {size(self.images)} of image files)"
            lines.append(f"the model as it was: {size(whole)}{parts if self.images else ''}")

        def told(count: int) -> str:
            heavier = whole and count > HEAVIER * whole
            return size(count) + (", heavier than the model" if heavier else "")

        if visit["browser"] is not None:
            lines.append(f"a VRML browser fetches {told(visit['browser'])}")
        lines.append(f"the first room is complete after {told(visit['first_room'])}")
        for what, when in (("mean", "on average"), ("most", "at most")):
            shares = f"{visit[f'{what}_volume']:.1%} of the volume"
            if visit[f"{what}_texels"] is not None:
                shares += f" and {visit[f'{what}_texels']:.1%} of the texels"
            held = told(visit[f"{what}_at_hand"])
            lines.append(f"at hand {when} {shares}: {held}")
        return lines
