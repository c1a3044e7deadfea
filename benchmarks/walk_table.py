"""Compares the clients of the simulator: ``python benchmarks/walk_table.py``

Every policy of the simulator, on four links and with three amounts of texture memory, on three
walks of 150 seconds through each of four scenes (`scenes.py`): `h1`, 100 ms to the first byte, 300
bytes of headers per request; geometry, records and hints use the link, too. Two processes produce
missing databases and runs. Runs are rows of a file of JSON lines, with their inputs as keys: the
sources of the simulator, the manifest of the database, the walk, the policy, the link and the
memory. An interrupted benchmark continues with the next run.

e             mean over pixels and frames of the root mean square error over R, G and B, 0 to 255
p95           95th percentile of e over the frames
waste         share of the bytes received that never were on the screen
/ oracle      e over that of `oracle` on the same walk under the same conditions, on average
/ best-exact  e over that of `best-exact` likewise: the gain by previews
± walks       standard deviation of that ratio over the walks through a scene, root mean square
p95 / ach     p95 on average over that of `ach`, which is 0 on some walks
90 %, s       time until a visitor at the start has 90 % of the picture, at most a minute
s             processor seconds of a run; a separate table gives those of preparing a walk

The last table gives e over that of the research prototype, over its scenes and conditions. The
prototype did not transmit geometry and hints, and used other walks.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import cache, lru_cache
from itertools import product
from math import nan
from multiprocessing import get_context
from pathlib import Path
from statistics import fmean, pstdev
from typing import Any

from scenes import FOLDER, ROOT, SCENES, WALKS, database_of, make_scenes, walk_file

from ptmtools.link import Conditions
from ptmtools.output.served import Served, read_served
from ptmtools.quantities import parse_bandwidth, parse_memory
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.rendering.records import Pyramids
from ptmtools.walk import read_walk
from ptmtools_lab.comparing import budget_of
from ptmtools_lab.forms import PTM
from ptmtools_lab.lossy import Lossy, read_lossy
from ptmtools_lab.measures import STANDS, measure
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.simulation import simulate
from ptmtools_lab.tables import Drawing
from ptmtools_lab.world import World, prepare

BANDWIDTHS = ("56k", "512k", "4M", "16M")
MEMORIES = ("4MiB", "10%", "30%")
#: The policies that take `.ptm`s; those of other systems are in `neighbours`.
OURS = [name for name, policy in POLICIES.items() if policy.form == PTM]
#: e of the prototype in three scenes, at .5, 4 and 16 Mbit/s: where clients are alike.
PROTOTYPE_SCENES, PROTOTYPE_LINKS = ("museum", "rooms", "hospital"), BANDWIDTHS[1:]
PROTOTYPE = {
    "paper": (1.83, 2.06, 3.18),
    "lru": (6.6, 7.8, 19),
    "ach": (0.76, 0.72, 1.69),
    "ach-views": (0.73, 0.71, 1.68),
    "ach-texture": (0.83, 0.79, 1.66),
    "distance": (0.69, 0.62, 1.82),
    "bbox": (0.76, 0.70, 1.64),
    "screen+distance": (0.53, 0.54, 1.42),
    "screen+ach": (0.55, 0.56, 1.41),
    "best": (0.54, 0.54, 1.41),
    "oracle": (0.40, 0.38, 1.38),
}
Row = dict[str, Any]
#: Rows of which a mean is taken, and what of them.
Rows = Sequence[Row]
Column = tuple[str, Callable[[Rows], float]]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--walks", default=",".join(map(str, WALKS)))
    parser.add_argument("--policy", default=",".join(OURS))
    parser.add_argument("--bandwidth", default=",".join(BANDWIDTHS))
    parser.add_argument("--memory", default=",".join(MEMORIES))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--results", type=Path, default=FOLDER / "runs.jsonl")
    given = parser.parse_args()
    scenes = given.scenes.split(",")
    make_scenes(scenes)
    walks = map(int, given.walks.split(","))
    asked = (given.policy.split(","), given.bandwidth.split(","), given.memory.split(","))
    cases = [Case(*case) for case in product(scenes, walks, *asked)]
    print("\n\n".join(tables(made(cases, given.results, given.jobs))))


def tables(rows: Rows) -> list[str]:
    """All tables, as Markdown."""
    rows = [{**row, **row["e"]} for row in rows]
    truth = {_place(row): row["mean"] for row in rows if row["policy"] == "oracle"}
    bare = {_place(row): row["mean"] for row in rows if row["policy"] == "best-exact"}
    rival = {_place(row): row["p95"] for row in rows if row["policy"] == "ach"}
    for row in rows:
        row["ratio"] = row["mean"] / truth.get(_place(row), nan)
        row["gain"] = row["mean"] / bare.get(_place(row), nan)
        row["standing"] = STANDS if row["final"][1] is None else row["final"][1]
        row["rival"] = rival.get(_place(row), nan)
    conditions = list(dict.fromkeys((row["bandwidth"], row["memory"]) for row in rows))
    scenes = list(dict.fromkeys(row["scene"] for row in rows))

    def under(name: str) -> list[Column]:
        return [
            (f"{link} {memory}", _mean(name, bandwidth=link, memory=memory))
            for link, memory in conditions
        ]

    summary: list[Column] = [
        *(("e", _mean("mean")), ("p95", _mean("p95")), ("waste", _mean("waste"))),
        *(("/ oracle", _mean("ratio")), ("± walks", _spread), ("p95 / ach", _against)),
        *(("90 %, s", _mean("standing")), ("s", _mean("seconds"))),
    ]
    by_scene: list[Column] = [
        (f"{scene} {head}", _mean(name, scene=scene))
        for scene in scenes
        for head, name in (("e", "mean"), ("p95", "p95"), ("/ oracle", "ratio"))
    ]
    gains: list[Column] = [
        (f"{scene} {link} {memory}", _mean("gain", scene=scene, bandwidth=link, memory=memory))
        for scene in scenes
        for link, memory in conditions
    ]
    actual = [
        _table("e", rows, under("mean") + summary),
        _table("e / oracle", rows, under("ratio")),
        *(_table("e / best-exact", rows, columns) for columns in (under("gain"), gains) if bare),
        _table("by scene", rows, by_scene),
        _preparation(rows),
    ]
    known = [row for row in rows if row["policy"] in PROTOTYPE]
    known = [row for row in known if row["bandwidth"] in PROTOTYPE_LINKS]
    beside = [s for s in PROTOTYPE_SCENES if s in scenes]
    if known and beside:
        actual.append(_table("e / prototype", known, [_prototype(scene) for scene in beside]))
    over = sum(row["overruns"] for row in rows)
    return [*actual, f"{len(rows):,} runs; frames above the budget: {over}"]


def _table(title: str, rows: Rows, columns: Sequence[Column]) -> str:
    """A row for each policy."""
    lines = [f"| {title} | " + " | ".join(head for head, _ in columns) + " |"]
    lines.append("|---" + "|--:" * len(columns) + "|")
    for policy in dict.fromkeys(row["policy"] for row in rows):
        some = [row for row in rows if row["policy"] == policy]
        lines.append(f"| {policy} | " + " | ".join(f"{of(some):.2f}" for _, of in columns) + " |")
    return "\n".join(lines)


def _preparation(rows: Rows) -> str:
    """Processor seconds that the walks of each scene took to be prepared."""
    lines = ["| preparation, s | mean | most |", "|---|--:|--:|"]
    for scene in dict.fromkeys(row["scene"] for row in rows):
        took = {row["walk"]: row["preparation"] for row in rows if row["scene"] == scene}
        lines.append(f"| {scene} | {fmean(took.values()):.1f} | {max(took.values()):.1f} |")
    return "\n".join(lines)


def _mean(name: str, **alike: str) -> Callable[[Rows], float]:
    """The mean of a figure of the rows that have those values."""

    def mean(rows: Rows) -> float:
        some = [row[name] for row in rows if alike.items() <= row.items()]
        return fmean(some) if some else nan

    return mean


def _spread(rows: Rows) -> float:
    """How much the ratio varies from walk to walk in the same scene, under the same conditions."""
    walks: dict[tuple[str, str, str], list[float]] = {}
    for row in rows:
        walks.setdefault(_place(row)[:3], []).append(row["ratio"])
    return fmean(pstdev(ratios) ** 2 for ratios in walks.values()) ** 0.5


def _against(rows: Rows) -> float:
    return fmean(row["p95"] for row in rows) / fmean(row["rival"] for row in rows)


def _prototype(scene: str) -> Column:
    here, at = _mean("mean", scene=scene), PROTOTYPE_SCENES.index(scene)
    return scene, lambda rows: here(rows) / PROTOTYPE[rows[0]["policy"]][at]


def _place(row: Row) -> tuple[str, str, str, int]:
    return row["scene"], row["bandwidth"], row["memory"], row["walk"]


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
    """Returns the rows of all cases, in order. Missing ones are run, one world in each of ``jobs``
    processes, and appended to the file one by one."""
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
    served, pyramids, lossy = _textures(scene)
    return prepare(served, read_walk(walk), pyramids, drawing=Drawing(lossy))


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
        actual = measure(run, world, simulate(standing, policy, link, budget))
        row = {
            "key": case.key,
            **vars(case),
            "budget": budget,
            "seconds": round(seconds, 3),
            "preparation": round(preparation, 1),
            **asdict(actual),
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
def _textures(scene: str) -> tuple[Served, Pyramids, Lossy]:
    served = read_served(database_of(scene))
    return served, read_pyramids(served), read_lossy(served)


@cache
def _sources() -> str:
    folders = (ROOT / "ptmtools" / name for name in ("lab", "rendering"))
    files = sorted(file for folder in folders for file in folder.rglob("*.py"))
    return _digest(b"".join(file.read_bytes() for file in files))


@cache
def _world(scene: str, walk: int) -> tuple[str, str]:
    files = (database_of(scene) / "manifest.json", walk_file(scene, walk))
    database, way = (_digest(file.read_bytes()) for file in files)
    return database, way


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()[:16]


if __name__ == "__main__":
    main()
