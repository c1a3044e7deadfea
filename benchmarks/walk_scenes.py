"""The databases and walks that the walkthrough is measured on: ``python benchmarks/walk_scenes.py``

museum        the sample museum (`make sample`): 12 rooms, 31 textures of 1024 × 1024 texels
rooms         a museum of 40 rooms and 120 textures of 1024 × 1024 texels
mixed         the same, the side of each texture drawn from 256, 512, 1024 and 2048 texels
hospital      of the shared data: 9 small textures, and much furniture

Each with three walks of 150 seconds. What is missing is made in ``build/bench/walks``, two scenes
at a time; the museums of 40 rooms take most of it, since their pictures are painted first.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from at_hand import MODELS, ROOT

FOLDER = ROOT / "build/bench/walks"
#: Sides of the textures of the museums that are made here.
SIDES = {"rooms": (1024,), "mixed": (256, 512, 1024, 2048)}
ROOMS, TEXTURES = 40, 120
SCENES = ("museum", *SIDES, "hospital")
#: Seeds of the walks, and how long each is, s.
WALKS, SECONDS = (1, 2, 3), 150
#: What clients other than the default ones need; browsers without a decoder are not measured.
BUILD = ("--per-texture", "--fallback-size", "256")


def database_of(scene: str) -> Path:
    """Where the database of a scene is."""
    return FOLDER / f"{scene}.db"


def walk_file(scene: str, seed: int, seconds: int = SECONDS) -> Path:
    """A walk through a scene; it is made if it is missing or older than the database."""
    database = database_of(scene)
    file = FOLDER / f"{scene}-{seed}-{seconds}.json"
    built = (database / "manifest.json").stat().st_mtime
    if not file.is_file() or file.stat().st_mtime < built:
        ptm("path", database, "-o", file, "--seed", seed, "--duration", seconds, "--force")
    return file


def make_scene(scene: str) -> None:
    """Makes the model, the database and the walks of a scene, or brings them up to date."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    model = FOLDER / f"{scene}/museum.obj" if scene in SIDES else MODELS[scene]
    if scene in SIDES and not model.is_file():
        make_mixed(model.parent, SIDES[scene])
    ptm("build-scene", model, "-o", database_of(scene), *BUILD)
    for seed in WALKS:
        walk_file(scene, seed)


def make_mixed(folder: Path, sides: tuple[int, ...]) -> None:
    """A museum of which each texture has one of so many sides."""
    sys.path.insert(0, str(ROOT / "sample_data"))
    from make_museum import MuseumOptions, make_museum, write

    museums = [list(make_museum(MuseumOptions(ROOMS, TEXTURES, side))) for side in sides]
    drawn = np.random.default_rng(1).integers(len(sides), size=len(museums[0]))
    write(folder, [museums[k][i] for i, k in enumerate(drawn.tolist())], force=True)


def make_scenes(scenes: Iterable[str]) -> None:
    """`make_scene`, two at a time."""
    with ProcessPoolExecutor(2) as pool:
        list(pool.map(make_scene, scenes))


def ptm(*arguments: object) -> None:
    """Runs the command; what it says is not shown, but for errors."""
    call = [sys.executable, "-m", "ptmtools", *map(str, arguments), "--quiet"]
    subprocess.run(call, check=True, cwd=ROOT)


if __name__ == "__main__":
    make_scenes(sys.argv[1:] or SCENES)
