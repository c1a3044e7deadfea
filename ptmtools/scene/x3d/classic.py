"""Parses VRML97 (ISO/IEC 14772-1, clause 4.3 and annex A) and the classic encoding of X3D.

The text is parsed without the types of fields, since its tokens tell numbers, texts, truth values
and nodes apart; lists of numbers, nearly all of a file, are cut out whole. Prototypes are expanded
where they are used, and their nodes are counted: prototypes of prototypes can stand for more than
any machine can hold. EXTERNPROTO, scripts and routes are parsed and have no effect.
"""

from __future__ import annotations

import re
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.errors import InputError, LimitError
from ptmtools.files import open_regular
from ptmtools.scene.markup import floats
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import decode
from ptmtools.scene.x3d.nodes import X3dNode, unescape

_SPACE = re.compile(r"(?:[\s,]++|#[^\r\n]*+)*+")
_TEXT = re.compile(r'"((?:[^"\\]++|\\.)*+)"', re.DOTALL)
_WORD = re.compile(r"[^\x00-\x20\"#',.\[\]\\{}0-9+-][^\x00-\x20\"#',\[\]\\{}]*+")
_NUMBERS = re.compile(r"[-+.,\s\deE]++")
_HEXADECIMAL = re.compile(r"0[xX][0-9a-fA-F]++")
_ENDS = frozenset(' \t\r\n,[]{}#"')
_INPUTS = ("eventIn", "eventOut", "inputOnly", "outputOnly")
_INTERFACE = (*_INPUTS, "field", "exposedField", "inputOutput", "initializeOnly")
#: Statements of X3D that take a line each.
_HEAD = ("PROFILE", "COMPONENT", "META", "UNIT", "IMPORT", "EXPORT")
#: Deepest nesting, largest number of nodes that prototypes make, and of bytes of a file that is
#: compressed.
_DEEPEST, _MOST_NODES, _LARGEST = 100, 100_000, 1 << 30


class _Is:
    """The value of a field in a prototype that is that of its instance."""

    def __init__(self, name: str) -> None:
        self.name = name


def parse_classic(file: Path, notes: IngestNotes) -> list[X3dNode]:
    """The nodes of a file.

    Raises ValueError if it is damaged, InputError PTM-I254 for VRML 1.0, LimitError PTM-L204 for
    one that is compressed and too large, and OSError.
    """
    with open_regular(file) as stream:
        data = stream.read()
    if data.startswith(b"\x1f\x8b"):
        decoder = zlib.decompressobj(31)
        try:
            data = decoder.decompress(data, _LARGEST)
        except zlib.error as error:
            raise ValueError(str(error)) from None
        if decoder.unconsumed_tail:
            raise LimitError(
                "PTM-L204", "more than 1 GiB if decompressed", file=file, remedy="split the model"
            )
    if data.startswith(b"#VRML V1"):
        raise InputError("PTM-I254", "is VRML 1.0", file=file, remedy="convert it to VRML97 or GLB")
    return _Parser(decode(data), file, notes).read()


class _Parser:
    def __init__(self, text: str, file: Path, notes: IngestNotes) -> None:
        self._text, self._file, self._notes = text, file, notes
        self._at = self._nodes = 0
        self._names: dict[str, X3dNode] = {}
        self._prototypes: dict[str, tuple[dict[str, Any], X3dNode | None]] = {}

    def read(self) -> list[X3dNode]:
        """All nodes of the text. Raises ValueError with the line of a fault."""
        try:
            return self._statements("", 0)
        except (ValueError, OverflowError) as error:
            line = self._text.count("\n", 0, self._at) + 1
            raise ValueError(f"line {line}: {error}") from None

    def _peek(self) -> str:
        """The next character, "" at the end."""
        match = _SPACE.match(self._text, self._at)
        self._at = match.end() if match else self._at
        return self._text[self._at : self._at + 1]

    def _accept(self, character: str) -> bool:
        if self._peek() != character:
            return False
        self._at += len(character)
        return True

    def _expect(self, character: str) -> None:
        if not self._accept(character):
            raise ValueError(f"{self._peek() or 'the end'!r} in place of {character!r}")

    def _word(self) -> str:
        self._peek()
        match = _WORD.match(self._text, self._at)
        if match is None:
            raise ValueError(f"{self._peek() or 'the end'!r} in place of a name")
        self._at = match.end()
        return match.group()

    def _next_word(self) -> str:
        """The next word, without reading it; "" if none is next."""
        self._peek()
        match = _WORD.match(self._text, self._at)
        return match.group() if match else ""

    def _statements(self, end: str, depth: int) -> list[X3dNode]:
        """Nodes and prototypes up to the character ``end``."""
        nodes: list[X3dNode] = []
        while not self._accept(end) if end else self._peek():
            if not self._declaration(self._next_word(), depth):
                nodes += self._node(depth)
        return nodes

    def _declaration(self, word: str, depth: int) -> bool:
        """Reads a prototype, a route or a statement of the head, if one is next."""
        if word == "PROTO":
            self._word()
            self._prototype(depth + 1)
        elif word == "EXTERNPROTO":
            self._word()
            name = self._word()
            self._interface(depth, defaults=False)
            self._value(depth)
            self._prototypes[name] = {}, None
            self._notes.note("PTM-N215", f"EXTERNPROTO {name} ignored", self._file.name)
        elif word == "ROUTE":
            for _ in range(4):
                self._word()
        elif word in _HEAD:
            end = self._text.find("\n", self._at)
            self._at = end if end >= 0 else len(self._text)
        else:
            return False
        return True

    def _prototype(self, depth: int) -> None:
        name = self._word()
        defaults = self._interface(depth, defaults=True)
        names, prototypes = self._names, self._prototypes
        self._names, self._prototypes = {}, dict(prototypes)
        self._expect("{")
        body = self._statements("}", depth)
        self._names, self._prototypes = names, prototypes
        prototypes[name] = defaults, body[0] if body else None

    def _interface(self, depth: int, *, defaults: bool) -> dict[str, Any]:
        """The fields of a prototype with their values."""
        fields: dict[str, Any] = {}
        self._expect("[")
        while not self._accept("]"):
            access, _, name = self._word(), self._word(), self._word()
            if access not in _INTERFACE:
                raise ValueError(f"{access} in an interface")
            if defaults and access not in _INPUTS:
                fields[name] = self._value(depth)
        return fields

    def _node(self, depth: int) -> list[X3dNode]:
        """A node; nothing for NULL, and for USE of an unknown name, a miss."""
        word, name = self._word(), ""
        if word == "NULL":
            return []
        if word == "USE":
            name = self._word()
            if name not in self._names:
                self._notes.miss("PTM-N214", f"USE {name}: no such node", self._file.name)
            return [self._names[name]] if name in self._names else []
        if word == "DEF":
            name, word = self._word(), self._word()
        if depth > _DEEPEST:
            raise ValueError(f"nodes nested more than {_DEEPEST} deep")
        node = X3dNode(word, name, self._file)
        self._expect("{")
        while not self._accept("}"):
            key = self._next_word()
            if self._declaration(key, depth):
                continue
            key = self._word()
            silent = key in _INPUTS
            if key in _INTERFACE:  # of a script
                self._word()
                key = self._word()
            if self._next_word() == "IS":
                self._word()
                node.fields[key] = _Is(self._word())
            elif not silent:
                node.fields[key] = self._value(depth)
        defaults, body = self._prototypes.get(word, ({}, None))
        if body is not None:
            node = self._copy(body, defaults | node.fields, {})
            node = replace(node, name=name or node.name)
        if name:
            self._names[name] = node
        return [node]

    def _copy(self, node: X3dNode, values: dict[str, Any], copies: dict[int, X3dNode]) -> X3dNode:
        """The node of an instance of a prototype."""
        if id(node) not in copies:
            self._nodes += 1
            if self._nodes > _MOST_NODES:
                raise ValueError(f"more than {_MOST_NODES:,} nodes of prototypes")
            result = copies[id(node)] = replace(node, fields={})
            for key, value in node.fields.items():
                if isinstance(value, _Is):
                    if value.name in values:
                        result.fields[key] = values[value.name]
                else:
                    result.fields[key] = [
                        self._copy(part, values, copies) if isinstance(part, X3dNode) else part
                        for part in value
                    ]
        return copies[id(node)]

    def _value(self, depth: int) -> list[Any]:
        """The value of a field: one, or several in brackets."""
        if not self._accept("["):
            return self._one(depth)
        result: list[Any] = []
        while not self._accept("]"):
            result += self._one(depth)
        return result

    def _one(self, depth: int) -> list[Any]:
        """A text, a truth value, a node, or all of the numbers that follow."""
        character = self._peek()
        if character == '"':
            match = _TEXT.match(self._text, self._at)
            if match is None:
                raise ValueError("a text does not end")
            self._at = match.end()
            return [unescape(match[1])]
        word = self._next_word()
        if word in ("TRUE", "FALSE", "true", "false"):
            self._word()
            return [word in ("TRUE", "true")]
        return self._node(depth + 1) if word else [self._numbers()]

    def _numbers(self) -> Floats:
        """All of the numbers that follow."""
        runs = [self._run()]
        while (character := self._peek()) and character in "+-.0123456789":
            runs.append(self._run())
        return np.concatenate(runs)

    def _run(self) -> Floats:
        """Numbers up to a comment, or a hexadecimal one."""
        match = _NUMBERS.match(self._text, self._at)
        run = match.group() if match else ""
        if self._text[self._at + len(run) : self._at + len(run) + 1] not in {"", *_ENDS}:
            run = run[: 1 + max(run.rfind(character) for character in " \t\r\n,")]
        if run:
            self._at += len(run)
            return floats(run.replace(",", " "))
        number = _HEXADECIMAL.match(self._text, self._at)
        if number is None:
            raise ValueError(f"{self._peek() or 'the end'!r} in place of a value")
        self._at = number.end()
        return np.array([float(int(number.group(), 16))])
