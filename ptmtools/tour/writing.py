"""Writes a changed tour into the text of the old one, so that the differences of the file are those
of the tour.

Values that are equal keep their text, with its spaces, escapes and forms of numbers. A changed
object or list keeps the text between its members. New members look like their neighbours. Labels
and stops are recognised by their ids wherever they move.
"""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

_SPACE = re.compile(r"[ \t\r\n]*")
_DECODER = json.JSONDecoder()
_POINT = re.compile(r"\[\s+(-?[\d.e+-]+),\s+(-?[\d.e+-]+),\s+(-?[\d.e+-]+)\s+\]")
#: Members by which objects of a list are recognised.
_NAMES = ("id", "label")


def format_json(value: Any, indent: int | str | None = 1) -> str:
    """JSON with a line for each member, and one for each point; all in one line without indent."""
    text = json.dumps(value, indent=indent, ensure_ascii=False)
    return _POINT.sub(r"[\1, \2, \3]", text)


def rewrite(text: str, document: Any) -> str:
    """The text of a document that was ``text`` before; JSON without a name twice in an object."""
    root = _parse(text, _SPACE.match(text).end())  # type: ignore[union-attr]
    lead = text[root.start + 1 : root.members[0].start] if root.members else ""
    unit = lead.rpartition("\n")[2] if "\n" in lead else None
    return text[: root.start] + _Writer(text, unit).merge(root, document, "") + text[root.end :]


@dataclass(frozen=True)
class _Node:
    """A value in a text: the characters [start, end).

    Attributes
    ----------
    value: as `json.loads` returns it.
    members: of an object or a list.
    """

    start: int
    end: int
    value: Any
    members: tuple[_Member, ...] = ()


@dataclass(frozen=True)
class _Member:
    """A member, which begins at ``start``; of an object with its name, of a list with ""."""

    start: int
    name: str
    node: _Node


def _parse(text: str, start: int) -> _Node:
    """The value that begins at a character of valid JSON."""
    kind = text[start]
    if kind not in "{[":
        value, end = _DECODER.raw_decode(text, start)
        return _Node(start, end, value)
    members = []
    at = _next(text, start + 1)
    while text[at] not in "}]":
        begin, name = at, ""
        if kind == "{":
            name, at = _DECODER.raw_decode(text, at)
            at = _next(text, _next(text, at) + 1)
        node = _parse(text, at)
        members.append(_Member(begin, name, node))
        at = _next(text, node.end)
        if text[at] == ",":
            at = _next(text, at + 1)
    value = {m.name: m.node.value for m in members} if kind == "{" else [
        m.node.value for m in members
    ]  # fmt: skip
    return _Node(start, at + 1, value, tuple(members))


def _next(text: str, at: int) -> int:
    return _SPACE.match(text, at).end()  # type: ignore[union-attr]


class _Writer:
    """Merges values into a text; ``unit``: the indentation of a level, None in one line."""

    def __init__(self, text: str, unit: str | None) -> None:
        self._text, self._unit = text, unit

    def merge(self, old: _Node | None, value: Any, indent: str, inline: bool = False) -> str:
        """The text of a value in the place of an old one, in a line with an indentation."""
        if old is None:
            return self._new(value, indent, inline)
        if _same(old.value, value):
            return self._text[old.start : old.end]
        if old.members and value and type(old.value) is type(value):
            if isinstance(value, dict):
                return self._object(old, value, indent)
            if isinstance(value, list):
                return self._list(old, value, indent)
        return self._new(value, indent, inline or not self._has_lines(old))

    def _new(self, value: Any, indent: str, inline: bool) -> str:
        text = format_json(value, None if inline or self._unit is None else self._unit)
        return text.replace("\n", f"\n{indent}")

    def _object(self, old: _Node, value: Mapping[str, Any], indent: str) -> str:
        before = {member.name: number for number, member in enumerate(old.members)}
        parts = []
        for name, inner in value.items():
            number = before.get(name)
            gap, inside = self._gap(old, number, indent)
            if number is None:
                text = f"{json.dumps(name, ensure_ascii=False)}: " + self.merge(
                    None, inner, inside, inline=not self._has_lines(old)
                )
            else:
                member = old.members[number]
                start = self._text[member.start : member.node.start]
                text = start + self.merge(member.node, inner, inside)
            parts.append((gap, text))
        return self._join(old, parts)

    def _list(self, old: _Node, values: Sequence[Any], indent: str) -> str:
        parts = []
        inline = not self._has_lines(old.members[-1].node)
        for number, value in zip(_matches(old, values), values, strict=True):
            gap, inside = self._gap(old, number, indent)
            node = None if number is None else old.members[number].node
            parts.append((gap, self.merge(node, value, inside, inline)))
        return self._join(old, parts)

    def _gap(self, old: _Node, number: int | None, indent: str) -> tuple[str, str]:
        """The text before a member, a new one without a number, and the indentation behind it."""
        members = old.members
        if number is None or number == 0:
            number = len(members) - 1
        if number:
            gap = self._text[members[number - 1].node.end : members[number].start]
        else:
            lead = self._lead(old)
            gap = f",{lead}" if "\n" in lead else ", "
        return gap, gap.rpartition("\n")[2] if "\n" in gap else indent

    def _lead(self, old: _Node) -> str:
        return self._text[old.start + 1 : old.members[0].start]

    def _join(self, old: _Node, parts: Sequence[tuple[str, str]]) -> str:
        """The members, each after its gap; the first one after the text that was before the
        first."""
        text = "".join(
            (gap if number else self._lead(old)) + part for number, (gap, part) in enumerate(parts)
        )
        end = self._text[old.members[-1].node.end : old.end]
        return self._text[old.start] + text + end

    def _has_lines(self, node: _Node) -> bool:
        return "\n" in self._text[node.start : node.end]


def _matches(old: _Node, values: Sequence[Any]) -> Iterator[int | None]:
    """For each value of a list the number of the old member in whose place it is: an equal one,
    else one of the same name, else the one at its place if neither has a name."""
    chosen: dict[int, int] = {}

    def choose(key: Callable[[int, Any], Hashable]) -> None:
        free, taken = defaultdict(list), set(chosen.values())
        for number in reversed(range(len(old.members))):
            if number not in taken:
                free[key(number, old.members[number].node.value)].append(number)
        free.pop(None, None)
        for number, value in enumerate(values):
            if number not in chosen and (numbers := free.get(key(number, value))):
                chosen[number] = numbers.pop()

    choose(lambda number, value: (number, _key(value)))
    choose(lambda number, value: _key(value))
    choose(lambda number, value: _name(value))
    choose(lambda number, value: number if _name(value) is None else None)
    return (chosen.get(number) for number in range(len(values)))


def _key(value: Any) -> str:
    return json.dumps(value, sort_keys=True)


def _name(value: Any) -> tuple[str, str] | None:
    if isinstance(value, dict):
        for name in _NAMES:
            if isinstance(value.get(name), str):
                return name, value[name]
    return None


def _same(a: Any, b: Any) -> bool:
    """Whether two values of JSON are equal: 1 and 1.0 are, 1 and true are not."""
    if isinstance(a, bool) or isinstance(b, bool):
        return a is b
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_same(a[k], b[k]) for k in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_same, a, b))
    return bool(a == b)
