"""Docstrings of the house style as mkdocstrings reads them: an extension of griffe.

Sections of the house style have an underlined heading and entries ``name: text`` or ``a, b: text``;
Google's style, which griffe knows, has the same entries under ``Parameters:``, indented, one name
each. A field of an options class has no docstring but a help text, ``option(default, "help")``.
"""

from __future__ import annotations

import ast
import re
from typing import Any

import griffe

#: An underlined heading with its entries, up to a paragraph that is none.
SECTION = re.compile(
    r"^(Parameters|Attributes|Raises|Returns)\n-+\n((?:.+\n?|\n(?= |(?:\w+, )*\w+: ))*)",
    re.MULTILINE,
)
#: The beginning of an entry for several names.
NAMES = re.compile(r"^(\w+(?:, \w+)+): ")
#: Placeholders of the command line that are units.
UNITS = {
    "BYTES": "bytes",
    "M/S": "m/s",
    "M2": "m²",
    "METRES": "metres",
    "MIB": "MiB",
    "PIXELS": "pixels",
    "SECONDS": "seconds",
    "TEXELS": "texels",
}


def google_style(docstring: str) -> str:
    """The docstring with sections of Google's style."""
    return SECTION.sub(
        lambda section: f"{section[1]}:\n" + "".join(_entries(section[1], section[2])), docstring
    )


def _entries(title: str, body: str) -> list[str]:
    """The lines of a section, indented; an entry for several names is one for each."""
    lines: list[str] = []
    for entry in re.split(r"^(?=\S)", body, flags=re.MULTILINE) if title != "Returns" else [body]:
        names = NAMES.match(entry) if title != "Raises" else None
        each = [f"{n}: {entry[names.end() :]}" for n in names[1].split(", ")] if names else [entry]
        lines += [f"    {line}\n" for text in each for line in text.splitlines()]
    return lines


class HouseStyle(griffe.Extension):
    """Rewrites docstrings, and gives the fields of options classes their defaults and texts."""

    def on_instance(self, *, obj: griffe.Object, **settings: Any) -> None:
        if obj.docstring:
            obj.docstring.value = google_style(obj.docstring.value)

    def on_function_instance(self, *, func: griffe.Function, **settings: Any) -> None:
        """Shows the value of a default that is a constant of the module, such as ``_DEFAULTS``."""
        for parameter in func.parameters:
            constant = func.module.members.get(str(parameter.default))
            if isinstance(constant, griffe.Attribute) and constant.name.startswith("_"):
                parameter.default = constant.value

    def on_attribute_instance(self, *, attr: griffe.Attribute, **settings: Any) -> None:
        call = attr.value
        if attr.parent is None or not attr.parent.is_class:  # of a command
            return
        if isinstance(call, griffe.ExprCall) and str(call.function) == "option":
            default, text, *details = call.arguments
            attr.value = default
            if isinstance(text, str):  # a literal, not computed
                shown = ast.literal_eval(text) + _unit(details)
                attr.docstring = griffe.Docstring(shown, parent=attr)


def _unit(details: list[Any]) -> str:
    """A sentence on the unit that the keywords of an option name."""
    given = {each.name: str(each.value) for each in details}
    unit = "radians" if "degrees" in given else UNITS.get(given.get("metavar", "").strip("\"'"), "")
    return f" In {unit}." if unit else ""
