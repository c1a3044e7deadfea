"""Command-line options made from the fields of an options dataclass; `ptmtools.pipeline.stage` is
the way back.

The dataclass stays the one home of names, defaults and their explanation: a field `wall_area:
float = 2.0` with the line ``wall_area: the least area …`` under "Attributes" of the docstring
becomes ``--wall-area FLOAT`` with that default and that help, with a capital
letter. The metadata of a field may say more:

* ``option``: its name on the command line, where that is not the field's own;
* ``was``: former names, which work for one release, with a note;
* ``deprecated``: why it does nothing any more; it is hidden, and giving it draws a note;
* ``note``: a function of what was given that returns what there is to say of it, or None;
* ``choices``: a table of what may be given, by name, each with an ``about``; with ``several``,
  several names may be given, separated by commas;
* ``numbers``: how many numbers one value consists of, where that varies, such as (3, 4);
* ``parse``, ``print``: from what the command line gives to the field's value, and back.

Fields of several classes that have the same option share it.
"""

from __future__ import annotations

import inspect
import re
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, fields
from functools import wraps
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

import click
from click.core import ParameterSource

from ptmtools.pipeline.stage import default_of, option_name

T = TypeVar("T")
Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


class Numbers(click.ParamType):  # type: ignore[type-arg]  # generic only in newer Clicks
    """``X,Y,Z``: so many numbers, separated by commas; ``kind`` is float or int."""

    name = "numbers"

    def __init__(self, counts: Sequence[int], kind: type[float] = float) -> None:
        self.counts = tuple(counts)
        self.kind = kind

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        if self.counts == (3, 4):
            return "X,Y,Z[,YAW]"
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


class Named(click.ParamType):  # type: ignore[type-arg]  # generic only in newer Clicks
    """A name in a table of declarations, or ``several`` with commas in between."""

    name = "name"

    def __init__(self, table: Mapping[str, Any], *, several: bool = False) -> None:
        self.table = table
        self.several = several

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        return "NAME[,NAME]" if self.several else f"[{'|'.join(self.table)}]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        for name in str(value).split(",") if self.several else [value]:
            if name not in self.table:
                self.fail(f"{name!r} is not one of {', '.join(self.table)}", param, ctx)
        return str(value)

    @property
    def explained(self) -> str:
        """What each name stands for."""
        return ", ".join(f"{name} ({declared.about})" for name, declared in self.table.items())


def descriptions(cls: type) -> dict[str, str]:
    """What the docstring of a dataclass, and of its bases, says of its fields: name → text."""
    if cls is object:
        return {}
    found = {name: text for base in cls.__bases__ for name, text in descriptions(base).items()}
    doc = inspect.cleandoc(cls.__doc__ or "")
    _, _, body = doc.partition("Attributes\n----------\n")
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
    return {name: re.sub(r"``?([^`]*)``?", r"\1", text) for name, text in found.items()}


def options_of(*classes: type) -> Decorator:
    """A decorator that adds the options of all fields of ``classes``."""
    found: dict[str, Decorator] = {}
    former: dict[str, str] = {}
    deprecated: dict[str, tuple[Any, str]] = {}
    for cls in classes:
        hints, texts = typing.get_type_hints(cls), descriptions(cls)
        for field in fields(cls):
            name = option_name(field)
            if name not in found:
                found[name] = _option(field, hints[field.name], texts.get(field.name))
                if reason := field.metadata.get("deprecated"):
                    deprecated[name] = default_of(field), reason
                for old in field.metadata.get("was", ()):
                    found[old] = _option(field, hints[field.name], None, former=old)
                    former[old] = name

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def renamed(*arguments: Any, **values: Any) -> Any:
            for old, new in former.items():
                given = values.pop(_variable(old))
                if given not in (None, ()):
                    source = click.get_current_context().get_parameter_source(_variable(new))
                    if source == ParameterSource.COMMANDLINE:
                        raise click.UsageError(f"--{old} is now called --{new}; give one of them")
                    click.echo(f"ptm: note: --{old} is now called --{new}", err=True)
                    values[_variable(new)] = given
            for name, (default, reason) in deprecated.items():
                if values[_variable(name)] != default:
                    word = f"no-{name}" if default is True else name
                    click.echo(f"ptm: note: --{word} does nothing any more: {reason}", err=True)
            return function(*arguments, **values)

        command: Callable[..., Any] = renamed
        for option in reversed(found.values()):
            command = option(command)
        return command

    return decorate


def take(cls: type[T], values: dict[str, Any]) -> T:
    """An instance of ``cls`` from the parsed values; a field whose option the command does not have
    keeps its default."""
    found = {}
    for field in fields(cls):  # type: ignore[arg-type]
        name = _variable(option_name(field))
        if name in values:
            parse = field.metadata.get("parse", lambda value: value)
            found[field.name] = parse(values[name])
    return cls(**found)


def _variable(option: str) -> str:
    """The name under which a command is handed an option."""
    return option.replace("-", "_")


def _option(field: Field[Any], hint: Any, text: str | None, former: str = "") -> Decorator:
    """The option of a field; with ``former`` the hidden one of that name, without a default."""
    default = None if former else default_of(field)
    name = former or option_name(field)
    settings: dict[str, Any] = {
        "default": default,
        "help": text and text[:1].upper() + text[1:],
        "hidden": bool(former or field.metadata.get("deprecated")),
    }
    if former:
        settings["help"] = f"Now --{option_name(field)}."
    if get_origin(hint) in (Union, UnionType):  # X | None
        hint = next(part for part in get_args(hint) if part is not NoneType)
    if default not in (None, (), ""):
        settings["show_default"] = True
    flag = f"--{name}"
    if hint is bool:
        # A switch that is on by default is named by what turns it off.
        flag = f"{flag}/--no-{name}"
    elif (table := field.metadata.get("choices")) is not None:
        settings["type"] = named = Named(table, several=field.metadata.get("several", False))
        settings["help"] = settings["help"] and f"{settings['help']}: {named.explained}."
    elif get_origin(hint) is Literal:
        settings["type"] = click.Choice([str(choice) for choice in get_args(hint)])
    elif counts := field.metadata.get("numbers"):
        settings["type"], settings["multiple"] = Numbers(counts), True
    elif get_origin(hint) is tuple:
        settings["type"], settings["multiple"] = _element(hint)
    else:
        settings["type"] = hint
    return click.option(flag, _variable(name), **settings)


def _element(hint: Any) -> tuple[Any, bool]:
    """(type of one value, whether it may be given several times) of a tuple's annotation."""
    parts = get_args(hint)
    if parts[-1] is not Ellipsis:
        return Numbers([len(parts)]), False
    if get_origin(parts[0]) is tuple:
        return Numbers([len(get_args(parts[0]))]), True
    return parts[0], True
