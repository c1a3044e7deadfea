"""16-bit and float images: exact, how large, and how far the paper's formula is off.

    python benchmarks/codec/floats.py [IMAGE …] [--fetch]

Images are generated (random bit patterns; magnitudes from 1e-38 to 1e38; a lit room with
highlights; a depth map; a height field in 16 bits) and read: the named ones, or three photographed
panoramas that ``--fetch`` takes from the npm package @pmndrs/assets (CC0; Poly Haven, 512 × 256,
half floats, OpenEXR). Compared with the whole pyramid in our profiles: zstd at level 19 of the raw
finest level, also with its bytes in planes; 16-bit PNG where it applies; OpenEXR (ZIP) if that
module is installed. Bytes of the raw finest level = 1.

The paper's fourth texel (§4.1), 4·I - a - b - c in float32, is compared with the exact one: share
of blocks in which it differs, and its largest relative error.
"""

from __future__ import annotations

import argparse
import base64
import re
import shutil
import subprocess
import tarfile
import tempfile
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
from images import OUTPUT
from numpy.typing import NDArray

from ptmtools.texture import EncodeOptions, build_pyramid, decode_levels, encode, load_image
from ptmtools_lab.codecs import time_best

Samples = NDArray[Any]
SIDE = 768
#: The panoramas, as base64 in JavaScript.
PACKAGE = "@pmndrs/assets@1.7.0"
NAMES = ("apartment", "city", "forest")


def made() -> dict[str, Samples]:
    """Images by name."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[:SIDE, :SIDE] / SIDE
    bits = rng.integers(0, 1 << 32, (SIDE, SIDE, 3), dtype=np.uint64).astype(np.uint32)
    wide = 10.0 ** rng.uniform(-38, 38, (SIDE, SIDE, 3))
    light = 0.02 + 1.5 / (1 + 40 * ((x - 0.3) ** 2 + (y - 0.2) ** 2))
    light += 900 * np.exp(-4000 * ((x - 0.7) ** 2 + (y - 0.35) ** 2))
    tiles = 0.55 + 0.25 * ((np.floor(x * 16) + np.floor(y * 16)) % 2)
    grain = 1 + 0.01 * rng.standard_normal((SIDE, SIDE))
    room = (light * tiles * grain)[:, :, None] * np.array([1.0, 0.9, 0.75])
    depth = np.where((x - 0.5) ** 2 + (y - 0.5) ** 2 < 0.1, 3 - x, 10.0)
    heights = sum(np.sin(x * f + f) * np.cos(y * f * 1.3) / f for f in (7, 19, 43, 97, 211))
    field = (heights - heights.min()) / np.ptp(heights) * 65535
    return {
        "random bits, float32": bits.view(np.float32),
        "random bits, float16": bits[:, :, :2].astype(np.uint16).view(np.float16),
        "1e-38…1e38, float32": wide.astype(np.float32),
        "lit room, float32": room.astype(np.float32),
        "lit room, float16": room.astype(np.float16),
        "depth map, float32": depth.astype(np.float32)[:, :, None],
        "height field, uint16": field.astype(np.uint16)[:, :, None],
        "noise, uint16": bits[:, :, :3].astype(np.uint16),
    }


def fetch_panoramas() -> None:
    """Downloads the panoramas that are missing; says so if there is no npm."""
    folder = OUTPUT / "hdr"
    wanted = {name: folder / f"{name}.exr" for name in NAMES}
    if all(path.exists() for path in wanted.values()):
        return
    if not shutil.which("npm"):
        print("no npm: the panoramas are left out (on Debian or Ubuntu: apt install npm)")
        return
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as place:
        subprocess.run(["npm", "pack", "--silent", PACKAGE], cwd=place, check=True)
        (archive,) = Path(place).glob("*.tgz")
        with tarfile.open(archive) as packed:
            for name, path in wanted.items():
                member = packed.extractfile(f"package/hdri/{name}.exr.js")
                assert member is not None
                actual = re.search(rb"base64,([A-Za-z0-9+/=]+)", member.read())
                assert actual is not None
                path.write_bytes(base64.b64decode(actual[1]))
                print(path)


def exact(image: Samples, profile: str) -> tuple[int, float, float]:
    """Bytes, seconds to encode and to decode; checks every bit of every level."""
    encoding, data = time_best(lambda: encode(image, EncodeOptions(profile)), 2)
    decoding, levels = time_best(lambda: list(decode_levels(data)), 2)
    for actual, wanted in zip(levels, build_pyramid(image), strict=True):
        assert actual.tobytes() == wanted.tobytes(), "not exact"
    return len(data), encoding, decoding


def rivals(image: Samples) -> dict[str, int]:
    """Bytes of the finest level alone."""
    raw = image.tobytes()
    apart = np.frombuffer(raw, np.uint8).reshape(-1, image.itemsize).T.tobytes()
    actual = {
        "zstd-19": len(imagecodecs.zstd_encode(raw, 19)),
        "zstd-19, bytes apart": len(imagecodecs.zstd_encode(apart, 19)),
    }
    if image.dtype == np.uint16:
        actual["PNG"] = len(imagecodecs.png_encode(image.squeeze()))
    else:
        actual |= open_exr(image)
    return actual


def open_exr(image: Samples) -> dict[str, int]:
    """OpenEXR (ZIP), if the module is installed."""
    try:
        import OpenEXR
    except ImportError:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/a.exr"
        names = ("Y", "YA", "RGB", "RGBA")[image.shape[2] - 1]
        channels = {n: np.ascontiguousarray(image[:, :, c]) for c, n in enumerate(names)}
        head = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with OpenEXR.File(head, channels) as file:
            file.write(path)
        return {"OpenEXR ZIP": Path(path).stat().st_size}


def formula(image: Samples) -> str:
    """How far the paper's fourth texel is off, over the finest level."""
    if image.dtype.kind != "f":
        return ""
    below = build_pyramid(image)[-2]
    h, w = below.shape[:2]
    p, q, r, s = (image[j : 2 * h : 2, i : 2 * w : 2] for j in (0, 1) for i in (0, 1))
    with np.errstate(all="ignore"):
        guess = image.dtype.type(4) * below - p - q - r
        wrong = ~((guess == s) | (np.isnan(guess) & np.isnan(s)))
        error = np.abs(guess.astype(np.float64) - s) / np.abs(s.astype(np.float64))
        largest = np.nanmax(np.where(np.isfinite(error), error, np.nan))
    return f"paper's formula: {wrong.mean():6.1%} differ, relative error up to {largest:.1e}"


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="16-bit and float images.")
    parser.add_argument("images", nargs="*", type=Path)
    parser.add_argument("--fetch", action="store_true", help="download the panoramas first")
    given = parser.parse_args()
    if given.fetch:
        fetch_panoramas()
    images = made()
    for file in given.images or sorted((OUTPUT / "hdr").glob("*.*")):
        images[file.name] = load_image(file).array()
    exact(next(iter(images.values()))[:64, :64], "fast")
    for name, image in images.items():
        print(f"{name}, {image.shape[1]} x {image.shape[0]} x {image.shape[2]}")
        for profile in ("raw", "fast", "small"):
            size, encoding, decoding = exact(image, profile)
            speed = f"{image.nbytes / encoding / 1e6:6.1f} / {image.nbytes / decoding / 1e6:6.1f}"
            print(f"  {'ptm ' + profile:22} {size / image.nbytes:7.4f}  {speed} MB/s", flush=True)
        for rival, size in rivals(image).items():
            print(f"  {rival:22} {size / image.nbytes:7.4f}")
        if formulas := formula(image):
            print(f"  {formulas}")


if __name__ == "__main__":
    main()
