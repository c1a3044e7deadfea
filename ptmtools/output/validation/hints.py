"""What the hints must satisfy beside their schemas: the index, the records and the statistics, each
by itself and beside each other. The emitters' checks hold them against their own files.

First-look bundles beside the records that list what is in them, and the textures' files.

How fine textures are needed, as a record says it: whether that can be."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools import schemas
from ptmtools.diagnostics import Place
from ptmtools.output.emitters import EMITTERS
from ptmtools.output.hints import RECORD_FORMAT as FORMAT, SCHEMA
from ptmtools.output.model import FileError, shaped
from ptmtools.output.names import BUNDLE, HINTS, HINTS_FOLDER, STATISTICS, path_of
from ptmtools.output.validation.files import ServedDatabase
from ptmtools.output.validation.findings import check_graph, check_list, check_shares
from ptmtools.output.validation.gltf import check_octrees
from ptmtools.output.validation.space import check_space
from ptmtools.output.validation.textures import check_record

#: A texture, and where in its file the bytes begin and end.
_Piece = tuple[int, int, int]


def check_first_looks(hints: ReadHints, database: ServedDatabase) -> None:
    """That there are bundles, and of the bytes that they should have; the files are read again."""
    template: str | None = hints.index.get("firstLook")
    urls = hints.expanded(template) if template else []
    ends = [row["ends"] for row in hints.index["textures"]]
    bundles: dict[str, list[_Piece]] = {}
    for i, record in hints.known():
        at = database.at(hints.paths[i], "firstLook")
        if (template is None) != ("firstLook" not in record):
            at.add("PTM-D742", "the index and the record disagree about whether there is a bundle")
            continue
        pieces = _pieces(record, ends)
        if pieces is None:
            at.add("PTM-D742", "a pair does not refine a texture in sight")
        elif pieces and (path := database.resolve(HINTS, urls[i])):
            bundles[path] = pieces
    lengths: dict[int, int] = {}
    for texture, _, end in (piece for pieces in bundles.values() for piece in pieces):
        lengths[texture] = max(end, lengths.get(texture, 0))
    files = {t: hints.images[t][-1] for t in lengths}
    heads = {t: database.head(file, lengths[t]) for t, file in files.items() if file}
    for path, pieces in bundles.items():
        wanted = b"".join(heads.get(t, b"")[start:end] for t, start, end in pieces)
        if database.head(path, len(wanted) + 1) != wanted:
            at = database.at(path)
            at.add("PTM-D742", "does not hold the bytes of the textures that its record lists")


def _pieces(record: Row, ends: Sequence[Sequence[int]]) -> list[_Piece] | None:
    """What the pairs of a record stand for; None if one of them cannot be."""
    seen = {texture for row in record["textures"] for texture in row}
    there: dict[int, int] = {}
    pieces = []
    for texture, level in record.get("firstLook", ()):
        before = there.get(texture, -1)
        if texture not in seen or not before < level < len(ends[texture]):
            return None
        pieces.append((texture, ends[texture][before] if before >= 0 else 0, ends[texture][level]))
        there[texture] = level
    return pieces


#: How far shares, which are rounded, may sum up above 1.
SHARES_ROUNDED = 1e-2


def impossible_need(record: Mapping[str, Any], levels: Sequence[int]) -> str:
    """What is wrong with the `need` of a record, "" if nothing is or there is none; ``levels``: how
    many each texture has."""
    rows: Sequence[Sequence[Any]] = record.get("need", ())
    textures = [row[0] for row in rows]
    in_sight = {texture for row in record["textures"] for texture in row}
    if any(one >= other for one, other in pairwise(textures)):
        return "its textures do not ascend"
    for texture, first, *shares in rows:
        if texture not in in_sight:
            return f"texture {texture} is not in sight"
        if first + len(shares) > levels[texture]:
            return f"texture {texture} has only {levels[texture]} levels"
        if any(one < other for one, other in pairwise(shares)):
            return f"the shares of texture {texture} increase"
    if sum(row[2] for row in rows) > 1 + SHARES_ROUNDED:
        return "the shares of the view sum to more than 1"
    return ""


#: How far sums of statistics, which are rounded, may be off.
ROUNDED = 1e-3
#: How far the ach values may sum up beside 1.
ACH_SLACK = 1e-9
#: Missed mass above this is worth a warning.
MISSED = 1e-4

#: What the statistics have a row for each of the index of.
_LISTS = ("cells", "textures")

#: Hints, or an object in them, as JSON has them: as the schema says, and every index in range.
Row = Mapping[str, Any]
#: The files of a texture in the served folder, the fallback image first; None is not there.
Images = tuple[str | None, ...]


@dataclass(frozen=True)
class ReadHints:
    """The hints as far as they can be used.

    Attributes
    ----------
    index: what `hints.json` holds.
    paths: of each cell where its record should be, in the served folder.
    records: of each cell its record, whose indices are in range; None without.
    statistics: None without; as many rows as the index has.
    images: of each texture its files.
    """

    index: Row
    paths: Sequence[str]
    records: Sequence[Row | None]
    statistics: Row | None
    images: Sequence[Images]

    def urls(self, form: str) -> list[str] | None:
        """The URLs of the cells' geometry in a form; None if the index does not name it."""
        template: str | None = self.index["geometry"].get(form)
        return None if template is None else self.expanded(template)

    def expanded(self, template: str) -> list[str]:
        """The URLs of the cells by a template."""
        return [_expanded(template, cell) for cell in self.index["cells"]]

    def known(self) -> Iterator[tuple[int, Row]]:
        """The records that can be used, with their cells' numbers."""
        return ((i, record) for i, record in enumerate(self.records) if record is not None)


def _expanded(template: str, cell: Row) -> str:
    return template.replace("{name}", cell["name"])


def read_file(path: str, data: bytes) -> Row | int | None:
    """The index, a record or the statistics; of a bundle its length, of other files nothing.

    Raises FileError: PTM-D740 of another schema; PTM-D700 not as the schema says.
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
        raise FileError("PTM-D740", "schema", message)
    with shaped("PTM-D700"):
        schemas.check(document, name)
    hints: Row = document
    return hints


def gather(database: ServedDatabase) -> ReadHints | None:
    """The hints of a database, whose URLs are resolved on the way; None without an index."""
    index: Row | None = database.held.get(HINTS)
    if index is None:
        return None
    cells, textures = index["cells"], index["textures"]
    urls = [_expanded(index["record"], cell) for cell in cells]
    paths = database.resolve_each(HINTS, "cells", urls)
    database.resolve(HINTS, index["statistics"])
    records: list[Row | None] = []
    for i, path in enumerate(paths):
        record = database.held.get(path) if path else None
        if record is not None and (fault := _misplaced(record, i, len(cells), len(textures))):
            database.at(path or "", fault.place).add(fault.code, fault.message)
            record = None
        records.append(record)
    statistics: Row | None = database.held.get(STATISTICS)
    if statistics is not None:
        counts = [f"{len(rows[name])} {name}" for rows in (statistics, index) for name in _LISTS]
        if counts[:2] != counts[2:]:
            message = f"of {' and '.join(counts[:2])}, not {' and '.join(counts[2:])}"
            database.at(STATISTICS).add("PTM-D741", message)
            statistics = None
    images: list[Images] = []
    files = database.resolve_each(HINTS, "textures", [row["file"] for row in textures])
    for row, file in zip(textures, files, strict=True):
        fallback = row["fallback"]
        images.append((file,) if fallback is None else (database.resolve(HINTS, fallback), file))
    shown = [path or url for path, url in zip(paths, urls, strict=True)]
    return ReadHints(index, shown, records, statistics, images)


def check_files(database: ServedDatabase) -> Mapping[str, int]:
    """Checks all that needs no cell files; counts nothing."""
    hints = database.hints
    if hints is None:
        return {}
    at = database.at(HINTS)
    places = [database.at(path) for path in hints.paths]
    known = dict(hints.known())
    levels = [len(row["ends"]) for row in hints.index["textures"]]
    for i, record in known.items():
        _check_record(record, i, places[i])
        if wrong := impossible_need(record, levels):
            places[i].add("PTM-D743", wrong, "need")
        if not _holds(hints.index["cells"][i]["box"], record["leaves"]):
            at.add("PTM-D741", "does not hold the leaves of the cell", f"cells[{i}].box")
    adjacent, visible = (
        {i: record[name] for i, record in known.items()} for name in ("adjacent", "visible")
    )
    check_graph(adjacent, visible, places.__getitem__)
    own = {i: record["textures"][0] for i, record in known.items() if record["textures"]}
    _check_own_textures(known, own, places)
    _check_textures(hints, {t for textures in own.values() for t in textures}, database)
    _check_statistics(hints, database)
    check_first_looks(hints, database)
    check_octrees(hints, database)
    _check_forms(hints, database)
    check_space(hints.records, hints.index["viewpoints"], places, at)
    for i, view in enumerate(hints.index["viewpoints"]):
        if not hints.index["cells"][view["cell"]].get("standing", True):
            message = f"nobody can stand in cell {view['cell']}"
            at.add("PTM-D706", message, f"viewpoints[{i}]")
    return {}


def _misplaced(record: Any, i: int, cells: int, textures: int) -> FileError | None:
    """Why what is held of a file is no record of the cell ``i`` of so many."""
    if not isinstance(record, dict) or record["format"] != FORMAT:
        return FileError("PTM-D741", "", "is no record of a cell, as the index has it")
    if record["cell"] != i:
        return FileError("PTM-D741", "cell", f"is {record['cell']}, in the index {i}")
    try:
        for name in ("adjacent", "visible"):
            _in_range(record[name], cells, name)
        for k, row in enumerate(record["textures"]):
            _in_range(row, textures, f"textures[{k}]")
        for k, portal in enumerate(record["portals"]):
            _in_range([portal["neighbour"]], cells, f"portals[{k}].neighbour")
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
    check_shares(ach, ACH_SLACK, ("PTM-D702", "PTM-D702"), at)
    for name in ("ach", "textures", "textureShares"):
        if len(record.get(name, ach)) != len(record["visible"]):
            at.add("PTM-D702", f"{name} is not aligned with visible")
    for shares, share in zip(record.get("textureShares", ()), ach, strict=False):
        if abs(sum(part for _, part in shares) - share) > ROUNDED:
            at.add("PTM-D707", "the shares of textures do not sum to those of their cells")
            break


def _holds(box: Sequence[float], leaves: Sequence[Row]) -> bool:
    points = np.array([point for leaf in leaves for point in leaf["points"]])
    return bool((points >= box[:3]).all() and (points <= box[3:]).all())


def _check_own_textures(
    records: Mapping[int, Row], own: Mapping[int, Sequence[int]], places: Sequence[Place]
) -> None:
    """What a record says of the textures of other cells is what theirs say."""
    for i, record in records.items():
        for other, textures in zip(record["visible"], record["textures"], strict=False):
            if own.get(other, textures) != textures:
                places[i].add("PTM-D741", f"not the textures of cell {other}", "textures")


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
        if record is not None and (wrong := _misfit(row, record["ach"])):
            at.add("PTM-D707", wrong)
        if row["missed"] > MISSED:
            share = f"{row['missed']:.3g} of the pixels"
            at.add("PTM-D703", f"{share} fell on cells outside the PVS")


def _misfit(row: Row, ach: Sequence[float] | NDArray[np.float64]) -> str:
    """What is wrong with the statistics of (n,) shares; empty if nothing is."""
    columns = {name: row[name] for name in ("error", "p95", "seen")}
    columns |= {f"views[{i}]": view for i, view in enumerate(row["views"])}
    for name, values in columns.items():
        if len(values) != len(ach):
            return f"{name} is not aligned with ach"
    if any(abs(sum(view) - 1) > ROUNDED for view in row["views"]):
        return "the shares of a view do not sum to 1"
    # But for a cell that sees nothing, which has 1 for itself.
    if any(seen == 0 < share < 1 for seen, share in zip(row["seen"], ach, strict=True)):
        return "what is seen from nowhere has a share"
    return ""


def _check_forms(hints: ReadHints, database: ServedDatabase) -> None:
    """The index names the forms that there are, and no other. What the emitters' checks know is
    left to them."""
    at, geometry = database.at(HINTS, "geometry"), hints.index["geometry"]
    if not geometry:
        at.add("PTM-D741", "there is no geometry")
    there = {form for form in EMITTERS if _is_there(form, len(hints.records), database)}
    for form in sorted(there - set(geometry)):
        at.add("PTM-D741", f"{form} is there, and not named")
    for form in sorted(set(geometry) - there):
        database.resolve_each(HINTS, "geometry", hints.urls(form) or ())


def _is_there(form: str, cells: int, database: ServedDatabase) -> bool:
    files = EMITTERS[form].cell_files
    return bool(files) and any(path_of(cell, files) in database.files for cell in range(cells))
