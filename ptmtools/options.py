"""Options classes: the metadata of their fields, and the words of the command line that give them.

A frozen dataclass is the one home of an option: its name, default and help text::

    wall_area: float = option(2.0, "Smallest wall that divides the building.", metavar="M2")

`ptmtools.cli.parameters` turns the fields into options of a command; `arguments` is the inverse.
Nothing heavy is imported.
"""

from __future__ import annotations

import math
import typing
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Any, get_args, get_origin

from ptmtools.errors import InputError

_KEY = "option"


@dataclass(frozen=True)
class OptionDeclaration:
    """The metadata of a field.

    Attributes
    ----------
    help: the text of ``--help``, one or two lines; a sentence with its full stop.
    name: the option without its dashes; by default the name of the field.
    metavar: the placeholder of its value; by default it follows from the type.
    basic: ``ptm build-scene --help`` lists it; ``--help-all`` lists all options.
    degrees: the field is in radians, the command line in degrees.
    choices: the values that are allowed, by name; each has an ``about``.
    several: one value consists of several choices, separated by commas.
    numbers: the counts of numbers, separated by commas, that one value may have, such as (3, 4).
    parse, print: convert the value of the command line to that of the field, and back.
    """

    help: str = ""
    name: str = ""
    metavar: str = ""
    basic: bool = False
    degrees: bool = False
    choices: Mapping[str, Any] | None = None
    several: bool = False
    numbers: tuple[int, ...] = ()
    parse: Callable[[Any], Any] | None = None
    print: Callable[[Any], Any] | None = None


def option(default: Any, help: str, *, compare: bool = True, **details: Any) -> Any:
    """A dataclass field with a default; ``details`` are attributes of its `OptionDeclaration`. With
    ``compare=False`` the option does not change what a stage computes."""
    return field(
        default=default, compare=compare, metadata={_KEY: OptionDeclaration(help, **details)}
    )


def require(*rules: tuple[bool, str, str | None]) -> None:
    """Raises InputError PTM-I111 for the first rule (holds, fault, remedy) that does not hold."""
    for holds, fault, remedy in rules:
        if not holds:
            raise InputError("PTM-I111", fault, remedy=remedy)


def require_ranges(
    options: Any, ranges: Mapping[str, tuple[float, float]], fault: str, remedy: str = ""
) -> None:
    """As `require`, for fields between two numbers or at their defaults. The texts have in braces
    ``least`` and ``most``, the option's ``name``, the ``field`` in words and its ``value``."""
    for key, (lower, upper) in ranges.items():
        value = getattr(options, key)
        if value is not getattr(type(options), key) and not lower <= value <= upper:
            words: dict[str, Any] = {"value": value, "least": lower, "most": upper}
            words |= {"name": key.replace("_", "-"), "field": key.replace("_", " ")}
            require((False, fault.format(**words), remedy.format(**words) or None))


def option_of(field: Field[Any]) -> OptionDeclaration:
    """The metadata of a field; empty if it was not declared by `option`."""
    declaration: OptionDeclaration = field.metadata.get(_KEY, OptionDeclaration())
    return declaration


def option_name(field: Field[Any]) -> str:
    """The option of a field, without its dashes."""
    return option_of(field).name or field.name.replace("_", "-")


def default_of(field: Field[Any]) -> Any:
    """The default of a field."""
    return field.default if field.default_factory is MISSING else field.default_factory()


def arguments(options: Iterable[Any]) -> list[str]:
    """The command-line arguments that give these instances of options classes, without those that
    are defaults. Where several classes share an option, the last one counts."""
    given: dict[str, list[str]] = {}
    for instance in options:
        for member in fields(instance):
            name, about = option_name(member), option_of(member)
            value = getattr(instance, member.name)
            if value == default_of(member):
                continue
            if about.print:
                value = about.print(value)
            if about.degrees:
                value = degrees_text(value)
            if isinstance(value, bool):
                given[name] = [f"--{name}" if value else f"--no-{name}"]
            else:
                many = isinstance(value, (list, tuple)) and _may_repeat(type(instance), member)
                values = value if many else [value]
                given[name] = [word for part in values for word in (f"--{name}", _text(part))]
    return [word for words in given.values() for word in words]


def degrees_text(radians: float) -> str:
    """The shortest number of degrees that is this angle, bit for bit where there is one."""
    degrees = math.degrees(radians)
    texts = [f"{degrees:.{digits}g}" for digits in (6, 9, 12, 15, 17)]
    return next((text for text in texts if math.radians(float(text)) == radians), texts[-1])


def _may_repeat(cls: type, field: Field[Any]) -> bool:
    """Whether the option of a field may be given several times."""
    hint = typing.get_type_hints(cls)[field.name]
    return get_origin(hint) is tuple and get_args(hint)[-1] is Ellipsis


def _text(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        return ",".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)
