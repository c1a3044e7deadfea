"""Bytes and PSNR for an allowed error d, beside JPEG-LS near and WebP near-lossless.

    python benchmarks/codec/near_lossless.py [--images 4]

Ours: the whole pyramid; PSNR and largest error of its finest level, and the largest error of all of
its levels against those of the image. JPEG-LS: subtract-green planes would let an error add up, so
each plane as it is, with the same d. WebP: `cwebp -near_lossless`, which promises no bound; its
largest error is shown. Single resolutions both. Sums over images of both sets of textures; PSNR of
the mean squared error of all of them.
"""

from __future__ import annotations

import argparse
import math
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
from images import sets
from numpy.typing import NDArray
from PIL import Image

from ptmtools.texture import EncodeOptions, build_pyramid, decode_levels, encode, read_image

Samples = NDArray[Any]
#: `cwebp -near_lossless` settings, from none to most.
NEAR_LOSSLESS = (100, 80, 60, 40, 20, 0)


class Sums:
    """Over images: bytes, squared error, samples, largest error."""

    def __init__(self) -> None:
        self.bytes = self.squares = self.samples = self.largest = 0

    def add(self, size: int, image: Samples, found: Samples) -> None:
        """One image more."""
        error = np.abs(image.astype(np.int64) - found)
        self.bytes += size
        self.squares += int((error * error).sum())
        self.samples += image.size
        self.largest = max(self.largest, int(error.max()))

    def line(self, label: str, lossless: int, more: str = "") -> str:
        """A row of the table."""
        mean = self.squares / self.samples
        psnr = f"{10 * math.log10(255**2 / mean):7.2f}" if mean else "  exact"
        share = self.bytes / lossless
        return f"{label:26} {self.bytes:12,} {share:8.3f} {psnr} {self.largest:5} {more}"


def ptm(images: list[Samples], profile: str, allowed: int) -> tuple[Sums, int]:
    """Ours, and the largest error of any level."""
    sums, worst = Sums(), 0
    for image in images:
        data = encode(image, EncodeOptions(profile, max_error=allowed))
        levels = list(decode_levels(data))
        sums.add(len(data), image, levels[-1])
        for level, exact in zip(levels, build_pyramid(image), strict=True):
            worst = max(worst, int(np.abs(level.astype(int) - exact).max()))
    return sums, worst


def jpeg_ls(images: list[Samples], allowed: int) -> Sums:
    """Plane by plane."""
    sums = Sums()
    for image in images:
        planes = [np.ascontiguousarray(image[:, :, c]) for c in range(image.shape[2])]
        coded = [imagecodecs.jpegls_encode(plane, level=allowed) for plane in planes]
        back = np.stack([imagecodecs.jpegls_decode(data) for data in coded], axis=2)
        sums.add(sum(map(len, coded)), image, back)
    return sums


def webp(images: list[Samples], setting: int) -> Sums:
    """By way of `cwebp`."""
    sums = Sums()
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "a.png", Path(folder) / "a.webp"
        for image in images:
            texels = np.repeat(image, 3, axis=2) if image.shape[2] == 1 else image
            Image.fromarray(texels).save(source)
            subprocess.run(
                ["cwebp", "-quiet", "-near_lossless", str(setting), str(source), "-o",
                 str(target)],
                check=True,
            )  # fmt: skip
            with Image.open(target) as file:
                back = np.asarray(file.convert("RGBA" if texels.shape[2] == 4 else "RGB"))
            sums.add(target.stat().st_size, texels, back)
    return sums


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="Bytes and PSNR for an allowed error.")
    parser.add_argument("--images", type=int, default=4)
    given = parser.parse_args()
    actual = sets()
    files = [*actual["Kodak"][: (given.images + 1) // 2], *actual["textures"][: given.images // 2]]
    images = [read_image(file) for file in files]
    print(f"{len(images)} images: {', '.join(file.name for file in files)}")
    print(f"{'':26} {'bytes':>12} {'of own 0':>8} {'PSNR':>7} {'max':>5}")
    for profile in ("fast", "small"):
        lossless = 0
        for allowed in (0, 1, 2, 4, 8):
            sums, worst = ptm(images, profile, allowed)
            lossless = lossless or sums.bytes
            more = f"(any level {worst})"
            print(sums.line(f"ptm {profile}, d = {allowed}", lossless, more), flush=True)
    lossless = 0
    for allowed in (0, 1, 2, 4, 8):
        sums = jpeg_ls(images, allowed)
        lossless = lossless or sums.bytes
        print(sums.line(f"JPEG-LS, near = {allowed}", lossless), flush=True)
    if not shutil.which("cwebp"):
        print("WebP near-lossless: no cwebp here (on Debian or Ubuntu: apt install webp)")
        return
    lossless = 0
    for setting in NEAR_LOSSLESS:
        sums = webp(images, setting)
        lossless = lossless or sums.bytes
        print(sums.line(f"WebP, near_lossless {setting}", lossless), flush=True)


if __name__ == "__main__":
    main()
