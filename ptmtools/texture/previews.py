"""Previews: ordinary lossy images of single levels of a texture.

For the error that a visitor sees over a thin link, an exact level takes ten times the bytes of a
lossy image of it. So a texture has three kinds of steps: the coarsest levels, exact; previews,
which browsers decode by themselves; the exact levels. A preview stands alone: it needs no other
bytes. A texture whose source is lossy already keeps the bytes of that image as its finest step and
has no lossless copy. A PNG with a palette that its exact levels exceed has its finest level as a
lossless image instead.

`benchmarks/codec/previews.py` prints the bytes and errors behind these choices:

- *Files beside the `.ptm`*, not groups in it: a lossy source has to be a file of its own in any
  case, plain hosts and caches serve whole files better than ranges, and a `.ptm` stays a sequence
  of levels. Groups would save one file for each preview and 0.1 % of the bytes.
- *Every level from `FIRST_SIDE` on* has one. Below, exact levels cost next to nothing. A ladder of
  all sizes takes 1.3 to 1.5 times the bytes of the finest image, and most views need no finest one.
- *Lower quality below the finest* (`LADDER`): the next preview replaces a coarser one, and halved
  it is a better image of the coarser level than that level at higher quality for the same bytes.
- *WebP* by default: AVIF takes a tenth fewer bytes for the same error, fewer browsers read it, and
  it is slow to write; JPEG takes twice the bytes.
"""

from __future__ import annotations

import io
import math
from bisect import bisect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from ptmtools.errors import InputError, MissingComponentError
from ptmtools.options import option

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.texture.detail import Detail

    Samples = NDArray[Any]

#: Longer side of the coarsest level with a preview, texels; coarser levels are exact only.
FIRST_SIDE = 64
#: By how much the quality of previews below the finest is lower, and the lowest quality.
LADDER, LOWEST = 25, 10
#: Qualities of previews that stand for a lossy image of as many bytes.
FITTED = range(50, 96, 5)
#: A preview of more than this share of the exact bytes up to its level is not worth its file.
WORTH = 0.5
#: Bytes of a texture beside a lossy source that is its own exact form, as a share of the source;
#: and the part of them for the coarsest levels.
BESIDE, COARSE_PART = 0.1, 0.4
#: Bytes that a lossless image must save to be worth its file, beside a tenth of its levels, some of
#: which would suffice for views from afar.
WORTH_SAVING = 2048
#: Effort of its encoder, 0 to 100: the next twentieth of the bytes takes twenty times as long.
EFFORT = 75


@dataclass(frozen=True)
class PreviewFormat:
    """A format of previews.

    Attributes
    ----------
    about: for ``--help``. suffix, media: of its files. side: its longest side, texels.
    alpha: whether it holds alpha. parameters: of Pillow's writer, beside the quality.
    """

    about: str
    suffix: str
    media: str
    side: int
    alpha: bool
    parameters: Mapping[str, Any]


WEBP, AVIF, JPEG, LOSSLESS = "webp", "avif", "jpeg", "lossless"
#: Formats by name. Images with alpha are WebP where the chosen format has none.
FORMATS: Mapping[str, PreviewFormat] = {
    WEBP: PreviewFormat(
        "read by all browsers since 2020", ".webp", "image/webp", 16383, True, {"exact": True}
    ),
    AVIF: PreviewFormat(
        "read by browsers since 2022 to 2024; slow to write",
        ".avif",
        "image/avif",
        65536,
        True,
        {"speed": 8, "max_threads": 1},  # threads change the bytes
    ),
    JPEG: PreviewFormat(
        "read by everything; twice the bytes", ".jpg", "image/jpeg", 65500, False, {}
    ),
    LOSSLESS: PreviewFormat(
        "WebP of an exact level",
        ".webp",
        "image/webp",
        16383,
        True,
        {"exact": True, "lossless": True},
    ),
}
#: Formats that users choose from.
_CHOICES = {name: form for name, form in FORMATS.items() if name != LOSSLESS}
#: Formats of lossy sources, as `Picture.lossy` names them, that browsers show.
SOURCES = {"JPEG": JPEG, "WebP": WEBP, "AVIF": AVIF}
Exact = Literal["always", "lossless-sources", "never"]


@dataclass(frozen=True)
class PreviewOptions:
    """Options of the steps of a texture. Raises InputError PTM-I111 for values out of range."""

    heading: ClassVar[str] = "Textures"

    preview: int = option(
        75,
        "Quality, 1 to 100, of the previews: lossy images of single levels, which show a texture "
        "in a tenth of the bytes until its exact levels arrive. 0 writes none.",
        metavar="QUALITY",
        basic=True,
    )
    preview_format: str = option(WEBP, "Format of the previews", choices=_CHOICES)
    exact: Exact = option(
        "lossless-sources",
        "Textures with lossless levels: always all of them; lossless-sources those whose images "
        "are lossless, while a JPEG, lossy WebP or AVIF is sent as it is, or as a preview of as "
        "many bytes if browsers do not read it, and a PNG with a palette that is smaller than its "
        "levels as lossless WebP; never none, and the finest preview is the finest level.",
        basic=True,
    )

    def __post_init__(self) -> None:
        check_previews(self)


def check_previews(options: PreviewOptions) -> None:
    """Raises InputError PTM-I111 for impossible options."""
    if type(options.preview) is not int or not 0 <= options.preview <= 100:
        raise InputError(
            "PTM-I111", f"preview is {options.preview!r}", remedy="use a quality from 0 to 100"
        )
    if options.exact == "never" and not options.preview:
        raise InputError(
            "PTM-I111",
            "without previews and exact levels a texture has no fine levels",
            remedy="use --preview 75, or --exact lossless-sources",
        )


@dataclass(frozen=True)
class Preview:
    """A lossy image of one level.

    Attributes
    ----------
    level: its number, the coarsest level of the texture being 0.
    width, height: texels. bytes: of the file. format: a name in `FORMATS`.
    difference: the mean over its texels of the root mean square over the colour components, as the
        image decodes, from the exact level; 0 to 255.
    error: root mean square from the finest level, 0 to 255.
    exact: whether it is the exact form of the texture: its source, or lossless.
    """

    level: int
    width: int
    height: int
    bytes: int
    format: str
    difference: float
    error: float
    exact: bool = False


@dataclass(frozen=True)
class Steps:
    """The steps of a texture beyond the levels of its `.ptm`.

    Attributes
    ----------
    detail: of all levels, those that exist as images only included.
    errors: root mean square of each level from the finest, 0 to 255, computed from the differences
        of successive levels, which are orthogonal but for rounding and odd sides.
    exact_levels: number of levels of the `.ptm`.
    previews: by ascending level.
    """

    detail: Detail
    errors: tuple[float, ...]
    exact_levels: int
    previews: tuple[Preview, ...] = ()

    @property
    def finest_is_image(self) -> bool:
        """Whether only a preview has the finest level."""
        return self.exact_levels < len(self.errors)


class Pyramid:
    """The levels of a texture, against which its previews are measured.

    Parameters
    ----------
    levels: (h, w, c) uint8, coarsest first; the coarsest is level 0.
    finer: those of the image that follow, which the texture lacks.
    """

    def __init__(self, levels: Sequence[Samples], finer: Sequence[Samples] = ()) -> None:
        import numpy as np

        from ptmtools.texture.detail import compare_levels, detail_of, mean_surplus, squares_between

        self.levels = levels
        pairs = list(zip(levels[1:], levels[:-1], strict=True))
        sizes = [level.shape[0] * level.shape[1] for level in levels]
        beyond = mean_surplus([levels[-1], *finer])
        self.detail = detail_of(levels[0], (compare_levels(*pair) for pair in pairs), beyond)
        squares = [squares_between(*pair) / n for pair, n in zip(pairs, sizes[1:], strict=True)]
        #: Mean squares from the finest level.
        self.squares = [*np.cumsum(squares[::-1])[::-1].tolist(), 0.0]

    @property
    def errors(self) -> tuple[float, ...]:
        """See `Steps`."""
        from ptmtools.texture.detail import round_difference

        return tuple(round_difference(math.sqrt(square)) for square in self.squares)

    def preview(self, level: int, quality: int, wanted: str) -> tuple[Preview, bytes]:
        """The preview of a level, and its file; in another format where the one wanted holds no
        alpha or no image of that size.

        Raises MissingComponentError PTM-M100 if Pillow lacks the format.
        """
        texels = self.levels[level]
        alpha, side = texels.shape[2] in (2, 4), max(texels.shape[:2])
        name = next(
            name
            for name in (wanted, WEBP, AVIF)
            if (FORMATS[name].alpha or not alpha) and side <= FORMATS[name].side
        )
        data = image_bytes(texels, name, quality)
        return self.measure(level, data, name), data

    def fit_preview(self, level: int, size: int, wanted: str) -> tuple[Preview, bytes]:
        """As `preview`, of the highest of `FITTED` whose file has at most ``size`` bytes, or of the
        lowest."""
        encode = cache(lambda quality: self.preview(level, quality, wanted))
        place = bisect(FITTED, size, key=lambda quality: encode(quality)[0].bytes)
        return encode(FITTED[max(0, place - 1)])

    def measure(self, level: int, data: bytes, name: str) -> Preview:
        """The preview that a file is of a level."""
        import numpy as np

        from ptmtools.texture.detail import colours_of, round_difference

        texels = self.levels[level]
        height, width, components = texels.shape
        colours = colours_of(components)
        length = square = 0.0
        decoded = decode_preview(data, components)
        for y in range(0, height, 256):
            strip = slice(y, y + 256)
            apart = decoded[strip, :, :colours].astype(np.float32) - texels[strip, :, :colours]
            squares = np.einsum("ijk,ijk->ij", apart, apart, dtype=np.float64) / colours
            length += float(np.sqrt(squares).sum())
            square += float(squares.sum())
        texel_count = height * width
        error = math.sqrt(self.squares[level] + square / texel_count)
        difference = round_difference(length / texel_count)
        return Preview(level, width, height, len(data), name, difference, round_difference(error))

    def exact(self, data: bytes, name: str) -> Preview:
        """The preview that is the exact form of the texture."""
        height, width = self.levels[-1].shape[:2]
        return Preview(len(self.levels) - 1, width, height, len(data), name, 0.0, 0.0, exact=True)

    def ladder(
        self,
        options: PreviewOptions,
        limits: Mapping[int, int],
        total: float = math.inf,
        *,
        exact_follows: bool = False,
    ) -> list[tuple[Preview, bytes]]:
        """The previews of levels from `FIRST_SIDE` on, by ascending level.

        Parameters
        ----------
        limits: the greatest number of bytes worth while, for each level that may have a preview.
        total: bytes of all previews; finer ones are left out from the first that exceeds it.
        exact_follows: whether an exact image of the finest level replaces its preview.
        """
        kept: list[tuple[Preview, bytes]] = []
        finest = len(self.levels) - 1
        for level, limit in sorted(limits.items()):
            if max(self.levels[level].shape[:2]) < FIRST_SIDE and level < finest:
                continue
            lower = 0 if level == finest and not exact_follows else LADDER
            quality = max(options.preview - lower, min(options.preview, LOWEST))
            preview, file = self.preview(level, quality, options.preview_format)
            if preview.bytes > limit:
                continue
            total -= preview.bytes
            if total < 0:
                break
            kept.append((preview, file))
        return kept


def coarse_levels(sides: Sequence[int]) -> int:
    """The number of levels that are exact in any case, given the longer side of each, coarsest
    first: those below `FIRST_SIDE` texels, and the coarsest."""
    return max(1, sum(side < FIRST_SIDE for side in sides))


def image_bytes(texels: Samples, name: str, quality: int, **more: Any) -> bytes:
    """(h, w, c) uint8 texels as an image of a format in `FORMATS`, with ``more`` parameters of the
    encoder; grey becomes RGB in WebP and AVIF. Raises MissingComponentError PTM-M100 if Pillow
    lacks the format."""
    import numpy as np
    from PIL import Image, features

    if name == AVIF and not features.check("avif"):
        raise MissingComponentError(
            "PTM-M100",
            "this Pillow cannot write AVIF",
            remedy="install Pillow 11.3 or newer, or use --preview-format webp",
        )
    components = texels.shape[2]
    shown = texels
    if components == 2 or (components == 1 and name != JPEG):
        shown = np.concatenate([np.repeat(texels[..., :1], 3, axis=2), texels[..., 1:]], axis=2)
    image = Image.fromarray(shown[..., 0] if shown.shape[2] == 1 else shown)
    buffer = io.BytesIO()
    form = FORMATS[name]
    image.save(buffer, form.media[6:].upper(), quality=quality, **form.parameters, **more)
    return buffer.getvalue()


def decode_preview(data: bytes, components: int) -> NDArray[np.uint8]:
    """(h, w, components) the texels of a preview's file. Raises what Pillow raises."""
    import numpy as np
    from PIL import Image

    with Image.open(io.BytesIO(data)) as image:
        texels = np.asarray(image.convert("RGBA" if components in (2, 4) else "RGB"))
    if components < 3:
        texels = texels[..., [0, 3][:components]]
    return texels
