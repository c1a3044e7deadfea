"""Measures of `ptm compare` are exact, or it states why there is none."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.texture import build_pyramid, encode
from ptmtools.texture.images.png import png_bytes
from ptmtools.texture.model import EncodeOptions
from ptmtools_lab.codecs import Codec, codecs, measure, total

RNG = np.random.default_rng(4)


@pytest.mark.parametrize("components", [1, 2, 3, 4])
@pytest.mark.parametrize("kind", ["uint8", "uint16"])
def test_every_rival_gives_back_what_it_holds(kind: str, components: int) -> None:
    texels = RNG.integers(0, 1000, (19, 33, components)).astype(kind)
    actual = {one.codec: one for one in measure(texels, codecs(["raw"]))}
    assert actual["PNG"].all_bytes == sum(len(png_bytes(level)) for level in build_pyramid(texels))
    assert actual["PNG"].finest_bytes == len(png_bytes(texels))
    assert actual["ptm raw"].all_bytes == len(encode(texels, EncodeOptions("raw")))
    for one in actual.values():
        if one.problem is None:
            assert one.raw_bytes == texels.nbytes
            assert one.encode_seconds > 0
            assert one.decode_seconds > 0
        else:
            assert "exactly" not in one.problem
            assert one.codec != "PNG"
    if kind == "uint8":
        assert [one.problem for one in actual.values() if "WebP" in one.codec] == [None]


@pytest.mark.parametrize("components", [2, 4])
def test_opaque_alpha_comes_back_from_webp(components: int) -> None:
    texels = RNG.integers(0, 256, (19, 33, components), np.uint8)
    if components == 2:
        texels[:, :, 0] = 200
    texels[:, :, -1] = 255
    webp = [codec for codec in codecs([]) if "WebP" in codec.name]
    assert [one.problem for one in measure(texels, webp)] == [None]


def test_a_lossy_codec_is_found_out() -> None:
    texels = RNG.integers(0, 256, (9, 9, 3), dtype=np.uint8)
    lossy = Codec("lossy", lambda image: image.tobytes(), lambda data, shape: texels & 254)
    (actual,) = measure(texels, [lossy])
    assert actual.problem == "does not give back uint8 texels exactly"
    assert total([[actual], [actual]]) == [actual]
