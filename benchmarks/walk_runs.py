"""Runs of clients along walks, kept in a file of JSON lines: a run that is there is not made again.

A run is known by what it depends on: the sources of the simulator, the manifest of the database,
the walk, the policy, the link and the memory. Rows of other sources stay in the file, unread.
"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import cache, lru_cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from at_hand import ROOT
from walk_scenes import database_of, walk_file

from ptmtools.quantities import parse_bandwidth, parse_memory
from ptmtools.walkthrough.comparing import budget_of
from ptmtools.walkthrough.measures import STANDS, measure
from ptmtools.walkthrough.network import Conditions
from ptmtools.walkthrough.policies import POLICIES
from ptmtools.walkthrough.served import Served, read_served
from ptmtools.walkthrough.simulation import simulate
from ptmtools.walkthrough.view.pyramids import read_pyramids
from ptmtools.walkthrough.view.records import Pyramids
from ptmtools.walkthrough.walk import read_walk
from ptmtools.walkthrough.world import World, prepare

Row = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """A run to be made; ``bandwidth`` and ``memory`` as `ptm simulate` takes them."""

    scene: str
    walk: int
    policy: str
    bandwidth: str
    memory: str

    @property
    def key(self) -> str:
        """What the run is known by."""
        here = (_sources(), *_world(self.scene, self.walk))
        return _digest("\n".join([*here, self.policy, self.bandwidth, self.memory]).encode())


def made(cases: list[Case], file: Path, jobs: int) -> list[Row]:
    """The rows of all cases, in their order; those that the file lacks are run, a world in each of
    so many processes, and added to it, one by one."""
    have = _kept(file)
    worlds: dict[tuple[str, int], list[Case]] = {}
    for case in cases:
        if case.key not in have:
            worlds.setdefault((case.scene, case.walk), []).append(case)
    with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        waiting = [pool.submit(_run_all, some, file) for some in worlds.values()]
        for done in as_completed(waiting):
            done.result()
    have = _kept(file)
    return [have[case.key] for case in cases]


def prepared(scene: str, walk: Path) -> World:
    """The world of a walk through a scene; textures that are decoded are kept for the next."""
    served, pyramids = _textures(scene)
    return prepare(served, read_walk(walk), pyramids)


def _run_all(cases: list[Case], file: Path) -> None:
    """Runs cases of one world, and adds them to the file."""
    scene, walk = cases[0].scene, cases[0].walk
    begin = time.process_time()
    world = prepared(scene, walk_file(scene, walk))
    preparation, standing = time.process_time() - begin, world.standing(STANDS)
    for case in cases:
        link = Conditions(parse_bandwidth(case.bandwidth))
        budget, policy = budget_of(world, parse_memory(case.memory)), POLICIES[case.policy]
        begin = time.process_time()
        run = simulate(world, policy, link, budget)
        seconds = time.process_time() - begin
        found = measure(run, world, simulate(standing, policy, link, budget))
        row = {
            "key": case.key,
            **vars(case),
            "budget": budget,
            "seconds": round(seconds, 3),
            "preparation": round(preparation, 1),
            **asdict(found),
        }
        with file.open("a", encoding="utf-8") as lines:
            lines.write(f"\n{json.dumps(row)}")  # before it: the last line may have been cut off


def _kept(file: Path) -> dict[str, Row]:
    """The rows of a file, by key; lines that were cut off are left out."""
    return {row["key"]: row for row in _rows(file)} if file.is_file() else {}


def _rows(file: Path) -> Iterator[Row]:
    for line in file.read_text(encoding="utf-8").splitlines():
        try:
            yield json.loads(line)
        except ValueError:
            continue


@lru_cache(1)
def _textures(scene: str) -> tuple[Served, Pyramids]:
    served = read_served(database_of(scene))
    return served, read_pyramids(served)


@cache
def _sources() -> str:
    files = sorted((ROOT / "ptmtools/walkthrough").rglob("*.py"))
    return _digest(b"".join(file.read_bytes() for file in files))


@cache
def _world(scene: str, walk: int) -> tuple[str, str]:
    files = (database_of(scene) / "manifest.json", walk_file(scene, walk))
    database, way = (_digest(file.read_bytes()) for file in files)
    return database, way


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]
