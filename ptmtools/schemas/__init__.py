"""Validates JSON documents that ptmtools writes or reads, by the published schemas in this folder.

The schemas (docs/formats/schemas.md) are JSON Schema, draft 2020-12, of which the keywords in
`_RULES` are supported; a schema with another keyword does not compile. Three rules are stricter
than the draft: an integer is written without a fraction (2, not 2.0), a number must be finite as a
float64, and values without a schema are nested at most `DEEPEST` levels.

A schema is compiled to nested functions, once. Lists of numbers, which are most of a large
document, are checked by the set of their types, their minimum and their maximum, ten times as fast
as one by one.

Tried and rejected: fastjsonschema 2.22. For the hints of the museum's 21 cells it takes 19 ms
instead of 6.4, and 140 ms instead of 16 to compile the two schemas. It reads drafts up to 2019 (no
`prefixItems`), accepts 2.0 for an integer, NaN and infinity, and has no limit of depth.
jsonschema-rs is faster but also accepts 2.0; jsonschema takes 34 times as long.
"""

from __future__ import annotations

import json
import operator
import re
import sys
from collections.abc import Callable, Mapping
from functools import cache
from importlib.resources import files
from typing import Any

#: Names of the schemas.
HINTS, CELL, STATISTICS = "hints", "cell", "statistics"
MANIFEST, FILES, VALIDATION, GLB, SCENE = "manifest", "files", "validation", "glb", "scene"
WALK, TRACE, SITE, MESSAGES, TOUR = "walk", "trace", "site", "messages", "tour"
#: Levels of lists and objects in a value without a schema.
DEEPEST = 16

Check = Callable[[Any], None]
Schema = Mapping[str, Any]

_NULL = type(None)
_TYPES: dict[str, set[type]] = {
    "array": {list},
    "boolean": {bool},
    "integer": {int},
    "null": {_NULL},
    "number": {int, float},
    "object": {dict},
    "string": {str},
}
_NUMBERS = {int, float}
_LARGEST = sys.float_info.max
#: Keywords that do not affect validity.
_ANNOTATIONS = {"$schema", "$id", "$defs", "title", "description"}
#: Keyword → the types that it bounds, the relation that must hold, and the message if it does not.
_BOUNDS: dict[str, tuple[set[type], Callable[[Any, Any], bool], str]] = {
    "minimum": (_NUMBERS, operator.ge, "is less than"),
    "maximum": (_NUMBERS, operator.le, "is more than"),
    "exclusiveMinimum": (_NUMBERS, operator.gt, "is not more than"),
    "exclusiveMaximum": (_NUMBERS, operator.lt, "is not less than"),
    "minLength": ({str}, operator.ge, "characters, fewer than"),
    "maxLength": ({str}, operator.le, "characters, more than"),
    "minItems": ({list}, operator.ge, "entries, fewer than"),
    "maxItems": ({list}, operator.le, "entries, more than"),
}


class ShapeError(ValueError):
    """The first violation of a schema. `path` leads to it: names and indices from the root."""

    def __init__(self, message: str) -> None:
        self.message = message
        self.path: list[str | int] = []
        super().__init__(message)

    def __str__(self) -> str:
        return f"{self.place}: {self.message}" if self.path else self.message

    @property
    def place(self) -> str:
        """The path as text, "cells[3].ach[1]"; "" for the whole document."""
        steps = (f"[{s}]" if isinstance(s, int) else f".{s}" for s in self.path)
        return "".join(steps).removeprefix(".")

    def under(self, step: str | int) -> ShapeError:
        """This error, as seen from the parent value."""
        self.path.insert(0, step)
        return self


def schema_text(name: str) -> str:
    """The text of a schema; ``name`` is its package and name, ``ptmtools_systems.schemas:apo``, or
    the name of one of this package."""
    package, _, stem = name.rpartition(":")
    return files(package or __name__).joinpath(f"{stem}.schema.json").read_text("utf-8")


def read(data: bytes, name: str) -> Any:
    """The document in ``data``, validated by the schema ``name``.

    Raises ShapeError: as `parse`, or the document violates the schema.
    """
    document = parse(data)
    check(document, name)
    return document


def parse(data: bytes) -> Any:
    """The document in ``data``.

    Raises ShapeError: not UTF-8, not JSON, or a name twice in an object.
    """
    try:
        return json.loads(
            data.decode("utf-8"), parse_constant=_not_finite, object_pairs_hook=_object
        )
    except ShapeError:
        raise
    except UnicodeDecodeError as fault:
        raise ShapeError(f"byte {fault.start} is not UTF-8") from None
    except (ValueError, RecursionError) as fault:
        raise ShapeError(f"not JSON ({fault})") from None


def check(document: Any, name: str) -> None:
    """Raises ShapeError if a document violates the schema ``name``."""
    _check_of(name)(document)


def _not_finite(number: str) -> None:
    raise ShapeError(f"the number {number} is not finite")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields = dict(pairs)
    if len(fields) < len(pairs):
        seen: set[str] = set()
        for name, _ in pairs:
            if name in seen:
                raise ShapeError(f"an object has two fields {name!r}")
            seen.add(name)
    return fields


@cache
def _check_of(name: str) -> Check:
    schema = json.loads(schema_text(name))
    return _compile(schema, schema)


def _compile(schema: Schema | bool, root: Schema) -> Check:
    """A function that raises ShapeError; ``root`` has the definitions that the schema refers to."""
    if isinstance(schema, bool):
        return _anything if schema else _nothing
    if unknown := set(schema) - set(_RULES) - _ANNOTATIONS:
        raise ValueError(f"a keyword that is not supported: {min(unknown)}")
    # In the order of the rules, the type first. Keywords that belong together have one rule.
    rules = dict.fromkeys(rule for word, rule in _RULES.items() if word in schema)
    checks = [rule(schema, root) for rule in rules]
    if len(checks) == 1:
        return checks[0]

    def check_all(value: Any) -> None:
        for check in checks:
            check(value)

    return check_all


def _anything(value: Any) -> None:
    level = [value]
    for _ in range(DEEPEST):
        level = [
            inner
            for outer in level
            if isinstance(outer, (dict, list))
            for inner in (outer.values() if isinstance(outer, dict) else outer)
        ]
        if not level:
            return
    raise ShapeError(f"lists in lists, more than {DEEPEST}")


def _nothing(value: Any) -> None:
    raise ShapeError("is not known")


def _reference(schema: Schema, root: Schema) -> Check:
    return _compile(_resolve(schema, root), root)


def _resolve(schema: Any, root: Schema) -> Any:
    """The schema that a reference names; any other schema itself."""
    if isinstance(schema, bool) or "$ref" not in schema:
        return schema
    return root["$defs"][schema["$ref"].removeprefix("#/$defs/")]


def _types(schema: Schema) -> set[type]:
    names = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    return set[type]().union(*(_TYPES[name] for name in names))


def _type(schema: Schema, root: Schema) -> Check:
    types = _types(schema)
    wanted = schema["type"] if isinstance(schema["type"], str) else " or ".join(schema["type"])

    def check_type(value: Any) -> None:
        if type(value) not in types:
            raise ShapeError(f"{_excerpt(value)} is not of type {wanted}")
        if type(value) in _NUMBERS and not -_LARGEST <= value <= _LARGEST:
            raise ShapeError(f"{_excerpt(value)} is not finite")

    return check_type


def _one_of(schema: Schema, root: Schema) -> Check:
    """`const` and `enum`."""
    known = schema["enum"] if "enum" in schema else [schema["const"]]

    def check_known(value: Any) -> None:
        if not any(type(value) is type(constant) and value == constant for constant in known):
            raise ShapeError(f"{_excerpt(value)} is not {' or '.join(map(repr, known))}")

    return check_known


def _bounds(schema: Schema, root: Schema) -> Check:
    """All keywords of `_BOUNDS`."""
    bounds = [(*_BOUNDS[word], schema[word]) for word in _BOUNDS if word in schema]

    def check_bounds(value: Any) -> None:
        for types, holds, fault, bound in bounds:
            if type(value) in types:
                size = value if types is _NUMBERS else len(value)
                if not holds(size, bound):
                    raise ShapeError(f"{_excerpt(size)} {fault} {bound}")

    return check_bounds


def _pattern(schema: Schema, root: Schema) -> Check:
    # A "$" of the draft is the very end; Python's also stands before a last line break.
    search = re.compile(schema["pattern"].replace("$", r"\Z")).search

    def check_pattern(value: Any) -> None:
        if type(value) is str and not search(value):
            raise ShapeError(f"{_excerpt(value)} does not match {schema['pattern']}")

    return check_pattern


def _object_fields(schema: Schema, root: Schema) -> Check:
    """`required`, `properties`, `additionalProperties` and `propertyNames` together."""
    required: list[str] = schema.get("required", [])
    fields = {n: _compile(s, root) for n, s in schema.get("properties", {}).items()}
    check_other = _compile(schema.get("additionalProperties", True), root)
    check_name = _compile(schema.get("propertyNames", True), root)

    def check_fields(value: Any) -> None:
        if type(value) is not dict:
            return
        for name in required:
            if name not in value:
                raise ShapeError(f"{name} is missing")
        for name, inner in value.items():
            try:
                check_name(name)
                fields.get(name, check_other)(inner)
            except ShapeError as fault:
                raise fault.under(name) from None

    return check_fields


def _items(schema: Schema, root: Schema) -> Check:
    """`items` and `prefixItems` together."""
    first = [_compile(s, root) for s in schema.get("prefixItems", [])]
    rest = _resolve(schema.get("items", True), root)
    check_rest = _compile(rest, root)
    all_valid = _numbers(rest) if not first else lambda values: False

    def check_items(value: Any) -> None:
        if type(value) is not list or all_valid(value):
            return
        for i, inner in enumerate(value):
            try:
                (first[i] if i < len(first) else check_rest)(inner)
            except ShapeError as fault:
                raise fault.under(i) from None

    return check_items


def _numbers(schema: Schema | bool) -> Callable[[list[Any]], bool]:
    """Whether a whole list is valid, for numbers within inclusive bounds; else False."""
    known = {"type", "minimum", "maximum"} | _ANNOTATIONS
    if isinstance(schema, bool) or "type" not in schema or set(schema) - known:
        return lambda values: False
    types = _types(schema)
    if types - _NUMBERS - {_NULL}:
        return lambda values: False
    low, high = schema.get("minimum", -_LARGEST), schema.get("maximum", _LARGEST)

    def all_valid(values: list[Any]) -> bool:
        present = set(map(type, values))
        if not present <= types:
            return False
        numbers = [v for v in values if v is not None] if _NULL in present else values
        return not numbers or (low <= min(numbers) and max(numbers) <= high)

    return all_valid


def _excerpt(value: Any) -> str:
    if isinstance(value, (dict, list)):
        return "an object" if isinstance(value, dict) else "a list"
    text = json.dumps(value)
    return text if len(text) <= 40 else f"{text[:40]}…"


_RULES: dict[str, Callable[[Schema, Schema], Check]] = {
    "$ref": _reference,
    "type": _type,
    "const": _one_of,
    "enum": _one_of,
    **dict.fromkeys(_BOUNDS, _bounds),
    "pattern": _pattern,
    "prefixItems": _items,
    "items": _items,
    "required": _object_fields,
    "properties": _object_fields,
    "propertyNames": _object_fields,
    "additionalProperties": _object_fields,
}
