"""Numbers, strings and whole files as text: shortest, exact, and read back."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ptmtools.database.numerals import listed, numeral, numerals, quoted, single
from ptmtools.database.wrl import HEADER, WrlError, parse
from ptmtools.errors import DatabaseError

FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)


@given(FLOATS)
def test_a_number_reads_back_and_is_short(value: float) -> None:
    text = numeral(value)
    assert np.float32(float(text)) == np.float32(value)
    assert not text.startswith("-0") or text[:3] == "-0."
    shorter = (f"{value:.{digits}g}" for digits in range(1, 9))
    digits = len(text.partition("e")[0].strip("-").replace(".", "").strip("0"))
    for other in shorter:
        if np.float32(float(other)) == np.float32(value):
            least = len(other.partition("e")[0].strip("-").replace(".", "").strip("0"))
            assert digits <= least
            break


def test_numbers_as_written() -> None:
    values = np.array([1, -0.0, 0.1, 1e-5, 1.5e20, -2.5, 16777216, 1 / 3], np.float32)
    wanted = ["1", "0", "0.1", "1e-5", "1.5e20", "-2.5", "1.6777216e7", "0.33333334"]
    assert numerals(values) == wanted


def test_not_finite_is_refused() -> None:
    for bad in (np.nan, np.inf, 1e39):
        with pytest.raises(DatabaseError, match="PTM-D601"):
            single([0.0, bad], "a wall")


def test_lists() -> None:
    assert listed([], 3, "") == "[ ]"
    assert listed("abc", 3, "") == "[ a, b, c ]"
    assert listed("abcd", 3, "  ") == "[\n    a, b, c,\n    d\n  ]"


def document(body: str) -> bytes:
    return f"{HEADER}\n{body}\n".encode()


@given(st.text())
def test_strings_read_back(text: str) -> None:
    try:
        data = document(f"WorldInfo {{ title {quoted(text)} }}")
    except UnicodeEncodeError:
        return
    (node,) = parse(data).nodes
    assert node.fields["title"] == " ".join(text.split())


@given(st.lists(st.tuples(FLOATS, FLOATS, FLOATS), max_size=40))
def test_points_read_back(points: list[tuple[float, float, float]]) -> None:
    array = np.array(points, np.float32).reshape(-1, 3)
    text = listed([" ".join(numerals(p)) for p in array], 8, "  ")
    data = document(
        f"Shape {{ geometry IndexedFaceSet {{ coord Coordinate {{ point {text} }} }} }}"
    )
    (shape,) = parse(data).nodes
    read = shape.fields["geometry"].fields["coord"].fields["point"]
    np.testing.assert_array_equal(read.reshape(-1, 3).astype(np.float32), array)


@pytest.mark.parametrize(
    ("body", "kind", "place"),
    [
        ("Viewpoint { position 1 nan 2 }", "finite", "line 2"),
        ("Viewpoint { position 1 1e39 2 }", "finite", "line 2"),
        ("\nShape { geometry IndexedFaceSet { coordIndex [ 0, 1.5 ] } }", "syntax", "line 3"),
        ("Shape { geometry IndexedFaceSet { coordIndex [ 0, 99999999999 ] } }", "syntax", "line 2"),
        ("Shape { geometry IndexedFaceSet { coordIndex 0 } }", "syntax", "line 2"),
        ("Shape { geometry Box { } }", "syntax", "line 2"),
        ("Shape { geometry IndexedFaceSet { solid true } }", "syntax", "line 2"),
        ("Shape { geometry IndexedFaceSet { solid TRUE solid TRUE } }", "syntax", "line 2"),
        ("Shape { geometry Material { } }", "syntax", "line 2"),
        ("DEF a.b Shape { }", "syntax", "line 2"),
        ("DEF a Shape { }\nDEF a Shape { }", "syntax", "line 3"),
        ("USE a", "syntax", "line 2"),
        ("PTMCell { }", "syntax", "line 2"),
        ("PROTO P [ field SFFoo a 1 ] { WorldInfo { } }", "syntax", "line 2"),
        ("PROTO P [ exposedField SFBool a TRUE ] { WorldInfo { } }", "syntax", "line 2"),
        ("PROTO P [ ] { Shape { } }", "syntax", "line 2"),
        ("WorldInfo { title 'x' }", "syntax", "line 2"),
        ('WorldInfo { info "x" }', "syntax", "line 2"),
        ("WorldInfo {", "syntax", "line 3"),
        ("Shape { geometry IndexedFaceSet { coord Coordinate { point [ 1 2 ] } } }",)
        + ("syntax", "line 2"),
        (
            "Shape { geometry IndexedFaceSet { coord Coordinate { point [ 1 2 1_0 ] } } }",
            "syntax",
            "line 2",
        ),
    ],
)
def test_what_the_pattern_does_not_have(body: str, kind: str, place: str) -> None:
    with pytest.raises(WrlError) as fault:
        parse(document(body))
    assert (fault.value.kind, fault.value.place) == (kind, place)


def test_the_header_and_the_encoding() -> None:
    for data, kind in (
        (b"", "syntax"),
        (b"#VRML V1.0 ascii\n", "syntax"),
        (b"\xef\xbb\xbf#VRML V2.0 utf8\n", "syntax"),
        (document("# \u00e4").replace(b"\xc3", b""), "encoding"),
    ):
        with pytest.raises(WrlError) as fault:
            parse(data)
        assert fault.value.kind == kind


@given(st.data())
@settings(max_examples=150, deadline=None)
def test_a_damaged_file_is_refused_or_read(finished, data) -> None:
    """Whatever is done to a file, nothing but a `WrlError` comes of it."""
    good = (finished / "www/cells/c0001.wrl").read_bytes()
    begin = data.draw(st.integers(0, len(good)))
    end = data.draw(st.integers(begin, min(len(good), begin + 40)))
    other = data.draw(st.one_of(st.binary(max_size=8), st.sampled_from([b"{", b"[", b'"', b"-1"])))
    with suppress(WrlError):
        parse(good[:begin] + other + good[end:])


def test_the_sample_pattern_is_read(shared) -> None:
    for name in ("c0000", "c0001"):
        read = parse((shared / f"vrml-sample/cells/{name}.wrl").read_bytes())
        (cell,) = read.of_type("PTMCell")
        assert cell.fields["cellName"] == name
        assert len(read.of_type("Shape")) == 7
