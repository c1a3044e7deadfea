"""The test models, and where they are."""

from __future__ import annotations

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SHARED = Path(os.environ.get("PTM_SHARED", ROOT.parent / "shared"))
TWO_ROOMS = ROOT / "sample_data/two_rooms/two_rooms.obj"
MUSEUM = "museum"
#: By name; `make sample` makes the museum.
MODELS = {
    MUSEUM: ROOT / "build/museum/museum.obj",
    **{
        name: SHARED / f"scenes/{name}/{name}.obj"
        for name in ("hospital", "willowgarage", "office", "gallery")
    },
}


def model_file(given: str) -> Path:
    """The file that a name of `MODELS`, or else a path, stands for."""
    return MODELS.get(given, Path(given))
