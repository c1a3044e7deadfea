"""The documentation and the program have the same codes."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: "PTM-L101", and what may follow: ", L102", " and I255", " to N213".
FIRST = re.compile(r"PTM-([A-Z])(\d{3})\b")
NEXT = re.compile(r"(,? and |, | to )(?:PTM-)?([A-Z]?)(\d{3})\b")


def documented() -> tuple[set[str], set[str]]:
    """Codes that are named, and those that stand between two of them."""
    named, between = set(), set()
    for file in (*ROOT.glob("docs/*.md"), ROOT / "README.md"):
        text = file.read_text("utf-8")
        for first in FIRST.finditer(text):
            letter, last = first[1], int(first[2])
            named.add(f"PTM-{letter}{last:03}")
            at = first.end()
            while following := NEXT.match(text, at):
                number = int(following[3])
                named.add(f"PTM-{following[2] or letter}{following[3]}")
                if following[1] == " to ":
                    between |= {f"PTM-{letter}{n:03}" for n in range(last, number)}
                last, at = number, following.end()
    return named, between


def told() -> set[str]:
    """Codes that the program can give."""
    return {
        f"PTM-{letter}{number}"
        for file in (ROOT / "ptmtools").rglob("*.py")
        for letter, number in FIRST.findall(file.read_text("utf-8"))
    }


def test_every_code_is_documented() -> None:
    named, between = documented()
    #: An example, in the docstring of what holds a code.
    assert sorted(told() - named - between - {"PTM-I001"}) == []


def test_every_documented_code_exists() -> None:
    named, _ = documented()
    strict = {code.replace("-N", "-I") for code in told()}
    assert sorted(named - told() - strict) == []
