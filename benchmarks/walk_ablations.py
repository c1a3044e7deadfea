"""What each hint, and each part of the best policy, is worth to the walker.

    python benchmarks/walk_ablations.py DB… [--walks 3] [--seconds 150]

The policy `best` walks through each database, built with `--first-look 64`, and then without one
thing at a time, over links of 56 kbit/s, 512 kbit/s and 4 Mbit/s with texture memory of a tenth of
all textures. Printed are what each hint takes in the index and the records, gzipped, and the mean
errors of the picture, over all walks, each beside that of `best`. Below, the policy `ach` with
coverage hints from fewer and from more sample points, beside those of the database, and the
processor seconds that these take (`benchmarks/need.py` has those of `need`).
"""

from __future__ import annotations

import argparse
import json
import time
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.coverage.ach import compute_ach
from ptmtools.coverage.options import AchOptions
from ptmtools.pipeline import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stages import APO, CELLS, PVS
from ptmtools.walkthrough.client import Client
from ptmtools.walkthrough.network import Conditions, Link
from ptmtools.walkthrough.path.options import PathOptions
from ptmtools.walkthrough.path.through import path_through
from ptmtools.walkthrough.policies import POLICIES, Declared, Knows
from ptmtools.walkthrough.policies.around import (
    by_distance,
    by_need,
    geometry_by_coverage,
)
from ptmtools.walkthrough.policies.best import BEST, SHARE, by_both
from ptmtools.walkthrough.policies.engine import (
    RANGE_BYTES,
    RANGE_SECONDS,
    EngineClient,
    Policy,
    Worth,
)
from ptmtools.walkthrough.policies.screen import Screen
from ptmtools.walkthrough.request import Request
from ptmtools.walkthrough.served import read_served
from ptmtools.walkthrough.simulation import simulate
from ptmtools.walkthrough.view.pyramids import read_pyramids
from ptmtools.walkthrough.view.records import Pyramids
from ptmtools.walkthrough.weighing import by_pixels
from ptmtools.walkthrough.world import World, prepare

#: Links, bit/s, and share of all textures that fits into memory.
LINKS, MEMORY = (56e3, 512e3, 4e6), 0.1
#: Sample points of coverage hints.
POINTS = (1, 8, 64, 512)
#: Frames that an old item buffer is behind: a second.
OLD = 5


@dataclass(frozen=True)
class Variant:
    """A client, and a change of the world that it walks through."""

    name: str
    client: Callable[[World, Link, int], Client]
    change: Callable[[World], World] = lambda world: world


def engine(policy: Policy) -> Callable[[World, Link, int], Client]:
    """A client of the engine with a policy."""
    return lambda world, link, budget: EngineClient(world, link, budget, policy)


class Covered(Screen):
    """`best` that sees no placeholders: geometry by average coverage."""

    def __call__(self, client: EngineClient) -> Worth:
        return replace(super().__call__(client), geometry=geometry_by_coverage(client))


class FirstLook(EngineClient):
    """`best` that asks for the bundle of the first cell before any texture: for as much of it as a
    range has, or for all of it."""

    most: float | None = None

    def __init__(self, world: World, link: Link, budget: int) -> None:
        super().__init__(world, link, budget, BEST)
        self._bundle: Request | None = None
        self._pieces: list[Any] = []

    def arrived(self, request: Request) -> None:
        if request is not self._bundle:
            super().arrived(request)
            return
        self.waiting.remove(request)
        for part in self._pieces:
            self.textures.arrived(part)

    def _fetch_one(self) -> bool:
        if self._bundle is None and self.cell >= 0 and self.geometry.asked[self.cell]:
            ends = self._ends()
            self._pieces = [self.textures.ask(t, end) for t, end in ends.items()]
            self._bundle = self.link.request(sum(ends.values()), 1.0, None)
            self.waiting.append(self._bundle)
            return True
        return super()._fetch_one()

    def _ends(self) -> dict[int, int]:
        """Where the part of the bundle that is asked for ends in each texture."""
        stock = self.world.catalogue
        most = self.most or max(RANGE_BYTES, RANGE_SECONDS * self.estimate.bandwidth / 8)
        ends: dict[int, int] = {}
        size = 0
        for t, level in stock.records[self.cell]["firstLook"]:
            end = int(stock.ends[t, level + 1])
            size += end - ends.get(t, 0)
            if size > most:
                break
            ends[t] = end
        return ends


class WholeFirstLook(FirstLook):
    """All of the bundle."""

    most = np.inf


def grey(world: World) -> World:
    """Without mean colours."""
    return replace(world, colored=False)


def plain_geometry(world: World) -> World:
    """Geometry as it lies, not compressed on the link."""
    template = world.served.index["geometry"]["gltf"]
    names = [cell["name"] for cell in world.served.index["cells"]]
    files = [world.served.folder / template.replace("{name}", name) for name in names]
    sizes = np.array([file.stat().st_size for file in files], dtype=np.int64)
    return replace(world, catalogue=replace(world.catalogue, geometry_bytes=sizes))


def nearly_free(world: World) -> World:
    """Records and geometry of a byte each, which come after the latency."""
    stock = world.catalogue
    geometry, records = np.ones_like(stock.geometry_bytes), np.ones_like(stock.record_bytes)
    return replace(world, catalogue=replace(stock, geometry_bytes=geometry, record_bytes=records))


def squared(world: World) -> World:
    """Root mean squares of the levels' differences in place of their means."""
    pyramids, stock = world.pyramids, world.catalogue
    found = np.zeros(stock.differences.shape)
    for t in range(stock.texture_count):
        below = None
        for n in range(int(pyramids.levels[t])):
            level = texels(pyramids, t, n)
            if below is not None:
                row = np.minimum(np.arange(level.shape[0]) // 2, below.shape[0] - 1)
                column = np.minimum(np.arange(level.shape[1]) // 2, below.shape[1] - 1)
                found[t, n + 1] = np.sqrt(((level - below[row][:, column]) ** 2).mean())
            below = level
    return replace(world, catalogue=replace(stock, differences=found))


def texels(pyramids: Pyramids, texture: int, level: int) -> Floats:
    """(h, w, 3) of a level."""
    width, height = pyramids.size[texture, level].tolist()
    start = int(pyramids.start[texture, level])
    part = pyramids.texel[start : start + width * height * 3]
    return part.reshape(height, width, 3).astype(np.float32)


VARIANTS = (
    Variant("best", engine(BEST)),
    Variant("without `differences`: all levels count the same", engine(
        Screen(by_both, SHARE, weighing=by_pixels)
    )),
    Variant("root mean squares in place of `differences`", engine(BEST), squared),
    Variant("without `color`: grey until the first level", engine(BEST), grey),
    Variant("without `need`", engine(Screen(by_distance, SHARE))),
    Variant("`need` without distance", engine(Screen(by_need, SHARE))),
    Variant("nothing of what lies around", engine(Screen())),
    Variant("no placeholders: geometry by `ach`", engine(Covered(by_both, SHARE))),
    Variant("an item buffer a second old", engine(Screen(by_both, SHARE, age=OLD))),
    Variant("with a range of `firstLook` in the first cell", FirstLook),
    Variant("with all of `firstLook` in the first cell", WholeFirstLook),
    Variant("geometry not compressed", engine(BEST), plain_geometry),
    Variant("records and geometry of a byte each", engine(BEST), nearly_free),
)  # fmt: skip


def walked(worlds: Sequence[World], client: Callable[[World, Link, int], Client]) -> Floats:
    """Mean errors by link."""
    declared = Declared("variant", "", Knows.SCREEN, client)
    return np.array(
        [
            np.mean(
                [
                    simulate(
                        world, declared, Conditions(link), int(MEMORY * world.catalogue.whole)
                    ).error.mean()
                    for world in worlds
                ]
            )
            for link in LINKS
        ]
    )


def with_points(world: World, made: Artifacts, points: int) -> tuple[World, float]:
    """The world with coverage hints from so many sample points, and the seconds these took."""
    scene, cells, pvs = made[APO], made[CELLS], made[PVS]
    start = time.process_time()
    ach = compute_ach(scene, cells, pvs, AchOptions(samples=points, backend="embree"))
    seconds = time.process_time() - start
    records = tuple(
        {**record, "ach": ach.row(c).tolist(), "floor": float(ach.floor[c])}
        for c, record in enumerate(world.catalogue.records)
    )
    return replace(world, catalogue=replace(world.catalogue, records=records)), seconds


def taken(documents: Sequence[Any], name: str) -> int:
    """Bytes, gzipped, that a field takes in documents, or in the rows of one."""

    def size(document: Any) -> int:
        return len(zlib.compress(json.dumps(document, separators=(",", ":")).encode(), 9))

    def without(document: Any) -> Any:
        if isinstance(document, dict):
            return {k: without(v) for k, v in document.items() if k != name}
        return [without(v) for v in document] if isinstance(document, list) else document

    return sum(size(document) - size(without(document)) for document in documents)


def printed(name: str, errors: Floats, base: Floats) -> None:
    """A row."""
    row = (f"{e:.3f} ({e / b - 1:+.1%})" for e, b in zip(errors, base, strict=True))
    print(f"| {name} | {' | '.join(row)} |", flush=True)


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("db", nargs="+")
    parser.add_argument("--walks", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=150.0)
    parser.add_argument("--only", default="", help="only variants that contain this")
    given = parser.parse_args()
    worlds: list[World] = []
    sources: list[Artifacts] = []
    for db in given.db:
        made, served = Artifacts(open_database(db)), read_served(db)
        pyramids = read_pyramids(served)
        for seed in range(1, given.walks + 1):
            options = PathOptions(seed=seed, duration=given.seconds)
            walk = path_through(made, options).walk
            worlds.append(prepare(served, walk, pyramids))
            sources.append(made)
        index, records = [served.index], list(served.records)
        sizes = {n: taken(index, n) for n in ("differences", "color")}
        sizes |= {n: taken(records, n) for n in ("need", "firstLook")}
        print(f"{db}: " + ", ".join(f"{n} {size} B" for n, size in sizes.items()))
    head = " | ".join(f"{link / 1e3:g} kbit/s" for link in LINKS)
    print(f"\n| best, and without | {head} |\n|---|{'---|' * len(LINKS)}")
    base = walked(worlds, VARIANTS[0].client)
    for variant in (v for v in VARIANTS if given.only in v.name):
        errors = walked([variant.change(world) for world in worlds], variant.client)
        printed(variant.name, errors, base)
    if given.only:
        return
    print(f"\n| ach of so many points | {head} | s |\n|---|{'---|' * (len(LINKS) + 1)}")
    client = POLICIES["ach"].client
    base = walked(worlds, client)
    for points in POINTS:
        changed = [with_points(w, made, points) for w, made in zip(worlds, sources, strict=True)]
        errors = walked([world for world, _ in changed], client)
        seconds = sum(s for _, s in changed) / given.walks
        row = (f"{e:.3f} ({e / b - 1:+.1%})" for e, b in zip(errors, base, strict=True))
        print(f"| {points} | {' | '.join(row)} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main()
