"""Models before their damage: made buildings, and pieces of real scenes.

A base is a function of a random generator, so that inputs of one base differ before any damage: a
building of a group, or another piece of a scene. A piece is made of the triangles nearest to one of
the scene's own, and keeps the names of objects.

Real scenes lie in the folder that ``PTM_SHARED`` names; without it there are the made bases only.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.fuzz.soup import Soup
from ptmtools.scene import IngestOptions, ingest

ROOT = Path(__file__).resolve().parents[2]
SHARED = Path(os.environ.get("PTM_SHARED", ROOT.parent / "shared"))
SCENES = {
    "hospital": "hospital/hospital.obj",
    "willow": "willowgarage/willowgarage.obj",
    "hall": "gallery/gallery.obj",
    "office": "office/office.obj",
    "flat": "apartment_gallery/gallery.glb",
    "cave": "cave/cave.glb",
}
#: Triangles of a made building at most.
LARGEST = 500
#: Triangles of a piece of a scene.
FEWEST, MOST = 40, 300

Base = Callable[[np.random.Generator], Soup]


def _building(group: str, rng: np.random.Generator) -> Soup:
    """One of the buildings of the tests, whose expected cells are known there."""
    buildings = _buildings()[group]
    return buildings[rng.integers(len(buildings))]


@lru_cache(maxsize=1)
def _buildings() -> Mapping[str, list[Soup]]:
    from tests.cells import closed_doors, small_buildings

    groups = {
        "rooms": small_buildings.ROOMS,
        "heights": small_buildings.HEIGHTS,
        "hollows": small_buildings.NO_PLACES,
        "models": small_buildings.MODELS,
        "doors": closed_doors.DOORS,
    }
    made = {}
    for group, cases in groups.items():
        models = [case.model for case in cases.values()]
        parts = [model if isinstance(model, dict) else {"building": model} for model in models]
        soups = [Soup.of_parts(part, up="z") for part in parts]
        made[group] = [soup for soup in soups if len(soup) <= LARGEST]
    return made


def _two_rooms(rng: np.random.Generator) -> Soup:
    return _read(ROOT / "sample_data/two_rooms/two_rooms.obj")


def _museum(rng: np.random.Generator) -> Soup:
    """A piece of the sample museum, with pictures and furniture."""
    return _piece(_whole_museum(int(rng.integers(4))), rng)


@lru_cache(maxsize=4)
def _whole_museum(seed: int) -> Soup:
    from ptmtools_samples.furnishing import furnish, hang
    from ptmtools_samples.plan import make_plan
    from ptmtools_samples.shell import make_shell

    plan = make_plan(5, np.random.default_rng(seed))
    shell, panels = make_shell(plan)
    hung = hang(panels, [1.4] * 6, 5, np.random.default_rng(seed))
    parts: dict[str, list[list[tuple[float, float, float]]]] = {}
    for thing in (*shell, *hung, *furnish(plan, np.random.default_rng(seed))):
        fans = parts.setdefault(thing.name, [])
        for face in thing.faces:
            first, *rest = face.points
            fans += [[first, a, b] for a, b in pairwise(rest)]
    return Soup.of_parts({name: np.array(fans) for name, fans in parts.items() if fans})


def _scene(file: Path, rng: np.random.Generator) -> Soup:
    return _piece(_read(file), rng)


@lru_cache(maxsize=2)
def _read(file: Path) -> Soup:
    """A model as ingest reads it, in metres, Y up."""
    scene = ingest(file, IngestOptions())
    names = tuple(f"{i} {name}".replace("\n", " ") for i, name in enumerate(scene.objects))
    of = np.asarray(scene.triangle_object, dtype=np.int64)
    return Soup(scene.corners, of, names, np.zeros(len(of), dtype=np.int64))


def _piece(whole: Soup, rng: np.random.Generator) -> Soup:
    """The triangles whose boxes are nearest to a point of one of them."""
    count = int(np.exp(rng.uniform(np.log(FEWEST), np.log(MOST))))
    middle = whole.corners[rng.integers(len(whole))].mean(axis=0)
    low, high = whole.corners.min(axis=1), whole.corners.max(axis=1)
    away = np.maximum(np.maximum(low - middle, middle - high), 0.0).max(axis=1)
    rows = np.argsort(away, kind="stable")[:count]
    return whole.take(np.sort(rows))


#: By name.
BASES: dict[str, Base] = {
    **{name: partial(_building, name) for name in ("rooms", "heights", "hollows", "models")},
    "doors": partial(_building, "doors"),
    "two_rooms": _two_rooms,
    "museum": _museum,
    **{
        name: partial(_scene, SHARED / "scenes" / file)
        for name, file in SCENES.items()
        if (SHARED / "scenes" / file).is_file()
    },
}
