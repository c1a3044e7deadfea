"""Size and speed of the texture codec beside PNG, on a folder of images, in one run.

    python benchmarks/codec.py [FOLDER] [--repeat 3]

For every image: bytes of the whole pyramid in both profiles over the bytes of Pillow's PNG (default
settings) of the finest level alone, and MB/s of encoding and decoding the finest level with all
below it, both counted in bytes of the finest level. Times are the best of the repetitions: only
their ratios within one run mean something. The first image is coded once before, so that compiling
is not counted.
"""

from __future__ import annotations

import argparse
import io
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ptmtools.errors import InputError
from ptmtools.texture import EncodeOptions, decode, encode, read_image
from ptmtools.texture.images import png_bytes

SHARED = Path(os.environ.get("PTM_SHARED", Path(__file__).resolve().parents[2] / "shared"))
SUFFIXES = {".png", ".jpg", ".jpeg", ".tga", ".bmp", ".tif", ".tiff", ".webp"}
CODECS: dict[str, tuple[Callable[[NDArray[np.uint8]], bytes], Callable[[bytes], object]]] = {
    "png": (png_bytes, lambda data: np.asarray(Image.open(io.BytesIO(data)))),
    "raw": (lambda image: encode(image, EncodeOptions("raw")), decode),
    "fast": (lambda image: encode(image, EncodeOptions("fast")), decode),
}


def best(action: Callable[[], object], repeat: int) -> tuple[float, object]:
    """Shortest time of some repetitions, seconds, and the last result."""
    shortest, result = float("inf"), None
    for _ in range(repeat):
        start = time.perf_counter()
        result = action()
        shortest = min(shortest, time.perf_counter() - start)
    return shortest, result


def measure(image: NDArray[np.uint8], repeat: int) -> dict[str, tuple[int, float, float]]:
    """Per codec: bytes, seconds to encode, seconds to decode. Checks what comes back."""
    found = {}
    for name, (encoder, decoder) in CODECS.items():
        encoding, data = best(lambda encoder=encoder: encoder(image), repeat)  # type: ignore[misc]
        assert isinstance(data, bytes)
        decoding, back = best(
            lambda decoder=decoder, data=data: decoder(data),  # type: ignore[misc]
            repeat,
        )
        if not np.array_equal(np.asarray(back).reshape(image.shape), image):
            sys.exit(f"{name} is not lossless")
        found[name] = (len(data), encoding, decoding)
    return found


def line(label: str, bytes_raw: int, found: dict[str, tuple[int, float, float]]) -> str:
    """One row of the table."""
    png = found["png"][0]
    cells = [f"{label[:28]:28}", f"{png:12,}"]
    cells += [f"{found[name][0] / png:8.3f}" for name in ("raw", "fast")]
    for name in CODECS:
        _, encoding, decoding = found[name]
        cells.append(f"{bytes_raw / encoding / 1e6:7.1f}/{bytes_raw / decoding / 1e6:6.1f}")
    return " ".join(cells)


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="Size and speed of the texture codec beside PNG.")
    parser.add_argument("folder", nargs="?", type=Path, default=SHARED / "textures")
    parser.add_argument("--repeat", type=int, default=3, help="repetitions; the best counts")
    arguments = parser.parse_args()
    files = sorted(file for file in arguments.folder.rglob("*") if file.suffix.lower() in SUFFIXES)
    if not files:
        sys.exit(f"no images in {arguments.folder}")
    print(f"{'':28} {'PNG bytes':>12} {'raw/PNG':>8} {'fast/PNG':>8}", end="")
    print("".join(f" {name + ' MB/s e/d':>14}" for name in CODECS))
    totals: dict[str, dict[str, tuple[int, float, float]]] = {}
    sizes: dict[str, int] = {}
    for number, file in enumerate(files):
        try:
            image = read_image(file)
        except InputError as error:
            print(error, file=sys.stderr)
            continue
        if number == 0:
            measure(image, 1)
        found = measure(image, arguments.repeat)
        print(line(str(file.relative_to(arguments.folder)), image.size, found), flush=True)
        for group in ("all", "kodim*" if file.name.startswith("kodim") else "others"):
            sum_so_far = totals.get(group, dict.fromkeys(CODECS, (0, 0.0, 0.0)))
            totals[group] = {
                name: tuple(a + b for a, b in zip(sum_so_far[name], found[name], strict=True))  # type: ignore[misc]
                for name in CODECS
            }
            sizes[group] = sizes.get(group, 0) + image.size
    for group in sorted(totals):
        print(line(f"total, {group}", sizes[group], totals[group]))


if __name__ == "__main__":
    main()
