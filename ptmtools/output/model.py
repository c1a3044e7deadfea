"""What goes into a database's served files besides the artifacts, and what comes out of them.

Options and results of `emit`, `validate_database` and `plot_plan`. Positions are world metres, Y
up (design, "Space"); angles are radians unless a name says otherwise.

What stops a reader of emitted files.

What a floor is called: by the storeys that a model names."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from ptmtools import schemas
from ptmtools.errors import InputError
from ptmtools.output.emitters import EMITTERS, chosen_emitters
from ptmtools.scene.model import Scene

if TYPE_CHECKING:
    from ptmtools.cells.options import Walker
    from ptmtools.output.emission import Visit
    from ptmtools.texture.detail import Detail
    from ptmtools.texture.model import Level


Vector = tuple[float, float, float]
#: Height of the eyes as a share of somebody's own: 1.6 m of 1.7.
EYE = 1.6 / 1.7


@dataclass(frozen=True)
class TextureRecord:
    """What the emitted files say of one image of the scene.

    Attributes
    ----------
    image: index into `Scene.images`.
    file: the `.ptm`, relative to the served folder, "textures/NAME.ptm".
    fallback: the fallback image, a PNG, relative to the served folder, or None.
    width, height, components: of the finest level stored.
    levels: as the header has them, coarsest first.
    sha256: hex digest of the `.ptm`'s bytes.
    fallback_level: index into `levels` of the one that the fallback image holds; None if there is
        no image, or if it is the finest.
    fallback_bytes: of the fallback image; 0 without.
    detail: what its levels show; None if that is not known.
    stored: where the `.ptm` lies on the disk; None if it is not at hand.
    """

    image: int
    file: str
    fallback: str | None
    width: int
    height: int
    components: int
    levels: tuple[Level, ...]
    sha256: str
    fallback_level: int | None = None
    fallback_bytes: int = 0
    detail: Detail | None = None
    stored: Path | None = field(default=None, compare=False)


@dataclass(frozen=True)
class OctreeRecord:
    """What the emitted files say of the octree texture of an object (docs/formats/apo.md).

    Attributes
    ----------
    object, number: its name, which objects may share, and its index in the scene.
    file: the stream of texels, relative to the served folder, "apo/NAME.bin".
    low, side: corner and side of the cube, world metres.
    levels: texels of each level, from the root on.
    ends: for each level, so many first bytes of the file hold it and all before it.
    crc32: of the texels of each level.
    """

    object: str
    number: int
    file: str
    low: tuple[float, ...]
    side: float
    levels: tuple[int, ...]
    ends: tuple[int, ...]
    crc32: tuple[int, ...]


@dataclass(frozen=True)
class GivenViewpoint:
    """A viewpoint that the user asks for.

    Attributes
    ----------
    position: world metres; put on the floor below where there is one within reach.
    yaw: degrees, counter-clockwise seen from above, 0 looks along -Z; None looks where there is
        most to see.
    """

    position: Vector
    yaw: float | None = None


@dataclass(frozen=True)
class Viewpoint:
    """A place to start from.

    Attributes
    ----------
    name: its DEF name, "VP_0".
    description: for a browser's menu.
    position: of the eye, world metres.
    direction: unit vector.
    orientation: (x, y, z, angle), the rotation that brings -Z to `direction` with Y kept up.
    field_of_view: radians, the smaller of the horizontal and the vertical one.
    cell: the cell that contains it.
    """

    name: str
    description: str
    position: Vector
    direction: Vector
    orientation: tuple[float, float, float, float]
    field_of_view: float
    cell: int


def _given(viewpoints: Sequence[tuple[float, ...]]) -> tuple[GivenViewpoint, ...]:
    """Viewpoints of (x, y, z[, yaw])."""
    return tuple(
        GivenViewpoint((x, y, z), rest[0] if rest else None) for x, y, z, *rest in viewpoints
    )


def _numbers(viewpoints: Sequence[GivenViewpoint]) -> list[tuple[float, ...]]:
    """Inverse of `_given`."""
    return [(*v.position, *(() if v.yaw is None else (v.yaw,))) for v in viewpoints]


@dataclass(frozen=True)
class EmitOptions:
    """
    Attributes
    ----------
    title: title of the world, which browsers show in their title bar.
    fallback: refer to the PNG of each texture as well, for clients that cannot read `.ptm`;
        otherwise only to the `.ptm`.
    viewpoints: where to begin. By default the model's cameras, or if there are none, the place with
        most to see in the largest rooms. Without YAW one looks where most is to be seen. May be
        given several times.
    viewpoint_count: give viewpoints to at most this many further rooms, the largest first. They are
        listed in the order of a walk through them.
    avatar_size: the visitor: distance kept from walls, eye height above the floor, and highest step
        climbed, all in metres. By default those of the --walker of the cells, with the eyes at
        0.94 of its height.
    field_of_view: field of view of viewpoints that are not cameras of the model, in radians.
    first_look: for each cell also write the levels of up to this many texels a side of all textures
        that can be seen from it, in one file; 0 does not.
    need: for each cell write how fine each texture is needed, measured from so many sample points;
        0 does not.
    gzip: also write a gzip copy of each VRML and JSON file, such as root.wrl.gz, for servers that
        send precompressed files.
    format: what to write, one or more names separated by commas
    """

    title: str = "ptmtools database"
    fallback: bool = True
    viewpoints: tuple[GivenViewpoint, ...] = field(
        default=(),
        metadata={"option": "viewpoint", "numbers": (3, 4), "parse": _given, "print": _numbers},
    )
    viewpoint_count: int = 32
    avatar_size: Vector | None = field(
        default=None, metadata={"default_before": (6, (0.25, 1.6, 0.75))}
    )
    field_of_view: float = 1.1
    first_look: int = 0
    need: int = field(default=16, metadata={"default_before": (8, 0)})
    gzip: bool = False
    format: str = field(
        default="vrml,gltf",
        metadata={"choices": EMITTERS, "several": True, "default_before": (5, "vrml")},
    )

    def __post_init__(self) -> None:
        wrong = None
        try:
            emitters = chosen_emitters(self.format)
            if not any(emitter.cell_files for emitter in emitters):
                raise ValueError("none of them is of cells; add vrml or gltf")
            chosen = {emitter.name for emitter in emitters}
            names = ",".join(name for name in EMITTERS if name in chosen)
            object.__setattr__(self, "format", names)
        except ValueError as fault:
            wrong = f"--format: {fault}"
        if not 0 < self.field_of_view < math.pi:
            wrong = f"a field of view of {self.field_of_view:g} is not between 0 and pi radians"
        elif not all(0 <= size < math.inf for size in self.avatar_size or ()):
            wrong = "the sizes of --avatar-size must be 0 or more"
        elif self.viewpoint_count < 0:
            wrong = f"--viewpoint-count {self.viewpoint_count} is below 0"
        elif self.first_look < 0:
            wrong = f"--first-look {self.first_look} is below 0"
        elif self.need < 0:
            wrong = f"--need {self.need} is below 0"
        if wrong:
            raise InputError("PTM-I603", wrong, remedy="leave the option out for its default")

    def avatar(self, walker: Walker) -> Vector:
        """``avatar_size``, if need be that of whoever walks in the cells."""
        eye = round(walker.height * EYE, 6)
        return self.avatar_size or (walker.radius, eye, walker.step)


@dataclass(frozen=True)
class EmitReport:
    """What `emit` wrote.

    Attributes
    ----------
    files: paths relative to the served folder, in the order of writing.
    viewpoints: the places to start from.
    shapes, triangles: written, over all cells; a piece in a boundary counts once per cell.
    collapsed: pieces left out because two corners are one after rounding to float32.
    bytes: of all files together.
    first_look: of these, bytes of first-look bundles.
    visit: what they mean for a visitor.
    notes: what there is to say, one line each.
    """

    files: tuple[str, ...]
    viewpoints: tuple[Viewpoint, ...]
    shapes: int
    triangles: int
    collapsed: int
    bytes: int
    first_look: int
    visit: Visit
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class PlotOptions:
    """
    Attributes
    ----------
    cell: shade every cell that can be seen from the cell with this number, by its average share of
        the view.
    height: how far above each storey's floor the building is cut, in metres.
    storey_gap: floors farther apart than this belong to different storeys, in metres.
    width: width of the picture, in inches.
    dpi: resolution, in dots per inch.
    """

    cell: int | None = None
    height: float = 1.2
    storey_gap: float = 1.5
    width: float = 12.0
    dpi: int = 110


@dataclass(frozen=True)
class PlotReport:
    """
    Attributes
    ----------
    file: the picture.
    floors: heights of the storeys drawn, metres.
    bytes: of the picture.
    """

    file: str
    floors: tuple[float, ...]
    bytes: int


class FileError(Exception):
    """The first thing in a file that is wrong: a code of `validation`, where, and what."""

    def __init__(self, code: str, place: str, message: str) -> None:
        self.code, self.place, self.message = code, place, message
        super().__init__(f"{place}: {message}")


@contextmanager
def shaped(code: str, place: str = "") -> Iterator[None]:
    """What is not as its schema says becomes a FileError of this code; ``place`` is that of a
    fault of the whole document."""
    try:
        yield
    except schemas.ShapeError as fault:
        raise FileError(code, fault.place or place, fault.message) from None


def storey_name(scene: Scene, floor: float, gap: float) -> str:
    """The name of the storey that is nearest to a floor, the lower of two; "" if the model names
    none that is nearer than half of ``gap``, metres. Floors that far apart are different storeys'.
    """
    near = [(abs(storey.height - floor), storey.name) for storey in scene.storeys]
    distance, name = min(near, key=lambda one: one[0], default=(gap, ""))
    return name if distance < gap / 2 else ""
