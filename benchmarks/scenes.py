"""Test models, databases and walks of the simulator's benchmarks.

    python benchmarks/scenes.py [museum rooms mixed hospital office web_gallery atrium]

builds missing databases in ``build/bench/walks``, each with three walks of 150 seconds:

museum        the sample museum (`make sample`): 12 rooms, 31 textures of 1024 × 1024 texels
rooms         a museum of 40 rooms and 120 textures of 1024 × 1024 texels
mixed         the same with random texture sides of 256, 512, 1024 and 2048 texels
hospital      of the shared data: 9 small textures, and much furniture
office        of the shared data: a floor of offices with one texture
web_gallery   40 JPEG paintings, geometry in Draco (`ptm sample web-gallery`)
atrium        one hall of 250,000 triangles, 25 textures (`ptm sample atrium`)

Two processes build scenes in parallel. The museums of 40 rooms take longest; painting their
pictures comes first.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
SHARED = Path(os.environ.get("PTM_SHARED", ROOT.parent / "shared"))
TWO_ROOMS = ROOT / "sample_data/two_rooms/two_rooms.obj"
MUSEUM = "museum"
#: OBJ files by name; `make sample` writes the museum.
MODELS = {
    MUSEUM: ROOT / "build/museum/museum.obj",
    **{
        name: SHARED / f"scenes/{name}/{name}.obj"
        for name in ("hospital", "willowgarage", "office", "gallery")
    },
}

FOLDER = ROOT / "build/bench/walks"
#: Models that `ptm sample` writes: sample and file.
SAMPLES = {
    "web_gallery": ("web-gallery", "web_gallery.glb"),
    "atrium": ("atrium", "atrium.obj"),
}
#: Sides of the textures of the museums that are made here.
SIDES = {"rooms": (1024,), "mixed": (256, 512, 1024, 2048)}
ROOMS, TEXTURES = 40, 120
SCENES = ("museum", *SIDES, "hospital")
#: Seeds of the walks, and how long each is, s.
WALKS, SECONDS = (1, 2, 3), 150
#: Per-texture hints are for the policy `ach-texture`; the fallback images are not measured, nor is
#: light, of which its own benchmark tells the cost.
BUILD = ("--per-texture", "--fallback-size", "256", "--light", "none")


def model_file(given: str) -> Path:
    """The file of a name in `MODELS`; any other text is a path."""
    return MODELS.get(given, Path(given))


def database_of(scene: str) -> Path:
    """Where the database of a scene is."""
    return FOLDER / f"{scene}.db"


def model_of(scene: str) -> Path:
    """The model of a scene; any other name is a file's."""
    if scene in SIDES:
        return FOLDER / f"{scene}/museum.obj"
    if scene in SAMPLES:
        return FOLDER / scene / SAMPLES[scene][1]
    return model_file(scene)


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
    model = model_of(scene)
    if scene in SIDES and not model.is_file():
        make_mixed(model.parent, SIDES[scene])
    if scene in SAMPLES and not model.is_file():
        ptm("sample", SAMPLES[scene][0], "-o", model.parent)
    ptm("build-scene", model, "-o", database_of(scene), *BUILD)
    for seed in WALKS:
        walk_file(scene, seed)


def make_mixed(folder: Path, sides: tuple[int, ...]) -> None:
    """Writes a museum; the side of each texture is drawn from ``sides``."""
    from ptmtools_samples.files import write
    from ptmtools_samples.museum import make_museum
    from ptmtools_samples.options import MuseumOptions

    museums = [list(make_museum(MuseumOptions(ROOMS, TEXTURES, side))) for side in sides]
    drawn = np.random.default_rng(1).integers(len(sides), size=len(museums[0]))
    write(folder, [museums[k][i] for i, k in enumerate(drawn.tolist())], force=True)


def make_scenes(scenes: Iterable[str]) -> None:
    """`make_scene`, two at a time."""
    with ProcessPoolExecutor(2) as pool:
        list(pool.map(make_scene, scenes))


def ptm(*arguments: object) -> None:
    """Runs `ptm` with those arguments and prints only its errors."""
    call = [sys.executable, "-m", "ptmtools", *map(str, arguments), "--quiet"]
    subprocess.run(call, check=True, cwd=ROOT)


if __name__ == "__main__":
    make_scenes(sys.argv[1:] or SCENES)
