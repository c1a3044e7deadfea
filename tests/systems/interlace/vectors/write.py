"""Writes the frozen folders that are not there yet, and the digests of their steps:

    PYTHONPATH=. python tests/systems/interlace/vectors/write.py

What is there is never written again: it must decode for ever.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from ptmtools.texture import Picture
from ptmtools_systems.interlace import (
    InterlaceOptions,
    deinterlace,
    interlace,
    read_manifest,
    write_folder,
)
from tests.systems.interlace.folders import image

VECTORS = Path(__file__).resolve().parent
#: Name → height, width, components, kind, container, minimum.
MADE = {
    "rgb": (32, 32, 3, "uint8", "png", 4),
    "grey": (16, 16, 1, "uint8", "png", 4),
    "grey-alpha": (8, 8, 2, "uint8", "png", 2),
    "rgb16": (16, 32, 3, "uint16", "png", 4),
    "rgba16": (8, 8, 4, "uint16", "png", 2),
    "wide": (8, 128, 3, "uint8", "png", 2),
    "tall": (64, 4, 4, "uint8", "png", 1),
    "scaled": (25, 45, 3, "uint8", "png", 4),
    "single": (8, 8, 3, "uint8", "png", 8),
    "rgb-webp": (32, 16, 3, "uint8", "webp", 4),
    "grey-alpha-webp": (8, 16, 2, "uint8", "webp", 2),
}


def digests(folder: Path) -> list[str]:
    """SHA-256 of the texels after each step, 16-bit samples little endian."""
    actual = []
    for step in range(1, len(read_manifest(folder).parts) + 1):
        texels = deinterlace(folder, step)
        little = texels.astype(texels.dtype.newbyteorder("<"), copy=False)
        actual.append(hashlib.sha256(little.tobytes()).hexdigest())
    return actual


def main() -> None:
    known = VECTORS / "digests.json"
    every = json.loads(known.read_text()) if known.exists() else {}
    for name, (height, width, components, kind, format, smallest) in MADE.items():
        if name not in every:
            texels = image(height, width, components, kind)
            written = interlace(Picture(texels), InterlaceOptions(smallest, format))
            write_folder(VECTORS / name, written)
            every[name] = digests(VECTORS / name)
    known.write_text(json.dumps(every, indent=1) + "\n")


if __name__ == "__main__":
    main()
