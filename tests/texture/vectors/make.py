"""Writes the frozen files of this folder: run once for each new version of the format or a profile.

    python tests/texture/vectors/make.py

Files that are there are never written again: they must decode for ever. ``digests.json`` holds the
SHA-256 of the texels of every level of each, taken from the pyramid and not from a decoder.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture import EncodeOptions, build_pyramid, encode

HERE = Path(__file__).resolve().parent


def noise(shape: tuple[int, ...], seed: int) -> NDArray[np.int64]:
    """A linear congruential generator: the same numbers with every version of numpy."""
    state, out = seed, []
    for _ in range(int(np.prod(shape))):
        state = (state * 1103515245 + 12345) & 0x7FFFFFFF
        out.append(state >> 16)
    return np.array(out).reshape(shape)


def photo(height: int, width: int, components: int, seed: int = 1) -> NDArray[np.uint8]:
    """Ramps, an edge and noise; components alike but not the same."""
    y, x = np.mgrid[:height, :width]
    ramp = (3 * x + 2 * y) // 4 + np.where(x + 2 * y > width, 70, 0)
    own = noise((height, width, components), seed) % 7
    return np.clip(ramp[:, :, None] + own + 9 * np.arange(components), 0, 255).astype(np.uint8)


def images() -> dict[str, tuple[NDArray[np.uint8], EncodeOptions]]:
    """Name of each file, its image and options."""
    fast, raw = EncodeOptions("fast"), EncodeOptions("raw")
    palette = np.array([[12, 200, 7], [250, 250, 250], [0, 0, 90], [130, 40, 40]], np.uint8)
    spikes = photo(40, 44, 3)
    spikes[::7, ::9] = (noise((6, 5, 3), 3) % 256).astype(np.uint8)
    return {
        "raw-grey-1x1": (photo(1, 1, 1), raw),
        "raw-greyalpha-6x9": (photo(6, 9, 2), raw),
        "raw-rgb-17x10": (photo(17, 10, 3), raw),
        "raw-rgba-8x8": (photo(8, 8, 4), raw),
        "fast-grey-64x70": (photo(70, 64, 1), fast),
        "fast-greyalpha-33x31": (photo(31, 33, 2), fast),
        "fast-rgb-97x83": (photo(83, 97, 3), fast),
        "fast-rgba-40x36": (photo(36, 40, 4), fast),
        "fast-rgb-ranks": (photo(80, 80, 3) // 6 * 6, fast),
        "fast-rgb-escapes": (spikes, fast),
        "fast-rgb-flat": (np.full((50, 41, 3), 77, np.uint8), fast),
        "fast-rgb-palette": (palette[noise((45, 50), 5) % 16 // 5], fast),
        "fast-grey-noise": ((noise((40, 40), 7) % 256).astype(np.uint8), fast),
        "fast-grey-line": (photo(1, 90, 1), fast),
        "fast-rgb-min-side": (photo(64, 48, 3), EncodeOptions("fast", min_side=12)),
        "raw-rgb-max-side": (photo(30, 47, 3), EncodeOptions("raw", max_side=24)),
    }


def main() -> None:
    """Writes what is missing."""
    digests_file = HERE / "digests.json"
    digests = json.loads(digests_file.read_text()) if digests_file.exists() else {}
    for name, (image, options) in images().items():
        file = HERE / f"{name}.ptm"
        if file.exists():
            continue
        file.write_bytes(encode(image, options))
        levels = build_pyramid(image, options.min_side)
        kept = [level for level in levels if max(level.shape[:2]) <= (options.max_side or 1 << 16)]
        digests[name] = [hashlib.sha256(level.tobytes()).hexdigest() for level in kept]
    digests_file.write_text(json.dumps(digests, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
