"""Previews: their place between exact levels, their measured errors, sources kept as they are."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray
from PIL import Image

from ptmtools.errors import InputError
from ptmtools.texture import EncodeOptions, build_pyramid, decode_levels, load_image, read_header
from ptmtools.texture.images import Picture, png_bytes
from ptmtools.texture.images.bare import bare, drop_alpha
from ptmtools.texture.images.picture import check_jpeg
from ptmtools.texture.previews import (
    BESIDE,
    FIRST_SIDE,
    FITTED,
    WORTH,
    PreviewOptions,
    Pyramid,
    decode_preview,
)
from ptmtools.texture.steps import EncodedSteps, encode_steps

Texels = NDArray[np.uint8]


def photograph(width: int, height: int, components: int = 3) -> Texels:
    """Texels with detail at every scale; alpha is a disc."""
    random = np.random.default_rng(1)
    image = np.zeros((height, width, components))
    side = 1
    while side <= max(width, height):
        noise = random.normal(0, 18, (side + 1, side + 1, components))
        y, x = np.arange(height) * side // height, np.arange(width) * side // width
        image += noise[y][:, x]
        side *= 2
    texels = np.clip(image + 128, 0, 255).astype(np.uint8)
    if components in (2, 4):
        y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
        texels[..., -1] = np.where(x * x + y * y < 0.8, 255, 0)
    return texels


def saved(texels: Texels, format: str, **parameters: object) -> bytes:
    shown = texels[..., 0] if texels.shape[2] == 1 else texels
    buffer = io.BytesIO()
    Image.fromarray(shown).save(buffer, format, **parameters)  # type: ignore[arg-type]
    return buffer.getvalue()


def steps_of(source: bytes, levels: EncodeOptions | None = None, **options: object) -> EncodedSteps:
    previews = PreviewOptions(**options)  # type: ignore[arg-type]
    return encode_steps(load_image(source), source, levels or EncodeOptions(), previews)


@pytest.mark.parametrize(("width", "height"), [(256, 256), (300, 131), (64, 1000)])
@pytest.mark.parametrize("components", [1, 2, 3, 4])
def test_every_preview_is_of_its_level(width: int, height: int, components: int) -> None:
    texels = photograph(width, height, components)
    encoded = steps_of(saved(texels, "PNG"), exact="always")
    exact = [*decode_levels(encoded.ptm)]
    assert np.array_equal(exact[-1], texels)
    assert encoded.steps.previews
    for preview, data in zip(encoded.steps.previews, encoded.previews, strict=True):
        level = exact[preview.level]
        image = decode_preview(data, components)
        assert image.shape == level.shape == (preview.height, preview.width, components)
        assert len(data) == preview.bytes
        colours = components - (components in (2, 4))
        apart = image[..., :colours].astype(float) - level[..., :colours]
        own = np.sqrt(np.square(apart).mean(axis=2)).mean()
        assert preview.difference == pytest.approx(own, rel=0.006)
        assert preview.difference < 40
        assert max(preview.width, preview.height) >= FIRST_SIDE
        assert len(data) <= WORTH * read_header(encoded.ptm).levels[preview.level].end


# Sides that halve evenly: edge texels of odd sides belong to no block and add to the error.
@given(
    width=st.sampled_from([64, 128, 192]),
    height=st.sampled_from([64, 128, 192]),
    components=st.sampled_from([1, 3, 4]),
)
@settings(max_examples=12, deadline=None)
def test_errors_are_those_of_the_enlarged_levels(width: int, height: int, components: int) -> None:
    pyramid = Pyramid(build_pyramid(photograph(width, height, components)))
    finest = pyramid.levels[-1].astype(float)
    colours = components - (components in (2, 4))
    count = len(pyramid.levels)
    for level, (texels, error) in enumerate(zip(pyramid.levels, pyramid.errors, strict=True)):
        up = texels
        for finer in pyramid.levels[level + 1 :]:
            rows = np.minimum(np.arange(finer.shape[0]) >> 1, up.shape[0] - 1)
            columns = np.minimum(np.arange(finer.shape[1]) >> 1, up.shape[1] - 1)
            up = up[rows][:, columns]
        real = math.sqrt(np.square(up[..., :colours] - finest[..., :colours]).mean())
        # Means are rounded down.
        assert error == pytest.approx(real, rel=0.02, abs=0.5)
    assert pyramid.errors[-1] == 0
    assert list(pyramid.errors) == sorted(pyramid.errors)[::-1]
    coarse, fine = (pyramid.preview(level, 75, "webp")[0] for level in (count - 3, count - 1))
    assert coarse.error > fine.error > 0
    assert coarse.error >= pyramid.errors[count - 3]


@pytest.mark.parametrize(
    ("format", "name", "parameters"),
    [
        ("JPEG", "jpeg", {"quality": 85}),
        ("WEBP", "webp", {"quality": 75}),
        ("AVIF", "avif", {"quality": 70, "speed": 10}),
    ],
)
def test_a_lossy_source_is_its_own_exact_form(
    format: str, name: str, parameters: dict[str, object]
) -> None:
    source = saved(photograph(512, 512), format, **parameters)
    encoded = steps_of(source)
    *between, finest = encoded.steps.previews
    assert (finest.exact, finest.format, finest.level) == (True, name, 9)
    assert (finest.width, finest.height, finest.difference, finest.error) == (512, 512, 0, 0)
    texels = load_image(source).array()
    assert np.array_equal(decode_preview(encoded.previews[-1], 3), texels)
    beside = len(encoded.ptm) + sum(preview.bytes for preview in between)
    assert beside <= BESIDE * len(source)
    assert {preview.exact for preview in between} == {False}
    levels = [*decode_levels(encoded.ptm)]
    assert len(levels) == encoded.steps.exact_levels < len(encoded.steps.errors) == 10
    for level, expected in zip(levels, build_pyramid(texels), strict=False):
        assert np.array_equal(level, expected)


def paletted(colours: int, components: int = 3) -> tuple[bytes, Texels]:
    """A PNG of 256 x 256 texels with a palette in random order, and its texels."""
    palette = np.random.default_rng(2).integers(0, 256, (colours, components), np.uint8)
    places = photograph(256, 256, 1)[..., 0] % colours
    buffer = io.BytesIO()
    image = Image.frombytes("P", (256, 256), places.tobytes())
    image.putpalette(palette.tobytes(), "RGBA" if components == 4 else "RGB")
    image.save(buffer, "PNG", optimize=True)
    return buffer.getvalue(), palette[places]


@pytest.mark.parametrize("components", [3, 4])
@pytest.mark.parametrize("colours", [16, 200])
def test_an_image_that_is_smaller_than_its_levels_is_a_lossless_image(
    colours: int, components: int
) -> None:
    source, texels = paletted(colours, components)
    levels = steps_of(source, exact="always")
    assert len(levels.ptm) > len(source)
    encoded = steps_of(source)
    *between, finest = encoded.steps.previews
    assert (finest.exact, finest.format, finest.level) == (True, "lossless", 8)
    assert (finest.width, finest.height, finest.difference, finest.error) == (256, 256, 0, 0)
    assert np.array_equal(decode_preview(encoded.previews[-1], components), texels)
    beside = len(encoded.ptm) + sum(preview.bytes for preview in between)
    assert finest.bytes + beside <= max(len(source), (1 + BESIDE) * finest.bytes)
    assert encoded.steps.finest_is_image
    assert encoded.steps.errors == levels.steps.errors
    for level, expected in zip(decode_levels(encoded.ptm), build_pyramid(texels), strict=False):
        assert np.array_equal(level, expected)
    assert [*decode_levels(steps_of(source, exact="never").ptm)][-1].shape[0] < FIRST_SIDE
    assert not any(preview.exact for preview in steps_of(source, exact="never").steps.previews)


def test_images_that_are_not_smaller_than_their_levels_keep_these() -> None:
    smooth = np.add.outer(np.arange(256), np.arange(256))[..., None] // 2 * np.ones(3)
    for texels in (smooth.astype(np.uint8), photograph(64, 48)):
        encoded = steps_of(saved(texels, "BMP"))
        assert np.array_equal([*decode_levels(encoded.ptm)][-1], texels)
        assert not encoded.steps.finest_is_image
    deep = Picture(photograph(128, 128).astype(np.uint16) * 257)
    encoded = encode_steps(deep, bytes(1000), EncodeOptions(), PreviewOptions())
    assert not encoded.steps.finest_is_image


@pytest.mark.parametrize("options", [{"exact": "always"}, {"exact": "always", "preview": 0}])
def test_a_lossless_copy_of_a_lossy_source_on_request(options: dict[str, object]) -> None:
    source = saved(photograph(128, 128), "JPEG")
    encoded = steps_of(source, **options)
    assert np.array_equal([*decode_levels(encoded.ptm)][-1], load_image(source).array())
    assert not any(preview.exact for preview in encoded.steps.previews)
    assert bool(encoded.steps.previews) == ("preview" not in options)


@pytest.mark.parametrize("components", [1, 3, 4])
@pytest.mark.parametrize("share", [0.01, 1, 100])
def test_texels_of_a_lossy_source_that_is_not_sent_have_a_preview_of_as_many_bytes(
    components: int, share: float
) -> None:
    """A PNG of them remembers the bytes."""
    kind = "WEBP" if components == 4 else "JPEG"
    original = photograph(256, 256, components)
    lossy = saved(original, kind, quality=80)
    texels, size = load_image(lossy).array(), int(share * len(lossy))
    encoded = steps_of(png_bytes(texels, lossy=size))
    *between, finest = encoded.steps.previews
    assert (finest.width, finest.height, finest.exact) == (256, 256, False)
    if share == 1:
        assert 0.8 * size < finest.bytes <= size
        # Less than the source has lost already.
        apart = texels[..., :3].astype(float) - original[..., :3]
        assert finest.error < math.sqrt(np.square(apart).mean())
    qualities = {0.01: FITTED[0], 100: FITTED[-1]}
    if quality := qualities.get(share):
        same = saved(texels, "WEBP", quality=quality, exact=True)
        assert encoded.previews[-1] == same or components == 1
    assert len(encoded.ptm) + sum(preview.bytes for preview in between) <= BESIDE * finest.bytes
    for options in ({"exact": "always"}, {"preview": 0}):
        exact = steps_of(png_bytes(texels, lossy=size), **options)
        assert np.array_equal([*decode_levels(exact.ptm)][-1], texels)
    assert load_image(bare(png_bytes(texels, lossy=size), "PNG")).lossy is None


def test_a_jpeg_that_browsers_do_not_read_is_not_sent(shared: Path) -> None:
    folder = shared / "cases/arithmetic-jpeg"
    kinds = {"ar.jpg": "uncommon JPEG", "base.jpg": "JPEG", "grey.jpg": "JPEG"}
    for name, kind in kinds.items():
        source = (folder / name).read_bytes()
        lossy = load_image(source).lossy
        assert lossy == (kind, len(source))
        finest = steps_of(source).steps.previews[-1]
        assert finest.exact == (kind == "JPEG")
        assert finest.bytes <= len(source)
    common = saved(photograph(8, 8), "JPEG", progressive=True)
    assert check_jpeg(common)
    at = common.index(b"\xff\xc2")
    for marker in range(0xC0, 0xD0):
        if marker not in (0xC4, 0xC8, 0xCC):
            changed = common[: at + 1] + bytes([marker]) + common[at + 2 :]
            assert check_jpeg(changed) == (marker <= 0xC2)


@pytest.mark.parametrize(("format", "name"), [("WEBP", "WebP"), ("AVIF", "AVIF")])
def test_a_lossy_image_without_its_alpha_has_the_same_colours(format: str, name: str) -> None:
    source = saved(photograph(40, 24, 4), format, quality=70)
    opaque = load_image(drop_alpha(source, name))
    assert opaque.lossy is not None
    assert np.array_equal(opaque.array(), load_image(source).array()[..., :3])


def test_trimmed_lossy_sources_are_not_kept() -> None:
    source = saved(photograph(256, 256), "JPEG")
    encoded = steps_of(source, EncodeOptions(max_side=128))
    assert not any(preview.exact for preview in encoded.steps.previews)
    assert [*decode_levels(encoded.ptm)][-1].shape == (128, 128, 3)


@pytest.mark.parametrize("format", ["webp", "avif", "jpeg"])
def test_without_exact_levels_the_finest_preview_remains(format: str) -> None:
    encoded = steps_of(saved(photograph(256, 200, 4), "PNG"), exact="never", preview_format=format)
    header, finest = read_header(encoded.ptm), encoded.steps.previews[-1]
    assert max(header.levels[-1].width, header.levels[-1].height) < FIRST_SIDE
    assert (finest.width, finest.height, finest.exact) == (256, 200, False)
    # JPEG has no alpha.
    assert finest.format == ("webp" if format == "jpeg" else format)
    levels = [preview.level for preview in encoded.steps.previews]
    assert levels == [*range(len(header.levels), len(encoded.steps.errors))]


def test_previews_of_deep_images_show_the_upper_bits() -> None:
    texels = photograph(128, 128, 3).astype(np.uint16) << 8 | 77
    encoded = encode_steps(Picture(texels), b"", EncodeOptions(), PreviewOptions())
    assert np.array_equal([*decode_levels(encoded.ptm)][-1], texels)
    shown = decode_preview(encoded.previews[-1], 3).astype(float)
    assert np.abs(shown - (texels >> 8)).mean() < 20


@pytest.mark.parametrize(
    "options", [{"preview": 101}, {"preview": -1}, {"preview": 0, "exact": "never"}]
)
def test_impossible_options_are_refused(options: dict[str, object]) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        PreviewOptions(**options)  # type: ignore[arg-type]


@pytest.mark.parametrize(("format", "name"), [("JPEG", "JPEG"), ("WEBP", "WebP")])
def test_a_bare_lossy_image_keeps_its_texels_and_loses_its_orientation(
    format: str, name: str
) -> None:
    texels = photograph(40, 24)
    exif = Image.Exif()
    exif[0x0112] = 6
    profile = b"not a profile" * 50
    source = saved(texels, format, exif=exif, icc_profile=profile)
    stripped = bare(source, name)
    assert profile in source
    assert profile not in stripped
    with Image.open(io.BytesIO(stripped)) as image, Image.open(io.BytesIO(source)) as original:
        assert image.getexif().get(0x0112, 1) == 1
        assert np.array_equal(np.asarray(image), np.asarray(original))
    assert bare(stripped, name) == stripped
