r"""The openings of a site: each is one file with everything small that a view needs, by worth.

At 4 Mbit/s and more, round trips and requests rule the first second: a view takes a record, the
geometry of some cells and the coarse levels of some textures, each a request of a few kilobytes.
The page fetches the opening with its program, so that both are there after two round trips. Larger
previews stay files of their own, which the page requests in the order of the opening's list: their
bytes are not published twice, and a request costs little beside them.

An opening is of a *view*, a viewpoint on a screen of 16:9. (Files by cell with the coarse levels of
all that may be seen from it bring nothing to the client.) The first viewpoint has one, and those
after it as long as the openings repeat little of the site: links lead to these. The order is that
of the client (docs/formats/client.md): the worth of a step by the pixels that need it, per byte.

A site no larger than `WHOLE` has one opening, with the records, geometry and small textures of all
cells after what its view needs: those of a small building take fewer bytes in one gzip stream, as
most of a small GLB or AVIF is a head like that of the others.

The file is one gzip stream, of which a browser unpacks the parts as they arrive:

=======  ============================================================
offset   little-endian
=======  ============================================================
0        length of the JSON, uint32
4        JSON: ``parts``, a list of [kind, number, bytes]; ``next``, a
         list of [number, lines] of previews
then     the parts, one after the other
=======  ============================================================

Kinds: ``record`` and ``geometry`` of a cell; ``texture``, the beginning of a `.ptm`; ``preview``, a
file. Textures are numbered as in the index, previews in its order, over all textures. A screen with
at most the lines of its pair does not need a preview.
"""

from __future__ import annotations

import gzip
import json
import math
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.output.emission import compress
from ptmtools.output.model import sizes_of
from ptmtools.output.served import Served
from ptmtools.rendering.footprints import detail_of_pixels, footprints
from ptmtools.rendering.rays import Caster, RayCamera
from ptmtools.rendering.records import triangles_of
from ptmtools.site.choice import next_fetch, previews_of
from ptmtools.site.client import LEAST_DIFFERENCE, NOTHING, OVERHEAD
from ptmtools.site.program import address_of
from ptmtools.texture.previews import coarse_levels

#: Pixels of the view, and its aspect.
WIDTH, HEIGHT = 160, 90
#: Lines of the screen, and by how many powers of two finer a texture may be needed than it is.
LINES, FINER = 1080, 4
#: Largest preview that is a part, and largest texture with its previews of another room, bytes.
SMALL = 4096
#: Largest site with all rooms in an opening, bytes on the link without page, index and meshes.
WHOLE = 1 << 18
#: Kinds of files, as visitors of another room need them.
KINDS = "record", "geometry", "texture", "preview"
#: Share of a texture's pixels that may need a finer level than those of the opening.
FEW = 0.02
#: Largest share of a site that openings after the first repeat; the most openings: the page lists
#: their views.
REPEATED, MOST = 1 / 50, 64
_LENGTH = struct.Struct("<I")


@dataclass(frozen=True)
class Needs:
    """The pixels of a view.

    Attributes
    ----------
    cells: for each cell in view the share of the pixels that show it.
    textures: for each texture in view (M,) the share of the pixels that require each level, the
        coarsest first.
    detail: for each the level of detail λ that all but `FEW` of its pixels have or exceed, below 0
        where the finest level is not fine enough.
    """

    cells: Mapping[int, float]
    textures: Mapping[int, Floats]
    detail: Mapping[int, float]


class NeedFinder:
    """Computes the needs of viewpoints. Raises ImportError without Embree."""

    def __init__(self, served: Served) -> None:
        self._textures = served.index["textures"]
        self._triangles = triangles_of(served.surfaces)
        self._caster = Caster(served.surfaces)

    def needs(self, viewpoint: Mapping[str, Any]) -> Needs:
        """Those on the screen of `RayCamera`."""
        triangles = self._triangles
        camera = RayCamera(WIDTH, HEIGHT, viewpoint["fieldOfView"], WIDTH / HEIGHT)
        eye, direction = (np.array(viewpoint[name]) for name in ("position", "direction"))
        sight = self._caster.look(camera, eye, direction)
        hit = np.flatnonzero(sight.triangle >= 0)
        triangle, pixel_share = sight.triangle[hit], 1 / len(sight.triangle)
        cells, counts = np.unique(triangles.cell[triangle], return_counts=True)
        textures, finest = {}, {}
        for texture in np.unique(triangles.texture[triangle]).tolist():
            if texture < 0:
                continue
            pixels = hit[triangles.texture[triangle] == texture]
            sizes = sizes_of(self._textures[texture])
            width, height = (side << FINER for side in sizes[-1])
            moves = footprints(sight, pixels, triangles)[1]
            detail = detail_of_pixels(moves, width, height) - FINER
            finest[texture] = float(np.quantile(detail, FEW))
            # A pixel requires level n by max(0, min(1, N - n - λ)).
            level = np.arange(len(sizes))
            required = len(sizes) - level - np.clip(detail, 0, len(sizes) - 1)[:, None]
            textures[texture] = pixel_share * np.clip(required, 0, 1).sum(axis=0)
        shares = dict(zip(cells.tolist(), (pixel_share * counts).tolist(), strict=True))
        return Needs(shares, textures, finest)


@dataclass(frozen=True)
class OpeningStep:
    """A part of an opening, or a preview that follows it.

    Attributes
    ----------
    kind, number: see the module. end: bytes of the file up to its end.
    bytes: of the part. density: worth per byte.
    lines: of the largest screen that does not need it.
    """

    kind: str
    number: int
    end: int
    bytes: int
    density: float = field(compare=False)
    lines: int = 0


def texture_steps(
    number: int, row: Mapping[str, Any], share: Floats, first: int, detail: float = 0.0
) -> list[OpeningStep]:
    """The steps of a texture, in their order, up to one that shows what the view needs; ``first``
    is the number of its first preview, ``detail``: see `Needs`."""
    sizes, previews = sizes_of(row), previews_of([row])
    needed = 1 + int(np.flatnonzero(share > FEW * share[0])[-1])
    # No preview is finer than the first that shows what the view needs.
    count = min(len(previews.column), int(np.searchsorted(previews.column, needed)) + 1)
    exact = coarse_levels([max(size) for size in sizes]) if len(previews.column) else needed
    exact = min(exact, len(row["ends"]))
    differences = np.maximum(row["differences"], LEAST_DIFFERENCE)
    worth = previews.gains(np.append(0, differences)[None]) * np.append(0, share)
    ends = np.pad(np.append(0, row["ends"]), (0, len(sizes) - len(row["ends"])), "edge")[None]
    previews = previews._replace(first=np.array([0, count]))
    stored, last, asked = np.array([exact]), np.array([len(sizes)]), np.zeros(1, np.int64)
    pending = np.zeros(len(previews.column), np.bool_)
    steps: list[OpeningStep] = []
    present = 0
    while present < needed:
        # Exact levels after previews of finer ones would lie before these: see `contents_of`.
        busy = np.array([present >= exact])
        density, source, column = next_fetch(
            worth, ends, stored, asked, busy, last, previews, pending, OVERHEAD
        )
        if source < 0:
            break
        # Half as many lines need one level less.
        lines = math.floor(LINES * 2.0 ** (detail - (len(sizes) - present))) if present else 0
        if source == 0:
            end = int(ends[0, column])
            step = OpeningStep("texture", number, end, end - int(asked[0]), density, lines)
            asked[0] = end
        else:
            preview = source - 1
            end, column = int(previews.bytes[preview]), int(previews.column[preview])
            step = OpeningStep("preview", first + preview, end, end, density, lines)
            pending[preview] = True
        steps.append(step)
        present = max(present, column)
    return steps


def ordered_steps(
    index: Mapping[str, Any], needs: Needs, cell: int, sizes: Mapping[tuple[str, int], int]
) -> list[OpeningStep]:
    """The steps of a view, the record and the geometry of its ``cell`` first, then by worth per
    byte; ``sizes``: bytes of records and geometry by (kind, cell)."""
    textures = index["textures"]
    first = [0, *accumulate(len(row.get("previews", ())) for row in textures)]

    def whole(kind: str, number: int, worth: float) -> OpeningStep:
        length = sizes[kind, number]
        return OpeningStep(kind, number, length, length, worth / length)

    steps = [
        whole("geometry", number, NOTHING * share)
        for number, share in needs.cells.items()
        if number != cell
    ]
    for number, share in needs.textures.items():
        # A texture's steps keep their order, which is that of their worth per byte but for leaps.
        density = np.inf
        row, detail = textures[number], needs.detail.get(number, 0.0)
        for step in texture_steps(number, row, share, first[number], detail):
            density = min(density, step.density)
            steps.append(replace(step, density=density))
    steps.sort(key=lambda step: -step.density)
    return [whole("record", cell, np.inf), whole("geometry", cell, np.inf), *steps]


def other_rooms(
    index: Mapping[str, Any], steps: Sequence[OpeningStep], sizes: Mapping[tuple[str, int], int]
) -> list[OpeningStep] | None:
    """The records, geometry and small textures of all cells that are not among the ``steps`` of a
    view, by `KINDS`; None if all files of a site are larger than `WHOLE` together. ``sizes``: see
    `ordered_steps`."""
    files, first, size = dict(sizes), 0, sum(sizes.values())
    for number, row in enumerate(index["textures"]):
        whole = {("texture", number): int(row["ends"][-1])}
        for at, preview in enumerate(row.get("previews", ()), first):
            whole["preview", at] = int(preview["bytes"])
        first += len(whole) - 1
        size += sum(whole.values())
        if sum(whole.values()) <= SMALL:
            files |= whole
    if size > WHOLE:
        return None
    rest = files.keys() - {(step.kind, step.number) for step in steps}
    in_order = sorted(rest, key=lambda key: (KINDS.index(key[0]), key[1]))
    return [OpeningStep(*key, files[key], files[key], 0.0) for key in in_order]


def contents_of(steps: Sequence[OpeningStep]) -> tuple[list[OpeningStep], list[OpeningStep]]:
    """The parts of the file, and the previews that follow it."""
    ends = {step.number: step.end for step in steps if step.kind == "texture"}
    parts, later = [], []
    for step in steps:
        if step.kind == "preview" and step.bytes > SMALL:
            later.append(step)
        elif step.kind != "texture":
            parts.append(step)
        elif end := ends.pop(step.number, 0):
            # The coarsest levels together, where the first of them has its place.
            parts.append(replace(step, end=end, bytes=end))
    return parts, later


def packed_opening(steps: Sequence[OpeningStep], read: Callable[[str, int, int], bytes]) -> bytes:
    """The file; ``read`` returns the bytes of the file of a kind and number up to an end."""
    contents, later = contents_of(steps)
    parts, data = [], []
    for step in contents:
        body = read(step.kind, step.number, step.end)
        parts.append([step.kind, step.number, len(body)])
        data.append(body)
    after = [[step.number, step.lines] for step in later]
    text = json.dumps({"parts": parts, "next": after}, separators=(",", ":")).encode()
    return compress(b"".join([_LENGTH.pack(len(text)), text, *data]))


def parts_of(opening: bytes) -> list[tuple[str, int, int]]:
    """Kind, number and bytes of each part of an opening."""
    data = gzip.decompress(opening)
    end = _LENGTH.size + _LENGTH.unpack_from(data)[0]
    return [(kind, number, size) for kind, number, size in json.loads(data[4:end])["parts"]]


def openings_of(
    served: Served,
    index: Mapping[str, Any],
    read: Callable[[str, int, int], bytes],
    size: int,
) -> Iterator[tuple[bytes, Sequence[float]]]:
    """The openings of the first viewpoints of a site, and the addresses of their views; a single
    one, with a 1 after its address, if it has all rooms.

    Parameters
    ----------
    index: of the site. read: returns the bytes of the file of a kind and number up to an end.
    size: bytes of the site.

    Raises ImportError without Embree.
    """
    views, cells = NeedFinder(served), index["cells"]
    sizes = {
        (kind, number): int(row[f"{kind}Bytes"])
        for number, row in enumerate(cells)
        for kind in ("record", "geometry")
    }

    repeatable = size * REPEATED
    # The page shows all views with the angle of the first.
    angle = {"fieldOfView": index["viewpoints"][0]["fieldOfView"]}
    for number, viewpoint in enumerate(index["viewpoints"][:MOST]):
        needs = views.needs({**viewpoint, **angle})
        steps = ordered_steps(index, needs, viewpoint["cell"], sizes)
        rest = None if number else other_rooms(index, steps, sizes)
        data = packed_opening([*steps, *(rest or ())], read)
        if number:
            repeatable -= len(data)
            if repeatable < 0:
                return
        if rest is not None:
            yield data, [*address_of(viewpoint), 1]
            return
        yield data, address_of(viewpoint)
