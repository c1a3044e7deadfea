"""Faults to be planted in the served files of a database."""

from __future__ import annotations

import gzip
import json
import re
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ptmtools.diagnostics import Issue

Damage = Callable[[Path], object]

#: Kinds of findings that share a code: kind → the code, and a pattern of their messages.
KINDS = {
    "special_file": ("D657", r"is a (pipe|device|socket)|is a broken link|is a link to a folder"),
    "utf8": ("D661", "not UTF-8"),
    "leads_out": ("D671", "points outside|is no relative URL"),
    "no_file": ("D671", "no such file"),
    "malformed_url": ("D671", "percent-encoded"),
    "twice": ("D671", r"is named \d+ times"),
    "own_first": ("D690", "does not begin with"),
    "order": ("D690", "twice or out of order|itself$"),
    "record_ach": ("D692", "aligned with visible|the ach values sum to"),
    "index": ("D700", "record|textures|in the index|names (no|files of another) form"),
    "needs": ("D700", "has only"),
    "octree_row": ("D700", "ascending|more than an octree|not aligned"),
    "glb_texture": ("D704", r"texture -?\d+$"),
    "fallback_differs": ("D710", "is not the size of any level"),
    "fallback_unreadable": ("D710", "is not a PNG|cannot be read"),
    "octree_length": ("D710", "the last level"),
    "octree_level": ("D710", "is damaged|before it is whole"),
    "octree_order": ("D710", "texels instead of|first child"),
    "octree_unnamed": ("D677", "no other file names it"),
    "other_schema": ("D656", "this ptmtools reads"),
    "glb_accessor": ("D731", "end|index or a size|bytes of|multiple"),
    "glb_indices": ("D731", r"indices up to"),
    "glb_numbers": ("D731", "is not finite|does not match the data"),
}


def is_planted(issue: Issue, kind: str) -> bool:
    """Whether a finding is of a kind of `KINDS`, or has the code that is named instead."""
    code, pattern = KINDS.get(kind, (kind, ""))
    repeats = issue.message.endswith("more of these")
    return issue.code == f"PTM-{code}" and (repeats or bool(re.search(pattern, issue.message)))


def expect(issues: Sequence[Issue], expected: str) -> None:
    """The kinds and codes named in ``expected`` are reported, and nothing else."""
    kinds = expected.split()
    shown = "\n".join(map(str, issues))
    assert all(any(is_planted(issue, kind) for issue in issues) for kind in kinds), shown
    assert all(any(is_planted(issue, kind) for kind in kinds) for issue in issues), shown


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
