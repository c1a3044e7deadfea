"""The record of a stage's last run: its options, why the stage has to run again, and the report.

A stage is current while its recipe, its parameters and the SHA-256 of its inputs are those of its
record, and all outputs are present with their recorded SHA-256.
"""

from __future__ import annotations

import json
import typing
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, is_dataclass
from types import UnionType
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Union, get_args, get_origin

from ptmtools.errors import PtmError

if TYPE_CHECKING:
    from ptmtools.store.folder import DatabaseFolder
    from ptmtools.store.manifest import StageRecord

O = TypeVar("O")

#: Files that a reason lists by name.
_NAMED = 3
#: The reason of a stage's first run.
NEVER_RUN = ("it has not been run",)


@dataclass(frozen=True)
class StageReport:
    """The result of a stage in one run.

    Attributes
    ----------
    stage: its name.
    ran: False if it was current.
    seconds: wall-clock time, checks included. Textures are encoded beside the other stages where
        there is more than one worker, so the sum may exceed the total.
    counts: the figures recorded in the manifest.
    notes: one line each.
    warnings: the notes that are warnings, one line for each kind.
    reasons: why it ran, one line each.
    tasks: for a stage that consists of tasks: the number of all, of those kept from the last run,
        and of those taken over from an interrupted run.
    """

    stage: str
    ran: bool
    seconds: float
    counts: Mapping[str, Any]
    notes: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    tasks: tuple[int, int, int] | None = None
    warnings: tuple[str, ...] = ()

    @property
    def further(self) -> tuple[str, ...]:
        """The notes that are no warnings."""
        return tuple(note for note in self.notes if note not in self.warnings)


def parameters(options: Any) -> dict[str, Any]:
    """The options that can change an artifact, as JSON reads them back; the others are not compared
    in their class (``field(compare=False)``)."""
    if not is_dataclass(options) or isinstance(options, type):
        raise TypeError(f"{options!r} is not an options dataclass")
    plain = asdict(options)
    for member in fields(options):
        if not member.compare:
            del plain[member.name]
    result: dict[str, Any] = json.loads(json.dumps(plain))
    return result


def options_of(kind: type[O], record: StageRecord) -> O:
    """Inverse of `parameters`: the options of the class ``kind`` that a record has.

    Parameters without a field are ignored. A field without a parameter has its default.

    Raises ValueError if the parameters are impossible.
    """
    hints = typing.get_type_hints(kind)
    values: dict[str, Any] = {}
    try:
        for member in fields(typing.cast(Any, kind)):
            if member.name in record.parameters and member.compare:
                values[member.name] = _restore(hints[member.name], record.parameters[member.name])
        return kind(**values)
    except (PtmError, AttributeError, LookupError, TypeError) as fault:
        raise ValueError(str(fault)) from fault


def _restore(hint: Any, value: Any) -> Any:
    """The option of type ``hint`` that JSON holds as ``value``; raises TypeError if there is
    none."""
    parts = get_args(hint)
    if get_origin(hint) in (Union, UnionType):
        for part in parts:
            with suppress(TypeError):
                return _restore(part, value)
    elif get_origin(hint) is tuple and isinstance(value, list):
        inner = [parts[0]] * len(value) if parts[-1] is Ellipsis else parts
        if len(inner) == len(value):
            return tuple(map(_restore, inner, value))
    elif isinstance(hint, type) and is_dataclass(hint) and isinstance(value, dict):
        hints = typing.get_type_hints(hint)
        return hint(**{name: _restore(hints.get(name), part) for name, part in value.items()})
    elif (
        (get_origin(hint) is Literal and value in parts)
        or type(value) is hint
        or (hint is float and type(value) is int)
    ):
        return value
    raise TypeError(f"{value!r} is not {hint}")


def reasons(
    stage: str, before: StageRecord | None, work: StageRecord, db: DatabaseFolder, changed: str = ""
) -> tuple[str, ...]:
    """Why a stage with the record ``before`` has to do ``work``; empty if it is current.
    ``changed`` describes the change of its recipe."""
    if before is None:
        if lost := db.manifest.lost.get(stage):
            return (f"{lost} is missing or damaged",)
        return NEVER_RUN
    lines = []
    if before.recipe != work.recipe:
        change = f": {changed}" if changed and before.recipe < work.recipe else ""
        lines.append(
            f"this release computes it differently (recipe {before.recipe} before){change}"
        )
    for name in dict.fromkeys((*before.parameters, *work.parameters)):
        old, new = before.parameters.get(name), work.parameters.get(name)
        both = name in before.parameters and name in work.parameters
        if old != new and (both or before.recipe == work.recipe):
            lines.append(f"{name.replace('_', ' ')}: {_text(old)} → {_text(new)}")
    options = bool(lines)
    for change, files in _changed_files(before.inputs, work.inputs).items():
        # Other options may need fewer inputs, which is no further reason.
        if files and not (options and change == "removed"):
            lines.append(f"{_file_names(files)} {change}")
    if not lines and (lost := db.first_damage(before.outputs)):
        lines.append(f"{lost} is missing or damaged")
    return tuple(lines)


def _changed_files(before: Mapping[str, str], after: Mapping[str, str]) -> dict[str, list[str]]:
    both = [n for n in after if n in before and after[n] != before[n]]
    return {
        "changed": [n for n in both if before[n] and after[n]],
        "added": [n for n in both if not before[n]] + [n for n in after if n not in before],
        "removed": [n for n in both if not after[n]] + [n for n in before if n not in after],
    }


def _file_names(files: list[str]) -> str:
    more = f" and {len(files) - _NAMED:,} more" if len(files) > _NAMED else ""
    return ", ".join(files[:_NAMED]) + more


def _text(value: Any) -> str:
    if value is None or value in ("", []):
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)
