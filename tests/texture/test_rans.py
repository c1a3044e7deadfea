"""Frequency tables and rANS: the compiled loops against plain Python and the specification."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.texture.coders import rans as tables, rans_kernels as kernels
from ptmtools.texture.coders.group import GroupReader
from ptmtools.texture.coders.rans import Sink, Stream, encode_symbols, read_stream
from tests.texture.oracles.rans import Symbols, built_in, normalised, read_tables

TABLES = 29


@settings(deadline=None, max_examples=60)
@given(
    counts=st.lists(
        st.integers(0, 5) | st.integers(0, 10**6) | st.integers(0, 2**40), min_size=1, max_size=256
    ).filter(any)
)
def test_normalised_frequencies(counts: list[int]) -> None:
    row = [*counts, *[0] * (256 - len(counts))]
    actual = tables.normalise(np.array([row], np.int64))[0]
    assert actual.tolist() == normalised(row)
    assert int(actual.sum()) == tables.TABLE_SIZE
    assert ((actual > 0) == (np.array(row) > 0)).all()


def test_built_in_tables_are_those_of_the_specification() -> None:
    for kind, row in enumerate(tables.built_in_family().tables[1:], start=1):
        assert row.tolist() == built_in(kind)


@settings(deadline=None, max_examples=40)
@given(st.lists(st.lists(st.integers(0, 2000), min_size=256, max_size=256), max_size=4))
def test_tables_survive_their_serialised_form(rows: list[list[int]]) -> None:
    counts = np.zeros((TABLES, 256), np.int64)
    for t, row in enumerate(rows):
        counts[7 * t] = row
    frequency, packed = tables.choose(counts, TABLES - 1, tables.built_in_family())
    reader = GroupReader(packed + b"more")
    np.testing.assert_array_equal(tables.parse(reader, TABLES, tables.built_in_family()), frequency)
    assert reader.rest() == b"more"
    reader = GroupReader(packed)
    assert read_tables(reader, TABLES) == frequency.tolist()
    reader.end()


def test_the_length_table_is_a_logarithm() -> None:
    """Only tables are chosen by it; it must not be far off."""
    f = np.arange(1, tables.TABLE_SIZE + 1)
    exact = 256 * (tables.TABLE_BITS - np.log2(f))
    assert np.abs(tables._log_table()[1:] - exact).max() <= 1.5


@pytest.fixture(scope="module")
def coded() -> tuple[Stream, tables.Frequencies, NDArray[np.uint16], NDArray[np.uint8]]:
    """A stream, its tables (of which the second is not in use), its symbols and their tables."""
    rng = np.random.default_rng(5)
    symbols = rng.geometric(0.2, 1000).astype(np.uint16) * rng.integers(0, 12, 1000, np.uint16)
    contexts = rng.choice(np.array([0, 2, 3], np.uint8), 1000)
    symbols[7] = 40_000
    counts = np.zeros((4, 256), np.int64)
    np.add.at(counts, (contexts, np.minimum(symbols, tables.ESCAPE)), 1)
    packed, data = encode_symbols(Sink(symbols, contexts, counts), 4, tables.built_in_family())
    frequency = tables.parse(GroupReader(packed), 4, tables.built_in_family())
    plain = Symbols(GroupReader(data), frequency.tolist())
    assert [plain.next(int(t)) for t in contexts] == symbols.tolist()
    return read_stream(GroupReader(data), 301), frequency, symbols, contexts


def test_symbols_come_back_row_by_row(coded: Any) -> None:
    stream, frequency, symbols, contexts = coded
    state = np.zeros(4, np.uint64)
    kernels.start_states(stream.words, state)
    table, begins = tables.row_tables(frequency)
    at, escaped, actual = 8, 0, []
    for row in (slice(0, 301), slice(301, 303), slice(303, 600), slice(600, 1000)):
        n = row.stop - row.start
        out = np.zeros(n, np.int32)
        at = kernels.decode_row(
            state, stream.words, at, table, begins.astype(np.uint64),
            contexts[row].astype(np.int32), n, out,
        )  # fmt: skip
        kernels.rotate_states(state, n)
        escaped = kernels.fill_escapes(out, n, stream.escapes, escaped)
        actual += out.tolist()
    assert actual == symbols.tolist()
    assert at == stream.limit
    assert escaped == len(stream.escapes)
    assert (state == kernels.STATE_LOW).all()


def test_symbols_come_back_one_by_one(coded: Any) -> None:
    stream, frequency, symbols, contexts = coded
    state = np.zeros(4, np.uint64)
    kernels.start_states(stream.words, state)
    table = tables.single_tables(frequency)
    at, escapes, actual = 8, iter(stream.escapes.tolist()), []
    for i, context in enumerate(contexts):
        z, used = kernels.decode_single(table, context, state, np.uint64(i & 3), stream.words[at])
        at += used
        actual.append(next(escapes) if z == tables.ESCAPE else z)
    assert actual == symbols.tolist()
    assert at == stream.limit
    assert (state == kernels.STATE_LOW).all()


@pytest.mark.parametrize(
    "data", [b"", b"\0", b"\5\0abc", b"\1\0\7", b"\1\0\x81", b"\2\0\x21\x10", b"\2\0\xf0\xff"]
)
def test_impossible_tables_are_refused(data: bytes) -> None:
    with pytest.raises(InputError, match="PTM-I112"):
        tables.parse(GroupReader(data), TABLES, tables.built_in_family())
