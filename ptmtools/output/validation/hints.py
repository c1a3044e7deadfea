"""The check of the hints beyond their schemas: the URLs, indices and lists of the index and the
records, and the textures that they describe."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ptmtools import schemas
from ptmtools.diagnostics import Place
from ptmtools.output.hints import RECORD_FORMAT as FORMAT, SCHEMA
from ptmtools.output.mesh_levels import row_fault
from ptmtools.output.model import FileError, convert_shape_errors, probe_fault, sizes_of
from ptmtools.output.names import HINTS, HINTS_FOLDER, STATISTICS
from ptmtools.output.representation import representations_in
from ptmtools.output.validation.files import ReadHints, Row, ServedDatabase
from ptmtools.output.validation.textures import check_record

#: Slack of the sum of the ach values.
_ACH_SLACK = 1e-9
#: Missed mass above this is reported.
_MISSED = 1e-4


def read_file(path: str, data: bytes) -> Row | None:
    """The index, a record or the statistics; None of other files.

    Raises FileError: PTM-D656 of another schema; PTM-D700 not valid against the schema.
    """
    if path == HINTS:
        index = _read(data, schemas.HINTS)
        for i, view in enumerate(index["viewpoints"]):
            _in_range([view["cell"]], len(index["cells"]), f"viewpoints[{i}].cell")
        return index
    if not path.startswith(f"{HINTS_FOLDER}/") or not path.endswith(".json"):
        return None
    return _read(data, schemas.STATISTICS if path == STATISTICS else schemas.CELL)


def _read(data: bytes, name: str) -> Row:
    with convert_shape_errors("PTM-D700"):
        document = schemas.parse(data)
    number = document.get("schema") if isinstance(document, dict) else None
    if type(number) is int and number != SCHEMA:
        message = f"is {number}, this ptmtools reads {SCHEMA}; `ptm build-scene` writes it anew"
        raise FileError("PTM-D656", "schema", message)
    with convert_shape_errors("PTM-D700"):
        schemas.check(document, name)
    hints: Row = document
    return hints


def gather(database: ServedDatabase) -> ReadHints | None:
    """The hints of a database; None without an index."""
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
            database.place(path or "", fault.place).add(fault.code, fault.message)
            record = None
        records.append(record)
    paths_or_urls = [path or url for path, url in zip(paths, urls, strict=True)]
    return ReadHints(index, paths_or_urls, records)


def check_files(database: ServedDatabase) -> None:
    """Checks the records, the textures and the viewpoints."""
    hints = database.hints
    if hints is None:
        return
    index, at = hints.index, database.place(HINTS)
    places = [database.place(path) for path in hints.paths]
    levels = [len(sizes_of(row)) for row in index["textures"]]
    for i, record in hints.usable_records():
        _check_record(record, i, levels, places[i])
    _check_textures(hints, database)
    for i, row in enumerate(database.contents.get(STATISTICS, {"cells": ()})["cells"]):
        if row["missed"] > _MISSED:
            message = f"{row['missed']:.3g} of the pixels fell on cells outside the PVS"
            database.place(STATISTICS, f"cells[{i}]").add("PTM-D703", message)
    for kind in representations_in(hints.index):
        kind.check.load()(hints, database)
    _check_meshes(index, at)
    if not index["geometry"]:
        at.add("PTM-D700", "names no form", "geometry")
    for form, template in index["geometry"].items():
        urls = hints.cell_urls(template)
        if database.files.isdisjoint(urls):  # else the check of the form compares its files
            database.resolve_each(HINTS, "geometry", urls)
        elif not any(e.name == form and e.is_owner(template) for e in database.forms):
            at.add("PTM-D700", "names files of another form", f"geometry.{form}")
    for i, view in enumerate(index["viewpoints"]):
        if not index["cells"][view["cell"]].get("standing", True):
            message = f"lies in cell {view['cell']}, which has no place to stand"
            at.add("PTM-D699", message, f"viewpoints[{i}]")


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
        _in_range([p["neighbour"] for p in record["portals"]], len(cells), "portals")
        for k, leaf in enumerate(record["leaves"]):
            for f, loop in enumerate(leaf["faces"]):
                _in_range(loop, len(leaf["points"]), f"leaves[{k}].faces[{f}]")
        for k, row in enumerate(record["textures"]):
            _in_range(row, textures, f"textures[{k}]")
        for k, shares in enumerate(record.get("textureShares", ())):
            _in_range([t for t, _ in shares if t is not None], textures, f"textureShares[{k}]")
        _in_range([row[0] for row in record.get("need", ())], textures, "need")
    except FileError as fault:
        return fault
    return None


def _in_range(indices: Sequence[int], count: int, place: str) -> None:
    if indices and max(indices) >= count:
        raise FileError("PTM-D700", place, f"the index {max(indices)} is out of range")


def _check_record(record: Row, i: int, levels: Sequence[int], at: Place) -> None:
    """Checks a record by itself; ``levels``: the number of levels of each texture."""
    if record["visible"][:1] != [i]:
        at.add("PTM-D690", f"visible does not begin with {i}")
    elif any(
        cells != sorted({*cells} - {i}) for cells in (record["adjacent"], record["visible"][1:])
    ):
        at.add("PTM-D690", f"a list has an entry twice or out of order, or {i} itself")
    for name in ("ach", "textures", "textureShares"):
        if len(record.get(name, record["visible"])) != len(record["visible"]):
            at.add("PTM-D692", f"{name} is not aligned with visible")
    total = float(np.sum(record["ach"]))
    if not abs(total - 1) <= _ACH_SLACK:
        at.add("PTM-D692", f"the ach values sum to {total:.9g}")
    for texture, first, *shares in record.get("need", ()):
        if first + len(shares) > levels[texture]:
            at.add("PTM-D700", f"texture {texture} has only {levels[texture]} levels", "need")


def _check_textures(hints: ReadHints, database: ServedDatabase) -> None:
    used = {
        t for _, record in hints.usable_records() for row in record["textures"][:1] for t in row
    }
    used |= {t for t, row in enumerate(hints.index["textures"]) if row.get("normals")}
    complete = all(record is not None for record in hints.records)
    rows = hints.index["textures"]
    files = database.resolve_each(HINTS, "textures", [row["file"] for row in rows])
    for i, (row, file) in enumerate(zip(rows, files, strict=True)):
        at = database.place(HINTS, f"textures[{i}]")
        member, message = probe_fault(row, len(hints.index["cells"]))
        if member:
            at.add("PTM-D700", message, f"textures[{i}].{member}")
        if complete and i not in used:
            at.add("PTM-D708", f"no cell uses {row['file']}")
        urls = (row["fallback"], *(preview["file"] for preview in row.get("previews", ())))
        images = [url and database.resolve(HINTS, url) for url in urls]
        fallback, *previews = (database.contents.get(image or "") for image in images)
        if header := database.contents.get(file or ""):
            check_record(row, header, fallback, previews, at)
