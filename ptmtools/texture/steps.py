"""Encodes an image as the steps of a texture: a `.ptm`, and previews beside it.

A *source that is its own exact form*, a JPEG, lossy WebP or AVIF, keeps its bytes; its `.ptm` has
only the coarsest levels, and previews of the levels between fill the rest of a tenth of its bytes.
A lossy source that browsers do not read, or that was converted, has a preview of as many bytes
instead: exact levels would repeat its losses in four times the bytes.

A PNG with a palette that its exact levels and previews exceed has its finest level as lossless
WebP: it takes 0.8 to 1.0 of the PNG so, and 1.2 to 1.7 as levels, which code colours and not their
places in the palette. The finest level has a lossy preview besides, since a
lossless image is of no use before its last byte.
"""

from __future__ import annotations

import io
import math
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ptmtools.texture.previews import (
    BESIDE,
    COARSE_PART,
    EFFORT,
    FORMATS,
    LOSSLESS,
    SOURCES,
    WORTH,
    WORTH_SAVING,
    Preview,
    PreviewOptions,
    Pyramid,
    Steps,
    coarse_levels,
    image_bytes,
)

if TYPE_CHECKING:
    from ptmtools.texture.detail import Detail
    from ptmtools.texture.images import Picture
    from ptmtools.texture.model import EncodeOptions

#: The beginning of a PNG whose texels are places in a palette (RFC 2083, 4.1.1).
_PALETTE = re.compile(rb"\x89PNG\r\n\x1a\n.{17}\x03", re.DOTALL)


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
        from ptmtools.texture.pyramid import build_pyramid, level_sizes
        from ptmtools.texture.samples import in_eight_bits

        self._picture, self._options, self._previews = picture, options, previews
        self._source = source
        self._texels, self._threads = picture.array(), threads
        height, width = self._texels.shape[:2]
        sizes, kept = level_sizes(width, height), kept_levels(width, height, options)
        levels = build_pyramid(in_eight_bits(self._texels), min(sizes[kept[0]]))
        self._pyramid = Pyramid(levels[: len(kept)], levels[len(kept) :])
        #: Numbers in the complete pyramid of the kept levels, and of those that are always exact.
        self._kept = kept
        self._coarse = kept[: coarse_levels([max(sizes[n]) for n in kept])]
        self._is_whole = kept[-1] == len(sizes) - 1 and len(self._coarse) < len(kept)
        #: The finest level as an image, beside which only the coarse levels are exact.
        self._finest = self._lossy_level() if self._is_whole else None

    def encode_all(self) -> EncodedSteps:
        """See `encode_steps`."""
        from ptmtools.texture.container import read_header

        never = self._previews.exact == "never" and len(self._coarse) < len(self._kept)
        if not self._finest and not never:
            data, detail = self._ptm(self._kept[-1])
            self._finest = self._lossless_level(len(data))
        if self._finest or never:
            size = self._finest[0].bytes if self._finest else 0
            data, _ = self._ptm(self._coarse[-1], BESIDE * COARSE_PART * size)
            detail = self._pyramid.detail
        levels = len(read_header(data).levels)
        steps = self._steps(data, levels)
        previews = tuple(preview for preview, _ in steps)
        return EncodedSteps(
            data,
            Steps(detail, self._pyramid.errors, levels, previews),
            tuple(file for _, file in steps),
        )

    def _lossless_level(self, size: int) -> tuple[Preview, bytes] | None:
        """The finest level as a lossless image, if the source is a PNG with a palette, which its
        exact levels, of ``size`` bytes, and their previews exceed; None also where that image saves
        little."""
        texels, source = self._texels, len(self._source)
        if (
            not (self._is_whole and self._previews.exact == "lossless-sources")
            or _PALETTE.match(self._source) is None
            or (1 + BESIDE) * size < source + WORTH_SAVING
            or texels.dtype.itemsize > 1
            or max(texels.shape) > FORMATS[LOSSLESS].side
        ):
            return None
        data = image_bytes(texels, LOSSLESS, EFFORT)
        if len(data) + WORTH_SAVING > (1 - BESIDE) * size:
            return None
        return self._pyramid.exact(data, LOSSLESS), data

    def _lossy_level(self) -> tuple[Preview, bytes] | None:
        """The finest level as the file of a lossy source or as a preview of as many bytes; None for
        one that shall have exact levels, or the finest preview of all sources."""
        from ptmtools.texture.images.bare import bare

        lossy, options, level = self._picture.lossy, self._previews, len(self._kept) - 1
        if lossy is None or options.exact == "always":
            return None
        if format := SOURCES.get(lossy.format):
            data = bare(self._source, lossy.format)
            return self._pyramid.exact(data, format), data
        if options.exact == "never" or not options.preview:
            return None
        return self._pyramid.fit_preview(level, lossy.bytes, options.preview_format)

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
        if self._finest:
            size, lossless = self._finest[0].bytes, self._finest[0].format == LOSSLESS
            beside = BESIDE * size
            if lossless:
                beside = max(beside, len(self._source) - size)
            else:
                del beyond[count - 1]
            if not options.preview:
                return [self._finest]
            ladder = pyramid.ladder(options, beyond, beside - len(data), exact_follows=lossless)
            return [*ladder, self._finest]
        if not options.preview:
            return []
        ends = [level.end for level in read_header(data).levels]
        return pyramid.ladder(
            options, beyond or {n: math.floor(WORTH * end) for n, end in enumerate(ends)}
        )
