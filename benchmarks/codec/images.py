"""The images that the benchmarks of the codec run on."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ptmtools.texture import read_image

ROOT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("PTM_SHARED", ROOT.parent / "shared"))
#: Where figures and generated images go.
OUTPUT = ROOT / "build" / "bench"
SUFFIXES = {".png", ".jpg", ".jpeg", ".tga", ".bmp", ".tif", ".tiff", ".webp"}


def image_files(folder: Path) -> list[Path]:
    """Every image under a folder, in order."""
    return sorted(file for file in folder.rglob("*") if file.suffix.lower() in SUFFIXES)


def sets() -> dict[str, list[Path]]:
    """The sets of images that sizes are summed over."""
    textures = image_files(SHARED / "textures")
    return {
        "Kodak": [file for file in textures if file.name.startswith("kodim")],
        "textures": [file for file in textures if not file.name.startswith("kodim")],
        "scenes": image_files(SHARED / "scenes"),
    }


def sample(name: str = "kodim05.png") -> NDArray[Any]:
    """One of the images."""
    return read_image(SHARED / "textures" / name)
