"""What `hints.json` must satisfy beside its schema: by itself, and against the cell files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools import schemas
from ptmtools.database.fault import FileError, shaped
from ptmtools.database.validation.cells import ReadCell
from ptmtools.database.validation.findings import Place
from ptmtools.database.validation.lists import check_graph, check_list, check_shares
from ptmtools.database.validation.space import check_space

#: How far sums of statistics, which are rounded, may be off.
ROUNDED = 1e-3
#: How far the ach values in full precision may sum up beside 1.
ACH_SLACK = 1e-9
#: Missed mass above this is worth a warning.
MISSED = 1e-4

#: Hints, or an object in them, as JSON has them: as the schema says, and every index in range.
Row = Mapping[str, Any]
#: The files of a texture in the served folder, the fallback image first; None is not there.
Images = tuple[str | None, ...]


def read_hints(data: bytes) -> Row:
    """The hints. Raises FileError PTM-D700 if they are not what their schema says."""
    with shaped("PTM-D700"):
        hints: Row = schemas.read(data, schemas.HINTS)
    _check_indices(hints)
    return hints


def check_hints(hints: Row, at: Place) -> None:
    """Checks all that needs no other file."""
    cells = hints["cells"]
    places = [at.at(f"cells[{i}]") for i in range(len(cells))]
    for i, (cell, here) in enumerate(zip(cells, places, strict=True)):
        check_list("adjacent", i, cell["adjacent"], here)
        check_list("visible", i, cell["visible"], here)
        check_list("textures", None, cell["textures"], here)
        ach = np.array(cell["ach"], dtype=np.float64)
        check_shares(ach, ACH_SLACK, ("PTM-D702", "PTM-D702"), here)
        if len(ach) != len(cell["visible"]):
            here.add("PTM-D702", f"{len(ach)} ach values for {len(cell['visible'])} visible cells")
        elif wrong := _misfit(cell["coverage"], ach):
            here.add("PTM-D707", wrong)
        if cell["missed"] > MISSED:
            share = f"{cell['missed']:.3g} of the pixels"
            here.add("PTM-D703", f"{share} fell on cells outside the PVS")
    adjacent, visible = (
        {i: cell[name] for i, cell in enumerate(cells)} for name in ("adjacent", "visible")
    )
    check_graph(adjacent, visible, places.__getitem__)
    used = {texture for cell in cells for texture in cell["textures"]}
    for i, texture in enumerate(hints["textures"]):
        if i not in used:
            at.add("PTM-D708", f"no cell uses {texture['file']}", f"textures[{i}]")
    check_space(cells, hints["viewpoints"], at)


def check_against_cells(
    hints: Row,
    known: Sequence[str],
    images: Sequence[Images],
    cells: Mapping[str, ReadCell],
    cell_images: Mapping[str, set[Images]],
    at: Place,
) -> None:
    """Compares with the cell files.

    Parameters
    ----------
    known: for each cell of the hints the name of its file in cells/, which need not be there.
    images: for each texture of the hints its files.
    cells: by the names of their files.
    cell_images: the files of each of their image textures.
    """
    for absent in sorted(set(cells) - set(known)):
        at.add("PTM-D701", f"{absent} is missing")
    for i, (name, row) in enumerate(zip(known, hints["cells"], strict=True)):
        cell = cells.get(name)
        if cell is None:
            continue
        listed, shown = {images[t] for t in row["textures"]}, cell_images[name]
        complete = not any(None in files for files in listed | shown)
        same: dict[str, bool] = {
            "name": row["name"] == cell.name,
            "adjacent": tuple(known[c] for c in row["adjacent"]) == cell.adjacent,
            "visible": tuple(known[c] for c in row["visible"]) == cell.visible,
            "ach": _equal_single(row["ach"], cell.ach),
            "leaves": _same_leaves(row["leaves"], cell),
            "textures": listed == shown or not complete,
        }
        for field in (f for f, equal in same.items() if not equal):
            at.add("PTM-D701", f"differs from {name}", f"cells[{i}].{field}")


def _check_indices(hints: Row) -> None:
    cells, textures = len(hints["cells"]), len(hints["textures"])
    for i, view in enumerate(hints["viewpoints"]):
        _in_range([view["cell"]], cells, f"viewpoints[{i}].cell")
    for i, cell in enumerate(hints["cells"]):
        place = f"cells[{i}]"
        _in_range(cell["adjacent"], cells, f"{place}.adjacent")
        _in_range(cell["visible"], cells, f"{place}.visible")
        _in_range(cell["textures"], textures, f"{place}.textures")
        _in_range([p["neighbour"] for p in cell["portals"]], cells, f"{place}.portals")
        for leaf in cell["leaves"]:
            for loop in leaf["faces"]:
                _in_range(loop, len(leaf["points"]), f"{place}.leaves")
        painted = [t for shares in cell["coverage"].get("textures", ()) for t, _ in shares]
        _in_range([t for t in painted if t is not None], textures, f"{place}.coverage.textures")


def _in_range(indices: Sequence[int], count: int, place: str) -> None:
    if indices and max(indices) >= count:
        raise FileError("PTM-D700", place, f"the index {max(indices)} is out of range")


def _misfit(coverage: Row, ach: NDArray[np.float64]) -> str:
    """What is wrong with the statistics of a row of (n,) shares; empty if nothing is."""
    views = coverage["views"]
    columns = {
        name: coverage[name] for name in ("error", "p95", "seen", "textures") if name in coverage
    }
    columns |= {f"views[{i}]": view for i, view in enumerate(views)}
    for name, values in columns.items():
        if len(values) != len(ach):
            return f"{name} is not aligned with ach"
    if any(abs(sum(view) - 1) > ROUNDED for view in views):
        return "the shares of a view do not sum to 1"
    # But for a cell that sees nothing, which has 1 for itself.
    if any(seen == 0 < share < 1 for seen, share in zip(coverage["seen"], ach, strict=True)):
        return "what is seen from nowhere has a share"
    for shares, share in zip(coverage.get("textures", ()), ach, strict=False):
        if abs(sum(part for _, part in shares) - share) > ROUNDED:
            return "the shares of textures do not sum to those of their cells"
    return ""


def _equal_single(full: Sequence[Any], written: NDArray[np.float64]) -> bool:
    return np.array_equal(np.array(full, np.float32), written.astype(np.float32))


def _same_leaves(leaves: Sequence[Row], cell: ReadCell) -> bool:
    """Whether the leaves are those of the file, if it has some, and reach as far as its hull."""
    if len(leaves) != max(len(cell.leaves), 1) or not len(cell.hull):
        return False
    points = [point for leaf in leaves for point in leaf["points"]]
    pairs = zip(leaves, cell.leaves, strict=False)
    return all(_equal_single(leaf["points"], written) for leaf, written in pairs) and all(
        _equal_single(end(points, axis=0), end(cell.hull, axis=0)) for end in (np.min, np.max)
    )
