"""Whatever stands in a group, behind a right checksum too: an error, or an image."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.errors import InputError
from ptmtools.texture.coders import haar, repeats, texel
from ptmtools.texture.profiles import paper, raw
from ptmtools.texture.pyramid import mean_below
from ptmtools.texture.samples import KINDS, from_ordered, to_ordered
from tests.memory import little_memory
from tests.texture.coding import Samples, textured
from tests.texture.test_repeats import ZOO
from tests.texture.test_texel import smooth

Coder = Callable[[Samples, Samples], bytes]
Decoder = Callable[[bytes, Samples, tuple[int, ...]], Samples]


def numbered(dtype: str) -> Samples:
    """Values of which some components are numbered: a list, a lattice."""
    values = to_ordered(smooth(33, 38, 3, np.dtype(dtype)))
    values[:, :, 0] |= values.dtype.type(15)
    values[:, :, 1] = values[:, :, 1] // 32 * 31
    return from_ordered(values, np.dtype(dtype))


def by_texel(max_error: int) -> tuple[Coder, Decoder]:
    return (
        lambda level, below: texel.encode(level, below, max_error)[0],
        lambda data, below, shape: texel.decode(data, below, shape, max_error),
    )


def by_profile(profile: Any) -> tuple[Coder, Decoder]:
    return (
        lambda level, below: profile.encode_tile(level, below).data,
        lambda data, below, shape: profile.decode_tile(data, below, shape).texels,
    )


def by_repeats(level: Samples, below: Samples) -> bytes:
    return repeats.write(repeats.find(level, below))


CASES: dict[str, tuple[Callable[[], Samples], tuple[Coder, Decoder]]] = {
    "haar": (lambda: textured(37, 41, 3) // 5 * 5, (haar.encode, haar.decode)),
    "paper": (lambda: textured(35, 38, 3), by_profile(paper)),
}
for _name in ("cut-out", "few colours", "photo", "lines"):
    _level = np.ascontiguousarray(ZOO[_name][:39, :43])
    CASES[f"repeats, {_name}"] = partial(np.copy, _level), (by_repeats, repeats.decode)
for _kind in KINDS:
    CASES[f"texel, {_kind}"] = partial(numbered, _kind), by_texel(0)
    if _kind.startswith("u"):
        CASES[f"texel, {_kind}, within 3"] = partial(numbered, _kind), by_texel(3)
    _level = (np.arange(11 * 10 * 2).reshape(11, 10, 2) * 37 % 101).astype(_kind)
    CASES[f"raw, {_kind}"] = partial(np.copy, _level), by_profile(raw)


@cache
def coded(name: str) -> tuple[Samples, bytes, Decoder]:
    make, (encode, decode) = CASES[name]
    level = make()
    return level, encode(level, mean_below(level)), decode


def test_sizes_are_checked_before_memory_is_taken() -> None:
    """Whichever four bytes are a size, such as that of the bits that are sent as they are."""
    level = smooth(16, 18, 1, np.dtype("u2"))
    below = mean_below(level)
    encode, decode = by_texel(0)
    group = encode(level, below)
    assert group[0] == texel.CODED
    decode(group, below, level.shape)  # which compiles
    for at in range(len(group) - 3):
        with little_memory(1 << 27), suppress(InputError):
            decode(group[:at] + b"\xff" * 4 + group[at + 4 :], below, level.shape)


@pytest.mark.parametrize("name", CASES)
@settings(deadline=None, max_examples=100)
@given(
    changes=st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), max_size=3),
    cut=st.floats(0, 1) | st.just(1.0),
    more=st.sampled_from([b"", b"", b"\0", b"\0\0\0"]),
    form=st.none() | st.integers(0, 7),
)
def test_a_damaged_group_is_an_error_or_an_image(
    name: str, changes: list[tuple[float, int]], cut: float, more: bytes, form: int | None
) -> None:
    if name == "paper" and not find_spec("imagecodecs"):
        pytest.skip("pip install 'ptmtools[codecs]'")
    level, whole, decode = coded(name)
    group = bytearray(whole)
    for position, value in changes:
        group[int(position * len(group))] = value
    if form is not None:
        group[0] = form
    group = group[: int(cut * len(group))] + more
    try:
        actual, code = decode(bytes(group), mean_below(level), level.shape).shape, ""
    except InputError as error:
        actual, code = None, error.code
    assert code == "PTM-I112" or actual == level.shape
    # The bytes of a group of integers are as many as its size says.
    assert code or not name.startswith("raw, u") or len(group) == len(whole)
