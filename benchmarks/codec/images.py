"""The images that the benchmarks of the codec run on, and how they take time."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from numpy.typing import NDArray

from ptmtools.texture import read_image

ROOT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("PTM_SHARED", ROOT.parent / "shared"))
#: Where figures and generated images go.
OUTPUT = ROOT / "build" / "bench"
SUFFIXES = {".png", ".jpg", ".jpeg", ".tga", ".bmp", ".tif", ".tiff", ".webp"}

Result = TypeVar("Result")


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


def best(action: Callable[[], Result], repeat: int) -> tuple[float, Result]:
    """Shortest time of some repetitions, seconds, and the last result."""
    shortest = float("inf")
    for _ in range(repeat):
        start = time.perf_counter()
        result = action()
        shortest = min(shortest, time.perf_counter() - start)
    return shortest, result
