"""JavaScript, cut into tokens: as much of its grammar as it takes to find comments and spaces.

What is hard about it is the slash: it divides, or begins a regular expression, and only the parser
of a whole language always knows. Here the token before it decides, as it does in all code that is
written as ours is; where it does not, behind a brace, the text is refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ptmtools.errors import InputError

#: Behind these a slash begins a regular expression, as it does behind most signs.
_BEFORE_VALUES = frozenset(
    ["await", "case", "delete", "do", "else", "in", "instanceof", "new"]
    + ["of", "return", "throw", "typeof", "void", "yield"]
)
#: What a parenthesis belongs to behind which a statement follows, and no operator.
_HEADS = frozenset(["for", "if", "while", "with"])
_SPACE = re.compile(r"(?:\s|//[^\n\r\u2028\u2029]*|/\*.*?\*/)+", re.DOTALL)
_LINE_END = re.compile(r"[\n\r\u2028\u2029]")
_WORD = re.compile(r"#?[\w$\u200c\u200d\\]+")
_STRING = re.compile(r"'(?:[^'\\\n]|\\.)*'|\"(?:[^\"\\\n]|\\.)*\"", re.DOTALL)
_EXPRESSION = re.compile(r"/(?:[^/\\\[\n]|\\.|\[(?:[^\]\\\n]|\\.)*\])+/\w*")
#: Text of a template up to its end or to an expression in it.
_TEMPLATE = re.compile(r"(?:[^`\\$]|\\.|\$(?!\{))*(`|\$\{)", re.DOTALL)
_SIGN = re.compile(r"=>|\+\+|--|\?\.(?!\d)|\.\.\.|[^\s\w]")


class Token(NamedTuple):
    """A piece of a script.

    Attributes
    ----------
    text: as written. line: where it begins, from 1.
    kind: "word" (numbers and keywords too), "member" (a word behind a dot, which is no keyword),
        "string", "template" (a whole one or a piece), "regex" or "sign".
    gap: what is before it: "" nothing, " " spaces and comments, "\\n" a line end among them.
    """

    text: str
    line: int
    kind: str
    gap: str


def refused(file: str, line: int, what: str) -> InputError:
    """The error for a script that is not written as ours are, PTM-I900."""
    return InputError(
        "PTM-I900",
        what,
        file=file,
        place=f"line {line}",
        remedy="the viewer's files are damaged; install ptmtools again",
    )


def tokens(text: str, file: str = "") -> list[Token]:
    """The tokens of a script; ``file`` is named in errors.

    Raises InputError: PTM-I900 a string, template, comment or regular expression that does not end,
    a bracket without its other half, or a slash behind a brace.
    """
    found: list[Token] = []
    #: Open brackets, each with whether a value follows its other half; None of a template.
    open_brackets: list[tuple[str, bool | None]] = []
    at, line = 0, 1
    closed_head = False

    def add(kind: str, end: int) -> None:
        nonlocal at, line
        found.append(Token(text[at:end], line, kind, gap))
        line += text.count("\n", at, end)
        at = end

    def template() -> None:
        """From a backquote or the brace that ends an expression."""
        match = _TEMPLATE.match(text, at + 1)
        if match is None:
            raise refused(file, line, "a template does not end")
        if match[1] == "${":
            open_brackets.append(("{", None))
        add("template", match.end())

    while True:
        space = _SPACE.match(text, at)
        gap = ""
        if space:
            gap = "\n" if _LINE_END.search(space[0]) else " "
            line += space[0].count("\n")
            at = space.end()
        if at == len(text):
            break
        letter = text[at]
        before = found[-1] if found else None
        if letter == "`":
            template()
        elif letter in "\"'":
            match = _STRING.match(text, at)
            if match is None:
                raise refused(file, line, "a string does not end")
            add("string", match.end())
        elif letter == "/" and _value_follows(before, closed_head, file, line):
            match = _EXPRESSION.match(text, at)
            if match is None or text.startswith("/*", at):
                raise refused(file, line, "a comment or a regular expression does not end")
            add("regex", match.end())
        elif match := _WORD.match(text, at):
            add("member" if before and before.text in (".", "?.") else "word", match.end())
        elif letter in "([{":
            head = before is not None and before.kind == "word" and before.text in _HEADS
            open_brackets.append((letter, letter == "(" and head))
            add("sign", at + 1)
        elif letter in ")]}":
            opening, then = open_brackets.pop() if open_brackets else ("", False)
            if opening + letter not in ("()", "[]", "{}"):
                raise refused(file, line, f"a {letter} without its other half")
            if then is None:
                template()
            else:
                closed_head = then
                add("sign", at + 1)
        else:
            add("sign", _SIGN.match(text, at).end())  # type: ignore[union-attr]
    if open_brackets:
        raise refused(file, line, f"a {open_brackets[-1][0]} without its other half")
    return found


def _value_follows(before: Token | None, closed_head: bool, file: str, line: int) -> bool:
    """Whether what follows a token is a value, which may be a regular expression."""
    if before is None:
        return True
    if before.kind == "word":
        return before.text in _BEFORE_VALUES
    if before.kind == "template":
        return before.text.endswith("${")
    if before.kind != "sign" or before.text in ("]", "++", "--"):
        return False
    if before.text == "}":
        raise refused(file, line, "a slash behind a brace, which may divide or not")
    return before.text != ")" or closed_head


def compact(pieces: Sequence[Token]) -> str:
    """A script of these tokens that means the same, without comments, indentation and spaces that
    nothing needs. Line ends stay, for they may end statements."""
    return "".join(_spaced(pieces)).strip("\n")


def _spaced(pieces: Sequence[Token]) -> Iterator[str]:
    before = None
    for token in pieces:
        if before and token.gap:
            yield "\n" if token.gap == "\n" else " " if _needs_space(before, token) else ""
        yield token.text
        before = token


def _needs_space(before: Token, after: Token) -> bool:
    """Whether two tokens would be read as others if there were nothing between them."""
    if after.kind == "word":
        return before.kind in ("word", "member", "regex")
    if before.kind == "word":  # 1 .toString()
        return before.text[0].isdigit() and after.text.startswith(".")
    return (before.text[-1], after.text[0]) in {("+", "+"), ("-", "-"), ("/", "/"), ("/", "*")}
