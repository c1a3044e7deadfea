"""The examples of docs/reference run, and the pages name what is public."""

from __future__ import annotations

import doctest
import re
import shutil
from pathlib import Path

import pytest

import ptmtools
from release.docstrings import google_style

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "docs/reference"
#: In this order: `databases` writes the database that the last two read.
PAGES = ("errors", "textures", "databases", "stages", "sites", "simulation")
EXAMPLES = re.compile(r"^```pycon\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def session(page: Path) -> doctest.DocTest:
    """The examples of a page as one session, at their lines of the page."""
    text = page.read_text("utf-8")
    lines = [""] * len(text.splitlines())
    for block in EXAMPLES.finditer(text):
        start = text.count("\n", 0, block.start(1))
        lines[start : start + block[1].count("\n")] = block[1].splitlines()
    return doctest.DocTestParser().get_doctest("\n".join(lines), {}, page.stem, str(page), 0)


def test_examples_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "sample_data/two_rooms", tmp_path / "two_rooms")
    monkeypatch.chdir(tmp_path)
    failures: list[str] = []
    for page in PAGES:
        runner = doctest.DocTestRunner(verbose=False)
        runner.run(session(REFERENCE / f"{page}.md"), out=failures.append)
        assert runner.tries, page
    assert not failures, "".join(failures)


def test_pages_have_the_public_names() -> None:
    pages = {page.stem: page.read_text("utf-8") for page in REFERENCE.glob("*.md")}
    assert {*pages} == {"index", *PAGES}
    named = [name for text in pages.values() for name in re.findall(r"^::: (\S+)$", text, re.M)]
    assert len(named) == len({*named})
    public = {f"ptmtools.{name}" for name in (*ptmtools.__all__, "open")}
    assert public - {*named} == set()


def test_sections_of_docstrings() -> None:
    text = """Adds.

Parameters
----------
a, b: (n,) float64, metres,
    world coordinates.
c: a note: text.

Raises
------
InputError, LimitError: PTM-I111 not a
    number.

Equal input gives equal output: always.
"""
    assert (
        google_style(text)
        == """Adds.

Parameters:
    a: (n,) float64, metres,
        world coordinates.
    b: (n,) float64, metres,
        world coordinates.
    c: a note: text.

Raises:
    InputError, LimitError: PTM-I111 not a
        number.

Equal input gives equal output: always.
"""
    )
