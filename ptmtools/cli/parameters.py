"""Options of commands: those generated from options classes, and those that commands share.

A field that `ptmtools.options.option` declares becomes an option of the command line. `Command`
prints the options under headings; a command with advanced options, which are those that are not
``basic``, prints them for ``--help-all``.
"""

from __future__ import annotations

import math
import os
import re
import typing
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import Field, fields
from functools import partial, wraps
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, Literal, TypeVar, Union, get_args, get_origin

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from ptmtools.cli.console import Console
from ptmtools.options import OptionDeclaration, default_of, degrees_text, option_name, option_of

if TYPE_CHECKING:
    from ptmtools.texture.model import Limits

T = TypeVar("T")
Function = Callable[..., Any]
Decorator = Callable[[Function], Function]

#: The heading of options that belong to no options class; it comes last.
GENERAL = "General"
#: Values of an option that its help explains; more are listed under a heading.
INLINE_VALUES = 5
HELP_ALL = "ptmtools.cli.help_all"
_ADDRESS = re.compile(r"\w+://.+:\d+")
_METAVARS = {"integer": "N", "integer range": "N", "float": "X", "float range": "X"}


class Option(click.Option):
    """An option with a heading."""

    def __init__(
        self,
        *arguments: Any,
        heading: str = GENERAL,
        basic: bool = True,
        shown_default: str | None = None,
        values: Sequence[tuple[str, str]] = (),
        **settings: Any,
    ) -> None:
        super().__init__(*arguments, **settings)
        self.heading, self.basic = heading, basic
        #: (name, description) of values that are listed under a heading of their own.
        self.values = values
        self._shown_default = shown_default

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """(names and placeholder, help and default)."""
        if self.hidden:
            return None
        names = ", ".join(self.opts)
        if self.default is True and self.secondary_opts:
            names += f" / {self.secondary_opts[0]}"
        takes_value = not self.is_flag
        default = self._shown_default
        if default is None and takes_value and not callable(self.default):
            default = _default_text(self.default)
        text = (self.help or "") + (f"  [default: {default}]" if default else "")
        return f"{names} {self._placeholder()}" if takes_value else names, text

    def _placeholder(self) -> str:
        if isinstance(self.type, click.Choice):
            return f"[{'|'.join(map(str, self.type.choices))}]"
        return self.metavar or _METAVARS.get(self.type.name, self.type.name.upper())


#: ``click.option`` for an `Option`.
option = partial(click.option, cls=Option)


class Command(click.Command):
    """A command whose options are listed under headings."""

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        if any(not getattr(parameter, "basic", True) for parameter in self.params):
            every = Option(
                ["--help-all"],
                is_flag=True,
                is_eager=True,
                expose_value=False,
                callback=_print_all_help,
                help="Show all options and exit.",
            )
            self.params.append(every)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Writes the options under their headings."""
        sections: dict[str, list[tuple[str, str]]] = {}
        omitted = 0
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx) if isinstance(parameter, click.Option) else None
            if record is None:
                continue
            if ctx.meta.get(HELP_ALL) or getattr(parameter, "basic", True):
                sections.setdefault(getattr(parameter, "heading", GENERAL), []).append(record)
            else:
                omitted += 1
        sections[GENERAL] = sections.pop(GENERAL, [])
        for parameter in self.params:
            if isinstance(parameter, Option) and parameter.values:
                sections[f"Values of {parameter.opts[0]}"] = list(parameter.values)
        width = min(30, max(len(names) for rows in sections.values() for names, _ in rows))
        for heading, rows in sections.items():
            with formatter.section(heading):
                formatter.write_dl([(names.ljust(width), text) for names, text in rows])
        if omitted:
            formatter.write_paragraph()
            formatter.write_text(f"--help-all shows {omitted} more options.")


def _print_all_help(context: click.Context, parameter: click.Parameter, given: bool) -> None:
    if given and not context.resilient_parsing:  # a shell completes a line
        context.meta[HELP_ALL] = True
        click.echo(context.get_help())
        context.exit()


class Numbers(click.ParamType):  # type: ignore[type-arg]  # generic only in newer Clicks
    """Numbers separated by commas, as many as one of the counts; ``kind`` is float or int."""

    name = "numbers"

    def __init__(self, counts: Sequence[int], kind: type[float] = float) -> None:
        self.counts = tuple(counts)
        self.kind = kind

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
            whole = "whole " if issubclass(self.kind, int) else ""
            self.fail(f"{value!r} is not {wanted} {whole}numbers separated by commas", param, ctx)
        return numbers


class Named(click.ParamType):  # type: ignore[type-arg]  # generic only in newer Clicks
    """A name in a table of declarations, or with ``several`` some names separated by commas."""

    name = "name"

    def __init__(self, table: Mapping[str, Any], *, several: bool = False) -> None:
        self.table = table
        self.several = several

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        for name in str(value).split(",") if self.several else [value]:
            if name not in self.table:
                self.fail(f"{name!r} is not one of {', '.join(self.table)}", param, ctx)
        return str(value)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        given, comma, last = incomplete.rpartition(",") if self.several else ("", "", incomplete)
        return [
            CompletionItem(given + comma + name, help=about)
            for name, about in self.descriptions
            if name.startswith(last) and name not in given.split(",")
        ]

    @property
    def descriptions(self) -> list[tuple[str, str]]:
        """(name, description) of each value."""
        return [(name, declared.about) for name, declared in self.table.items()]


class Degrees(click.ParamType):  # type: ignore[type-arg]  # generic only in newer Clicks
    """An angle in degrees, converted to radians; a default is in radians.

    Fields of view were in radians once. Numbers below pi, too small for degrees, are still read as
    such, with a note.
    """

    name = "degrees"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        if isinstance(value, float):
            return value
        try:
            angle = float(value)
        except ValueError:
            self.fail(f"{value!r} is not a number of degrees", param, ctx)
        if not 0 < angle < math.pi:
            return math.radians(angle)
        name = param.opts[0] if param else "the angle"
        click.echo(
            f"ptm: note: {name} is in degrees now; {value} is read as radians, which are "
            f"{degrees_text(angle)} degrees",
            err=True,
        )
        return angle


def options_of(
    *classes: type, layered: bool = False, hidden: bool = False, without: Container[str] = ()
) -> Decorator:
    """A decorator that adds the options of all fields of ``classes``, but for the fields
    ``without``, under the ``heading`` of each class; with ``layered``, ``--help`` lists the basic
    ones only, with ``hidden``, none. Fields of several classes that have the same option share
    it."""
    options: dict[str, Decorator] = {}
    for cls in classes:
        hints, heading = typing.get_type_hints(cls), getattr(cls, "heading", "Options")
        for field in fields(cls):
            name, about = option_name(field), option_of(field)
            if name in options or field.name in without:
                continue
            settings: dict[str, Any] = {"heading": heading, "hidden": hidden}
            settings["basic"] = about.basic or not layered
            options[name] = _option(field, hints[field.name], **settings)

    def decorate(function: Function) -> Function:
        for add_option in reversed(options.values()):
            function = add_option(function)
        return function

    return decorate


def take(cls: type[T], values: Mapping[str, Any]) -> T:
    """An instance of ``cls`` from the parsed values; a field whose option the command does not have
    keeps its default."""
    given = {}
    for field in fields(cls):  # type: ignore[arg-type]
        name = _variable(option_name(field))
        if name in values:
            parse = option_of(field).parse or (lambda value: value)
            given[field.name] = parse(values[name])
    return cls(**given)


def given_options(*classes: type) -> set[str]:
    """The options of these classes that the command line contains, without their dashes."""
    context = click.get_current_context()
    names = [option_name(field) for cls in classes for field in fields(cls)]
    return {
        name
        for name in names
        if context.get_parameter_source(_variable(name)) == ParameterSource.COMMANDLINE
    }


def _variable(option: str) -> str:
    """The keyword argument of a command for an option."""
    return option.replace("-", "_")


def _option(field: Field[Any], hint: Any, **settings: Any) -> Decorator:
    """The option of a field."""
    default, about, name = default_of(field), option_of(field), option_name(field)
    settings |= {"default": default, "help": about.help, "metavar": about.metavar or None}
    if get_origin(hint) in (Union, UnionType):  # X | None
        hint = next(part for part in get_args(hint) if part is not NoneType)
    if hint is bool:
        return option(f"--{name}/--no-{name}", _variable(name), **settings)
    settings |= _settings_of_type(about, hint)
    if about.degrees and default is not None:
        settings["shown_default"] = f"{math.degrees(default):.4g}"
    return option(f"--{name}", _variable(name), **settings)


def _settings_of_type(about: OptionDeclaration, hint: Any) -> dict[str, Any]:
    """The settings of an option that follow from its declaration and the type of the field."""
    if about.choices is not None:
        named = Named(about.choices, several=about.several)
        metavar = "NAME[,NAME]" if about.several else f"[{'|'.join(about.choices)}]"
        settings = {"type": named, "metavar": metavar}
        if len(named.descriptions) > INLINE_VALUES:
            return {**settings, "help": f"{about.help}; see below.", "values": named.descriptions}
        values = ", ".join(f"{name} ({text})" for name, text in named.descriptions)
        return {**settings, "help": f"{about.help}: {values}."}
    if about.degrees:
        return {"type": Degrees()}
    if about.numbers:
        return {"type": Numbers(about.numbers), "multiple": get_args(hint)[0] is not float}
    if get_origin(hint) is Literal:
        return {"type": click.Choice([str(choice) for choice in get_args(hint)])}
    if get_origin(hint) is not tuple:
        return {"type": hint}
    parts = get_args(hint)
    if parts[-1] is not Ellipsis:
        return {"type": Numbers([len(parts)])}
    if get_origin(parts[0]) is tuple:
        return {"type": Numbers([len(get_args(parts[0]))]), "multiple": True}
    return {"type": parts[0], "multiple": True}


def _default_text(value: Any) -> str:
    """A default as the user would give it; "" for none."""
    if value is None or value == () or type(value).__name__ == "Sentinel":
        return ""
    if isinstance(value, (tuple, list)):
        return ",".join(map(_default_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def with_console(function: Function) -> Function:
    """Adds ``-q`` and ``-v``, and passes the `Console` as the first argument."""

    @option("-q", "--quiet", is_flag=True, help="Print errors only.")
    @option("-v", "--verbose", is_flag=True, help="Print details, and the traceback of an error.")
    @click.pass_obj
    @wraps(function)
    def command(console: Console, /, quiet: bool, verbose: bool, **values: Any) -> Any:
        console.quiet |= quiet
        console.verbose |= verbose
        return function(console, **values)

    return command


#: ``--json``, as `Console.as_json`.
json_option = option(
    "--json",
    is_flag=True,
    expose_value=False,
    callback=lambda context, parameter, given: setattr(context.obj, "as_json", given),
    help="Print the report as JSON.",
)


def local_copy(context: click.Context, parameter: click.Parameter, value: str) -> str:
    """The folder of a database to read; of one at a URL that of its copy."""
    from ptmtools.store.objects import is_url, plain_path

    if context.resilient_parsing:  # a shell completes a line
        return value
    if not is_url(plain_path(value)):
        return os.fspath(plain_path(value))
    from ptmtools.store.remote import fetch_database

    return os.fspath(fetch_database(value))


database_argument = click.argument("db", type=click.Path(), callback=local_copy)


def output_option(text: str, variable: str = "output", **settings: Any) -> Decorator:
    """``-o``, the main file or folder to write."""
    return option("-o", "--output", variable, type=click.Path(), help=text, **settings)


def file_option(name: str, text: str, heading: str = "Output", **settings: Any) -> Decorator:
    """``--NAME FILE`` for a further file or folder, as ``NAME_file``."""
    settings = {"metavar": "FILE", "type": click.Path(), "help": text, **settings}
    return option(f"--{name}", f"{name}_file", heading=heading, **settings)


def force_option(text: str = "Replace existing files.") -> Decorator:
    """``--force``."""
    return option("--force", is_flag=True, help=text)


#: ``-j``, as ``workers``; 0 is one for each processor.
jobs_option: Decorator = option(
    "-j",
    "--jobs",
    "workers",
    type=click.IntRange(0, 1024),
    default=0,
    help="Number of workers; 0 means one per processor. The result does not depend on it.",
)


def cluster_options(function: Function) -> Function:
    """Adds ``-j`` and ``--scheduler``, the arguments of `open_executor`."""
    return option(
        "--scheduler",
        metavar="ADDRESS",
        callback=scheduler_address,
        help="Run the tasks on the cluster of this Dask scheduler, such as tcp://10.0.0.1:8786; "
        "-j then limits the number of tasks that run at the same time.",
    )(jobs_option(function))


def scheduler_address(
    context: click.Context, parameter: click.Parameter, value: str | None
) -> str | None:
    """The callback of ``--scheduler``: refuses what is no address."""
    if value is not None and not _ADDRESS.fullmatch(value):
        raise click.BadParameter(f"{value!r} is not an address such as tcp://10.0.0.1:8786")
    return value


def _limits(context: click.Context, parameter: click.Parameter, value: int) -> Limits:
    from ptmtools.texture.model import Limits

    return Limits(decoded_bytes=value << 20)


#: ``--limit``, as the `Limits` ``limits``.
limit_option: Decorator = option(
    "--limit",
    "limits",
    type=click.IntRange(1, 1 << 20),
    default=1024,
    metavar="MIB",
    callback=_limits,
    help="Maximum decoded size of an image.",
)


def new_database_option(function: Function) -> Function:
    """Adds ``-o DB`` to a command with a model; by default the database lies beside the model."""

    @output_option(
        "Folder of the database to write. Default: beside the model, such as museum.db for "
        "museum.obj.",
        "db",
        metavar="DB",
    )
    @wraps(function)
    def command(*arguments: Any, model: str, db: str | None, **values: Any) -> Any:
        if not model or db == "":
            raise click.UsageError("a name is empty")
        place = os.path.splitext(model)[0] + ".db" if db is None else db
        return function(*arguments, model=model, db=place, **values)

    return command
