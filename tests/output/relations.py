"""Compares the records of one emitted database with each other, the index and the root file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from ptmtools.tolerance import TIE_SHARE, Tolerance
from tests.output.solids import SolidError, farthest, solid_planes, spatial_faults
from tests.output.vrml_reader import VrmlDocument

#: Slack of sums of statistics, which are rounded; of a sum of needed shares above 1.
STATISTICS_SLACK, NEED_SLACK = 1e-3, 1e-2
FAULTS = (KeyError, TypeError, IndexError, ValueError)


def relations(
    index: Any, records: Mapping[str, Any], statistics: Any, extent: float
) -> Iterator[str]:
    """The differences between the records, which are given by the names of the cells, and what is
    wrong with them in space. ``extent``: see `tolerance_about`."""
    numbers = {cell["name"]: i for i, cell in enumerate(index["cells"])}
    of = {numbers[name]: record for name, record in records.items() if name in numbers}
    with suppress(*FAULTS):
        yield from _graph(of)
    with suppress(*FAULTS):
        yield from _own_textures(of)
    with suppress(*FAULTS):
        yield from _portals(of)
    with suppress(*FAULTS):
        yield from _apart(of)
    with suppress(*FAULTS):
        yield from spatial_faults(of, index["viewpoints"], extent)
    with suppress(*FAULTS):
        yield from _boxes(index, of)
    baked = [
        {n for n, row in enumerate(index["textures"]) if kind in row} for kind in ("light", "probe")
    ]
    for i, record in of.items():
        with suppress(*FAULTS):
            if fault := _shares(record, baked):
                yield f"shares: {i}: {fault}"
    with suppress(*FAULTS):
        for name in ("cells", "textures"):
            if len(statistics[name]) != len(index[name]):
                yield f"statistics: other {name}"
        for i, row in enumerate(statistics["cells"]):
            if i in of and (fault := _statistics(row, of[i]["ach"])):
                yield f"statistics: {i}: {fault}"


def _graph(records: Mapping[int, Any]) -> Iterator[str]:
    """Both relations are symmetric, and adjacent cells visible."""
    for i, record in records.items():
        if hidden := set(record["adjacent"]) - set(record["visible"]):
            yield f"relation: {i}: {hidden} adjacent, but not visible"
        for name in ("adjacent", "visible"):
            for other in record[name]:
                if other in records and i not in records[other][name]:
                    yield f"relation: {i}: {other} is {name}, but not the reverse"


def _own_textures(records: Mapping[int, Any]) -> Iterator[str]:
    """Each record lists the textures of other cells as their own records do, ascending."""
    own = {i: record["textures"][0] for i, record in records.items()}
    for i, record in records.items():
        for other, textures in zip(record["visible"], record["textures"], strict=False):
            if own.get(other, textures) != textures or textures != sorted(set(textures)):
                yield f"relation: {i}: textures of {other}"


def _portals(records: Mapping[int, Any]) -> Iterator[str]:
    """Portals lead to exactly the adjacent cells, which have them in reverse."""
    points = [p for r in records.values() for leaf in r["leaves"] for p in leaf["points"]]
    tolerance = Tolerance.for_points(np.array(points, np.float64))
    openings: dict[int, Counter[Any]] = {i: Counter() for i in records}
    for i, record in records.items():
        if {portal["neighbour"] for portal in record["portals"]} != set(record["adjacent"]):
            yield f"openings: {i}: not to the adjacent cells"
        for portal in record["portals"]:
            polygon = np.array(portal["polygon"], np.float64)
            loop = tuple(map(tuple, portal["polygon"]))
            openings[i][(portal["neighbour"], loop, portal["area"])] += 1
            arms = polygon - polygon[0]
            area = float(np.linalg.norm(np.cross(arms[1:-1], arms[2:]).sum(axis=0)) / 2)
            slack = tolerance.plane * tolerance.extent
            if not portal["area"] <= area * (1 + TIE_SHARE) + slack:
                yield f"openings: {i}: larger than the polygon"
    for i, of_cell in openings.items():
        for (neighbour, loop, area), count in of_cell.items():
            if neighbour in records and openings[neighbour][(i, loop[::-1], area)] != count:
                yield f"openings: {i}: not in the record of {neighbour}"


def _apart(records: Mapping[int, Any]) -> Iterator[str]:
    """The centroid of a leaf lies in no other leaf."""
    leaves = [(i, leaf) for i, record in records.items() for leaf in record["leaves"]]
    points = [np.array(leaf["points"], np.float64) for _, leaf in leaves]
    tolerance = Tolerance.for_points(np.concatenate(points))
    middles = np.array([rows.mean(axis=0) for rows in points])
    for k, (i, leaf) in enumerate(leaves):
        with suppress(SolidError):
            planes = solid_planes(points[k], leaf["faces"], tolerance)
            within = np.flatnonzero(farthest(planes, middles) < -tolerance.rounding)
            for other in set(within.tolist()) - {k}:
                yield f"overlap: a leaf of {leaves[other][0]} lies in one of {i}"


def _boxes(index: Any, records: Mapping[int, Any]) -> Iterator[str]:
    """The box of a cell in the index holds its leaves."""
    for i, record in records.items():
        points = np.array([point for leaf in record["leaves"] for point in leaf["points"]])
        box = index["cells"][i]["box"]
        if not ((points >= box[:3]).all() and (points <= box[3:]).all()):
            yield f"box: {i}: does not contain the leaves"


def _shares(record: Any, baked: Sequence[set[int]]) -> str:
    for shares, share in zip(record.get("textureShares", ()), record["ach"], strict=False):
        if abs(sum(part for _, part in shares) - share) > STATISTICS_SLACK:
            return "the textures' do not sum to the cell's"
    visible = {texture for row in record["textures"] for texture in row}
    numbers = [row[0] for row in record.get("need", ())]
    if numbers != sorted(set(numbers)):
        return "the textures of the need are not in ascending order"
    if not visible >= {*numbers}:
        return "a texture of the need is not visible"
    needs = {row[0]: row[2:] for row in record.get("need", ())}
    if any(list(shares) != sorted(shares, reverse=True) for shares in needs.values()):
        return "the need of a texture increases"
    # A surface shows its image, its lightmap and its probe.
    images = needs.keys() - set().union(*baked)
    for numbers in (images, *(needs.keys() & numbers for numbers in baked)):
        if sum(needs[number][0] for number in numbers) > 1 + NEED_SLACK:
            return "the need sums to more than 1"
    return ""


def _statistics(row: Any, ach: Sequence[float]) -> str:
    """The fault of the statistics of (n,) shares; "" if there is none."""
    for values in (row["error"], row["p95"], row["seen"], *row["views"]):
        if len(values) != len(ach):
            return "not aligned with ach"
    if any(abs(sum(view) - 1) > STATISTICS_SLACK for view in row["views"]):
        return "the shares of a view do not sum to 1"
    # The own share of a cell without any hit is 1.
    if any(seen == 0 < share < 1 for seen, share in zip(row["seen"], ach, strict=True)):
        return "a cell that is seen from nowhere has a share"
    return ""


def root_file(
    document: VrmlDocument, names: Sequence[str], cells: Mapping[str, VrmlDocument]
) -> Iterator[str]:
    """The differences between the root file and the cell files; ``cells`` are the readable ones of
    these names."""
    named = {node.name for node in document.of_type("Viewpoint")}
    of_view = {
        node.fields.get("viewpoint", ""): node.fields.get("cellUrl", ())
        for node in document.of_type("PTMViewpointCell")
    }
    if not named or set(of_view) != named or any(len(urls) != 1 for urls in of_view.values()):
        yield "root: a viewpoint without a cell"
    expected = {f"ptm:viewpoint {name} {urls[0]}" for name, urls in of_view.items() if urls}
    for node in document.of_type("WorldInfo"):
        info = node.fields.get("info", ())
        if {line for line in info if line.startswith("ptm:viewpoint ")} != expected:
            yield "root: the viewpoints in info"
    inlines = [node for node in document.of_type("Inline") if not node.lacks]
    urls = [url for node in inlines for url in node.fields["url"]]
    if sorted(urls) != sorted(f"cells/{name}.wrl" for name in names):
        yield "root: other cells"
    for node in inlines:
        cell = cells.get(node.fields["url"][0].removeprefix("cells/").removesuffix(".wrl"))
        if cell is not None and not _is_boxed(node.fields, cell):
            yield f"root: {node.fields['url'][0]}: the box does not contain the cell"


def _is_boxed(fields: Mapping[str, Any], cell: VrmlDocument) -> bool:
    rows = [node.fields.get("hullPoint", ()) for node in cell.of_type("PTMCell")]
    rows += [shape.at("geometry", "coord").get("point", ()) for shape in cell.of_type("Shape")]
    points = np.concatenate([np.zeros((0, 3)), *(row for row in rows if len(row))])
    centre, size = (
        fields[name].astype(np.float32).astype(np.float64) for name in ("bboxCenter", "bboxSize")
    )
    slack = np.spacing(np.abs(points).max(axis=0).astype(np.float32))
    return bool((np.abs(points - centre) <= size / 2 + slack).all())
