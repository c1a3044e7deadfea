"""Images, and the way through a coder and back, for several tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture.coder import Coding
from ptmtools.texture.pyramid import build_pyramid

Samples = NDArray[Any]


def textured(height: int, width: int, components: int, seed: int = 0) -> NDArray[np.uint8]:
    """Ramps, an edge and some noise."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    ramp = np.stack([x * 2 + y * (c + 1) + 50 * (x > width // 2) for c in range(components)], 2)
    return np.clip(ramp + rng.integers(-4, 5, ramp.shape), 0, 255).astype(np.uint8)


def same(found: Any, wanted: Samples) -> None:
    """The same type, shape and bits; a NaN is not equal to itself."""
    assert (found.dtype, found.shape) == (wanted.dtype, wanted.shape)
    assert found.tobytes() == wanted.tobytes()


def coded_groups(
    profile: Any, image: Samples, max_error: int = 0, threads: int = 1
) -> list[tuple[bytes, Samples]]:
    """Every group of a pyramid and its level. What comes back has the encoder's bits, and the
    level's or lies within the error; each level refines the one that came back."""
    coarsest, *levels = build_pyramid(image)
    actual = [(profile.encode_base(coarsest), coarsest)]
    below = profile.decode_base(actual[0][0], coarsest.shape, coarsest.dtype)
    same(below, coarsest)
    learned = known = None
    for level in levels:
        tile = profile.encode_tile(level, below, Coding(max_error, learned, threads))
        coding = Coding(max_error, known, threads)
        back = profile.decode_tile(tile.data, below, level.shape, coding)
        same(back.texels, np.asarray(tile.texels))
        if max_error:
            assert np.abs(back.texels.astype(int) - level).max() <= max_error
        else:
            same(back.texels, level)
        below, learned, known = back.texels, tile.memory, back.memory
        actual.append((tile.data, level))
    return actual
