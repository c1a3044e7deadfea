"""`.ptm` files in Pillow, for reading and saving::

    import ptmtools.pillow
    ptmtools.pillow.register()
    image = Image.open("wall.ptm")

Opening reads the head alone; texels are decoded on access. `draft` and `reduce`
choose a coarser level before that; finer groups are then neither read nor decoded.

==========================  ==========  =======================================================
samples                     components  mode
==========================  ==========  =======================================================
uint8                       1 to 4      L, LA, RGB, RGBA
uint16                      1           I;16
float32, float16 (widened)  1           F
==========================  ==========  =======================================================

Pillow has no mode for the rest; `ptmtools.texture.open` reads them. Saved are the modes 1, L, LA,
P, RGB, RGBA, I;16 and F; 1 becomes L, P becomes RGB, or RGBA where it is transparent. A colour key
(``info["transparency"]``) becomes alpha.

A file cut short opens, and decodes up to its last whole level. A finer one raises OSError when it
is loaded, unless ``PIL.ImageFile.LOAD_TRUNCATED_IMAGES`` is set: then it is the finest whole level,
each texel repeated.

A damaged profile or orientation is a warning, and texels are decoded without them. Errors have
Pillow's classes and our codes in the message. HP's Polynomial Texture Maps, which share the suffix,
are not taken for ours.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, replace
from typing import IO, Any, cast

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFile

from ptmtools.errors import InputError, PtmError
from ptmtools.texture.container import MAGIC
from ptmtools.texture.images.opening import ORIENTATION, description_of, orientation_of, read_strips
from ptmtools.texture.model import Description, EncodeOptions, Limits, PtmHeader
from ptmtools.texture.reader import PtmReader
from ptmtools.texture.sources import RowSource, ranges_of

FORMAT = "PTM"
#: Kind of sample and components → mode.
_MODES = {
    ("uint8", 1): "L",
    ("uint8", 2): "LA",
    ("uint8", 3): "RGB",
    ("uint8", 4): "RGBA",
    ("uint16", 1): "I;16",
    ("float32", 1): "F",
    ("float16", 1): "F",
}
_SAVED = ("1", "L", "LA", "P", "PA", "RGB", "RGBA", "I;16", "I;16L", "I;16B", "F")
_OPTIONS = tuple(field.name for field in fields(EncodeOptions))


class PtmImageFile(ImageFile.ImageFile):
    """One level of a `.ptm`, the finest unless another is chosen before it is loaded.

    ``info`` has ``ptm``, the file's `ptmtools.texture.PtmHeader`, and, if the file has them,
    ``icc_profile``, ``srgb``, ``gamma``, ``chromaticity`` (as Pillow's PNG) and ``exif`` with the
    orientation, which is not applied (`PIL.ImageOps.exif_transpose` does).
    """

    format = FORMAT
    format_description = "Progressive texture map"

    def _open(self) -> None:
        assert self.fp is not None
        # Pillow's own check of the number of texels comes right after this.
        everything = Limits(decoded_bytes=1 << 62)
        with _pillow_errors():
            self._ptm = PtmReader(ranges_of(cast("Any", self.fp)), everything, 1)
            header = self._ptm.header
            description = self._description()
        mode = _MODES.get((header.kind, header.components))
        if mode is None:
            raise OSError(
                f"Pillow has no mode for {header.components} components of {header.kind}; "
                "ptmtools.texture.open reads them [PTM-I126]"
            )
        self._mode = mode
        self._chosen = len(header.levels) - 1
        self._size = self.levels[-1]
        self.info["ptm"] = header
        if description.icc is not None:
            self.info["icc_profile"] = description.icc
        if description.srgb is not None:
            self.info["srgb"] = description.srgb
        if description.gamma is not None:
            self.info["gamma"] = description.gamma / 100_000
        if description.chromaticities is not None:
            self.info["chromaticity"] = tuple(v / 100_000 for v in description.chromaticities)
        if description.orientation != 1:
            exif = Image.Exif()
            exif[ORIENTATION] = description.orientation
            self.info["exif"] = exif.tobytes()

    def _description(self) -> Description:
        """None of it if it is damaged: the texels may be intact."""
        try:
            return self._ptm.description()
        except InputError as error:
            warnings.warn(f"{error}; colour and orientation are not known", stacklevel=2)
            return Description()

    @property
    def levels(self) -> list[tuple[int, int]]:
        """Width and height of every level that the file has, coarsest first."""
        return [(level.width, level.height) for level in self._header.levels]

    @property
    def level(self) -> int:
        """The number of the level that this is, or will be when it is loaded; 0 is the coarsest."""
        return self._chosen

    @level.setter
    def level(self, number: int) -> None:
        if self._im is not None:
            raise ValueError("the image is loaded; its level cannot be chosen any more")
        if not 0 <= number < len(self._header.levels):
            raise ValueError(f"there are levels 0 to {len(self._header.levels) - 1}")
        self._chosen = number
        self._size = self.levels[number]

    def draft(
        self, mode: str | None, size: tuple[int, int] | None
    ) -> tuple[str, tuple[int, int, float, float]] | None:
        """Chooses the coarsest level that is at least ``size`` wide and high, before loading.

        As for JPEG; `PIL.Image.Image.thumbnail` makes use of it. ``mode`` is not heeded. Returns
        the mode and the rectangle that the level fills, or None if nothing is chosen.
        """
        if self._im is not None or size is None:
            return None
        for number in range(self._chosen + 1):
            width, height = self.levels[number]
            if width >= size[0] and height >= size[1]:
                self.level = number
                return self.mode, (0, 0, width, height)
        return None

    @property
    def reduce(self) -> Any:
        """Set before loading: how many of the finest levels to leave out, as for JPEG 2000. It
        can be called all the same, and is then Pillow's method of that name."""
        left_out = len(self._header.levels) - 1 - self._chosen
        if left_out and self._im is None:
            return _LeftOut(left_out, super().reduce)
        return super().reduce

    @reduce.setter
    def reduce(self, levels: int) -> None:
        self.level = len(self._header.levels) - 1 - levels

    def load(self) -> Any:
        """The texels of the chosen level are decoded. Raises OSError."""
        if self._im is None and self.fp is not None:
            with _pillow_errors():
                self.im = _image(self._texels(), self.mode).im
            if self._exclusive_fp:
                self.fp.close()
            self.fp = None
        return super().load()

    @property
    def _header(self) -> PtmHeader:
        return self._ptm.header

    def _texels(self) -> NDArray[Any]:
        whole = self._ptm.whole
        if self._chosen < whole or not whole or not ImageFile.LOAD_TRUNCATED_IMAGES:
            return self._ptm.level(self._chosen)
        texels = self._ptm.level(whole - 1)
        width, height = self.size
        # As many as the level below has for each; the last is repeated for an odd size.
        steps = self._chosen - (whole - 1)
        rows = np.minimum(np.arange(height) >> steps, texels.shape[0] - 1)
        columns = np.minimum(np.arange(width) >> steps, texels.shape[1] - 1)
        return cast("NDArray[Any]", texels[rows[:, None], columns])


class _LeftOut(int):
    """A number of levels that can be called as the method that its name hides."""

    def __new__(cls, levels: int, method: Callable[..., Image.Image]) -> _LeftOut:
        result = super().__new__(cls, levels)
        result.method = method
        return result

    method: Callable[..., Image.Image]

    def __call__(self, *arguments: Any, **named: Any) -> Image.Image:
        return self.method(*arguments, **named)


def register() -> None:
    """Makes Pillow read and save `.ptm` files."""
    Image.register_open(FORMAT, PtmImageFile, _accept)
    Image.register_save(FORMAT, _save)
    Image.register_extension(FORMAT, ".ptm")
    Image.register_mime(FORMAT, "application/x-ptm")


def _accept(prefix: bytes) -> bool:
    return prefix.startswith(MAGIC)


def _image(texels: NDArray[Any], mode: str) -> Image.Image:
    if mode == "F":
        texels = texels.astype("float32", copy=False)
    return Image.fromarray(texels[:, :, 0] if texels.shape[2] == 1 else texels)


def _save(im: Image.Image, fp: IO[bytes], filename: str | bytes) -> None:
    """``save(name, **options)``: those of `ptmtools.texture.EncodeOptions` and ``threads``.

    Kept unless ``icc_profile`` or ``exif`` say otherwise: profile, sRGB, gamma and orientation.
    """
    from ptmtools.texture.encoder import encode_to

    given = im.encoderinfo
    if im.mode not in _SAVED:
        raise OSError(f"cannot write mode {im.mode} as PTM [PTM-I126]")
    with _pillow_errors(ValueError):
        options = EncodeOptions(**{name: given[name] for name in _OPTIONS if name in given})
        seeks = hasattr(fp, "seekable") and fp.seekable()
        file = fp if seeks else io.BytesIO()
        encode_to(
            file,
            _rows(im),
            options,
            description=_description(im, given),
            threads=given.get("threads", 1),
        )
    if isinstance(file, io.BytesIO) and not seeks:
        fp.write(file.getvalue())


def _description(im: Image.Image, given: Mapping[str, Any]) -> Description:
    """The image's own description, unless the arguments of ``save`` override it."""
    kept = description_of(im)
    if "icc_profile" in given:
        kept = replace(kept, icc=given["icc_profile"] or None)
    if "exif" in given:
        kept = replace(kept, orientation=orientation_of(lambda: _exif(given["exif"])))
    return kept


def _exif(given: Image.Exif | bytes | None) -> Image.Exif:
    if isinstance(given, Image.Exif):
        return given
    exif = Image.Exif()
    exif.load(given or b"")
    return exif


def _rows(im: Image.Image) -> RowSource:
    if im.mode == "1":
        im = im.convert("L")
    elif im.mode in ("P", "PA"):
        transparent = im.mode == "PA" or "transparency" in im.info
        transparent |= im.palette is not None and im.palette.mode == "RGBA"
        im = im.convert("RGBA" if transparent else "RGB")
    components = len(im.getbands())

    def texels(strip: Image.Image) -> NDArray[Any]:
        return np.asarray(strip).reshape(-1, im.width, components)

    dtype = {"F": "float32", "I": "uint16"}.get(im.mode[0], "uint8")
    return read_strips([im], components, dtype, texels, _colour_key(im)).texels


def _colour_key(im: Image.Image) -> tuple[int, ...] | None:
    """The colour that stands for transparent pixels, as in PNG and GIF."""
    key = im.info.get("transparency")
    if im.mode not in ("L", "RGB") and not im.mode.startswith("I;16"):
        return None
    key = key if isinstance(key, tuple | list) else (key,)
    whole = all(isinstance(value, int) for value in key)
    return tuple(key) if whole and len(key) == len(im.getbands()) else None


@contextmanager
def _pillow_errors(error_class: type[Exception] = OSError) -> Iterator[None]:
    """Turns our errors into OSError, which Pillow's users expect, or another class."""
    try:
        yield
    except PtmError as error:
        raise error_class(str(error)) from error
