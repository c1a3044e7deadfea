"""Byte ranges and conditions, without a server."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from ptmtools.site.responses import accepts_gzip, asked_range, names_tag

SIZES = st.integers(0, 50)


@given(whole=SIZES, first=SIZES, last=SIZES)
def test_first_and_last(whole: int, first: int, last: int) -> None:
    part = asked_range(f"bytes={first}-{last}", whole)
    data = bytes(range(whole))
    if last < first:
        assert part is None
        return
    assert part is not None
    assert data[slice(*part)] == data[first : last + 1]


@given(whole=SIZES, first=SIZES)
def test_open_ended_and_suffix(whole: int, first: int) -> None:
    data = bytes(range(whole))
    part, suffix = asked_range(f"bytes={first}-", whole), asked_range(f"bytes=-{first}", whole)
    assert part is not None
    assert suffix is not None
    assert data[slice(*part)] == data[first:]
    assert data[slice(*suffix)] == data[whole - min(first, whole) :]


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
    assert asked_range(header, 10) is None


def test_spaces_and_empty_elements_are_nothing() -> None:
    assert asked_range(" Bytes=, 2-3 ,", 10) == (2, 4)


def test_tags() -> None:
    for header in ('"a"', '"b", "a"', 'W/"a"', " * ", '"with, comma", "a"'):
        assert names_tag(header, '"a"'), header
    for header in ("", "a", '"b"', '"a-gzip"', 'x"a'):
        assert not names_tag(header, '"a"'), header


def test_who_accepts_gzip() -> None:
    for header in ("gzip", "deflate, gzip;q=0.5, br", "GZIP", "*", "x-gzip", "gzip ; q=1"):
        assert accepts_gzip(header), header
    for header in (None, "", "identity", "gzip;q=0", "gzip;q=0.000, *", "*;q=0", "br"):
        assert not accepts_gzip(header), header
