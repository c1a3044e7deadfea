"""Options of stages as words of the command line; `ptmtools.cli.parameters` is the way there."""

from __future__ import annotations

import typing
from collections.abc import Iterable
from dataclasses import MISSING, Field, fields
from typing import Any, get_args, get_origin


def words(options: Iterable[Any]) -> list[str]:
    """The command-line words that give these instances of options classes; defaults are left out.
    Where several share an option the last one counts."""
    found: dict[str, list[str]] = {}
    for each in options:
        for field in fields(each):
            value, name = getattr(each, field.name), option_name(field)
            if value == default_of(field) or "deprecated" in field.metadata:
                continue
            value = field.metadata.get("print", lambda value: value)(value)
            if isinstance(value, bool):
                found[name] = [f"--{name}" if value else f"--no-{name}"]
            else:
                many = isinstance(value, (list, tuple)) and _repeated(type(each), field)
                each_value = value if many else [value]
                found[name] = [w for one in each_value for w in (f"--{name}", _text(one))]
    return [word for given in found.values() for word in given]


def _repeated(cls: type, field: Field[Any]) -> bool:
    """Whether the option of a field may be given several times."""
    hint = typing.get_type_hints(cls)[field.name]
    return get_origin(hint) is tuple and get_args(hint)[-1] is Ellipsis


def _text(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return ",".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


def option_name(field: Field[Any]) -> str:
    """The option of a field, without its dashes."""
    name: str = field.metadata.get("option", field.name.replace("_", "-"))
    return name


def default_of(field: Field[Any]) -> Any:
    """What a field is unless it is given."""
    return field.default if field.default_factory is MISSING else field.default_factory()
