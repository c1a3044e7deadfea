"""The site of the documentation says what the pages in the repository say. Its build, `make docs`,
checks the links."""

from __future__ import annotations

from html.parser import HTMLParser
from itertools import zip_longest
from pathlib import Path
from types import SimpleNamespace

import markdown
import pytest
from markdown_it import MarkdownIt
from mkdocs.exceptions import PluginError

from release import docs_site

ROOT = Path(__file__).resolve().parents[2]
#: Without the measurements, which are tables.
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("web/*/*.md")]
BLOCKS = {"li", "ul", "ol", "pre", "table", "tr", "th", "td", "h1", "h2", "h3", "h4"}
INLINE = {"code", "em", "strong", "a", "img"}


class Outline(HTMLParser):
    """The words of a page between the elements that they stand in."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.parts: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag in BLOCKS | INLINE:
            self.parts.append(f"<{tag}>")

    def handle_endtag(self, tag: str) -> None:
        if tag in BLOCKS:
            self.parts.append(f"</{tag}>")

    def handle_data(self, data: str) -> None:
        self.parts += data.split()


def difference(text: str) -> str:
    """The first words that Python-Markdown, of the site, reads differently from CommonMark, of
    GitHub: "" if there are none."""
    shown = markdown.markdown(
        docs_site.bars(text),
        extensions=["tables", "attr_list", "pymdownx.superfences", "pymdownx.highlight"],
        extension_configs={"pymdownx.highlight": {"use_pygments": False}},
    )
    meant = Outline(MarkdownIt("commonmark").enable("table").render(text)).parts
    pairs = enumerate(zip_longest(Outline(shown).parts, meant))
    return next((" ".join(meant[max(0, n - 6) : n + 1]) for n, (a, b) in pairs if a != b), "")


def test_pages_read_as_on_github() -> None:
    differences = {p.relative_to(ROOT).as_posix(): difference(p.read_text("utf-8")) for p in PAGES}
    assert {page: words for page, words in differences.items() if words} == {}


@pytest.mark.parametrize(
    "text",
    [
        "a list:\n- without an empty line",
        "- an item\n  - with a list of two columns",
        "nothing but\n+ and -",
        "- an item\n\n      and its code",
    ],
)
def test_a_difference_is_seen(text: str) -> None:
    assert difference(text)


def test_links_to_files_of_the_repository() -> None:
    page = SimpleNamespace(
        file=SimpleNamespace(abs_src_path=ROOT / "docs/guide/cli.md", src_uri="guide/cli.md")
    )
    text = "[a](../../README.md#in-python) [b](../formats/ptm.md) `[c](../../README.md)` [d](#d)"
    assert docs_site.on_page_markdown(text, page, None, None) == (
        "[a](../repository/README.md#in-python) [b](../formats/ptm.md) `[c](../../README.md)` "
        "[d](#d)"
    )


def test_no_page_needs_another_host() -> None:
    page = SimpleNamespace(file=SimpleNamespace(src_uri="index.md"))
    ours = '<script src="assets/a.js"></script> <a href="https://example.org">'
    assert docs_site.on_post_page(ours, page, None) == ours
    with pytest.raises(PluginError, match=r"index\.md loads from another host"):
        docs_site.on_post_page('<link rel=icon href="https://example.org/i">', page, None)
