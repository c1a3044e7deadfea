"""The browser's decoder gives Python's texels, to the last bit, or refuses with Python's code."""

from __future__ import annotations

import hashlib
import random
import struct
import sys
import zlib
from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ptmtools.texture import EncodeOptions, Limits, decode_levels, encode, read_header
from ptmtools.texture.container import whole_levels
from tests.texture.test_repeats import ZOO
from tests.web.node import Decoded, by_python, decode_all, missing, run

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from benchmarks.fuzz.mutation import damaged  # noqa: E402
from benchmarks.fuzz.textures import FIELDS, LIMITS, Ptm, sealed  # noqa: E402

VECTORS = ROOT / "tests" / "texture" / "vectors" / "v2"
#: Of a profile, kind of sample or version that is not read.
UNKNOWN = "PTM-I104"

Bytes = NDArray[np.uint8]


@pytest.fixture(scope="module", autouse=True)
def _node(require: Callable[[str, str], None]) -> None:
    if remedy := missing():
        require("node", remedy)


def known(file: bytes) -> bool:
    """Whether the file is of a profile and kind that a browser reads."""
    header = read_header(file)
    return header.profile in ("fast", "raw") and header.kind == "uint8" and header.version == 2


def image(name: str, height: int, width: int, components: int) -> Bytes:
    """One of the zoo, as large as that and with so many components."""
    one = ZOO[name]
    tall, wide = -(-height // one.shape[0]), -(-width // one.shape[1])
    deep = -(-components // one.shape[2])
    return np.ascontiguousarray(np.tile(one, (tall, wide, deep))[:height, :width, :components])


@cache
def synthetic() -> dict[str, bytes]:
    """Files of all shapes, components, tiles and errors, and of every coder."""
    files = {}
    sizes = [(1, 1), (1, 9), (12, 1), (2, 2), (3, 3), (2, 5), (7, 4), (16, 17), (33, 30), (39, 43)]
    for number, name in enumerate(ZOO):
        for components in range(1, 5):
            for height, width in sizes[number % 2 :: 2] + [(70, 53)]:
                for profile, error in (("fast", 0), ("fast", 1), ("fast", 40), ("raw", 0)):
                    if (profile == "raw" or error) and number % 3 != components % 3:
                        continue
                    tile = (0, 16, 30)[(height + components) % 3]
                    made = image(name, height, width, components)
                    options = EncodeOptions(profile, max_error=error, tile=tile)
                    files[f"{name} {made.shape} {options}"] = encode(made, options)
    rng = np.random.default_rng(5)
    large = image("photo", 230, 260, 3)
    large[:, :, 1] = rng.integers(0, 16, large.shape[:2]) * 17
    # So large that weights are sent; ranks; levels that a file begins or ends with; long runs.
    files["weights"] = encode(large, EncodeOptions())
    files["weights, tiles"] = encode(large, EncodeOptions(tile=100))
    files["weights, within 2"] = encode(large, EncodeOptions(max_error=2))
    files["within 255"] = encode(large, EncodeOptions(max_error=255))
    files["noise within 2"] = encode(image("noise", 50, 51, 3), EncodeOptions(max_error=2))
    files["from 8"] = encode(image("lines", 140, 90, 3), EncodeOptions(min_side=8))
    files["from 30, raw"] = encode(large, EncodeOptions("raw", min_side=30, max_side=200))
    files["runs"] = encode(np.full((9, 1500, 4), 8, np.uint8), EncodeOptions(tile=0))
    return files


def test_frozen_files(tmp_path: Path) -> None:
    files = [file.read_bytes() for file in sorted(VECTORS.glob("*.ptm"))]
    for file, actual in zip(files, decode_all(tmp_path, files), strict=True):
        if known(file):
            assert actual == by_python(file)
        else:
            assert (actual.error, actual.levels) == (UNKNOWN, ())
    assert sum(map(known, files)) == 23


def test_synthetic_files(tmp_path: Path) -> None:
    files = synthetic()
    actual = decode_all(tmp_path, list(files.values()))
    wrong = [
        name
        for (name, file), one in zip(files.items(), actual, strict=True)
        if one.error or one != by_python(file)
    ]
    assert wrong == []
    assert len(files) > 300


def test_ready_for_upload(tmp_path: Path) -> None:
    """As RGBA grey is in all three, and what has no alpha is opaque."""
    images = [image("photo", 21, 18, components) for components in range(1, 5)]
    files = [encode(one) for one in images]
    actual = decode_all(tmp_path, files, "rgba")
    for file, one in zip(files, actual, strict=True):
        wanted = []
        for level in decode_levels(file):
            colour = level[:, :, :3] if level.shape[2] > 2 else np.repeat(level[:, :, :1], 3, 2)
            opaque = np.full(level.shape[:2], 255, np.uint8)
            alpha = opaque if level.shape[2] % 2 else level[:, :, -1]
            wanted.append(hashlib.sha256(np.dstack([colour, alpha]).tobytes()).hexdigest())
        assert one.levels == tuple(wanted)


@pytest.mark.parametrize(
    "name", ["fast-rgb-palette", "fast-greyalpha-27x30", "fast-rgb-error-2", "raw-rgb-tiles"]
)
def test_cut_at_every_byte(tmp_path: Path, name: str) -> None:
    """Whatever is whole comes out, and nothing else."""
    file = (VECTORS / f"{name}.ptm").read_bytes()
    header, exact = read_header(file), by_python(file)
    cuts = [file[:size] for size in range(len(file))]
    for cut, actual in zip(cuts, decode_all(tmp_path, cuts), strict=True):
        if len(cut) < header.description[0]:
            assert actual == by_python(cut)
        else:
            whole = whole_levels(header, len(cut))
            assert actual == Decoded(exact.levels[:whole], None), len(cut)


@pytest.mark.parametrize(
    "name", ["fast-rgb-ranks", "fast-grey-33x31", "fast-rgba-24x21", "fast-rgb-error-2"]
)
def test_every_byte_flipped(tmp_path: Path, name: str) -> None:
    """One bit of each byte: no checksum lets it pass."""
    file = (VECTORS / f"{name}.ptm").read_bytes()
    flips = []
    for at in range(len(file)):
        flipped = bytearray(file)
        flipped[at] ^= 1 << (at % 8)
        flips.append(bytes(flipped))
    exact = by_python(file)
    for at, actual in enumerate(decode_all(tmp_path, flips)):
        assert actual.error is not None, at
        assert actual == by_python(flips[at]) or actual.error == UNKNOWN
        assert actual.levels == exact.levels[: len(actual.levels)]


def test_flips_behind_right_checksums(tmp_path: Path) -> None:
    """Refused, or decoded to what Python makes of it."""
    flips = []
    for name in ("fast-rgb-ranks", "fast-rgb-palette", "fast-rgb-error-2", "fast-rgb-tiles"):
        file = (VECTORS / f"{name}.ptm").read_bytes()
        begin = read_header(file).levels[0].offset
        for at in range(begin, len(file), 7):
            flipped = bytearray(file)
            flipped[at] ^= 1 << (at % 8)
            flips.append(sealed(bytes(flipped), file))
    passed = 0
    for flipped, actual in zip(flips, decode_all(tmp_path, flips), strict=True):
        assert actual == by_python(flipped)
        passed += actual.error is None
    assert 0 < passed < len(flips)


def test_the_fuzzers_files(tmp_path: Path) -> None:
    """The same levels as Python's, and the same code of what is refused."""
    target, rng = Ptm(tmp_path, tmp_path), random.Random("browser")
    files = [target.make(rng).data for _ in range(1000)]
    own = [file for file in synthetic().values() if len(file) < 5000]
    for _ in range(1500):
        file = rng.choice(own)
        changed = damaged(rng, file, rng.choice(own), rng.choice(((), (), FIELDS)))
        files.append(sealed(changed, file) if rng.random() < 0.9 else changed)
    decoded = decode_all(tmp_path, files, "native", str(LIMITS.decoded_bytes))
    outcomes: Counter[str | None] = Counter()
    for file, actual in zip(files, decoded, strict=True):
        wanted = by_python(file, LIMITS)
        # Python looks whether the finest level is within its limit before the coarsest.
        if actual.error != UNKNOWN and "PTM-L103" not in (actual.error, wanted.error):
            assert actual == wanted
            outcomes[actual.error] += 1
    assert outcomes[None] > 300
    assert outcomes["PTM-I112"] > 200


def hostile_head(**fields: int) -> bytes:
    """A head whose checksum is right, of one level, followed by nothing."""
    at = {"width": 12, "height": 16, "components": 20, "tile": 28, "described": 36, "length": 52}
    sizes = {"components": 1, "length": 8}
    file = bytearray(encode(np.zeros((1, 1, 1), np.uint8)))
    for name, value in fields.items():
        size = sizes.get(name, 4)
        file[at[name] : at[name] + size] = value.to_bytes(size, "little")
    described = struct.unpack_from("<I", file, 36)[0]
    file[44:52] = (68 + described).to_bytes(8, "little")
    file[64:68] = zlib.crc32(file[:64]).to_bytes(4, "little")
    return bytes(file[:68])


def test_huge_sizes_are_refused_before_memory_is_taken(tmp_path: Path) -> None:
    huge = [
        hostile_head(width=65536, height=1, components=4, length=2 * 65536 * 4),
        hostile_head(width=65537),
        hostile_head(width=2**32 - 1, height=2**32 - 1),
        hostile_head(width=0),
        hostile_head(described=2**24 + 1),
        hostile_head(described=2**32 - 1),
        hostile_head(length=2**63),
        hostile_head(length=2**32),
        hostile_head(tile=15),
        hostile_head(tile=2**31),
        hostile_head(components=5),
        hostile_head(components=0),
    ]
    actual = decode_all(tmp_path, huge)
    assert actual == [by_python(file) for file in huge]
    assert {one.error for one in actual} == {None, "PTM-L104", "PTM-I105"}


def test_memory_stays_within_the_limit(tmp_path: Path) -> None:
    """The largest level that the format allows, of which not one byte is there, takes none."""
    script = Path(__file__).with_name("limits.mjs")
    reported = run(script).split()
    assert reported[:2] == ["PTM-L103", "PTM-L103"]
    assert int(reported[2]) < 1 << 24


def test_a_large_tile_leaves_nothing_behind(tmp_path: Path) -> None:
    """Of 34 MB: the decoder gives its memory up and begins anew."""
    large = encode(np.full((2600, 2600, 1), 200, np.uint8), EncodeOptions(tile=0))
    small = encode(image("photo", 60, 61, 3))
    actual = decode_all(tmp_path, [small, large, small])
    assert actual == [by_python(file) for file in (small, large, small)]


def test_a_limit_is_a_limit(tmp_path: Path) -> None:
    file = encode(image("photo", 300, 400, 3))
    whole = decode_all(tmp_path, [file])[0]
    small = decode_all(tmp_path, [file], "native", str(1 << 22))[0]
    assert whole.error is None
    assert small.error == "PTM-L103"
    assert small.levels == whole.levels[: len(small.levels)]
    assert 5 < len(small.levels) < len(whole.levels)
    assert by_python(file, Limits(1 << 16)).error == "PTM-L103"
