"""Arrays in a file: the same bytes for the same arrays, and no damage unnoticed."""

from __future__ import annotations

import io
import struct
import zipfile
from collections.abc import Callable
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as npst

from ptmtools.errors import DatabaseError
from ptmtools.store.archive import Stored, pack_arrays, unpack_arrays, without_repeats
from tests.memory import little_memory

DTYPES = st.sampled_from(["<f8", "<i4", "<i8", "|u1", "|b1"])
ARRAYS = st.dictionaries(
    st.text("abcdef_", min_size=1, max_size=8),
    DTYPES.flatmap(lambda d: npst.arrays(d, npst.array_shapes(min_dims=0, min_side=0))),
    max_size=5,
)


@given(ARRAYS)
def test_what_goes_in_comes_out(arrays: dict[str, np.ndarray]) -> None:
    actual = unpack_arrays(pack_arrays(arrays), file="x.npz")
    assert set(actual) == set(arrays)
    for name, array in arrays.items():
        assert actual[name].dtype == array.dtype
        assert actual[name].shape == array.shape
        assert actual[name].tobytes() == array.tobytes()
        assert actual[name].flags.writeable


def test_bytes_depend_on_the_arrays_alone() -> None:
    a, b = np.arange(6.0), np.arange(6, dtype=np.int32).reshape(2, 3)
    packed = pack_arrays({"a": a, "b": b})
    assert packed == pack_arrays({"b": b, "a": a})
    assert packed == pack_arrays({"a": a.astype(">f8"), "b": np.asfortranarray(b)})
    assert packed != pack_arrays({"a": a + 1, "b": b})


def test_equal_rows_are_stored_once() -> None:
    """Readers ask for as many as there are of something else, which bounds them."""
    uv, number = np.zeros((5, 3, 2)), np.arange(5, dtype=np.int32)
    arrays = without_repeats({"uv": uv, "number": number, "other": uv}, "uv", "number")
    assert [len(array) for array in arrays.values()] == [1, 5, 5]
    stored = Stored(unpack_arrays(pack_arrays(arrays), file="x.npz"))
    with pytest.raises(ValueError, match="shape"):
        stored.array("uv", np.float64, 5, 3, 2)
    again = stored.repeat_rows(5, "uv", "number")
    assert np.array_equal(again.array("uv", np.float64, 5, 3, 2), uv)
    assert np.array_equal(again.array("number", np.int32, 5), number)
    with pytest.raises(ValueError, match="shape"):
        again.array("number", np.int32, 4)
    assert len(without_repeats({"none": uv[:0]}, "none")["none"]) == 0


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
        actual = unpack_arrays(bytes(packed), file="x.npz")
        assert all(np.array_equal(values, array) for values in actual.values())


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


Change = Callable[[zipfile.ZipFile], object]


def zipped(change: Change, **settings: object) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", **settings) as archive:  # type: ignore[arg-type]
        change(archive)
    return out.getvalue()


def body(head: str, data: bytes = b"", version: bytes = b"\1\0") -> bytes:
    """An array of numpy's format, with any text as its head."""
    text = head.encode() + b"\n"
    length = struct.pack("<H" if version == b"\1\0" else "<I", len(text))
    return b"\x93NUMPY" + version + length + text + data


def npy(shape: str, descr: str = "'<f8'", data: bytes = b"", order: str = "False") -> bytes:
    return body(f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}", data)


def packed() -> bytes:
    return pack_arrays({"a": np.arange(4.0), "b": np.arange(4.0)})


def patched(offset: int, value: bytes, *, central: bool = True, data: bytes = b"") -> bytes:
    """The archive with a field of its first directory entry, or local head, replaced."""
    changed = bytearray(data or packed())
    at = changed.index(b"PK\1\2" if central else b"PK\3\4") + offset
    changed[at : at + len(value)] = value
    return bytes(changed)


def both(offset: int, value: bytes) -> bytes:
    """As `patched`, in the local head as well, where fields stand two bytes earlier."""
    return patched(offset - 2, value, central=False, data=patched(offset, value))


def overlapping(members: int = 300) -> bytes:
    """Sound members, each of which begins inside the one before and goes on to the end of all:
    what they claim grows with the square of the file."""
    entries: dict[str, tuple[bytes, int]] = {}
    data = b""
    for number in reversed(range(members)):
        name = f"a{number:04}.npy"
        content = npy(f"({len(data)},)", "'|u1'", data)
        whole = zipped(lambda z, n=name, c=content: z.writestr(zipfile.ZipInfo(n), c))  # type: ignore[misc]
        at = whole.rindex(b"PK\1\2")
        entries[name] = (whole[at : whole.rindex(b"PK\5\6")], at)
        data = whole[:at]
    directory = b"".join(
        entry[:42] + struct.pack("<I", len(data) - length) + entry[46:]
        for entry, length in reversed(entries.values())
    )
    counts = (members, members, len(directory), len(data), 0)
    return data + directory + struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, *counts)


def member(name: str, data: bytes, **settings: object) -> bytes:
    return zipped(lambda z: z.writestr(name, data), **settings)


GOOD = npy("(1,)", data=bytes(8))

#: What → an archive that must be refused. All but the first lists are the work of an enemy: the
#: checksums are right where that matters.
ATTACKS: dict[str, bytes] = {
    "a name that leads out": member("../a.npy", GOOD),
    "an absolute name": member("/etc/a.npy", GOOD),
    "a name of Windows": member("C:a.npy", GOOD),
    "a folder": member("a/", b""),
    "a name in a folder": member("a/b.npy", GOOD),
    "no suffix": member("a", GOOD),
    "a name with a line end": member("a.npy\n", GOOD),
    "a name with a terminal's escape": member("\x1b[2J.npy", GOOD),
    "the same name twice": packed().replace(b"b.npy", b"a.npy"),
    "deflated": member("a.npy", GOOD, compression=zipfile.ZIP_DEFLATED),
    "a bomb": member("a.npy", bytes(1 << 24), compression=zipfile.ZIP_DEFLATED),
    "LZMA": member("a.npy", GOOD, compression=zipfile.ZIP_LZMA),
    "BZIP2": member("a.npy", GOOD, compression=zipfile.ZIP_BZIP2),
    "an unknown compression": both(10, struct.pack("<H", 99)),
    "encrypted": both(8, struct.pack("<H", 1)),
    "strongly encrypted": both(8, struct.pack("<H", 64)),
    "sizes behind the data": both(8, struct.pack("<H", 8)),
    "larger than the file": patched(24, struct.pack("<I", 1 << 30)),
    "larger than the file, twice": patched(20, struct.pack("<II", 1 << 30, 1 << 30)),
    "smaller than it is": patched(24, struct.pack("<I", 100)),
    "sizes in a zip64 field that is not there": patched(20, b"\xff" * 8),
    "beyond the end": patched(42, struct.pack("<I", 1 << 31)),
    "another checksum": patched(16, b"abcd"),
    "another name in front of the data": patched(30, b"x", central=False),
    "overlapping members": overlapping(),
    "objects": member("a.npy", npy("(1,)", "'|O'", bytes(8))),
    "records": member("a.npy", npy("(1,)", "[('x', '<f8')]", bytes(8))),
    "texts": member("a.npy", npy("(1,)", "'<U2'", bytes(8))),
    "dates": member("a.npy", npy("(1,)", "'<M8[s]'", bytes(8))),
    "elements of no size": member("a.npy", npy("(1000000000000000,)", "'|V0'")),
    "elements of a huge size": member("a.npy", npy("(1,)", "'|V2147483647'")),
    "columns first": member("a.npy", npy("(1,)", data=bytes(8), order="True")),
    "a side below 0": member("a.npy", npy("(-1, -1)", data=bytes(8))),
    "a product that overflows to 1": member("a.npy", npy(f"({2**32}, {2**32})", data=bytes(8))),
    "a product that overflows to 0": member("a.npy", npy(f"({2**63}, 2)")),
    "sides beside a 0 that no array has": member("a.npy", npy(f"(0, {10**19 - 1})")),
    "a side of ten thousand digits": member("a.npy", npy(f"({'9' * 10_000},)")),
    "a side of ten thousand hexadecimal digits": member("a.npy", npy(f"(0x{'f' * 10_000},)")),
    "sixty thousand sides": member("a.npy", npy("(" + "1," * 30_000 + ")", data=bytes(8))),
    "sixty sides": member("a.npy", npy("(" + "1, " * 65 + ")", data=bytes(8))),
    "a sum for a side": member("a.npy", npy("(1+0,)", data=bytes(8))),
    "a truth for a side": member("a.npy", npy("(True,)", data=bytes(8))),
    "a head of brackets": member("a.npy", body("(" * 60_000)),
    "a head of minuses": member("a.npy", body("-" * 60_000 + "1")),
    "a head that is no text": member("a.npy", b"\x93NUMPY\1\0\4\0\xff\xfe\0\0"),
    "a head of four gigabytes": member("a.npy", b"\x93NUMPY\2\0\xff\xff\xff\xff{}"),
    "a head that ends elsewhere": member("a.npy", GOOD.replace(b"\1\0", b"\1\0\1", 1)),
    "more bytes than elements": member("a.npy", GOOD + b"\0"),
    "fewer bytes than elements": member("a.npy", GOOD[:-1]),
    "no array": member("a.npy", b""),
}


@pytest.mark.parametrize("what", ATTACKS)
def test_attacks(what: str) -> None:
    data = ATTACKS[what]
    most = 8 * len(data) + (1 << 20)
    with little_memory(most), pytest.raises(DatabaseError, match="PTM-D006"):
        unpack_arrays(data, file="x.npz")


def test_the_attacks_fail_for_what_is_wrong_with_them() -> None:
    assert list(unpack_arrays(member("a.npy", GOOD), file="x.npz")) == ["a"]
    assert list(unpack_arrays(patched(16, b""), file="x.npz")) == ["a", "b"]
    assert len(unpack_arrays(overlapping(1), file="x.npz")) == 1
    with (
        suppress(zipfile.BadZipFile),  # some Pythons refuse it themselves
        np.load(io.BytesIO(overlapping())) as archive,
    ):
        assert sum(archive[name].nbytes for name in archive.files) > 10 * len(overlapping())
