"""Command-line options made from the fields of an options dataclass.

The dataclass stays the one home of names, defaults and their explanation: a field `wall_area:
float = 2.0` with the line ``wall_area: the least area …`` under "Attributes" of the docstring
becomes ``--wall-area FLOAT`` with that default and that help. A field whose metadata has
``choices``, a table of declarations by name, becomes a choice among them.
"""

from __future__ import annotations

import inspect
import re
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, fields
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

import click

T = TypeVar("T")
Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

#: Fields whose option has another name: of lists it names one element; of a stage, the stage.
NAMES = {
    "viewpoints": "viewpoint",
    "image_folders": "image_folder",
    "method": "pvs",
    "budget": "pvs_budget",
    "lines": "pvs_lines",
    "exact": "pvs_exact",
}


class Numbers(click.ParamType):  # type: ignore[type-arg]  # generic only in newer Clicks
    """``X,Y,Z``: so many numbers, separated by commas; ``kind`` is float or int."""

    name = "numbers"

    def __init__(self, counts: Sequence[int], kind: type[float] = float) -> None:
        self.counts = tuple(counts)
        self.kind = kind

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return "X,Y,Z" if self.counts == (3,) else ",".join("N" * self.counts[0])

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, ...]:
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(self.kind(part) for part in str(value).split(","))
        except ValueError:
            numbers = ()
        if len(numbers) not in self.counts:
            wanted = " or ".join(str(count) for count in self.counts)
            whole = "whole " if self.kind is int else ""
            self.fail(f"{value!r} is not {wanted} {whole}numbers separated by commas", param, ctx)
        return numbers


class OneOf(click.ParamType):  # type: ignore[type-arg]  # generic only in newer Clicks
    """A name in a table of declarations, each of which says in ``about`` what it is for."""

    name = "name"

    def __init__(self, table: Mapping[str, Any]) -> None:
        self.table = table

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return f"[{'|'.join(self.table)}]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        if value not in self.table:
            self.fail(f"{value!r} is not one of {', '.join(self.table)}", param, ctx)
        return str(value)

    def help(self, text: str | None) -> str:
        """What is said of the option, and then of each name."""
        names = ", ".join(f"{name} ({declared.about})" for name, declared in self.table.items())
        return f"{text}: {names}."


def descriptions(cls: type) -> dict[str, str]:
    """What the docstring of a dataclass, and of its bases, says of its fields: name → text."""
    if cls is object:
        return {}
    found = {name: told for base in cls.__bases__ for name, told in descriptions(base).items()}
    text = inspect.cleandoc(cls.__doc__ or "")
    _, _, body = text.partition("Attributes\n----------\n")
    names: list[str] = []
    for line in re.split(r"\n\w+\n-+\n", body)[0].splitlines():
        if head := re.match(r"(\w+(?:, \w+)*): (.*)", line):
            names = head[1].split(", ")
            found.update(dict.fromkeys(names, head[2]))
        elif line.startswith(" ") and names:
            for name in names:
                found[name] += " " + line.strip()
        else:
            names = []
    return {name: re.sub(r"``?([^`]*)``?", r"\1", told) for name, told in found.items()}


def options_of(cls: type, *, omit: Sequence[str] = ()) -> Decorator:
    """A decorator that adds one option for every field of ``cls`` that is not in ``omit``."""
    hints = typing.get_type_hints(cls)
    told = descriptions(cls)

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        for field in reversed(fields(cls)):
            if field.name not in omit:
                function = _option(field, hints[field.name], told.get(field.name))(function)
        return function

    return decorate


def take(
    cls: type[T],
    values: dict[str, Any],
    *,
    omit: Sequence[str] = (),
    share: Sequence[str] = (),
    **given: Any,
) -> T:
    """An instance of ``cls`` from the parsed values, which are removed from ``values`` but for
    those that others ``share``; fields in ``omit`` keep their defaults."""
    names = {field.name for field in fields(cls)} & set(values) - set(omit)  # type: ignore[arg-type]
    found = {name: values[name] if name in share else values.pop(name) for name in sorted(names)}
    return cls(**found, **given)


def _option(field: Field[Any], hint: Any, told: str | None) -> Decorator:
    default = field.default if field.default_factory is MISSING else field.default_factory()
    flag = "--" + NAMES.get(field.name, field.name).replace("_", "-")
    settings: dict[str, Any] = {"default": default, "help": told}
    if get_origin(hint) in (Union, UnionType):  # X | None
        hint = next(part for part in get_args(hint) if part is not NoneType)
    if default not in (None, (), ""):
        settings["show_default"] = True
    if hint is bool:
        # A switch that is on by default is named by what turns it off.
        flag = f"{flag}/--no-{flag[2:]}"
    elif "choices" in field.metadata:
        settings["type"] = OneOf(field.metadata["choices"])
        settings["help"] = settings["type"].help(told)
    elif get_origin(hint) is Literal:
        settings["type"] = click.Choice([str(choice) for choice in get_args(hint)])
    elif get_origin(hint) is tuple:
        settings["type"], settings["multiple"] = _element(hint)
    else:
        settings["type"] = hint
    return click.option(flag, field.name, **settings)


def _element(hint: Any) -> tuple[Any, bool]:
    """(type of one value, whether it may be given several times) of a tuple's annotation."""
    parts = get_args(hint)
    if parts[-1] is not Ellipsis:
        return Numbers([len(parts)]), False
    if get_origin(parts[0]) is tuple:
        return Numbers([len(get_args(parts[0]))]), True
    return parts[0], True
