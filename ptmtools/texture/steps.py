"""Encodes an image as the steps of a texture: a `.ptm`, and previews beside it.

A *source that is its own exact form*, a JPEG, lossy WebP or AVIF, keeps its bytes; its `.ptm` has
only the coarsest levels, and previews of the levels between fill the rest of a tenth of its bytes.
"""

from __future__ import annotations

import io
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ptmtools.texture.previews import (
    BESIDE,
    COARSE_PART,
    SOURCES,
    WORTH,
    Preview,
    PreviewOptions,
    Pyramid,
    Steps,
    coarse_levels,
)

if TYPE_CHECKING:
    from ptmtools.texture.detail import Detail
    from ptmtools.texture.images import Picture
    from ptmtools.texture.model import EncodeOptions


@dataclass(frozen=True)
class EncodedSteps:
    """The files of a texture.

    Attributes
    ----------
    ptm: the bytes of the `.ptm`. steps: what its levels and previews show.
    previews: the files of `Steps.previews`.
    """

    ptm: bytes
    steps: Steps
    previews: tuple[bytes, ...]


def encode_steps(
    picture: Picture,
    source: bytes,
    options: EncodeOptions,
    previews: PreviewOptions,
    threads: int = 1,
) -> EncodedSteps:
    """The `.ptm` of an image with the levels that the options keep, and its previews.

    Parameters
    ----------
    picture: the image; of samples deeper than 8 bits the previews have the upper 8.
    source: the bytes of its file, which may become its exact form.
    threads: as for `encode`.

    Raises as `encode`; MissingComponentError PTM-M100 if Pillow lacks the format of the previews.
    """
    return _StepsEncoder(picture, source, options, previews, threads).encode_all()


class _StepsEncoder:
    """The encoding of one image."""

    def __init__(
        self,
        picture: Picture,
        source: bytes,
        options: EncodeOptions,
        previews: PreviewOptions,
        threads: int,
    ) -> None:
        from ptmtools.texture.encoder import kept_levels
        from ptmtools.texture.images.bare import bare
        from ptmtools.texture.pyramid import build_pyramid, level_sizes
        from ptmtools.texture.samples import in_eight_bits

        self._picture, self._options, self._previews = picture, options, previews
        self._texels, self._threads = picture.array(), threads
        height, width = self._texels.shape[:2]
        sizes, kept = level_sizes(width, height), kept_levels(width, height, options)
        levels = build_pyramid(in_eight_bits(self._texels), min(sizes[kept[0]]))
        self._pyramid = Pyramid(levels[: len(kept)], levels[len(kept) :])
        #: Numbers in the complete pyramid of the kept levels, and of those that are always exact.
        self._kept = kept
        self._coarse = kept[: coarse_levels([max(sizes[n]) for n in kept])]
        format = SOURCES.get(picture.lossy or "")
        is_exact = previews.exact != "always" and kept[-1] == len(sizes) - 1
        is_exact &= len(self._coarse) < len(kept)
        self._format = format if is_exact else None
        self._source = bare(source, picture.lossy or "") if self._format else b""

    def encode_all(self) -> EncodedSteps:
        """See `encode_steps`."""
        from ptmtools.texture.container import read_header

        never = self._previews.exact == "never" and len(self._coarse) < len(self._kept)
        if self._format or never:
            data, _ = self._ptm(self._coarse[-1], BESIDE * COARSE_PART * len(self._source))
            detail = self._pyramid.detail
        else:
            data, detail = self._ptm(self._kept[-1])
        levels = len(read_header(data).levels)
        steps = self._steps(data, levels)
        previews = tuple(preview for preview, _ in steps)
        return EncodedSteps(
            data,
            Steps(detail, self._pyramid.errors, levels, previews),
            tuple(file for _, file in steps),
        )

    def _ptm(self, last: int, limit: float = 0) -> tuple[bytes, Detail]:
        """The `.ptm` with the kept levels up to ``last``, with fewer if it has more than ``limit``
        bytes; 0 is no limit."""
        from ptmtools.texture.container import read_header
        from ptmtools.texture.encoder import encode_to

        while True:
            buffer = io.BytesIO()
            options = replace(self._options, max_level=last)
            detail = encode_to(
                buffer,
                self._picture.texels,
                options,
                description=self._picture.description,
                threads=self._threads,
            )
            data = buffer.getvalue()
            if not limit or len(data) <= limit or last == self._kept[0]:
                return data, detail
            levels = read_header(data).levels
            # With an allowed error, the finest level decides how those below it are coded.
            room = math.inf if options.max_error else limit + levels[0].offset
            small = [n for n, level in zip(self._kept, levels, strict=False) if level.end <= room]
            last = min(last - 1, max(small, default=self._kept[0]))

    def _steps(self, data: bytes, levels: int) -> Sequence[tuple[Preview, bytes]]:
        """The previews beside a `.ptm`, and their files."""
        from ptmtools.texture.container import read_header

        count, pyramid, options = len(self._kept), self._pyramid, self._previews
        beyond = dict.fromkeys(range(levels, count), sys.maxsize)
        if self._format:
            source = [(pyramid.source(self._source, self._format), self._source)]
            del beyond[count - 1]
            room = BESIDE * len(self._source) - len(data)
            return [*(pyramid.ladder(options, beyond, room) if options.preview else []), *source]
        if not options.preview:
            return []
        ends = [level.end for level in read_header(data).levels]
        return pyramid.ladder(
            options, beyond or {n: math.floor(WORTH * end) for n, end in enumerate(ends)}
        )
