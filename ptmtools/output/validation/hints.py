"""The check of the hints beyond their schemas: the index, the records and the statistics against
each other, and textures and first-look bundles against them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ptmtools import schemas
from ptmtools.diagnostics import Place
from ptmtools.output.emitter import Emitter
from ptmtools.output.hints import RECORD_FORMAT as FORMAT, SCHEMA
from ptmtools.output.model import FileError, shaped
from ptmtools.output.names import BUNDLE, HINTS, HINTS_FOLDER, STATISTICS, path_of
from ptmtools.output.validation.files import Images, ReadHints, Row, ServedDatabase
from ptmtools.output.validation.findings import check_graph, check_list, check_shares
from ptmtools.output.validation.gltf import check_octrees
from ptmtools.output.validation.space import check_space
from ptmtools.output.validation.textures import check_record
from ptmtools.tolerance import PARALLEL_COSINE

#: A texture, and the start and end of bytes in its file.
_Piece = tuple[int, int, int]


def _check_first_looks(hints: ReadHints, database: ServedDatabase) -> None:
    """Compares each bundle with the bytes of the textures that its record lists; reads the files
    again."""
    template: str | None = hints.index.get("firstLook")
    urls = hints.expanded(template) if template else []
    ends = [row["ends"] for row in hints.index["textures"]]
    bundles: dict[str, list[_Piece]] = {}
    for i, record in hints.known():
        at = database.at(hints.paths[i], "firstLook")
        if (template is None) != ("firstLook" not in record):
            at.add("PTM-D704", "only one of the index and the record names a bundle")
            continue
        pieces = _pieces(record, ends)
        if pieces is None:
            at.add("PTM-D704", "a pair does not refine a visible texture")
        elif pieces and (path := database.resolve(HINTS, urls[i])):
            bundles[path] = pieces
    lengths: dict[int, int] = {}
    for texture, _, end in (piece for pieces in bundles.values() for piece in pieces):
        lengths[texture] = max(end, lengths.get(texture, 0))
    files = {t: hints.images[t][-1] for t in lengths}
    heads = {t: database.head(file, lengths[t]) for t, file in files.items() if file}
    for path, pieces in bundles.items():
        expected = b"".join(heads.get(t, b"")[start:end] for t, start, end in pieces)
        if database.head(path, len(expected) + 1) != expected:
            message = "does not consist of the bytes of the textures that its record lists"
            database.at(path).add("PTM-D704", message)


def _pieces(record: Row, ends: Sequence[Sequence[int]]) -> list[_Piece] | None:
    """The pieces of a record's bundle; None if a pair is invalid."""
    visible = {texture for row in record["textures"] for texture in row}
    reached: dict[int, int] = {}
    pieces = []
    for texture, level in record.get("firstLook", ()):
        before = reached.get(texture, -1)
        if texture not in visible or not before < level < len(ends[texture]):
            return None
        pieces.append((texture, ends[texture][before] if before >= 0 else 0, ends[texture][level]))
        reached[texture] = level
    return pieces


#: Slack of a sum of shares above 1, since they are rounded.
_NEED_SLACK = 1e-2


def need_fault(record: Row, levels: Sequence[int]) -> str:
    """The fault of the `need` of a record, "" if there is none; ``levels``: the number of levels of
    each texture."""
    rows: Sequence[Sequence[Any]] = record.get("need", ())
    textures = [row[0] for row in rows]
    visible = {texture for row in record["textures"] for texture in row}
    if any(one >= other for one, other in pairwise(textures)):
        return "its textures are not in ascending order"
    for texture, first, *shares in rows:
        if texture not in visible:
            return f"texture {texture} is not visible"
        if first + len(shares) > levels[texture]:
            return f"texture {texture} has only {levels[texture]} levels"
        if any(one < other for one, other in pairwise(shares)):
            return f"the shares of texture {texture} increase"
    if sum(row[2] for row in rows) > 1 + _NEED_SLACK:
        return "the shares of the view sum to more than 1"
    return ""


#: Slack of sums of statistics, which are rounded.
_STATISTICS_SLACK = 1e-3
#: Slack of the sum of the ach values.
_ACH_SLACK = 1e-9
#: Missed mass above this is reported.
_MISSED = 1e-4

#: The lists of the index that the statistics have a row for each entry of.
_LISTS = ("cells", "textures")


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
    statistics: Row | None = database.contents.get(STATISTICS)
    if statistics is not None:
        counts = [f"{len(rows[name])} {name}" for rows in (statistics, index) for name in _LISTS]
        if counts[:2] != counts[2:]:
            message = f"of {' and '.join(counts[:2])}, not {' and '.join(counts[2:])}"
            database.at(STATISTICS).add("PTM-D700", message)
            statistics = None
    images: list[Images] = []
    files = database.resolve_each(HINTS, "textures", [row["file"] for row in textures])
    for row, file in zip(textures, files, strict=True):
        fallback = row["fallback"]
        images.append((file,) if fallback is None else (database.resolve(HINTS, fallback), file))
    paths_or_urls = [path or url for path, url in zip(paths, urls, strict=True)]
    return ReadHints(index, paths_or_urls, records, statistics, images)


def check_files(database: ServedDatabase) -> Mapping[str, int]:
    """Checks everything that needs no cell files; returns no counts."""
    hints = database.hints
    if hints is None:
        return {}
    at = database.at(HINTS)
    places = [database.at(path) for path in hints.paths]
    known = dict(hints.known())
    levels = [len(row["ends"]) for row in hints.index["textures"]]
    for i, record in known.items():
        _check_record(record, i, places[i])
        if fault := need_fault(record, levels):
            places[i].add("PTM-D700", fault, "need")
        if not _contains(hints.index["cells"][i]["box"], record["leaves"]):
            at.add("PTM-D700", "does not contain the leaves of the cell", f"cells[{i}].box")
    adjacent, visible = (
        {i: record[name] for i, record in known.items()} for name in ("adjacent", "visible")
    )
    check_graph(adjacent, visible, places.__getitem__)
    own = {i: record["textures"][0] for i, record in known.items() if record["textures"]}
    _check_own_textures(known, own, places)
    _check_textures(hints, {t for textures in own.values() for t in textures}, database)
    _check_statistics(hints, database)
    _check_first_looks(hints, database)
    check_octrees(hints, database)
    _check_forms(hints, database)
    check_space(hints.records, hints.index["viewpoints"], places, at)
    for i, view in enumerate(hints.index["viewpoints"]):
        if not hints.index["cells"][view["cell"]].get("standing", True):
            message = f"lies in cell {view['cell']}, which has no place to stand"
            at.add("PTM-D699", message, f"viewpoints[{i}]")
        if abs(math.hypot(*view["direction"]) - 1) > 1 - PARALLEL_COSINE:
            at.add("PTM-D699", "is no unit vector", f"viewpoints[{i}].direction")
    return {}


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


def _check_record(record: Row, i: int, at: Place) -> None:
    check_list("adjacent", i, record["adjacent"], at)
    check_list("visible", i, record["visible"], at)
    for textures in record["textures"]:
        check_list("textures", None, textures, at)
    ach = np.array(record["ach"], dtype=np.float64)
    check_shares(ach, _ACH_SLACK, at)
    for name in ("ach", "textures", "textureShares"):
        if len(record.get(name, ach)) != len(record["visible"]):
            at.add("PTM-D692", f"{name} is not aligned with visible")
    for shares, share in zip(record.get("textureShares", ()), ach, strict=False):
        if abs(sum(part for _, part in shares) - share) > _STATISTICS_SLACK:
            at.add("PTM-D692", "the shares of textures do not sum to those of their cells")
            break


def _contains(box: Sequence[float], leaves: Sequence[Row]) -> bool:
    points = np.array([point for leaf in leaves for point in leaf["points"]])
    return bool((points >= box[:3]).all() and (points <= box[3:]).all())


def _check_own_textures(
    records: Mapping[int, Row], own: Mapping[int, Sequence[int]], places: Sequence[Place]
) -> None:
    """Each record lists the textures of other cells as their own records do."""
    for i, record in records.items():
        for other, textures in zip(record["visible"], record["textures"], strict=False):
            if own.get(other, textures) != textures:
                places[i].add("PTM-D700", f"are not the textures of cell {other}", "textures")


def _check_textures(hints: ReadHints, used: set[int], database: ServedDatabase) -> None:
    complete = all(record is not None for record in hints.records)
    for i, (row, files) in enumerate(zip(hints.index["textures"], hints.images, strict=True)):
        at = database.at(HINTS, f"textures[{i}]")
        if complete and i not in used:
            at.add("PTM-D708", f"no cell uses {row['file']}")
        texture = database.textures.get(files[-1] or "")
        if texture is None:
            continue
        check_record(row, texture, at)
        if hints.statistics and hints.statistics["textures"][i]["sha256"] != texture.sha256:
            place = database.at(STATISTICS, f"textures[{i}].sha256")
            place.add("PTM-D704", f"is {texture.sha256} in the file")


def _check_statistics(hints: ReadHints, database: ServedDatabase) -> None:
    rows = hints.statistics["cells"] if hints.statistics else ()
    for i, (row, record) in enumerate(zip(rows, hints.records, strict=False)):
        at = database.at(STATISTICS, f"cells[{i}]")
        if record is not None and (fault := _statistics_fault(row, record["ach"])):
            at.add("PTM-D692", fault)
        if row["missed"] > _MISSED:
            share = f"{row['missed']:.3g} of the pixels"
            at.add("PTM-D703", f"{share} fell on cells outside the PVS")


def _statistics_fault(row: Row, ach: Sequence[float]) -> str:
    """The fault of the statistics of (n,) shares; "" if there is none."""
    columns = {name: row[name] for name in ("error", "p95", "seen")}
    columns |= {f"views[{i}]": view for i, view in enumerate(row["views"])}
    for name, values in columns.items():
        if len(values) != len(ach):
            return f"{name} is not aligned with ach"
    if any(abs(sum(view) - 1) > _STATISTICS_SLACK for view in row["views"]):
        return "the shares of a view do not sum to 1"
    # The own share of a cell without any hit is 1.
    if any(seen == 0 < share < 1 for seen, share in zip(row["seen"], ach, strict=True)):
        return "a cell that is seen from nowhere has a share"
    return ""


def _check_forms(hints: ReadHints, database: ServedDatabase) -> None:
    """The index names the forms whose files exist, and no other; the checks of the forms compare
    their files."""
    at, geometry = database.at(HINTS, "geometry"), hints.index["geometry"]
    if not geometry:
        at.add("PTM-D700", "names no form")
    present = {e.name for e in database.emitters if _is_present(e, len(hints.records), database)}
    for form in sorted(present - set(geometry)):
        at.add("PTM-D700", f"does not name {form}, whose files exist")
    for form in sorted(set(geometry) - present):
        database.resolve_each(HINTS, "geometry", hints.urls(form) or ())


def _is_present(emitter: Emitter, cells: int, database: ServedDatabase) -> bool:
    files = emitter.cell_files
    return bool(files) and any(path_of(cell, files) in database.files for cell in range(cells))
