"""Texture coordinates far from the origin."""

from __future__ import annotations

import numpy as np
from hypothesis import given, strategies as st

from ptmtools.scene.baking import FAR, near_origin


@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.sampled_from([1, 500, 3e3, 1e7, 1e12]))
def test_whole_repetitions_alike_in_a_group(seed: int, count: int, far: float) -> None:
    random = np.random.default_rng(seed)
    group = random.integers(0, 4, count)
    middle = random.uniform(-far, far, (4, 1, 2))[group]
    # Of few binary digits, so that what is left of them is exact.
    uv = np.round((middle + random.uniform(-3, 3, (count, 3, 2))) * 256) / 256
    repeats = random.integers(0, 2, (4, 2)).astype(bool)[group]
    actual = near_origin(uv, group, repeats)
    moved = uv - actual
    assert (moved % 2 == 0).all()
    assert (moved.transpose(0, 2, 1)[~repeats] == 0).all()
    for number in range(4):
        here = moved[group == number].reshape(-1, 2)
        assert (here == here[:1]).all()
    near = np.abs(actual).max(axis=1)
    assert (near[repeats] <= FAR).all()
    assert (moved.transpose(0, 2, 1)[np.abs(uv).max(axis=1) <= FAR - 8] == 0).all()
