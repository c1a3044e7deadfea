"""One ES module of ours: what it takes, what it gives, and the rest.

All of them are written in a part of the language that can be joined by looking at tokens alone:
named imports from relative paths, named exports of functions, classes and single constants,
`import("./x.js")` of modules that are needed later, and `import.meta` only as the end of
`new URL("…", import.meta.url)`. Everything else is refused, with its line.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from ptmtools.errors import InputError
from ptmtools.viewer.scripts import Token, refused, tokens

_OPENING, _CLOSING = ("(", "[", "{"), (")", "]", "}")


@dataclass
class Import:
    """A name that a module takes from another, what it is called here, and on which line."""

    path: Path
    name: str
    here: str
    line: int


@dataclass
class Module:
    """A module.

    Attributes
    ----------
    imports: also those that it only exports again.
    exports: what it is called outside → here. again: where those of them are from that it exports
        for others: outside → module and name there.
    later: modules that it may load.
    body: all other tokens; one of kind "later" is a whole `import(…)`, with the module as its text.
    """

    path: Path
    imports: list[Import] = field(default_factory=list)
    exports: dict[str, str] = field(default_factory=dict)
    again: dict[str, tuple[Path, str]] = field(default_factory=dict)
    later: list[Path] = field(default_factory=list)
    body: list[Token] = field(default_factory=list)


def read_module(path: Path, assets: Mapping[Path, str]) -> Module:
    """A module. URLs of files beside it are replaced by those of ``assets``.

    Raises InputError: PTM-I900 it cannot be read, or is not written as described above.
    """
    file = os.fspath(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as fault:
        raise refused(file, 1, f"cannot be read ({fault})") from None
    reader = _Reader(Module(path), tokens(text, file), assets)
    reader.read()
    return reader.module


class _Reader:
    """Goes through the tokens of a module."""

    def __init__(self, module: Module, pieces: list[Token], assets: Mapping[Path, str]) -> None:
        self.module = module
        self._assets = assets
        last = pieces[-1].line if pieces else 1
        self._tokens = [*pieces, Token("", last, "end", "\n")]
        self._at = self._depth = 0

    def read(self) -> None:
        """All of it."""
        while self._next.kind != "end":
            word = self._next.text if self._next.kind == "word" else ""
            if word == "import":
                self._import()
            elif word == "export":
                self._export()
            elif word == "await" and not self._depth:
                raise self._wrong("waits at its top level")
            else:
                self._depth += _deeper(self._next)
                self.module.body.append(self._take())

    @property
    def _next(self) -> Token:
        return self._tokens[self._at]

    def _take(self, *wanted: str) -> Token:
        """The next token, which must be one of these if any are told."""
        token = self._next
        if token.kind == "end" or (wanted and token.text not in wanted):
            shown = token.text or "the end"
            raise self._wrong(f"has {shown} where {' or '.join(wanted) or 'more'} must be")
        self._at += 1
        return token

    def _skip(self, text: str) -> bool:
        found = self._next.text == text
        self._at += found
        return found

    def _wrong(self, what: str, line: int = 0) -> InputError:
        return refused(os.fspath(self.module.path), line or self._next.line, what)

    def _import(self) -> None:
        whole = self._take()
        if self._skip("("):
            path = self._path()
            self._take(")")
            self.module.later.append(path)
            self.module.body.append(whole._replace(text=os.fspath(path), kind="later"))
        elif self._skip("."):
            self._take("meta")
            self._take(".")
            self._take("url")
            self._asset(whole)
        elif self._depth:
            raise self._wrong("imports inside of something", whole.line)
        else:
            names = self._names()
            self._take("from")
            path = self._path()
            self.module.imports += [Import(path, a, b, whole.line) for a, b in names]
            self._skip(";")

    def _asset(self, whole: Token) -> None:
        """Behind `import.meta.url`: the string before it becomes the URL of the asset."""
        before = self.module.body[-5:]
        if [token.text for token in before[:3] + before[4:]] != ["new", "URL", "(", ","]:
            what = 'has import.meta elsewhere than in new URL("…", import.meta.url)'
            raise self._wrong(what, whole.line)
        path = self._resolved(before[3])
        if path not in self._assets:
            what = f"names {before[3].text}, which is not beside the joined script"
            raise self._wrong(what, whole.line)
        self.module.body[-2] = before[3]._replace(text=json.dumps(self._assets[path]))
        self.module.body.append(whole._replace(text="import.meta.url"))

    def _export(self) -> None:
        begin = self._take()
        if self._depth:
            raise self._wrong("exports inside of something", begin.line)
        if self._next.text == "{":
            self._export_names(begin)
            return
        body, exports = self.module.body, self.module.exports
        body.append(self._take("function", "class", "const", "async")._replace(gap="\n"))
        constant = body[-1].text == "const"
        if body[-1].text == "async":
            body.append(self._take("function"))
        if self._next.text == "*":
            body.append(self._take())
        if self._next.kind != "word":
            raise self._wrong("exports what has no name of its own")
        exports[self._next.text] = self._next.text
        if constant:
            self._check_one_constant()

    def _export_names(self, begin: Token) -> None:
        """`export { a, b as c };`, and the same from another module."""
        names = self._names()
        if not self._skip("from"):
            self.module.exports.update({outside: name for name, outside in names})
        else:
            path = self._path()
            for name, outside in names:
                here = f"_{len(self.module.imports)}_{outside}"
                self.module.imports.append(Import(path, name, here, begin.line))
                self.module.exports[outside] = here
                self.module.again[outside] = path, name
        self._skip(";")

    def _check_one_constant(self) -> None:
        """Raises unless a declaration is of one constant only, and ends with a semicolon."""
        depth = 0
        for token in self._tokens[self._at :]:
            if not depth and token.text in (";", ","):
                if token.text == ";":
                    return
                break
            depth += _deeper(token)
        raise self._wrong("exports several constants at once, or without a semicolon")

    def _names(self) -> list[tuple[str, str]]:
        """`{ a, b as c }`: names, and what they become."""
        names = []
        self._take("{")
        while not self._skip("}"):
            name = self._name()
            names.append((name, self._name() if self._skip("as") else name))
            if self._next.text != "}":
                self._take(",")
        return names

    def _name(self) -> str:
        if self._next.kind != "word" or self._next.text == "default":
            raise self._wrong(f"has {self._next.text or 'the end'} where a name must be")
        return self._take().text

    def _path(self) -> Path:
        return self._resolved(self._take())

    def _resolved(self, token: Token) -> Path:
        """The file that a string names."""
        text = token.text[1:-1]
        if token.kind != "string" or not text.startswith(("./", "../")) or "\\" in text:
            raise self._wrong(f"names {token.text}, which is no relative path", token.line)
        return Path(os.path.normpath(self.module.path.parent / text))


def _deeper(token: Token) -> int:
    """How many more brackets are open behind a token."""
    if token.kind not in ("sign", "template"):
        return 0
    opens = token.text.endswith("${") if token.kind == "template" else token.text in _OPENING
    closes = token.text[0] == "}" if token.kind == "template" else token.text in _CLOSING
    return opens - closes
