"""The context mixing coder and the profile `small`."""

import numpy as np
import pytest

from ptmtools.errors import InputError
from ptmtools.texture.coder import Coding
from ptmtools.texture.coders import mixing_tables as tables
from ptmtools.texture.coders.mixing import _split, decode_mixing, encode_mixing
from ptmtools.texture.profiles import small
from ptmtools.texture.pyramid import build_pyramid, mean_below
from tests.texture.coding import coded_groups
from tests.texture.oracles.mixing import ReferenceState, decode_reference


def _image(height, width, components, seed=1):
    """Smooth shades, an edge, a little noise; components alike but not the same."""
    y, x = np.mgrid[:height, :width]
    noise = np.random.default_rng(seed).integers(0, 6, (height, width, components))
    shade = 90 + 60 * np.sin(x / 9)[..., None] + y[..., None] * np.arange(1, components + 1) / 3
    return (shade + 40 * (x + y > 25)[..., None] + noise).clip(0, 255).astype(np.uint8)


def _pyramid_sizes(image, max_error=0):
    """Encodes and decodes all levels; the sizes of the groups."""
    return [len(data) for data, _ in coded_groups(small, image, max_error)]


@pytest.mark.parametrize("components", [1, 2, 3, 4])
@pytest.mark.parametrize("size", [(1, 2), (2, 1), (2, 2), (3, 3), (5, 17), (17, 4), (16, 15)])
def test_all_sizes_come_back(size, components):
    _pyramid_sizes(_image(*size, components))


def test_every_small_size_comes_back():
    for height in range(1, 18):
        for width in range(1, 18):
            level = _image(height, width, 1 + (height + width) % 4, height)
            below = mean_below(level)
            data, _, _ = encode_mixing(level, below)
            assert np.array_equal(decode_mixing(data, below, level.shape)[0], level)


@pytest.mark.parametrize("components", [1, 3])
@pytest.mark.parametrize("max_error", [1, 3, 20, 255])
def test_an_allowed_error_is_kept_and_saves_bytes(max_error, components):
    image = _image(40, 33, components)
    assert sum(_pyramid_sizes(image, max_error)) < sum(_pyramid_sizes(image))


@pytest.mark.parametrize("components", [2, 3, 4])
@pytest.mark.parametrize("size", [(70, 202), (71, 258), (3, 512), (33, 257)])
@pytest.mark.parametrize("max_error", [0, 2])
def test_threads_change_no_byte(components, size, max_error):
    """Odd heights too, whose last blocks look at the odd row of the plane before."""
    level = _image(*size, components)
    below = mean_below(level)
    data, texels, memory = encode_mixing(level, below, Coding(max_error))
    for threads in (2, 4):
        coding = Coding(max_error, threads=threads)
        again, _, same = encode_mixing(level, below, coding)
        assert again == data
        assert all(
            np.array_equal(a, b)
            for one, two in zip(memory, same, strict=True)
            for a, b in zip(one, two, strict=True)
        )
        back, _ = decode_mixing(data, below, level.shape, coding)
        assert np.array_equal(back, texels)


def test_memory_is_not_changed_and_makes_a_difference():
    level = _image(48, 48, 3)
    below = mean_below(level)
    fresh, _, memory = encode_mixing(level, below)
    coding = Coding(memory=memory)
    first = encode_mixing(level, below, coding)[0]
    assert encode_mixing(level, below, coding)[0] == first
    assert len(first) < len(fresh)


def test_reading_leaves_the_memory_that_writing_left():
    levels = build_pyramid(_image(40, 44, 3))
    seen, written, read = levels[0], None, None
    for level in levels[1:]:
        tile = small.encode_tile(level, seen, Coding(memory=written))
        back = small.decode_tile(tile.data, seen, level.shape, Coding(memory=read))
        seen, written, read = back.texels, tile.memory, back.memory
    for one, two in zip(written, read, strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(one, two, strict=True))


def test_flat_images_are_tiny():
    sizes = _pyramid_sizes(np.full((128, 96, 3), 77, np.uint8))
    assert sum(sizes) <= 3 + 12 * len(sizes)


def test_noise_costs_one_percent():
    image = np.random.default_rng(3).integers(0, 256, (129, 254, 3), np.uint8)
    assert sum(_pyramid_sizes(image)) <= 1.01 * image.nbytes


@pytest.mark.parametrize("width", [40, 140])
def test_damage_is_an_error_or_an_image(width):
    level = _image(30, width, 3)
    below = mean_below(level)
    data, _, _ = encode_mixing(level, below)
    rng = np.random.default_rng(5)
    wrong = 0
    for i in range(60):
        damaged = bytearray(data)
        if i % 3 == 0:
            damaged = damaged[: rng.integers(len(data))]
        elif i % 3 == 1:
            damaged[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
        else:
            damaged = bytearray(rng.integers(0, 256, rng.integers(2 * len(data)), np.uint8))
        try:
            assert decode_mixing(bytes(damaged), below, level.shape)[0].shape == level.shape
        except InputError:
            wrong += 1
    assert wrong > 50


def test_the_profile_refuses_what_is_not_its_own():
    below = np.zeros((2, 2, 1), np.uint8)
    for data in (b"", b"\x09", b"\x02abc", b"\x01abc", b"\x01" + bytes(17), b"\x00\x00"):
        with pytest.raises(InputError):
            small.decode_tile(data, below, (4, 4, 1))
    with pytest.raises(InputError):
        small.decode_base(b"\x01\x02", (4, 4, 1), np.dtype(np.uint8))


@pytest.mark.parametrize(
    ("height", "width", "components", "max_error"),
    [(24, 20, 3, 0), (21, 15, 4, 0), (20, 22, 1, 0), (13, 24, 2, 2), (6, 130, 2, 0)],
)
def test_the_reference_decoder_agrees(height, width, components, max_error):
    image = _image(height, width, components)
    image[: height // 2, : width // 2] = 200
    levels = build_pyramid(image)
    seen, memory = levels[0], None
    states = [ReferenceState() for _ in range(components)]
    for level in levels[1:]:
        data, texels, memory = encode_mixing(level, seen, Coding(max_error, memory))
        streams = map(bytes, _split(data, components if level.shape[1] >= 66 else 1))
        back = decode_reference(list(streams), seen, level.shape, max_error, states)
        assert np.array_equal(back, texels)
        seen = texels
    for plane, state in zip(memory, states, strict=True):
        assert plane.weights.tolist() == state.weights
        assert plane.bias.tolist() == state.bias


def test_no_entry_of_a_table_is_in_doubt(monkeypatch):
    """Far from a half: the last bits of a library's logarithm change none."""
    margins = []

    def recorded(values):
        margins.append(np.abs(values % 1 - 0.5).min())
        return np.rint(values).astype(np.int32)

    monkeypatch.setattr(tables, "_round", recorded)
    for table in (tables.squash, tables.magnitude):
        table.__wrapped__()
    tables.soft_plus()
    tables.survival()
    assert len(margins) == 4
    assert min(margins) > 9e-5
