"""Tests a claim of the paper (§4.1): partial levels in lossless JPEG take 1 / 2.5 of their bytes.

    python benchmarks/codec/lossless_jpeg.py

For each set of images of 8 bits, the median (least to most) of: the bytes of all partial levels as
they are (profile `raw`, without remainders) over those in lossless JPEG (profile `paper`); the same
with the remainders; the image itself over one lossless JPEG of it ("2 : 1"), and over a file of the
profile `fast`. Needs ``pip install 'ptmtools[codecs]'`` and PTM_SHARED.
"""

from __future__ import annotations

import io
from statistics import median

import imagecodecs
import numpy as np
from images import sets

from ptmtools.texture import encode_to, read_header, read_image
from ptmtools.texture.model import EncodeOptions


def sizes(texels: np.ndarray, profile: str) -> tuple[int, int]:
    """Bytes of the groups of a file of one tile each, and of the remainders in them."""
    out = io.BytesIO()
    encode_to(out, texels, EncodeOptions(profile=profile))
    levels = read_header(out.getvalue()).levels
    remainders = 0
    for level in levels[1:]:
        blocks = (level.width // 2) * (level.height // 2)
        remainders += -(-blocks * texels.shape[2] // 4)
    return sum(level.length for level in levels), remainders


def main() -> None:
    print("| images | partial levels | with remainders | one lossless JPEG | `fast` |")
    print("|---|---|---|---|---|")
    for name, files in sets().items():
        rows = []
        for file in files:
            texels = read_image(file)
            texels = texels[..., None] if texels.ndim == 2 else texels
            if texels.dtype != np.uint8 or texels.shape[2] not in (1, 3):
                continue
            plain = np.ascontiguousarray(texels[..., 0] if texels.shape[2] == 1 else texels)
            whole = len(imagecodecs.jpeg8_encode(plain, lossless=True, predictor=7))
            (raw, remainders), (paper, _) = sizes(texels, "raw"), sizes(texels, "paper")
            rows.append((
                (raw - remainders) / (paper - remainders),
                raw / paper,
                texels.nbytes / whole,
                texels.nbytes / sizes(texels, "fast")[0],
            ))  # fmt: skip
        if rows:
            cells = (
                f"{median(c):.2f} ({min(c):.2f} to {max(c):.2f})" for c in zip(*rows, strict=True)
            )
            print(f"| {len(rows)} of {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
