"""A strict reader of the VRML97 that `emit` writes, and of no other, for tests.

Browsers are lenient: view3dscene and X_ITE both accept indices out of range, colours above 1 and
bytes that are not UTF-8. This reader accepts only the nodes and fields of the emission pattern with
their types, requires brackets around multiple values and capitals for truth values, and stops at
the first fault. Number lists, nearly all of a file, are cut out whole: about 15 MB/s; a token at a
time, 2.

Nodes nest no deeper than the pattern's types, and no expression below backtracks ("++", "*+"), so
that the time is linear in the length of any file.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from dataclasses import dataclass
from itertools import islice, takewhile
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from ptmtools.output.model import FileError
from ptmtools.output.vrml import CELL, CELL_OF_LEAVES, HEADER, VIEWPOINT_CELL, declaration

#: The emission pattern: node → field → type; the node's name for SFNode. A "?" marks
#: optional fields.
NODES: dict[str, dict[str, str]] = {
    "WorldInfo": {"title": "SFString?", "info": "MFString?"},
    "NavigationInfo": {"type": "MFString?", "avatarSize": "MFFloat?", "headlight": "SFBool?"},
    "Viewpoint": {
        "position": "SFVec3f",
        "orientation": "SFRotation",
        "fieldOfView": "SFFloat",
        "description": "SFString",
    },
    "Inline": {"url": "MFString", "bboxCenter": "SFVec3f", "bboxSize": "SFVec3f"},
    "Shape": {"appearance": "Appearance", "geometry": "IndexedFaceSet"},
    "Appearance": {"material": "Material?", "texture": "ImageTexture?"},
    "Material": {
        "diffuseColor": "SFColor?",
        "emissiveColor": "SFColor?",
        "transparency": "SFFloat?",
    },
    "ImageTexture": {"url": "MFString", "repeatS": "SFBool?", "repeatT": "SFBool?"},
    "IndexedFaceSet": {
        "solid": "SFBool?",
        "coord": "Coordinate",
        "coordIndex": "MFInt32",
        "texCoord": "TextureCoordinate?",
        "texCoordIndex": "MFInt32?",
        "color": "Color?",
        "colorIndex": "MFInt32?",
        "colorPerVertex": "SFBool?",
    },
    "Coordinate": {"point": "MFVec3f"},
    "TextureCoordinate": {"point": "MFVec2f"},
    "Color": {"color": "MFColor"},
}
PROTOS = (CELL, CELL_OF_LEAVES, VIEWPOINT_CELL)
#: Nodes that USE may repeat: their content does not grow with the file.
USED = ("ImageTexture",)
#: Numbers in one value of a numeric type.
_WIDTH = {"Float": 1, "Int32": 1, "Vec2f": 2, "Vec3f": 3, "Color": 3, "Rotation": 4}

_SPACE = re.compile(r"(?:[ \t\n,]++|#[^\r\n]*+)*+")
_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*+(?=[ \t\n{}\[\],]|\Z)")
_NUMBER = re.compile(r"[+-]?(?:[0-9]++\.?[0-9]*+|\.[0-9]++)(?:[eE][+-]?[0-9]++)?(?=[ \t\n}\],]|\Z)")
_NUMBERS = re.compile(r"[-+., \t\n0-9eE]*+")
_STRING = re.compile(r'"((?:[^"\\\r\n]++|\\["\\])*+)"')
_STRINGS = re.compile(rf"(?:[ \t\n,]++|{_STRING.pattern})*+")
_ESCAPED = re.compile(r"\\(.)")
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity)\b", re.IGNORECASE)
_PROTO_WORD = re.compile(r"[^ \t\n,]++")
_PROTOS = [(declaration(*proto).split(), proto) for proto in PROTOS]


@dataclass(frozen=True)
class VrmlNode:
    """A node: strings and truth values are Python's; numbers are arrays, (n, width) for multiple
    values of vectors and colours; nodes are nodes. `line` is its first line; `lacks` lists the
    missing fields of the node and of the nodes in it."""

    type: str
    name: str
    fields: dict[str, Any]
    line: int
    lacks: tuple[str, ...]

    @property
    def place(self) -> str:
        return f"line {self.line}" + (f", {self.name}" if self.name else "")

    def at(self, *path: str) -> dict[str, Any]:
        """The fields of the node at a path of fields; empty if there is none."""
        fields = self.fields
        for name in path:
            fields = fields[name].fields if name in fields else {}
        return fields


@dataclass(frozen=True)
class VrmlDocument:
    """A file: its nodes, in order."""

    nodes: tuple[VrmlNode, ...]

    def of_type(self, type: str) -> list[VrmlNode]:
        return [n for n in self.nodes if n.type == type]


def parse(data: bytes) -> VrmlDocument:
    """Reads a file.

    Raises FileError PTM-D661 at the first thing that is not as in the emission pattern.
    """
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as fault:
        raise FileError("PTM-D661", f"byte {fault.start}", "not UTF-8") from fault
    return _VrmlParser(text).document()


class _VrmlParser:
    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._breaks = [match.start() for match in re.finditer("\n", text)]
        self._types = dict(NODES)
        self._names: dict[str, VrmlNode | None] = {}

    def document(self) -> VrmlDocument:
        if not self._text.startswith(HEADER):
            self._fail(f"the first line is not {HEADER.strip()!r}")
        nodes: list[VrmlNode] = []
        while self._skip() < len(self._text):
            if self._peek("PROTO"):
                self._proto()
            else:
                nodes.append(self._node(self._word("a node")))
        return VrmlDocument(tuple(nodes))

    def _proto(self) -> None:
        # For each PROTO of the pattern: the number of equal words, the position of the first
        # different one, and whether that is a field of the pattern that is not declared.
        alike = [(0, self._at, False)]
        for words, (name, fields) in _PROTOS:
            if name in self._types:
                continue
            tokens = [*islice(_PROTO_WORD.finditer(self._text, self._at), len(words))]
            pairs = zip(words, tokens, strict=False)
            same = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1].group(), pairs))
            if same == len(words):
                self._types[name] = fields
                self._at = tokens[-1].end()
                return
            at = tokens[same].start() if same < len(tokens) else len(self._text)
            alike.append((same, at, 3 <= same < words.index("{") and words[same].isalpha()))
        _, self._at, declares = max(alike)
        word = self._text[self._at : self._at + 12]
        if declares:
            self._fail(
                f"{word!r}: the PROTO does not declare the pattern's fields", code="PTM-D661"
            )
        self._fail(f"{word!r} is in no PROTO of the emission pattern, or the PROTO stands twice")

    def _node(self, type: str) -> VrmlNode:
        name = ""
        if type == "DEF":
            name = self._word("a DEF name")
            if name in self._names:
                self._fail(f"the DEF name {name} is used twice")
            self._names[name] = None
            type = self._word("a node")
        pattern = self._types.get(type)
        if pattern is None:
            self._fail(f"{type} is not a node of the emission pattern")
        line = self._line(self._at)
        self._take("{")
        fields: dict[str, Any] = {}
        while not self._peek("}"):
            field = self._word("a field")
            if field not in pattern:
                self._fail(f"{type} has no field {field!r} in the emission pattern")
            if field in fields:
                self._fail(f"{type} has two fields {field!r}")
            fields[field] = self._value(pattern[field].removesuffix("?"))
        self._take("}")
        lacks = [
            f"{type} lacks {field}"
            for field, kind in pattern.items()
            if field not in fields and not kind.endswith("?")
        ]
        for value in fields.values():
            lacks += value.lacks if isinstance(value, VrmlNode) else ()
        node = VrmlNode(type, name, fields, line, tuple(lacks))
        if name:
            self._names[name] = node
        return node

    def _value(self, type: str) -> Any:
        if type in self._types:
            word = self._word("a node")
            used = word == "USE" and type in USED
            node = self._names.get(self._word("a DEF name")) if used else self._node(word)
            if node is None or node.type != type:
                self._fail(f"not a node {type}")
            return node
        if type == "SFBool":
            word = self._word("TRUE or FALSE")
            if word not in ("TRUE", "FALSE"):
                self._fail(f"{word!r} is neither TRUE nor FALSE")
            return word == "TRUE"
        if type == "SFString":
            return _ESCAPED.sub(r"\1", self._word("a string", _STRING)[1:-1])
        if type == "MFString":
            return self._strings()
        kind = type[2:]
        return self._numbers(kind) if type.startswith("MF") else self._single(kind)

    def _single(self, kind: str) -> NDArray[np.float64]:
        values = []
        for _ in range(_WIDTH[kind]):
            match = _NUMBER.match(self._text, self._skip())
            if match is None:
                self._no_number()
            self._at = match.end()
            values.append(float(match.group()))
        return self._finite(np.array(values), self._at)

    def _numbers(self, kind: str) -> NDArray[Any]:
        self._take("[")
        begin = self._at
        match = _NUMBERS.match(self._text, begin)
        assert match is not None
        self._at = match.end()
        if not self._text.startswith("]", self._at):
            # Back to the start of the invalid word.
            while self._at > begin and self._text[self._at - 1] not in " ,\t\n":
                self._at -= 1
            self._no_number()
        words = match.group().replace(",", " ").split()
        whole = kind == "Int32"
        try:
            values = np.array(words, dtype=np.int64 if whole else np.float64)
        except (ValueError, OverflowError):
            self._fail(f"{self._bad(words, kind)!r} is not a valid {kind}", begin)
        if whole:
            limits = np.iinfo(np.int32)
            if ((values < limits.min) | (values > limits.max)).any():
                self._fail("an integer does not fit into 32 bits", begin)
        else:
            self._finite(values, begin)
        self._take("]")
        width = _WIDTH[kind]
        if len(values) % width:
            self._fail(f"{len(values)} numbers are not a list of {kind}", begin)
        return values.reshape(-1, width) if width > 1 else values

    def _bad(self, words: list[str], kind: str) -> str:
        shape = re.compile(r"[+-]?[0-9]{1,10}") if kind == "Int32" else _NUMBER
        return next((w[:24] for w in words if not shape.fullmatch(w)), "a number")

    def _finite(self, values: NDArray[Any], at: int) -> NDArray[Any]:
        with np.errstate(over="ignore"):
            if not np.isfinite(values.astype(np.float32)).all():
                self._fail("a number is not finite", at, "PTM-D661")
        return values

    def _no_number(self) -> NoReturn:
        if _NOT_FINITE.match(self._text, self._at):
            self._fail("a number is not finite", code="PTM-D661")
        self._fail(f"{self._text[self._at : self._at + 12]!r} is not a number")

    def _strings(self) -> tuple[str, ...]:
        self._take("[")
        match = _STRINGS.match(self._text, self._at)
        assert match is not None
        self._at = match.end()
        if not self._text.startswith("]", self._at):
            self._fail("no string")
        self._at += 1
        strings = _STRING.findall(match.group())
        if "\\" in match.group():
            strings = [_ESCAPED.sub(r"\1", string) for string in strings]
        return tuple(strings)

    def _word(self, noun: str, pattern: re.Pattern[str] = _WORD) -> str:
        match = pattern.match(self._text, self._skip())
        if match is None:
            self._fail(f"{self._text[self._at : self._at + 12]!r} is not {noun}")
        self._at = match.end()
        return match.group()

    def _take(self, sign: str) -> None:
        if not self._peek(sign):
            self._fail(f"{self._text[self._at : self._at + 12]!r} instead of {sign!r}")
        self._at += len(sign)

    def _peek(self, sign: str) -> bool:
        return self._text.startswith(sign, self._skip())

    def _skip(self) -> int:
        match = _SPACE.match(self._text, self._at)
        assert match is not None
        self._at = match.end()
        return self._at

    def _line(self, at: int) -> int:
        return 1 + bisect_left(self._breaks, at)

    def _fail(self, message: str, at: int | None = None, code: str = "PTM-D661") -> NoReturn:
        raise FileError(code, f"line {self._line(self._at if at is None else at)}", message)
