"""Icons and ranks of the points of interest of a campus, which its administrator writes by hand."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ptmtools.errors import InputError
from ptmtools.files import open_below
from ptmtools_systems.campus.model import HIGHEST_RANK, ICONS

#: In the folder of the records.
PLACES = "places.json"
#: Longest file, bytes.
_LONGEST = 1 << 20
_EXAMPLE = '{"Library": {"icon": "books", "rank": 1}}'


def read_places(
    folder: str | os.PathLike[str], objects: Iterable[tuple[str, str]]
) -> tuple[dict[str, dict[str, Any]], tuple[str, ...]]:
    """The fields ``icon`` and ``rank`` of objects by their names in files, and notes on places of
    no object; none if the folder has no `PLACES`.

    Parameters
    ----------
    folder: that of the records.
    objects: name in files and label of each.

    Raises
    ------
    InputError: PTM-I122 the file cannot be read, is too long, or is not a table of places.
    """
    root = Path(folder)
    file = root / PLACES
    if not file.exists():
        return {}, ()
    try:
        with open_below(root, PLACES) as stream:
            data = stream.read(_LONGEST + 1)
        if len(data) > _LONGEST:
            raise _wrong(file, f"has more than {_LONGEST:,} bytes")
        table = json.loads(data)
    except OSError as fault:
        raise _wrong(file, f"cannot be read ({fault.strerror or fault})") from None
    except (ValueError, RecursionError):
        raise _wrong(file, "is not JSON") from None
    if not isinstance(table, dict):
        raise _wrong(file, "is not a JSON object")
    for key, fields in table.items():
        _check(file, key, fields)
    left, places = dict.fromkeys(table), {}
    for name, label in objects:
        key = next((key for key in (label, name) if key in left), None)
        if key is not None:
            places[name] = table[key]
            del left[key]
    return places, tuple(f"{PLACES}: no object is called {key!r}" for key in left)


def _check(file: Path, key: str, fields: Any) -> None:
    """Raises InputError PTM-I122."""
    if not isinstance(fields, Mapping) or not fields or not fields.keys() <= {"icon", "rank"}:
        raise _wrong(file, "has other fields than icon and rank", key)
    if "icon" in fields and fields["icon"] not in ICONS:
        raise _wrong(file, f"icon is not one of {', '.join(ICONS)}", key)
    rank = fields.get("rank", 0)
    if type(rank) is not int or not 0 <= rank <= HIGHEST_RANK:
        raise _wrong(file, f"rank is not a whole number from 0 to {HIGHEST_RANK}", key)


def _wrong(file: Path, message: str, place: str | None = None) -> InputError:
    return InputError("PTM-I122", message, file=file, place=place, remedy=f"write {_EXAMPLE}")
