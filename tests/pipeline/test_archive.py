"""Arrays in a file: the same bytes for the same arrays, and no damage unnoticed."""

from __future__ import annotations

import io
import zipfile
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from ptmtools.errors import DatabaseError
from ptmtools.pipeline.archive import pack_arrays, unpack_arrays

DTYPES = st.sampled_from(["<f8", "<i4", "<i8", "|u1", "|b1"])
ARRAYS = st.dictionaries(
    st.text("abcdef_", min_size=1, max_size=8),
    DTYPES.flatmap(lambda d: npst.arrays(d, npst.array_shapes(min_dims=0, min_side=0))),
    max_size=5,
)


@given(ARRAYS)
def test_what_goes_in_comes_out(arrays: dict[str, np.ndarray]) -> None:
    found = unpack_arrays(pack_arrays(arrays), file="x.npz")
    assert set(found) == set(arrays)
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype
        assert found[name].shape == array.shape
        assert found[name].tobytes() == array.tobytes()
        assert found[name].flags.writeable


def test_bytes_depend_on_the_arrays_alone() -> None:
    a, b = np.arange(6.0), np.arange(6, dtype=np.int32).reshape(2, 3)
    packed = pack_arrays({"a": a, "b": b})
    assert packed == pack_arrays({"b": b, "a": a})
    assert packed == pack_arrays({"a": a.astype(">f8"), "b": np.asfortranarray(b)})
    assert packed != pack_arrays({"a": a + 1, "b": b})


def test_numpy_reads_it() -> None:
    with np.load(io.BytesIO(pack_arrays({"a": np.eye(3)})), allow_pickle=False) as archive:
        assert np.array_equal(archive["a"], np.eye(3))


@given(st.data())
def test_no_flipped_bit_of_an_array_passes(data: st.DataObject) -> None:
    array = np.arange(32, dtype=np.float64)
    packed = bytearray(pack_arrays({"a": array}))
    at = data.draw(st.integers(0, len(packed) - 1))
    packed[at] ^= 1 << data.draw(st.integers(0, 7))
    with suppress(DatabaseError):
        # Where it passes, it was a bit of the archive's own bookkeeping, such as a date.
        found = unpack_arrays(bytes(packed), file="x.npz")
        assert all(np.array_equal(values, array) for values in found.values())


@pytest.mark.parametrize("data", [b"", b"PK", b"no archive at all", b"\x93NUMPY"])
def test_what_is_no_archive_is_refused(data: bytes) -> None:
    with pytest.raises(DatabaseError, match="PTM-D006"):
        unpack_arrays(data, file="x.npz")


def test_a_declared_size_takes_no_memory() -> None:
    body = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": (2**40, 2**20)}
    np.lib.format.write_array_header_1_0(body, header)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("a.npy", body.getvalue())
    with pytest.raises(DatabaseError, match="shape does not match"):
        unpack_arrays(out.getvalue(), file="x.npz")


def test_a_pickle_is_refused() -> None:
    out = io.BytesIO()
    np.savez(out, a=np.array([{}], dtype=object))
    with pytest.raises(DatabaseError, match="PTM-D006"):
        unpack_arrays(out.getvalue(), file="x.npz")
