"""What a reader makes of a model file, before anything is judged, dropped or moved.

Coordinates are the file's own. A reader resolves the names of textures to something that can be
read, but opens no image: which of them some surface uses is known only after the faces have been
cleaned.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError
from ptmtools.files import open_regular
from ptmtools.scene.model import Camera, Kind, Note, Shine, Storey, Wrap
from ptmtools.scene.reference import Folder

SourceWrap = Literal[Wrap, "mirror"]
#: `Scene.triangles` is int32: more vertices cannot be numbered.
MAX_VERTICES = 2**31 - 1


def decode(raw: bytes) -> str:
    """Text of a model file: UTF-8 with or without a mark, and Latin-1 where it is not that."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def too_many_triangles(most: int, file: Path) -> LimitError:
    """The error for a model of more triangles than are to be read, PTM-L203."""
    return LimitError(
        "PTM-L203",
        f"has more than {most:,} triangles",
        file=file,
        remedy="raise the limit (--max-triangles), or split the model",
    )


@dataclass(frozen=True)
class FileRange:
    """Reads bytes of a file: all of it, or ``length`` bytes from ``offset``."""

    path: Path
    offset: int = 0
    length: int | None = None

    def __call__(self) -> bytes:
        with open_regular(self.path) as stream:
            stream.seek(self.offset)
            return stream.read() if self.length is None else stream.read(self.length)

    def size(self) -> int:
        """How many bytes there are, read or not. Raises OSError."""
        there = max(0, os.stat(self.path).st_size - self.offset)
        return there if self.length is None else min(there, self.length)


@dataclass(frozen=True)
class HeldBytes:
    """Bytes that have no file of their own (a data URI)."""

    data: bytes

    def __call__(self) -> bytes:
        return self.data


@dataclass(frozen=True)
class Texture:
    """An image as a material names it.

    Attributes
    ----------
    read: returns the bytes of the image's file.
    label: the name the emitted file is called after.
    what: how the model speaks of it ("map_Kd bricks.png"), for notes.
    place: where it does ("museum.mtl:12").
    wrap_s, wrap_t: beyond [0, 1]; "mirror" is a repetition of which every other is mirrored.
    channel: the channel that a mask takes its values from: "m" (matte), "l" (luminance), "r",
        "g", "b", or "" for matte where there is one and luminance elsewhere.
    strength: how much of it applies, in [0, 1] (glTF's occlusionTexture).
    """

    read: Callable[[], bytes]
    label: str
    what: str
    place: str
    wrap_s: SourceWrap = "repeat"
    wrap_t: SourceWrap = "repeat"
    channel: str = ""
    strength: float = 1.0


@dataclass(frozen=True)
class SourceMaterial:
    """A material of the model.

    Attributes
    ----------
    color: tint in [0, 1], sRGB; None where the model says nothing.
    opacity: in [0, 1].
    see_through: the material itself says that it is blended, tested or transmitting.
    ignores_alpha: the alpha of its texture has no effect, by the mode of the material (glTF, USD).
    cutoff: texels of less alpha are not drawn and all others are opaque (alpha testing); None where
        they are blended.
    two_sided: whether its faces have a back.
    texture, mask: colours, and a separate image of opacities (``map_d``).
    shine: where it reflects.
    """

    name: str
    color: tuple[float, float, float] | None = None
    opacity: float = 1.0
    see_through: bool = False
    ignores_alpha: bool = False
    cutoff: float | None = None
    two_sided: bool = True
    texture: Texture | None = None
    mask: Texture | None = None
    shine: Shine | None = None


@dataclass(frozen=True)
class Source:
    """Triangles in the file's units and axes.

    What a format does not say is left out: its default.

    Attributes
    ----------
    points: (P, 3) float64, may be non-finite, unused or repeated.
    triangles: (T, 3) int64 into `points`, in the order of the file.
    uv: (T, 3, 2) float64 per corner, origin at the image's lower left.
    triangle_object, triangle_material: (T,) int64.
    objects, materials, cameras: see `ptmtools.scene.model`; cameras in the file's space.
    metres, up: fixed by the format (glTF), else None.
    colors: (T, 3, 3) uint8 sRGB per corner, multiplied with the material's; None where no surface
        has any.
    step: of the coarsest grid that points lie on, in the file's units; 0 where it is float32's.
    kinds: what each object is by its class (IFC); empty where the format knows no classes.
    storeys: named by the file, their heights along its up axis in its units.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    uv: NDArray[np.float64]
    triangle_object: NDArray[np.int64]
    triangle_material: NDArray[np.int64]
    objects: tuple[str, ...]
    materials: tuple[SourceMaterial, ...]
    cameras: tuple[Camera, ...] = ()
    metres: float | None = None
    up: Literal["y", "z"] | None = None
    colors: NDArray[np.uint8] | None = None
    step: float = 0.0
    kinds: tuple[Kind, ...] = ()
    storeys: tuple[Storey, ...] = ()


class Findings:
    """Collects the notes of one ingest, in whose folder the model's files are looked for; under
    ``strict`` a miss becomes an error at the end.

    Misses are what the model asks for and does not get: files, materials, faces. Error and note
    share their number: note PTM-N203 is error PTM-I203.
    """

    def __init__(self, model: Path, allow_outside: bool = False) -> None:
        self.model = model
        self.folder = Folder(model.absolute().parent, allow_outside)
        self._notes: dict[tuple[str, str, str], int] = {}
        self._misses: list[tuple[str, str, str]] = []

    def say(self, code: str, message: str, place: str = "", count: int = 1) -> None:
        """Record something done or guessed."""
        key = (code, message, place)
        self._notes[key] = self._notes.get(key, 0) + count

    def miss(self, code: str, message: str, place: str = "", count: int = 1) -> None:
        """Record something that ``strict`` does not tolerate."""
        if (code, message, place) not in self._notes:
            self._misses.append((code, message, place))
        self.say(code, message, place, count)

    def locate(
        self,
        name: str,
        what: str,
        place: str,
        missing: str = "PTM-N204",
        base: Path | None = None,
        hint: str = "",
    ) -> Path | None:
        """`Folder.find` with a note of where the file is or why there is none, and a ``hint`` for
        what is missing."""
        found = self.folder.find(name, base)
        if found.path is None:
            if found.outcome == "outside":
                self.miss("PTM-N205", f"{what}: lies outside the model's folder", place)
            else:
                self.miss(missing, f"{what}: not found{hint}", place)
        elif found.outcome == "elsewhere":
            self.say("PTM-N208", f"{what}: found as {self.folder.label(found.path)}", place)
        return found.path

    def told(self) -> list[tuple[str, str, str, int, bool]]:
        """All of them, for `take` in another process."""
        missed = set(self._misses)
        return [(*key, count, key in missed) for key, count in self._notes.items()]

    def take(self, told: Iterable[tuple[str, str, str, int, bool]]) -> None:
        """Record what others have `told`."""
        for code, message, place, count, missed in told:
            (self.miss if missed else self.say)(code, message, place, count)

    @property
    def notes(self) -> tuple[Note, ...]:
        return tuple(Note(*key, count) for key, count in self._notes.items())

    def enforce(self) -> None:
        """Raise the first miss as an `InputError`, and say how many more there are."""
        if not self._misses:
            return
        code, message, place = self._misses[0]
        more = len(self._misses) - 1
        raise InputError(
            code.replace("-N", "-I"),
            message + (f" (and {more} more findings)" if more else ""),
            file=self.model,
            place=place or None,
            remedy="correct the model, or build without --strict",
        )
