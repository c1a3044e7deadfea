"""Writes the frozen files of a version of the format: run once for each new profile or kind.

    python tests/texture/vectors/make.py

Files that are there are never written again: they must decode for ever. ``digests.json`` holds the
SHA-256 of the texels of every level of each: taken from the pyramid and not from a decoder, unless
an error was allowed; then the decoded levels are first held against the pyramid.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.texture import EncodeOptions, build_pyramid, decode_levels, encode
from ptmtools.texture.container import VERSION

HERE = Path(__file__).resolve().parent / f"v{VERSION}"
Samples = NDArray[Any]


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


def deep(height: int, width: int, components: int) -> NDArray[np.uint16]:
    """The same in 16 bits."""
    low = noise((height, width, components), 9) % 200
    return (photo(height, width, components).astype(np.int64) * 250 + low).astype(np.uint16)


def real(height: int, width: int, components: int, dtype: str) -> Samples:
    """Magnitudes over many powers of two, with all that is special in a float."""
    power = noise((height, width, components), 4) % 24 - 12
    image = (photo(height, width, components) / 16.0 * 2.0**power).astype(dtype)
    specials = [np.nan, np.inf, -np.inf, -0.0, np.finfo(dtype).smallest_subnormal, -1.5]
    image.reshape(-1)[3 : 3 + 7 * len(specials) : 7] = specials
    return image


def images() -> dict[str, tuple[Samples, EncodeOptions]]:
    """Name of each file, its image and options."""
    palette = np.array([[12, 200, 7], [250, 250, 250], [0, 0, 90], [130, 40, 40]], np.uint8)
    spikes = photo(40, 44, 3)
    spikes[::7, ::9] = (noise((6, 5, 3), 3) % 256).astype(np.uint8)
    tile = photo(12, 10, 3)
    actual: dict[str, tuple[Samples, EncodeOptions]] = {
        "paper-rgb-17x10": (photo(17, 10, 3), EncodeOptions("paper")),
        "paper-deep-9x14": (deep(9, 14, 1), EncodeOptions("paper")),
    }
    for profile in ("raw", "fast", "small"):
        kinds: dict[str, tuple[Samples, dict[str, int]]] = {
            "grey-1x1": (photo(1, 1, 1), {}),
            "grey-line": (photo(1, 90, 1), {}),
            "grey-33x31": (photo(31, 33, 1), {}),
            "greyalpha-27x30": (photo(30, 27, 2), {}),
            "rgb-49x38": (photo(38, 49, 3), {}),
            "rgba-24x21": (photo(21, 24, 4), {}),
            "deep-grey-31x22": (deep(22, 31, 1), {}),
            "deep-rgb-20x20": (deep(20, 20, 3), {}),
            "half-rgb-21x17": (real(17, 21, 3, "float16"), {}),
            "float-greyalpha-19x22": (real(22, 19, 2, "float32"), {}),
            "rgb-tiles": (photo(70, 41, 3), {"tile": 16}),
            "rgb-trimmed": (photo(40, 47, 3), {"min_level": 1, "max_level": -2}),
        }
        if profile != "raw":
            kinds |= {
                "rgb-ranks": (photo(64, 64, 3) // 6 * 6, {}),
                "rgb-escapes": (spikes, {}),
                "rgb-flat": (np.full((50, 41, 3), 77, np.uint8), {}),
                "rgb-palette": (palette[noise((45, 50), 5) % 16 // 5], {}),
                "rgb-repeats": (np.tile(tile, (4, 5, 1)), {}),
                "grey-noise": ((noise((28, 28), 7) % 256).astype(np.uint8), {}),
                "deep-flat": (np.full((21, 20, 1), 40000, np.uint16), {}),
                "rgb-error-2": (photo(38, 49, 3), {"max_error": 2}),
                "deep-error-300": (deep(22, 31, 3), {"max_error": 300}),
            }
        for name, (image, options) in kinds.items():
            actual[f"{profile}-{name}"] = image, EncodeOptions(profile, **options)
    return actual


def expected(image: Samples, options: EncodeOptions, data: bytes) -> list[Samples]:
    """The levels that the file must hold."""
    exact = build_pyramid(image if image.ndim == 3 else image[:, :, None])
    exact = exact[options.min_level : len(exact) + 1 + options.max_level]
    if not options.max_error:
        return exact
    levels = list(decode_levels(data))
    for level, wanted in zip(levels, exact, strict=True):
        assert np.abs(level.astype(np.int64) - wanted).max() <= options.max_error
    return levels


def main() -> None:
    """Writes what is missing."""
    HERE.mkdir(exist_ok=True)
    digests_file = HERE / "digests.json"
    digests = json.loads(digests_file.read_text()) if digests_file.exists() else {}
    for name, (image, options) in images().items():
        file = HERE / f"{name}.ptm"
        if file.exists():
            continue
        data = encode(image, options)
        levels = expected(image, options, data)
        digests[name] = [hashlib.sha256(level.tobytes()).hexdigest() for level in levels]
        file.write_bytes(data)
    digests_file.write_text(json.dumps(digests, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
