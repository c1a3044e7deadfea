"""Hostile sites: an index with other values or bytes, or a file damaged, often with its checksum
corrected in the index, as a host may serve them that nothing has checked."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from dataclasses import replace
from random import Random
from typing import Any

from benchmarks.fuzz.mutation import NAMES, damaged, dumped, twisted
from ptmtools.site.content import Site
from ptmtools.site.entry import SiteEntry


def hostile(site: Site, seed: int) -> Mapping[str, SiteEntry]:
    """The files of a site of which one is hostile: the index for even seeds."""
    random = Random(seed)
    data = {name: entry for name, entry in site.entries.items() if name.startswith("data")}
    (index,) = (name for name in data if name.endswith(".json") and _is_index(name))
    entries, document = dict(site.entries), json.loads(data[index].read())
    if seed % 2 == 0:
        entries[index] = _with(data[index], dumped(random, twisted(random, document, NAMES)))
        return entries
    name = random.choice([name for name in data if name != index])
    other = random.choice(list(data.values())).read()
    sound = data[name].read()
    changed = damaged(random, sound, other)
    if random.random() < 0.6 and _sealed(document, name, changed):
        entries[index] = _with(data[index], json.dumps(document).encode())
    else:
        # One that is too short is asked for again and again: `test_forms.py` waits for that.
        changed = changed[: len(sound)].ljust(len(sound), b"\0")
    entries[name] = _with(data[name], changed)
    return entries


def _is_index(name: str) -> bool:
    file = name.rpartition("/")[2]
    return file in ("apo.json", "interlace.json", "campus.json") or file.startswith("index-")


def _sealed(tree: Any, name: str, data: bytes) -> bool:
    """Whether a document has size and checksum of a file, which are then corrected."""
    if not isinstance(tree, (dict, list)):
        return False
    if isinstance(tree, dict) and isinstance(tree.get("crc32"), int):
        if not name.endswith("/" + tree.get("file", tree.get("name", "/"))):
            return False
        tree |= {"bytes": len(data), "crc32": zlib.crc32(data)}
        return True
    values = tree.values() if isinstance(tree, dict) else tree
    return sum(_sealed(value, name, data) for value in values) > 0


def _with(entry: SiteEntry, data: bytes) -> SiteEntry:
    return replace(entry, source=data, state=None, digest="")
