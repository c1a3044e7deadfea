"""Markdown of labels, as a small tree that cannot contain markup.

CommonMark without HTML and without images, parsed by markdown-it-py. The result is a list of nodes:
a string, or ``[kind, …children]`` with kind p, h, em, strong, code, ul, ol, li, quote or br;
``["a", address, …children]`` for links to https, http and mailto. The page makes elements of the
kinds that it knows and texts of everything else, so that no text becomes markup.
"""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

if TYPE_CHECKING:
    from collections.abc import Iterable

    from markdown_it.token import Token

Node = str | list[Any]

#: Token of markdown-it → kind.
_KINDS = {
    "paragraph": "p",
    "heading": "h",
    "em": "em",
    "strong": "strong",
    "bullet_list": "ul",
    "ordered_list": "ol",
    "list_item": "li",
    "blockquote": "quote",
}
#: Kind → element.
_ELEMENTS = {"h": "h4", "quote": "blockquote"}
_SCHEMES = ("https", "http", "mailto")
#: Deepest nesting; the children of deeper nodes belong to their parents.
DEEPEST = 12


def is_address(text: str) -> bool:
    """Whether a link may lead there: https, http or mailto, without control characters."""
    try:
        parts = urlsplit(text)
    except ValueError:
        return False
    return (
        text.isprintable()
        and parts.scheme.lower() in _SCHEMES
        and bool(parts.netloc or parts.scheme.lower() == "mailto")
    )


def nodes_of(text: str) -> list[Node]:
    """The tree of a Markdown text; the text itself where it has no markup."""
    from markdown_it import MarkdownIt

    parser = MarkdownIt("commonmark", {"html": False, "maxNesting": 10 * DEEPEST})
    parser.disable(["image", "hr", "reference"])
    return _NodeBuilder().build(parser.parse(text))


class _NodeBuilder:
    """Builds the nodes of tokens."""

    def __init__(self) -> None:
        self._open: list[list[Any]] = [[]]

    def build(self, tokens: Iterable[Token]) -> list[Node]:
        for token in tokens:
            if token.type == "inline":
                self._open[-1].extend(_NodeBuilder().build(token.children or ()))
            elif token.nesting > 0:
                self._begin(token)
            elif token.nesting < 0:
                self._end()
            elif token.type in ("softbreak", "hardbreak"):
                self._add(" " if token.type == "softbreak" else ["br"])
            elif token.type in ("code_inline", "code_block", "fence"):
                self._add(["code", token.content])
            else:
                self._add(token.content)
        while len(self._open) > 1:
            self._end()
        return self._open[0]

    def _begin(self, token: Token) -> None:
        kind = token.type.removesuffix("_open")
        address = str(token.attrGet("href") or "")
        if kind == "link":
            node = ["a", address] if is_address(address) else ["em"]
        else:
            node = [_KINDS.get(kind, "p")]
        if len(self._open) > DEEPEST:
            node = self._open[-1]
        else:
            self._add(node)
        self._open.append(node)

    def _end(self) -> None:
        self._open.pop()

    def _add(self, node: Node) -> None:
        siblings = self._open[-1]
        if isinstance(node, str) and siblings and isinstance(siblings[-1], str) and self._in_text():
            siblings[-1] += node
        elif node != "":
            siblings.append(node)

    def _in_text(self) -> bool:
        """Whether the last string of the open node is text, not its kind or its address."""
        node = self._open[-1]
        if len(self._open) == 1:
            return True
        return len(node) > (2 if node[0] == "a" else 1)


def html_of(nodes: Iterable[Node]) -> str:
    """HTML of a tree; every text is escaped."""
    parts = []
    for node in nodes:
        if isinstance(node, str):
            parts.append(escape(node))
        elif node[0] == "br":
            parts.append("<br>")
        elif node[0] == "a":
            parts.append(f'<a href="{escape(node[1])}" rel="noopener">{html_of(node[2:])}</a>')
        else:
            element = _ELEMENTS.get(node[0], node[0])
            parts.append(f"<{element}>{html_of(node[1:])}</{element}>")
    return "".join(parts)


def plain_text(nodes: Iterable[Node]) -> str:
    """The text of a tree without its markup, for descriptions."""
    parts = []
    for node in nodes:
        if isinstance(node, str):
            parts.append(node)
        else:
            inner = plain_text(node[2 if node[0] == "a" else 1 :])
            parts.append(f"{inner} " if node[0] in ("p", "h", "li", "br") else inner)
    return "".join(parts)
