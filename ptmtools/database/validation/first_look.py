"""First-look bundles beside the records that list what is in them, and the textures' files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ptmtools.database.names import HINTS
from ptmtools.database.validation.served import ServedDatabase

if TYPE_CHECKING:
    from ptmtools.database.validation.hints import ReadHints, Row

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
