"""The repeats coder: what repeats costs nothing; the compiled pass against its reference."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from ptmtools.texture.coders import repeats, repeats_blocks as symbols
from ptmtools.texture.pyramid import mean_below
from tests.texture.oracles.repeats import decode_repeats


def zoo() -> dict[str, NDArray[np.uint8]]:
    """Images of 40 × 44 texels in which something repeats, and some in which nothing does."""
    rng = np.random.default_rng(2)
    y, x = np.mgrid[:40, :44]
    smooth = np.stack([x * 3 + y, 2 * y + 40, x + y], axis=2)
    palette = rng.integers(0, 256, (5, 3))
    blobs = (x // 7 * 3 + y // 5 * 5 + (x - 20) ** 2 // 90) % 5
    lines = np.where((x + 2 * y) % 17 == 0, 200, np.where(x % 13 == 0, 90, 20))
    cutout = np.dstack([smooth, 255 * (np.hypot(x - 20, y - 20) < 15)])
    cutout[cutout[:, :, 3] == 0] = 0
    actual = {
        "flat": np.full((40, 44, 3), 9),
        "tiled": np.tile(rng.integers(0, 256, (10, 11, 3)), (4, 4, 1)),
        "ramp": smooth,
        "photo": smooth + rng.integers(-6, 7, smooth.shape),
        "noise": rng.integers(0, 256, (40, 44, 3)),
        "few colours": palette[blobs],
        "lines": lines[:, :, None],
        "checks": np.dstack([(x ^ y) & 1, (x // 4 ^ y // 4) & 1]) * 255,
        "cut-out": cutout,
        "specks": np.where((3 * x + 7 * y) % 61 == 0, 122, 120)[:, :, None],
    }
    return {name: np.clip(image, 0, 255).astype(np.uint8) for name, image in actual.items()}


ZOO = zoo()


def encode(level: NDArray[np.uint8]) -> bytes:
    return repeats.write(repeats.find(level, mean_below(level)))


@pytest.mark.parametrize("name", ZOO)
@pytest.mark.parametrize(
    ("height", "width"), [(40, 44), (39, 43), (1, 20), (21, 1), (2, 2), (3, 2), (1, 1)]
)
def test_compiled_pass_agrees_with_the_reference(name: str, height: int, width: int) -> None:
    level = np.ascontiguousarray(ZOO[name][:height, :width])
    below = mean_below(level)
    group = encode(level)
    np.testing.assert_array_equal(repeats.decode(group, below, level.shape), level)
    np.testing.assert_array_equal(decode_repeats(group, below, level.shape), level)


def test_between_them_the_images_use_every_sort_of_symbol() -> None:
    counts = np.zeros((symbols.TABLES, 256), np.int64)
    for image in ZOO.values():
        level = image[:39, :43]
        counts += repeats.find(np.ascontiguousarray(level), mean_below(level)).counts
    assert (counts[symbols.GUESS : symbols.TEXEL].sum(axis=0)[:5] > 0).all()
    assert (counts[symbols.TEXEL : symbols.EDGE].sum(axis=0)[:6] > 0).all()
    firsts = [symbols.FIRST, symbols.EDGE, symbols.HAAR, symbols.SAMPLE, symbols.REMAINDER]
    assert all(counts[first : first + 10].sum() > 0 for first in firsts)
    runs = counts[symbols.RUN :]
    assert runs[:, 0].sum() > 0
    assert runs[:, 1:].sum() > 0


def test_what_repeats_costs_next_to_nothing() -> None:
    tiled = np.tile(ZOO["noise"], (4, 4, 1))
    once = len(encode(ZOO["noise"]))
    assert len(encode(tiled)) < 1.1 * once
    assert len(encode(np.tile(ZOO["flat"], (8, 8, 1)))) < 60
