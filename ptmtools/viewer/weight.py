"""What a visitor of a site downloads, in bytes on the link, without the headers of HTTP."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ptmtools.viewer.entry import Entry
from ptmtools.viewer.program import INDEX
from ptmtools.viewer.site import DATA, Site, link_bytes

#: Texels of the longer side up to which the textures of a room count as there.
COARSE = 64


@dataclass(frozen=True)
class Weight:
    """Bytes; what is worth compressing counts as gzip makes it.

    Attributes
    ----------
    page: the page, the viewer, a worker and the decoder: what comes before anything of the
        building.
    first_room: the page, the poster, the index, and the room of the first viewpoint.
    mean_room, worst_room: record and geometry of a room, and of the textures in it the levels up to
        `COARSE` texels. Of all cells that somebody can stand in; worst_cell is the heaviest.
    whole: all that a walk can need; the VRML files do not count.
    """

    page: int
    first_room: int
    mean_room: int
    worst_room: int
    worst_cell: int
    whole: int


def weight_of(site: Site) -> Weight:
    """What a site weighs."""
    index = site.index
    rooms = {
        number: _room(site.entries, index, row)
        for number, row in enumerate(index["cells"])
        if row.get("standing", True)
    }
    bytes_of = {name: link_bytes(entry) for name, entry in site.entries.items() if _walked(name)}
    begins = (f"{DATA}/index-", f"{DATA}/poster-")
    page = sum(size for name, size in bytes_of.items() if not name.startswith(f"{DATA}/"))
    before = sum(size for name, size in bytes_of.items() if name.startswith(begins))
    first = _room(site.entries, index, index["cells"][index["viewpoints"][0]["cell"]])
    worst = max(rooms, key=rooms.__getitem__)
    return Weight(
        page=page,
        first_room=page + before + first,
        mean_room=round(sum(rooms.values()) / len(rooms)),
        worst_room=rooms[worst],
        worst_cell=worst,
        whole=sum(bytes_of.values()),
    )


def _walked(name: str) -> bool:
    """Whether a walk in a browser of these days needs a file."""
    later = name.endswith("-later.js")
    return name == INDEX or (name.startswith(("viewer-", f"{DATA}/")) and not later)


def _room(entries: Mapping[str, Entry], index: Mapping[str, Any], row: Mapping[str, Any]) -> int:
    record = json.loads(entries[f"{DATA}/{row['record']}"].read())
    coarse = sum(_coarse(index["textures"][texture]) for texture in record["textures"][0])
    return int(row["recordBytes"]) + int(row["geometryBytes"]) + coarse


def _coarse(texture: Mapping[str, Any]) -> int:
    """Bytes of the levels of a texture up to `COARSE` texels; of the coarsest at least."""
    side, ends = max(texture["width"], texture["height"]), texture["ends"]
    found = [end for n, end in enumerate(ends) if side >> (len(ends) - 1 - n) <= COARSE]
    return int(found[-1] if found else ends[0])
