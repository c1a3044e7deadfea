"""Markdown of labels: trees, and that no text becomes markup."""

from __future__ import annotations

import re
from html.parser import HTMLParser

import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.tour.markdown import DEEPEST, html_of, is_address, nodes_of, plain_text

KINDS = {"p", "h", "em", "strong", "code", "ul", "ol", "li", "quote", "br", "a"}
ELEMENTS = {*["p", "h4", "em", "strong", "code", "ul", "ol", "li", "blockquote", "br", "a"]}
HOSTILE = [
    "<script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "[x](javascript:alert(1))",
    "[x](<javascript:alert(1)>)",
    "[x](data:text/html,<script>alert(1)</script>)",
    "![x](https://example.org/x.png)",
    "[x](JaVaScRiPt:alert(1))",
    "[x](&#106;avascript:alert(1))",
    '[x](https://example.org/"onmouseover="alert(1))',
    "<https://example.org/<script>>",
    "```html\n<script>alert(1)</script>\n```",
    "<!-- --><style>*{display:none}</style>",
    "[a]: javascript:alert(1)\n[a]",
    "\u202e<b>\u0000",
]


def depth(nodes: object) -> int:
    return 1 + max(map(depth, nodes), default=0) if isinstance(nodes, list) else 0


class Elements(HTMLParser):
    """The elements of a text, and their attributes."""

    def __init__(self) -> None:
        super().__init__()
        self.elements: list[tuple[str, list[tuple[str, str | None]]]] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, attributes))


def check(text: str) -> None:
    """No other kinds in the tree, no other elements and attributes in the HTML."""
    nodes = nodes_of(text)
    waiting: list[object] = list(nodes)
    while waiting:
        node = waiting.pop()
        if isinstance(node, list):
            kind, *children = node
            assert kind in KINDS
            if kind == "a":
                address, *children = children
                assert is_address(address)
            waiting += children
        else:
            assert isinstance(node, str)
    parser = Elements()
    parser.feed(html_of(nodes))
    for tag, attributes in parser.elements:
        assert tag in ELEMENTS
        names = [name for name, _ in attributes]
        assert names == (["href", "rel"] if tag == "a" else [])
        if tag == "a":
            assert re.match(r"(?i)https?:|mailto:", attributes[0][1] or "")


def test_the_usual_forms() -> None:
    text = (
        "# A *b*\n\none\ntwo\\\nthree **four** `<x>`\n\n- five\n\n> six\n\n[seven](https://e.org)"
    )
    assert nodes_of(text) == [
        ["h", "A ", ["em", "b"]],
        ["p", "one two", ["br"], "three ", ["strong", "four"], " ", ["code", "<x>"]],
        ["ul", ["li", ["p", "five"]]],
        ["quote", ["p", "six"]],
        ["p", ["a", "https://e.org", "seven"]],
    ]
    assert html_of(nodes_of("a < b & *c*")) == "<p>a &lt; b &amp; <em>c</em></p>"
    assert plain_text(nodes_of("# A *b*\n\none [two](https://e.org)")) == "A b one two "
    assert nodes_of("") == []


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_texts_stay_texts(text: str) -> None:
    check(text)


@settings(max_examples=60)
@given(st.text(alphabet="ab<>&[]()!*_`#-\n\\\"':/ 1.", max_size=60))
def test_no_text_becomes_markup(text: str) -> None:
    check(text)


def test_deep_nesting_loses_no_text() -> None:
    nodes = nodes_of("> " * 40 + "inner")
    assert "inner" in plain_text(nodes)
    assert depth(nodes) <= DEEPEST + 2


@pytest.mark.parametrize(
    ("text", "valid"),
    [
        ("https://example.org/a?b#c", True),
        ("mailto:a@example.org", True),
        ("http:///x", False),
        ("javascript:alert(1)", False),
        ("//example.org", False),
        ("https://example.org/\n", False),
        ("https://[", False),
        ("", False),
    ],
)
def test_addresses(text: str, valid: bool) -> None:
    assert is_address(text) == valid
