"""The text of `root.wrl`: where a walk can begin, and all cells for browsers that want them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.cellfile import HEADER
from ptmtools.database.model import EmitOptions, Viewpoint
from ptmtools.database.names import cell_path
from ptmtools.database.numerals import listed, numeral, numerals, quoted, single

#: The version of the emission pattern, in WorldInfo's first info string.
PATTERN = 1
_PROTO = (
    "PROTO PTMViewpointCell [\n"
    '  field SFString viewpoint ""\n'
    "  field MFString cellUrl   [ ]\n"
    "] {\n  WorldInfo { }\n}\n"
)


def root_text(
    viewpoints: Sequence[Viewpoint], boxes: Sequence[NDArray[np.float32]], options: EmitOptions
) -> str:
    """The root file; ``boxes`` are the (2, 3) bounds of every cell's contents.

    Raises
    ------
    DatabaseError: PTM-D601 a number is not finite in float32.
    """
    info = [quoted(f"ptm:database {PATTERN}")]
    info += [quoted(f"ptm:viewpoint {v.name} {cell_path(v.cell)}") for v in viewpoints]
    avatar = ", ".join(numeral(x) for x in options.avatar_size)
    parts = [
        HEADER,
        _PROTO,
        f"WorldInfo {{\n  title {quoted(options.title)}\n  info {listed(info, 1)}\n}}\n",
        f'NavigationInfo {{ type [ "WALK", "ANY" ] avatarSize [ {avatar} ] headlight TRUE }}\n',
    ]
    parts += [_viewpoint(v) for v in viewpoints]
    parts += [
        f"PTMViewpointCell {{ viewpoint {quoted(v.name)} cellUrl [ {quoted(cell_path(v.cell))} ]"
        " }\n"
        for v in viewpoints
    ]
    for cell, box in enumerate(boxes):
        centre, size = _centred(box)
        parts.append(
            f"Inline {{ url [ {quoted(cell_path(cell))} ]"
            f" bboxCenter {_vector(centre)} bboxSize {_vector(size)} }}\n"
        )
    return "".join(parts)


def _viewpoint(v: Viewpoint) -> str:
    position = single(v.position, f"viewpoint {v.name}")
    turn = single(v.orientation, f"viewpoint {v.name}")
    return (
        f"DEF {v.name} Viewpoint {{ position {_vector(position)} orientation {_vector(turn)}"
        f" fieldOfView {numeral(v.field_of_view)} description {quoted(v.description)} }}\n"
    )


def _vector(v: NDArray[np.float32]) -> str:
    return " ".join(numerals(v))


def _centred(box: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Centre and size in float32 that together hold the box: the size is rounded up."""
    low, high = box.astype(np.float64)
    centre = single((low + high) / 2, "bounding box")
    half = np.maximum(high - centre, centre - low)
    size = single(2 * half, "bounding box")
    short = size.astype(np.float64) < 2 * half
    return centre, np.where(short, np.nextafter(size, np.float32(np.inf)), size)
