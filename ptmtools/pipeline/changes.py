"""Why a stage has to be run: its options or inputs have changed, or an output is gone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.manifest import SCHEMA, StageRecord

#: Files that are named one by one.
_NAMED = 3
#: Why a stage is run for the first time.
NEVER_RUN = ("has not been run",)


def reasons(
    before: StageRecord | None, work: StageRecord, db: DatabaseFolder, changed: str = ""
) -> tuple[str, ...]:
    """What makes a stage with this record do ``work``; empty if it is current. ``changed`` is what
    its recipe has changed."""
    if before is None:
        earlier = db.manifest.replaced
        if earlier is None:
            return NEVER_RUN
        return (f"the database has schema {earlier}, this ptmtools writes {SCHEMA}",)
    found = []
    if before.recipe != work.recipe:
        what = f": {changed}" if changed and before.recipe < work.recipe else ""
        found.append(f"this ptmtools computes it differently (recipe {before.recipe} before){what}")
    names = [*before.parameters, *(n for n in work.parameters if n not in before.parameters)]
    for name in names:
        old, new = before.parameters.get(name), work.parameters.get(name)
        both = name in before.parameters and name in work.parameters
        if old != new and (both or before.recipe == work.recipe):
            found.append(f"{name.replace('_', ' ')}: {_text(old)} → {_text(new)}")
    options = bool(found)
    for what, files in _changed(before.inputs, work.inputs).items():
        # What it does not read any more because of its options says nothing beside them.
        if files and not (options and what == "removed"):
            found.append(f"{_listed(files)} {what}")
    if not found and (lost := db.damaged(before.outputs)):
        found.append(f"{lost} is missing or damaged")
    return tuple(found)


def _changed(before: Mapping[str, str], after: Mapping[str, str]) -> dict[str, list[str]]:
    both = [n for n in after if n in before and after[n] != before[n]]
    return {
        "changed": [n for n in both if before[n] and after[n]],
        "added": [n for n in both if not before[n]] + [n for n in after if n not in before],
        "removed": [n for n in both if not after[n]] + [n for n in before if n not in after],
    }


def _listed(files: list[str]) -> str:
    more = f" and {len(files) - _NAMED:,} more" if len(files) > _NAMED else ""
    return ", ".join(files[:_NAMED]) + more


def _text(value: Any) -> str:
    if value is None or value in ("", []):
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)
