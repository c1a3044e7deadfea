"""The codes of all findings of a validation, and checks that cell files and hints share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.diagnostics import Place, Severity

#: Code → (severity, meaning). docs/formats/database.md repeats this table.
CODES: dict[str, tuple[Severity, str]] = {
    "PTM-D650": (
        "error",
        "the manifest is missing or damaged, or records options that a stage cannot have",
    ),
    "PTM-D651": ("error", "a file of the database is missing"),
    "PTM-D652": ("error", "the hash of a file differs from the manifest: the file was changed"),
    "PTM-D653": ("warning", "a file in a folder of ptmtools that no stage wrote"),
    "PTM-D654": ("error", "a file cannot be read"),
    "PTM-D655": ("warning", "the database is not finished: the stage `emit` has not run"),
    "PTM-D656": ("error", "a stage is out of date: its input has changed since"),
    "PTM-D657": ("error", "a link leads out of the served folder"),
    "PTM-D658": ("error", "a pipe, a device or a linked folder lies where files are served"),
    "PTM-D659": ("error", "a count in the manifest does not match the files"),
    "PTM-D660": ("error", "a VRML file is not UTF-8"),
    "PTM-D661": ("error", "a VRML file is not in the emission pattern"),
    "PTM-D662": ("error", "a number in a VRML file is not finite"),
    "PTM-D663": ("error", "a VRML file lacks a node or a field of the emission pattern"),
    "PTM-D670": ("error", "a URL leads out of the served folder"),
    "PTM-D671": ("error", "a URL names a missing file"),
    "PTM-D672": ("error", "a cell file is missing"),
    "PTM-D673": ("error", "a URL is malformed"),
    "PTM-D674": ("error", "two entries of a list name the same file"),
    "PTM-D675": ("warning", "names of served files differ only in case"),
    "PTM-D676": ("error", "a .gz copy is damaged, or differs from the file without .gz"),
    "PTM-D677": ("warning", "nothing refers to a texture file"),
    "PTM-D680": ("error", "coordIndex is out of range, or is not a list of triangles"),
    "PTM-D681": ("error", "texCoordIndex is out of range, or does not match coordIndex"),
    "PTM-D682": ("error", "a colour or transparency is outside 0 to 1, or colorIndex is invalid"),
    "PTM-D683": ("error", "a hull is not a closed convex polyhedron"),
    "PTM-D684": ("error", "geometry or leaves of a cell lie outside of its hull"),
    "PTM-D685": ("error", "leafPoint and leafStart do not describe leaves"),
    "PTM-D690": ("error", "a list of visible cells does not begin with the cell itself"),
    "PTM-D691": ("error", "ach and visibleUrl differ in length"),
    "PTM-D692": ("error", "an ach value (share of the view) is outside 0 to 1"),
    "PTM-D693": ("error", "the ach values do not sum to 1"),
    "PTM-D694": ("error", "adjacency is not symmetric"),
    "PTM-D695": ("error", "visibility is not symmetric"),
    "PTM-D696": ("error", "an adjacent cell is not visible"),
    "PTM-D697": ("error", "a list of cells has a cell twice or out of order, or the cell itself"),
    "PTM-D698": ("error", "a cell's name differs from its file's"),
    "PTM-D699": ("error", "the root file contradicts itself or the cells"),
    "PTM-D700": (
        "error",
        "the hints do not match their schemas, or an index in them is out of range",
    ),
    "PTM-D702": (
        "error",
        "the ach values in a record are outside 0 to 1, do not sum to 1, or are not aligned",
    ),
    "PTM-D703": (
        "warning",
        "pixels fell on cells outside the potentially visible set (PVS): missed mass",
    ),
    "PTM-D704": ("error", "the hints and a texture file disagree"),
    "PTM-D705": ("error", "portals in a record are invalid, or do not match the adjacent cells"),
    "PTM-D706": ("error", "a viewpoint in hints.json lies outside of its cell, or is invalid"),
    "PTM-D707": ("error", "the coverage statistics do not match the ach values"),
    "PTM-D708": ("warning", "a texture is listed in hints.json that no cell uses"),
    "PTM-D709": (
        "error",
        "a leaf (convex part of a cell) in a record is not convex, or lies in another",
    ),
    "PTM-D710": ("error", "a .ptm file is damaged"),
    "PTM-D711": ("error", "a .ptm file and its fallback image show different images"),
    "PTM-D712": ("error", "a fallback image cannot be read"),
    "PTM-D713": ("warning", "a file is too large for --limit: only its checksum was checked"),
    "PTM-D720": ("error", "the arrays of a stage cannot be read"),
    "PTM-D721": ("error", "the arrays of the stages do not belong together"),
    "PTM-D730": ("error", "the GLBs do not match the cells"),
    "PTM-D731": ("error", "a GLB is damaged: its header, its chunks or its JSON"),
    "PTM-D732": ("error", "a GLB is not in the emission pattern"),
    "PTM-D733": ("error", "an accessor of a GLB leads out of its bytes, or is misaligned"),
    "PTM-D734": ("error", "indices of a GLB are out of range, or not a list of triangles"),
    "PTM-D735": ("error", "a number in a GLB is not finite, or bounds do not match the data"),
    "PTM-D736": ("error", "a GLB and hints.json disagree about a texture"),
    "PTM-D740": ("error", "the hints have another schema: the database is of another release"),
    "PTM-D741": ("error", "the index, the records and the statistics contradict each other"),
    "PTM-D742": ("error", "a first-look bundle does not match its cell's record and the textures"),
    "PTM-D743": ("error", "the required levels of textures in a record are invalid"),
    "PTM-D744": ("error", "the interlaced images do not match the textures"),
    "PTM-D860": ("error", "the row of an octree texture in hints.json contradicts itself"),
    "PTM-D861": ("error", "an octree texture is shorter or longer than its levels"),
    "PTM-D862": ("error", "a level of an octree texture is damaged"),
    "PTM-D863": ("error", "the texels of an octree texture do not form a breadth-first octree"),
    "PTM-D864": ("warning", "hints.json does not name an octree texture"),
    "PTM-D865": ("error", "a GLB and hints.json disagree about an octree texture"),
    "PTM-D866": ("warning", "an octree texture is listed in hints.json that no GLB uses"),
}

#: Codes of changed files: a build detects these by itself.
SEEN_BY_BUILD = frozenset(f"PTM-D{n}" for n in (651, 652, 654, 655, 656, 740))
#: Codes that no build can repair: foreign files, the memory limit, and properties of the model.
NOT_BUILT = frozenset(f"PTM-D{n}" for n in (653, 657, 658, 675, 703, 708, 713))


def check_list(name: str, own: Any, entries: Sequence[Any], at: Place) -> None:
    """Checks a cell's list of indices or URLs: ascending, no entry twice, without the cell ``own``
    itself. A list of visible cells begins with ``own``."""
    rest = entries
    if name.startswith("visible"):
        if not entries or entries[0] != own:
            at.add("PTM-D690", f"{name} does not begin with {own}")
            return
        rest = entries[1:]
    if own in rest:
        at.add("PTM-D697", f"{name} contains {own} itself")
    elif list(rest) != _ascending(rest):
        at.add("PTM-D697", f"{name} has an entry twice or out of order")


def _ascending(entries: Sequence[Any]) -> list[Any]:
    ordered = sorted(set(entries))
    if ordered and isinstance(ordered[0], str):
        ordered.sort(key=len)  # "c9999.wrl" comes before "c10000.wrl"
    return ordered


def check_graph(
    adjacent: Mapping[Any, Sequence[Any]],
    visible: Mapping[Any, Sequence[Any]],
    at: Callable[[Any], Place],
) -> None:
    """Checks that both relations are symmetric and adjacent cells visible. ``at`` gives the place
    of a cell; entries that are not cells are ignored."""
    adjacent_of, visible_of = (
        {cell: frozenset(row) for cell, row in rows.items()} for rows in (adjacent, visible)
    )
    for cell, row in adjacent_of.items():
        if hidden := sorted(row - visible_of[cell]):
            at(cell).add("PTM-D696", f"{hidden[0]} is adjacent, but not visible")
    for code, rows, relation in (
        ("PTM-D694", adjacent_of, "is adjacent to it, but not the reverse"),
        ("PTM-D695", visible_of, "sees it, but not the reverse"),
    ):
        for cell, others in rows.items():
            for other in sorted(others):
                if other in rows and cell not in rows[other]:
                    at(other).add(code, f"{cell} {relation}")


def check_shares(ach: NDArray[np.float64], slack: float, codes: tuple[str, str], at: Place) -> None:
    """Checks that values are in [0, 1] and sum to 1 within ``slack``."""
    if ((ach < 0) | (ach > 1)).any():
        at.add(codes[0], "an ach value is outside 0 to 1")
    total = float(ach.sum())
    if not abs(total - 1) <= slack:
        at.add(codes[1], f"the ach values sum to {total:.9g}")
