"""Byte ranges and conditions, without a server."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from ptmtools.server.ranges import Part, asked_part, has_already, still_valid, takes_gzip

SIZES = st.integers(0, 50)


@given(whole=SIZES, first=SIZES, last=SIZES)
def test_first_and_last(whole: int, first: int, last: int) -> None:
    part = asked_part(f"bytes={first}-{last}", whole)
    data = bytes(range(whole))
    if last < first:
        assert part is None
        return
    assert part is not None
    assert data[part.begin : part.end] == data[first : last + 1]


@given(whole=SIZES, first=SIZES)
def test_open_ended_and_suffix(whole: int, first: int) -> None:
    data = bytes(range(whole))
    part, suffix = asked_part(f"bytes={first}-", whole), asked_part(f"bytes=-{first}", whole)
    assert part is not None
    assert suffix is not None
    assert data[part.begin : part.end] == data[first:]
    assert data[suffix.begin : suffix.end] == data[whole - min(first, whole) :]


@pytest.mark.parametrize(
    "header",
    [
        None,
        "",
        "bytes",
        "bytes=",
        "bytes=-",
        "bytes=5-2",
        "bytes=1-2,4-5",
        "lines=1-2",
        "bytes=a-b",
        "bytes=1-2x",
        "bytes=+1-2",
        "bytes=0x1-2",
        "bytes=٣-٤",
        "bytes=" + "9" * 400 + "-",
    ],
)
def test_what_is_no_single_range_is_no_range(header: str | None) -> None:
    assert asked_part(header, 10) is None


def test_spaces_and_empty_elements_are_nothing() -> None:
    assert asked_part(" Bytes=, 2-3 ,", 10) == Part(2, 4, 10)


def test_content_range() -> None:
    assert Part(2, 4, 10).content_range == "bytes 2-3/10"
    assert Part(10, 10, 10).content_range == "bytes */10"


def test_tags() -> None:
    assert still_valid(None, '"a"')
    assert still_valid(' "a"', '"a"')
    assert not still_valid('W/"a"', '"a"')  # a part needs the very same bytes
    assert not still_valid("Mon, 23 Nov 2026 03:29:48 GMT", '"a"')
    for header in ('"a"', '"b", "a"', 'W/"a"', " * ", '"with, comma", "a"'):
        assert has_already(header, '"a"'), header
    for header in ("", "a", '"b"', '"a-gzip"', 'x"a'):
        assert not has_already(header, '"a"'), header


def test_who_takes_gzip() -> None:
    for header in ("gzip", "deflate, gzip;q=0.5, br", "GZIP", "*", "x-gzip", "gzip ; q=1"):
        assert takes_gzip(header), header
    for header in (None, "", "identity", "gzip;q=0", "gzip;q=0.000, *", "*;q=0", "br"):
        assert not takes_gzip(header), header
