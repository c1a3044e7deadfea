"""Numbers, strings and whole files as text: shortest, exact, and read back."""

from __future__ import annotations

import re
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.errors import DatabaseError
from ptmtools.output.model import FileError
from ptmtools.output.numbers import decimal, row_texts, single
from ptmtools.output.vrml import (
    CELL,
    CELL_OF_LEAVES,
    HEADER,
    declaration,
    field,
    list_field,
    loops,
    rows_field,
    sf_string,
)
from tests.output.vrml_reader import parse

FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)


def bits(*patterns: np.ndarray) -> np.ndarray:
    """The finite numbers of these bit patterns, without the negative zero."""
    values = np.concatenate(patterns).astype(np.uint32).view(np.float32)
    return values[np.isfinite(values)] + np.float32(0)


def hard() -> np.ndarray:
    """Every power of two and its neighbours, every subnormal power, decimals of few digits in
    every magnitude and their neighbours, whole numbers about the last that all are exact."""
    binade = np.arange(256, dtype=np.int64) << 23
    near = np.arange(-1, 2)
    powers = np.concatenate([(binade[:, None] + near).ravel(), (1 << np.arange(24)), np.arange(64)])
    digits = np.arange(1, 100)[:, None] * 10.0 ** np.arange(-46, 38)
    whole = 2**24 + np.arange(-40, 40)
    plain = np.concatenate([digits.ravel(), whole, np.arange(2000) / 8, np.arange(3000) / 100])
    with np.errstate(over="ignore"):
        plain = plain.astype(np.float32)
    patterns = plain.view(np.uint32).astype(np.int64)
    patterns = np.concatenate([powers, (patterns[:, None] + near).ravel()])
    patterns = patterns[(patterns >= 0) & (patterns < 2**31)]
    return bits(patterns, patterns | 2**31)


def nearly_whole() -> np.ndarray:
    """Of every binade the numbers that, or whose neighbours half way, come nearest to a multiple
    of the power of ten that decides on their last digit, without being one."""
    actual = []
    for binade in range(1, 255):
        unit = Fraction(2) ** (binade - 150)
        for ten in range(-46, 40):
            quotient = unit / Fraction(10) ** ten / 2
            if not 1 <= 2 * quotient < 100:
                continue
            # Best approximations from below and above, of up to 2^25 halves.
            low, high, below, above = 1, 1, quotient % 1, 1 - quotient % 1
            while below and above and max(low, high) < 2**25:
                if below < above:
                    above, high = above - below, high + low
                else:
                    below, low = below - above, low + high
                for halves in (low, high):
                    if 2**24 <= halves < 2**25:
                        actual += [(binade << 23) | ((halves + i >> 1) & 0x7FFFFF) for i in (0, 1)]
    return bits(np.array(actual, dtype=np.int64))


def random_bits(count: int, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return bits(random.integers(0, 2**32, count, dtype=np.uint32))


def texts(values: np.ndarray) -> list[str]:
    return row_texts(values[:, None])


def exact(text: str) -> tuple[int, int]:
    """(digits, exponent) of a numeral, without zeros at the end."""
    mantissa, _, power = text.lstrip("-").partition("e")
    whole, _, part = mantissa.partition(".")
    digits, exponent = int(whole + part), int(power or 0) - len(part)
    while digits and digits % 10 == 0:
        digits, exponent = digits // 10, exponent + 1
    return (digits, exponent) if digits else (0, 0)


@pytest.mark.parametrize("some", [hard, nearly_whole, lambda: random_bits(60_000, 1)])
def test_arrays_are_written_as_numpy_has_it(some: Callable[[], np.ndarray]) -> None:
    """Digit by digit as its own conversion (Dragon4), and no longer than either form."""
    values = some()
    for value, text in zip(values, texts(values), strict=True):
        theirs = np.format_float_scientific(value, unique=True, trim="-")
        digits, exponent = exact(text)
        assert exact(theirs) == (digits, exponent)
        assert text.startswith("-") == (value < 0)
        assert len(text) <= len(f"{digits}e{exponent}") + (value < 0)


@pytest.mark.parametrize("seed", range(2))
def test_millions_read_back(seed: int) -> None:
    values = random_bits(1_000_000, seed)
    read = np.array(texts(values), dtype=np.float64).astype(np.float32)
    np.testing.assert_array_equal(read, values)


def single_or_inf(text: str) -> np.float32:
    with np.errstate(over="ignore"):
        return np.float32(float(text))


@given(FLOATS)
def test_float64_reads_back_as_either_type(value: float) -> None:
    (text,) = row_texts(np.array([[np.float32(value)]], np.float64) + 0.0)
    assert float(text) == np.float32(value)
    assert np.float32(text) == np.float32(value)
    assert re.fullmatch(r"-?(0|[1-9]\d*)(\.\d+|e-?\d+)?", text)


@given(FLOATS)
def test_a_number_reads_back_and_is_short(value: float) -> None:
    text = decimal(value)
    assert np.float32(float(text)) == np.float32(value)
    assert not text.startswith("-0") or text[:3] == "-0."
    digits = len(str(exact(text)[0]))
    for fewer in range(1, digits):
        assert single_or_inf(f"{value:.{fewer}g}") != value
    others = (f"{value:.{digits - 1}e}", f"{value:.{digits - 1}f}", f"{value:.{digits}f}")
    for other in (*others, str(int(value))):
        if single_or_inf(other) == value:
            assert len(text) <= len(other)


def test_numbers_as_written() -> None:
    wanted = {
        1: "1", -0.0: "0", 0.1: "0.1", -2.5: "-2.5", 1 / 3: "0.33333334", 16777216: "16777216",
        100: "100", 1000: "1e3", 120: "120", 12000: "12e3", 1.5e20: "15e19", 0.01: "0.01",
        0.001: "1e-3", 0.0012: "12e-4", 0.0123: "0.0123", 1e-5: "1e-5",
        1.2345678e-3: "0.0012345678", -1.2345678e-12: "-12345678e-19", 1.4e-45: "1e-45",
        3.4028235e38: "34028235e31",
    }  # fmt: skip
    assert texts(single(list(wanted), "these")) == list(wanted.values())
    assert [decimal(v) for v in wanted] == list(wanted.values())


def test_rows_of_lists() -> None:
    rows = row_texts(np.array([[0, 1, 2], [0.5, -1, 1e7], [3, 3, 3]], np.float32))
    assert rows == ["0 1 2", "0.5 -1 1e7", "3 3 3"]
    assert rows_field(rows, np.array([2, 1, 0]), per_line=2) == "[ 3 3 3,0.5 -1 1e7\n0 1 2 ]"
    assert rows_field(rows, np.zeros(0, np.int64)) == "[ ]"
    assert row_texts(np.zeros((0, 3), np.float32)) == []


def test_loops() -> None:
    triangles = np.array([[0, 1, 2], [10, 123456, 9], [99, 100, 2**31 - 1]])
    assert loops(triangles, 2) == "[ 0 1 2 -1,10 123456 9 -1\n99 100 2147483647 -1 ]"
    assert loops(triangles[:0]) == "[ ]"


def test_not_finite_is_refused() -> None:
    for bad in (np.nan, np.inf, 1e39):
        with pytest.raises(DatabaseError, match="PTM-D601"):
            single([0.0, bad], "a wall")


def test_lists() -> None:
    assert list_field([], 3) == "[ ]"
    assert list_field("abc", 3) == "[ a, b, c ]"
    assert list_field("abcd", 3) == "[ a, b, c\nd ]"


def document(body: str) -> bytes:
    return f"{HEADER}{body}\n".encode()


@given(st.text())
def test_strings_read_back(text: str) -> None:
    try:
        data = document(f"WorldInfo {{ title {sf_string(text)} }}")
    except UnicodeEncodeError:
        return
    (node,) = parse(data).nodes
    assert node.fields["title"] == " ".join(text.split())


@given(st.lists(st.tuples(FLOATS, FLOATS, FLOATS), max_size=40))
def test_points_read_back(points: list[tuple[float, float, float]]) -> None:
    array = np.array(points, np.float32).reshape(-1, 3)
    text = field(row_texts(array + np.float32(0)))
    data = document(
        f"Shape {{ appearance Appearance {{ }} geometry IndexedFaceSet {{"
        f" coord Coordinate {{ point {text} }} coordIndex [ ] }} }}"
    )
    (shape,) = parse(data).nodes
    read = shape.at("geometry", "coord")["point"]
    np.testing.assert_array_equal(read.reshape(-1, 3).astype(np.float32), array)


@pytest.mark.parametrize(
    ("body", "kind", "place"),
    [
        ("Viewpoint { position 1 nan 2 }", "PTM-D661", "line 2"),
        ("Viewpoint { position 1 1e39 2 }", "PTM-D661", "line 2"),
        ("\nShape { geometry IndexedFaceSet { coordIndex [ 0, 1.5 ] } }", "PTM-D661", "line 3"),
        (
            "Shape { geometry IndexedFaceSet { coordIndex [ 9999999999 ] } }",
            "PTM-D661",
            "line 2",
        ),
        ("Shape { geometry IndexedFaceSet { coordIndex 0 } }", "PTM-D661", "line 2"),
        ("Shape { geometry Box { } }", "PTM-D661", "line 2"),
        ("Shape { geometry IndexedFaceSet { solid true } }", "PTM-D661", "line 2"),
        ("Shape { geometry IndexedFaceSet { solid TRUE solid TRUE } }", "PTM-D661", "line 2"),
        ("Shape { geometry Material { } }", "PTM-D661", "line 2"),
        ("DEF a.b Shape { }", "PTM-D661", "line 2"),
        ("DEF a WorldInfo { }\nDEF a WorldInfo { }", "PTM-D661", "line 3"),
        ("USE a", "PTM-D661", "line 2"),
        ("PTMCell { }", "PTM-D661", "line 2"),
        ("PROTO P [ field SFFoo a 1 ] { WorldInfo { } }", "PTM-D661", "line 2"),
        ("PROTO P [ exposedField SFBool a TRUE ] { WorldInfo { } }", "PTM-D661", "line 2"),
        ("PROTO P [ ] { Shape { } }", "PTM-D661", "line 2"),
        ("PROTO PTMViewpointCell [ field\n SFInt32 a 1 ] { WorldInfo { } }", "PTM-D661", "line 3"),
        ("PROTO PTMCell [ ] { WorldInfo { } }", "PTM-D661", "line 2"),
        (declaration(*CELL).replace("ach ", "acht "), "PTM-D661", "line 8"),
        (declaration(*CELL).replace("World", "Word"), "PTM-D661", "line 10"),
        (declaration(*CELL).rstrip("}\n"), "PTM-D661", "line 11"),
        (declaration(*CELL) + declaration(*CELL_OF_LEAVES), "PTM-D661", "line 12"),
        ("WorldInfo { title 'x' }", "PTM-D661", "line 2"),
        ('WorldInfo { info "x" }', "PTM-D661", "line 2"),
        ("WorldInfo {", "PTM-D661", "line 3"),
        ("Shape { geometry IndexedFaceSet { coord Coordinate { point [ 1 2 ] } } }",)
        + ("PTM-D661", "line 2"),
        (
            "Shape { geometry IndexedFaceSet { coord Coordinate { point [ 1 2 1_0 ] } } }",
            "PTM-D661",
            "line 2",
        ),
    ],
)
def test_what_the_pattern_does_not_have(body: str, kind: str, place: str) -> None:
    with pytest.raises(FileError) as fault:
        parse(document(body))
    assert (fault.value.code, fault.value.place) == (kind, place)


def test_nodes_that_lack_fields_are_read() -> None:
    """Fields that nodes in them lack count as theirs."""
    parts = "appearance Appearance { texture ImageTexture { } } geometry IndexedFaceSet { }"
    shape, _, inline = parse(
        document(f"\nDEF a Shape {{ {parts} }}\nWorldInfo {{ }} Inline {{ }}")
    ).nodes
    wanted = (
        "ImageTexture lacks url",
        "IndexedFaceSet lacks coord",
        "IndexedFaceSet lacks coordIndex",
    )
    assert (shape.lacks, shape.place) == (wanted, "line 3, a")
    assert (len(inline.lacks), inline.place) == (3, "line 4")


def test_the_header_and_the_encoding() -> None:
    for data, kind in (
        (b"", "PTM-D661"),
        (b"#VRML V1.0 ascii\n", "PTM-D661"),
        (b"\xef\xbb\xbf#VRML V2.0 utf8\n", "PTM-D661"),
        (document("# \u00e4").replace(b"\xc3", b""), "PTM-D661"),
    ):
        with pytest.raises(FileError) as fault:
            parse(data)
        assert fault.value.code == kind


def test_the_sample_pattern_is_read(shared) -> None:
    for name in ("c0000", "c0001"):
        read = parse((shared / f"vrml-sample/cells/{name}.wrl").read_bytes())
        (cell,) = read.of_type("PTMCell")
        assert cell.fields["cellName"] == name
        assert len(read.of_type("Shape")) == 7
