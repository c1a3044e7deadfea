"""Names of textures, and the PNG twins."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from ptmtools.pipeline.textures import bare_png, texture_names
from ptmtools.texture import read_image


def test_names_are_unique_without_regard_to_case() -> None:
    assert texture_names(("a.png", "b.tar.png", "c")) == ["a", "b.tar", "c"]
    assert texture_names(("a.png", "A.jpg", "a_png.tif")) == ["a_png", "A_jpg", "a_png_2"]
    assert texture_names((".png",)) == ["png"]


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGB", "RGBA"])
@pytest.mark.parametrize("transparent", [False, True])
def test_a_bare_png_has_the_same_texels_and_nothing_else(mode: str, transparent: bool) -> None:
    noise = np.random.default_rng(0).integers(0, 256, (9, 7, 4), np.uint8)
    image = Image.fromarray(noise).convert(mode)
    told = PngImagePlugin.PngInfo()
    told.add_text("Comment", "made on a Monday")
    told.add(b"gAMA", (45455).to_bytes(4, "big"))
    key = {"L": 3, "P": 3, "RGB": (1, 2, 3)}.get(mode) if transparent else None
    out = io.BytesIO()
    image.save(
        out, "PNG", pnginfo=told, dpi=(72, 72), **({} if key is None else {"transparency": key})
    )
    bare = bare_png(out.getvalue())
    assert np.array_equal(read_image(bare), read_image(out.getvalue()))
    assert len(bare) < len(out.getvalue())
    assert not any(kind in bare for kind in (b"tEXt", b"gAMA", b"pHYs"))
    assert bare_png(bare + b"behind the end") == bare
