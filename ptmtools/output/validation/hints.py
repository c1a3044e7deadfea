"""The check of the hints beyond their schemas: the URLs and indices of the index and the records,
and the cells in space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ptmtools import schemas
from ptmtools.diagnostics import Place
from ptmtools.output.hints import RECORD_FORMAT as FORMAT, SCHEMA
from ptmtools.output.mesh_levels import row_fault
from ptmtools.output.model import FileError, shaped, sizes_of
from ptmtools.output.names import BUNDLE, HINTS, HINTS_FOLDER, STATISTICS
from ptmtools.output.representation import listed
from ptmtools.output.validation.files import Images, ReadHints, Row, ServedDatabase
from ptmtools.output.validation.space import check_space
from ptmtools.output.validation.textures import Pictures, check_record
from ptmtools.tolerance import PARALLEL_COSINE

#: Slack of the sum of the ach values.
_ACH_SLACK = 1e-9
#: Missed mass above this is reported.
_MISSED = 1e-4


def read_file(path: str, data: bytes) -> Row | int | None:
    """The index, a record or the statistics; the length of a bundle; None of other files.

    Raises FileError: PTM-D656 of another schema; PTM-D700 not valid against the schema.
    """
    if path == HINTS:
        index = _read(data, schemas.HINTS)
        for i, view in enumerate(index["viewpoints"]):
            _in_range([view["cell"]], len(index["cells"]), f"viewpoints[{i}].cell")
        return index
    if path.endswith(BUNDLE):
        return len(data)
    if not path.startswith(f"{HINTS_FOLDER}/") or not path.endswith(".json"):
        return None
    return _read(data, schemas.STATISTICS if path == STATISTICS else schemas.CELL)


def _read(data: bytes, name: str) -> Row:
    with shaped("PTM-D700"):
        document = schemas.parse(data)
    number = document.get("schema") if isinstance(document, dict) else None
    if type(number) is int and number != SCHEMA:
        message = f"is {number}, this ptmtools reads {SCHEMA}; `ptm build-scene` writes it anew"
        raise FileError("PTM-D656", "schema", message)
    with shaped("PTM-D700"):
        schemas.check(document, name)
    hints: Row = document
    return hints


def gather(database: ServedDatabase) -> ReadHints | None:
    """The hints of a database, with all their URLs resolved; None without an index."""
    index: Row | None = database.contents.get(HINTS)
    if index is None:
        return None
    cells, textures = index["cells"], index["textures"]
    urls = [index["record"].replace("{name}", cell["name"]) for cell in cells]
    paths = database.resolve_each(HINTS, "cells", urls)
    database.resolve(HINTS, index["statistics"])
    records: list[Row | None] = []
    for i, path in enumerate(paths):
        record = database.contents.get(path) if path else None
        if record is not None and (fault := _record_fault(record, i, cells, len(textures))):
            database.at(path or "", fault.place).add(fault.code, fault.message)
            record = None
        records.append(record)
    images: list[Images] = []
    files = database.resolve_each(HINTS, "textures", [row["file"] for row in textures])
    for row, file in zip(textures, files, strict=True):
        fallback = row["fallback"] and database.resolve(HINTS, row["fallback"])
        previews = [database.resolve(HINTS, each["file"]) for each in row.get("previews", ())]
        images.append(Images(file, fallback, tuple(previews)))
    paths_or_urls = [path or url for path, url in zip(paths, urls, strict=True)]
    return ReadHints(index, paths_or_urls, records, images)


def check_files(database: ServedDatabase) -> None:
    """Checks the records, the textures, the first-look bundles and the cells in space."""
    hints = database.hints
    if hints is None:
        return
    index, at = hints.index, database.at(HINTS)
    places = [database.at(path) for path in hints.paths]
    levels = [len(sizes_of(row)) for row in index["textures"]]
    for i, record in hints.known():
        _check_record(record, i, levels, places[i])
        points = np.array([point for leaf in record["leaves"] for point in leaf["points"]])
        box = index["cells"][i]["box"]
        if not ((points >= box[:3]).all() and (points <= box[3:]).all()):
            at.add("PTM-D700", "does not contain the leaves of the cell", f"cells[{i}].box")
    _check_textures(hints, database)
    for i, row in enumerate(database.contents.get(STATISTICS, {"cells": ()})["cells"]):
        if row["missed"] > _MISSED:
            message = f"{row['missed']:.3g} of the pixels fell on cells outside the PVS"
            database.at(STATISTICS, f"cells[{i}]").add("PTM-D703", message)
    _check_first_looks(hints, database)
    for kind in listed(hints.index):
        kind.check.load()(hints, database)
    _check_meshes(index, at)
    if not index["geometry"]:
        at.add("PTM-D700", "names no form", "geometry")
    for urls in map(hints.expanded, index["geometry"].values()):
        if database.files.isdisjoint(urls):  # else the check of the form compares its files
            database.resolve_each(HINTS, "geometry", urls)
    check_space(hints.records, index["viewpoints"], places, at, database.extent)
    for i, view in enumerate(index["viewpoints"]):
        if not index["cells"][view["cell"]].get("standing", True):
            message = f"lies in cell {view['cell']}, which has no place to stand"
            at.add("PTM-D699", message, f"viewpoints[{i}]")
        if abs(math.hypot(*view["direction"]) - 1) > 1 - PARALLEL_COSINE:
            at.add("PTM-D699", "is no unit vector", f"viewpoints[{i}].direction")


def _check_meshes(index: Row, at: Place) -> None:
    named: set[str] = set()
    for i, row in enumerate(index.get("meshes", ())):
        member, message = row_fault(row, len(index["cells"]))
        if member:
            at.add("PTM-D700", message, f"meshes[{i}].{member}")
        if not named.isdisjoint(row["files"]):
            at.add("PTM-D700", "has a file of another row", f"meshes[{i}].files")
        named.update(row["files"])


def _record_fault(record: Any, i: int, cells: Sequence[Row], textures: int) -> FileError | None:
    """The reason why the content of a file is no record of the cell ``i``; None if it is one."""
    if not isinstance(record, dict) or record["format"] != FORMAT:
        return FileError("PTM-D700", "", "is not a record of a cell")
    for name, expected in (("cell", i), ("name", cells[i]["name"])):
        if record[name] != expected:
            return FileError("PTM-D700", name, f"is {record[name]!r}, in the index {expected!r}")
    try:
        for name in ("adjacent", "visible"):
            _in_range(record[name], len(cells), name)
        for k, row in enumerate(record["textures"]):
            _in_range(row, textures, f"textures[{k}]")
        for k, portal in enumerate(record["portals"]):
            _in_range([portal["neighbour"]], len(cells), f"portals[{k}].neighbour")
        for k, leaf in enumerate(record["leaves"]):
            for f, loop in enumerate(leaf["faces"]):
                _in_range(loop, len(leaf["points"]), f"leaves[{k}].faces[{f}]")
        for k, shares in enumerate(record.get("textureShares", ())):
            used = [texture for texture, _ in shares if texture is not None]
            _in_range(used, textures, f"textureShares[{k}]")
        _in_range([t for t, _ in record.get("firstLook", ())], textures, "firstLook")
        _in_range([row[0] for row in record.get("need", ())], textures, "need")
    except FileError as fault:
        return fault
    return None


def _in_range(indices: Sequence[int], count: int, place: str) -> None:
    if indices and max(indices) >= count:
        raise FileError("PTM-D700", place, f"the index {max(indices)} is out of range")


def _check_record(record: Row, i: int, levels: Sequence[int], at: Place) -> None:
    """Checks a record by itself; ``levels``: the number of levels of each texture."""
    for name in ("adjacent", "visible"):
        others = record[name]
        if name == "visible":
            if others[:1] != [i]:
                at.add("PTM-D690", f"visible does not begin with {i}")
                continue
            others = others[1:]
        if i in others or not _ascends(others):
            at.add("PTM-D690", f"{name} has an entry twice or out of order, or {i} itself")
    for name in ("ach", "textures", "textureShares"):
        if len(record.get(name, record["visible"])) != len(record["visible"]):
            at.add("PTM-D692", f"{name} is not aligned with visible")
    total = float(np.sum(record["ach"]))
    if not abs(total - 1) <= _ACH_SLACK:
        at.add("PTM-D692", f"the ach values sum to {total:.9g}")
    visible = {texture for row in record["textures"] for texture in row}
    needs: Sequence[Sequence[Any]] = record.get("need", ())
    if not _ascends([row[0] for row in needs]):
        at.add("PTM-D700", "its textures are not in ascending order", "need")
    for texture, first, *shares in needs:
        if texture not in visible:
            at.add("PTM-D700", f"texture {texture} is not visible", "need")
        elif first + len(shares) > levels[texture]:
            at.add("PTM-D700", f"texture {texture} has only {levels[texture]} levels", "need")


def _ascends(entries: Sequence[int]) -> bool:
    return all(one < other for one, other in pairwise(entries))


def _check_textures(hints: ReadHints, database: ServedDatabase) -> None:
    used = {t for _, record in hints.known() for row in record["textures"][:1] for t in row}
    used |= {t for t, row in enumerate(hints.index["textures"]) if row.get("normals")}
    complete = all(record is not None for record in hints.records)
    for i, (row, images) in enumerate(zip(hints.index["textures"], hints.images, strict=True)):
        at = database.at(HINTS, f"textures[{i}]")
        if complete and i not in used:
            at.add("PTM-D708", f"no cell uses {row['file']}")
        if header := database.contents.get(images.file or ""):
            fallback, *previews = (
                database.contents.get(file or "") for file in (images.fallback, *images.previews)
            )
            check_record(row, header, Pictures(fallback, previews), at)


def _check_first_looks(hints: ReadHints, database: ServedDatabase) -> None:
    """Compares the length of each bundle with the levels that its record lists."""
    template: str | None = hints.index.get("firstLook")
    urls = hints.expanded(template) if template else []
    ends = [[0, *row["ends"]] for row in hints.index["textures"]]
    for i, record in hints.known():
        at = database.at(hints.paths[i], "firstLook")
        if (template is None) != ("firstLook" not in record):
            at.add("PTM-D704", "only one of the index and the record names a bundle")
            continue
        visible = {texture for row in record["textures"] for texture in row}
        reached: dict[int, int] = {}
        for texture, level in record.get("firstLook", ()):
            before = reached.get(texture, -1)
            if texture not in visible or not before < level < len(ends[texture]) - 1:
                at.add("PTM-D704", "a pair does not refine a visible texture")
                break
            reached[texture] = level
        else:
            length = sum(ends[texture][level + 1] for texture, level in reached.items())
            if length and (path := database.resolve(HINTS, urls[i])):
                actual = database.contents.get(path, length)
                if actual != length:
                    message = f"the bundle has {actual} bytes, its levels {length}"
                    database.at(path).add("PTM-D704", message)
