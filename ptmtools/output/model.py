"""Options, records and results of `emit`, `validate_database` and `plot_plan`.

Positions are world metres, Y up (design, "Space"); angles are radians unless a name says otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from ptmtools import schemas
from ptmtools.errors import InputError
from ptmtools.options import degrees_text, option, require

if TYPE_CHECKING:
    from ptmtools.cells.options import Walker
    from ptmtools.texture.detail import Detail
    from ptmtools.texture.model import Level
    from ptmtools.texture.previews import Preview
    from ptmtools.texture.sources import PtmSource


Vector = tuple[float, float, float]
#: Height of the eyes as a share of the body's: 1.6 m of 1.7.
EYE = 1.6 / 1.7


@dataclass(frozen=True)
class PreviewRecord:
    """A preview of a texture: its file, relative to the served folder, its properties, and the file
    to read, if it was encoded."""

    file: str
    preview: Preview
    stored: PtmSource | None = field(default=None, compare=False)


@dataclass(frozen=True)
class TextureRecord:
    """The texture of one image of the scene, the lightmap of a cell, or the normal map of an
    object, for the emitted files.

    Attributes
    ----------
    image: index into `Scene.images`, or -1.
    file: the `.ptm`, relative to the served folder, "textures/NAME.ptm".
    fallback: the fallback image, a PNG or a preview, relative to the served folder, or None.
    width, height, components: of the finest level in the `.ptm`.
    levels: as the header has them, coarsest first.
    sha256: hex digest of the `.ptm`'s bytes.
    fallback_level: number of the level in the fallback image; None without an image, or if it is
        the finest of the `.ptm`.
    fallback_bytes: of the fallback image; 0 without.
    detail: mean colour and differences of all levels; None if unknown.
    stored: the `.ptm` to read; None if it was not encoded.
    errors: root mean square of each level from the finest, 0 to 255; empty if unknown.
    previews: by ascending level; the finest may be of levels that the `.ptm` lacks.
    cell, object: the cell whose lightmap it is, or -1; the object whose normal map, or -1.
    probe: the cell whose probe it is, or -1.
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
    stored: PtmSource | None = field(default=None, compare=False)
    errors: tuple[float, ...] = ()
    previews: tuple[PreviewRecord, ...] = ()
    cell: int = -1
    object: int = -1
    probe: int = -1

    @property
    def level_count(self) -> int:
        """Number of levels, those that exist as images only included."""
        finest = self.previews[-1].preview.level + 1 if self.previews else 0
        return max(len(self.levels), finest)

    @property
    def finest(self) -> tuple[int, int]:
        """Width and height of the finest level."""
        if self.level_count == len(self.levels):
            return self.width, self.height
        preview = self.previews[-1].preview
        return preview.width, preview.height


def sizes_of(row: Mapping[str, Any]) -> list[tuple[int, int]]:
    """(width, height) of all levels of a row of `textures`, coarsest first, those that exist as
    previews only included."""
    width, height, count = row["width"], row["height"], len(row["ends"])
    previews = row.get("previews", ())
    if previews and previews[-1]["level"] >= count:
        finest = previews[-1]
        width, height, count = finest["width"], finest["height"], finest["level"] + 1
    shifts = range(count - 1, -1, -1)
    return [(max(1, width >> shift), max(1, height >> shift)) for shift in shifts]


def offsets_of(row: Mapping[str, Any]) -> list[int]:
    """What clients add to the colours of each level of a row of `textures`, coarsest first; 0 for
    levels without."""
    offsets, count = row.get("offsets", ()), len(sizes_of(row))
    return [*offsets[:count], *([0] * (count - len(offsets)))]


def probe_fault(row: Mapping[str, Any], cells: int) -> tuple[str, str]:
    """The member of a row of `textures` that is wrong for a probe, and a message; two empty texts
    if it is right, or no probe. ``cells``: their number."""
    from ptmtools.light.model import PROBE_SIZE

    probe = row.get("probe")
    if probe is None:
        return "", ""
    if probe["cell"] >= cells:
        return "probe.cell", f"the index {probe['cell']} is out of range"
    if any(a > b for a, b in zip(probe["low"], probe["high"], strict=True)):
        return "probe.low", "is above high"
    if sizes_of(row)[-1] != PROBE_SIZE or row["components"] != 3:
        return "probe", "its image is not one of {} x {} texels in colour".format(*PROBE_SIZE)
    if "color" not in row:
        return "color", "is missing of a probe"
    return "", ""


@dataclass(frozen=True)
class GivenViewpoint:
    """A viewpoint that the user asks for.

    Attributes
    ----------
    position: world metres; moved to the floor below if one is within reach.
    yaw: degrees, counter-clockwise seen from above, 0 looks along -Z; None chooses the best view.
    """

    position: Vector
    yaw: float | None = None


@dataclass(frozen=True)
class Viewpoint:
    """A place where a walk may start.

    Attributes
    ----------
    name: its DEF name, "VP_0".
    description: for a browser's menu.
    position: of the eye, world metres.
    direction: unit vector.
    orientation: (x, y, z, angle), the rotation that turns -Z to `direction` and keeps Y up.
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


def _parse_viewpoint(viewpoints: Sequence[tuple[float, ...]]) -> tuple[GivenViewpoint, ...]:
    """Viewpoints of (x, y, z[, yaw])."""
    return tuple(
        GivenViewpoint((x, y, z), rest[0] if rest else None) for x, y, z, *rest in viewpoints
    )


def _numbers(viewpoints: Sequence[GivenViewpoint]) -> list[tuple[float, ...]]:
    """Inverse of `_given`."""
    return [(*v.position, *(() if v.yaw is None else (v.yaw,))) for v in viewpoints]


@dataclass(frozen=True)
class WriterOptions:
    """Options of the writers of served files.

    Raises InputError PTM-I111 for values out of range.
    """

    heading: ClassVar[str] = "Served files"

    title: str = option(
        "ptmtools database", "Title of the database, which VRML browsers show.", basic=True
    )
    fallback: bool = option(
        True, "Also refer to the PNG of each texture, for clients that cannot read .ptm."
    )
    plain_gltf: bool = option(
        False,
        "Write GLBs without compression, with the exact coordinates, for viewers that cannot read "
        "EXT_meshopt_compression.",
    )
    gltf_step: float | None = option(
        None,
        "Largest rounding step of positions in compressed GLBs. Default: 1 mm or a tenth of the "
        "least thickness, whichever is less.",
        metavar="METRES",
    )
    viewpoints: tuple[GivenViewpoint, ...] = option(
        (),
        "Viewpoint inside the building: position in metres, Y up, and yaw in degrees, "
        "counter-clockwise from -Z; without YAW, towards the best view. Default: the model's "
        "cameras, or the best views in the largest rooms. Repeatable.",
        name="viewpoint",
        metavar="X,Y,Z[,YAW]",
        numbers=(3, 4),
        parse=_parse_viewpoint,
        print=_numbers,
    )
    viewpoint_count: int = option(
        32,
        "Maximum number of viewpoints in addition to those of --viewpoint and of the model's "
        "cameras: one per room, the best first. They are listed in the order in which a walk "
        "passes them.",
    )
    avatar_size: Vector | None = option(
        None,
        "Size of the visitor in the viewer and in VRML browsers: distance from walls, eye height "
        "and highest step, in metres. Default: the size of --walker, with the eyes at 0.94 times "
        "its height.",
        metavar="RADIUS,EYE,STEP",
    )
    field_of_view: float = option(
        1.1,
        "Field of view of viewpoints that are not cameras of the model.",
        metavar="DEGREES",
        degrees=True,
    )
    lods: Literal["auto", "none"] = option(
        "auto",
        "Levels of detail of objects with thousands of triangles: auto (clients of the GLBs draw a "
        "simplified mesh first, and finer ones where the difference can be seen) or none.",
    )
    tone: Literal["neutral", "agx"] = option(
        "neutral",
        "Tone curve of buildings with baked light: neutral (colours stay those of the model up to "
        "0.8 of white, as pictures want) or agx (softer contrast, as film; bright colours pale). "
        "Without effect on light of the model, and without light.",
    )
    need: int = option(
        16,
        "Number of sample points per cell for measuring the required resolution of each texture; "
        "0 omits this measurement.",
    )
    gzip: bool = option(
        False,
        "Also write a gzip copy of each VRML and JSON file, for servers that send precompressed "
        "files.",
    )

    def __post_init__(self) -> None:
        fault = ""
        if not 0 < self.field_of_view < math.pi:
            fault = (
                f"a field of view of {degrees_text(self.field_of_view)}° is not between 0 and 180"
            )
        elif not all(0 <= size < math.inf for size in self.avatar_size or ()):
            fault = "the sizes of --avatar-size must be 0 or more"
        elif self.viewpoint_count < 0:
            fault = f"--viewpoint-count {self.viewpoint_count} is below 0"
        elif self.gltf_step is not None and not 0 < self.gltf_step < math.inf:
            fault = f"--gltf-step {self.gltf_step:g} m is not above 0"
        elif self.need < 0:
            fault = f"--need {self.need} is below 0"
        if fault:
            raise option_error(fault)

    def avatar(self, walker: Walker) -> Vector:
        """``avatar_size``, by default that of the walker."""
        eye = round(walker.height * EYE, 6)
        return self.avatar_size or (walker.radius, eye, walker.step)


def option_error(problem: str) -> InputError:
    """The error for an option out of range."""
    return InputError("PTM-I111", problem, remedy="leave the option out for its default")


@dataclass(frozen=True)
class VisitCost:
    """The cost of a visit, see `ptmtools.output.emission`.

    Attributes
    ----------
    browser: bytes that a VRML browser fetches; None without VRML.
    first_room: bytes until the first room is complete.
    simplified: bytes until it is drawn with simplified meshes; None where no object has levels of
        detail.
    mean_at_hand, most_at_hand: resident bytes.
    mean_90, mean_99: bytes, with their textures, of the cell itself and of the fewest others that
        cover 90 and 99 % of the average view, mean over places.
    everything: bytes of all cells and textures.
    mean_volume, most_volume: share of the volume of all cells that is resident.
    mean_texels, most_texels: share of the texels in use; None without textures.
    """

    browser: int | None
    first_room: int
    simplified: int | None
    mean_at_hand: int
    most_at_hand: int
    mean_90: int
    mean_99: int
    everything: int
    mean_volume: float
    most_volume: float
    mean_texels: float | None
    most_texels: float | None


@dataclass(frozen=True)
class EmitReport:
    """The files that `emit` wrote.

    Attributes
    ----------
    files: paths relative to the served folder, in the order of writing.
    viewpoints: where a walk may start.
    shapes, triangles: written, over all cells; a piece in a boundary counts once per cell.
    collapsed: pieces left out because two corners are one after rounding to float32.
    bytes: of all files together.
    visit: the cost of a visit.
    notes: remarks, one line each.
    """

    files: tuple[str, ...]
    viewpoints: tuple[Viewpoint, ...]
    shapes: int
    triangles: int
    collapsed: int
    bytes: int
    visit: VisitCost
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class PlotOptions:
    """Options of `plot_plan`."""

    heading: ClassVar[str] = "Plan"

    cell: int | None = option(
        None, "Shade the cells visible from this one by their average share of the view."
    )
    height: float = option(
        1.2,
        "Height of the horizontal cut above the floor of each storey, and between two of them at "
        "least.",
        metavar="METRES",
    )
    width: float = option(12.0, "Width of the picture.", metavar="INCHES")
    dpi: int = option(110, "Resolution, in dots per inch.")

    def __post_init__(self) -> None:
        """Raises InputError PTM-I111 for an impossible height."""
        sound = 0 < self.height < float("inf")
        require((sound, f"height is {self.height:g}", "use a number of metres above 0"))


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
    """The first fault in a file: a code of `validation`, the place, and a message."""

    def __init__(self, code: str, place: str, message: str) -> None:
        self.code, self.place, self.message = code, place, message
        super().__init__(f"{place}: {message}")


@contextmanager
def convert_shape_errors(code: str, place: str = "") -> Iterator[None]:
    """Turns a violation of a schema into a FileError of this code; ``place`` is that of a fault of
    the whole document."""
    try:
        yield
    except schemas.ShapeError as fault:
        raise FileError(code, fault.place or place, fault.message) from None
