"""Faults to be planted in the served files of a database."""

from __future__ import annotations

import gzip
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

Damage = Callable[[Path], object]


def rewritten(name: str, change: Callable[[bytes], bytes]) -> Damage:
    """Other bytes of a served file, which need not be there."""

    def damage(db: Path) -> None:
        path = db / "www" / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(change(path.read_bytes() if path.exists() else b""))

    return damage


def put(name: str, data: bytes = b"something") -> Damage:
    return rewritten(name, lambda _: data)


def appended(name: str, data: bytes) -> Damage:
    return rewritten(name, lambda old: old + data)


def replaced(name: str, pattern: str, new: str) -> Damage:
    """Replaces the first match in a file; it must be there."""

    def change(data: bytes) -> bytes:
        text, count = re.subn(pattern, new, data.decode(), count=1, flags=re.DOTALL)
        assert count == 1, f"{pattern} is not in {name}"
        return text.encode()

    return rewritten(name, change)


def hinted(change: Callable[[dict[str, Any]], object], name: str = "hints.json") -> Damage:
    """Changes a file of the hints, the index if no other is named."""

    def changed(data: bytes) -> bytes:
        document = json.loads(data)
        change(document)
        return json.dumps(document).encode()

    return rewritten(name, changed)


def zipped(name: str, change: Callable[[bytes], bytes] = bytes) -> Damage:
    """Puts a gzip copy beside a file."""

    def damage(db: Path) -> None:
        data = gzip.compress((db / "www" / name).read_bytes(), mtime=0)
        put(f"{name}.gz", change(data))(db)

    return damage


def all_of(*damages: Damage) -> Damage:
    return lambda db: [damage(db) for damage in damages]


def removed(name: str) -> Damage:
    return lambda db: (db / "www" / name).unlink()


def copied(name: str, other: str) -> Damage:
    return lambda db: shutil.copy(db / "www" / name, db / "www" / other)


def linked(name: str, target: str) -> Damage:
    def damage(db: Path) -> None:
        (db / "www" / name).unlink(missing_ok=True)
        (db / "www" / name).symlink_to(target)

    return damage
