"""Compares systems by their pictures after equal bytes: ``python benchmarks/neighbours.py``

The viewer's client, other clients of `.ptm` files, and the clients of the neighbouring systems, on
the same walks: the sample museum (`make sample`), and a hall of large, distinct photographs
(`ptm sample photo-gallery`), the target scene of interlaced images. `h1`, 100 ms to the
first byte, 300 bytes of headers per request; geometry, records and hints use the link, too. The
script first builds missing data in ``build/bench/neighbours``, which takes minutes.

e             mean over pixels and frames of the root mean square error over R, G and B, 0 to 255,
              against the picture of all `.ptm` files with all of their levels
/ best        e over that of `best`
p95           95th percentile of e over the frames
50 %, …, s    time until a visitor at the start has that share of the picture, at most a minute
e at 100 kB   e for a visitor in front of a picture, at `PLACES` places of the walk, after that
              number of bytes over a link of 512 kbit/s with all memory, and over that of `best`;
              then the final e, after a minute, and the bytes by then
complete      e over the walk with all files present: the effect of scaling to powers of two and of
              other mip levels
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path

import numpy as np
from scenes import ROOT, ptm

from ptmtools.arrays import Floats
from ptmtools.link import Conditions
from ptmtools.output.served import read_served
from ptmtools.quantities import size
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.walk import read_walk
from ptmtools_lab.comparing import RunResult, SimulateOptions, play
from ptmtools_lab.forms import FORMS, PTM
from ptmtools_lab.measures import STANDS
from ptmtools_lab.policies import POLICIES, PolicyEntry
from ptmtools_lab.policies.whole_files import GpuiiClient
from ptmtools_lab.report import link_text
from ptmtools_lab.simulation import simulate
from ptmtools_lab.tables import Drawing
from ptmtools_lab.world import World, prepare, read_forms

FOLDER = ROOT / "build/bench/neighbours"
#: Those that take `.ptm`s, and the neighbouring systems; a row each.
OURS, NEIGHBOURS = ("best", "paper", "lru", "distance"), ("gpuii",)
RIVAL = "best"
#: Of the walk, s; of links; and of texture memory.
SECONDS, BANDWIDTHS, MEMORIES = 120, "56k,512k,4M", "10%,inf"
#: Bytes received at which pictures are compared, at how many places, over what link.
MARKS, PLACES, LINK = (100_000, 200_000, 500_000, 1_000_000, 2_000_000), 8, Conditions(512e3)
#: Widths of the rings of `gpuii` that ``--rings`` tries, metres.
RINGS = (0.5, 1.0, 2.0, 4.0, 8.0, 1000.0)


@dataclass(frozen=True)
class Scene:
    """A scene: the arguments of Python that make its model, and the model."""

    name: str
    maker: tuple[str, ...]
    model: Path


SCENES = {
    scene.name: scene
    for scene in (
        Scene("museum", ("-m", "ptmtools", "sample", "museum"), ROOT / "build/museum/museum.obj"),
        Scene(
            "photos",
            ("-m", "ptmtools", "sample", "photo-gallery"),
            ROOT / "build/photo_gallery/photo_gallery.obj",
        ),
    )
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--policy", default=",".join((*OURS, *NEIGHBOURS)))
    parser.add_argument("--bandwidth", default=BANDWIDTHS)
    parser.add_argument("--memory", default=MEMORIES)
    parser.add_argument("--rings", action="store_true", help="try rings of several widths instead")
    given = parser.parse_args()
    options = SimulateOptions(policy=given.policy, bandwidth=given.bandwidth, memory=given.memory)
    for name in given.scenes.split(","):
        world = world_of(SCENES[name], options.policies)
        print(f"## {name}\n")
        for line in rings(world) if given.rings else tables(world, options):
            print(line, flush=True)


def world_of(scene: Scene, policies: Sequence[PolicyEntry]) -> World:
    """The world of a walk through a scene, in all forms that the policies take."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    made(scene.maker, scene.model)
    database, walk = FOLDER / f"{scene.name}.db", FOLDER / f"{scene.name}-{SECONDS}.json"
    # The simulator's pictures have no coarser meshes.
    options = ("--format", "vrml,gltf,interlace", "--lods", "none", "--light", "none")
    ptm("build-scene", scene.model, "-o", database, *options)
    ptm("path", database, "-o", walk, "--duration", SECONDS, "--force")
    served = read_served(database)
    pyramids = read_pyramids(served)
    forms = read_forms(served, pyramids, (policy.form for policy in policies))
    return prepare(served, read_walk(walk), pyramids, drawing=Drawing(forms=forms))


def made(maker: tuple[str, ...], model: Path) -> None:
    """Makes a model, unless it exists."""
    if not model.is_file():
        call = [sys.executable, *maker, "-o", str(model.parent)]
        subprocess.run(call, check=True, cwd=ROOT)


def tables(world: World, options: SimulateOptions) -> Iterator[str]:
    """All of a scene, as Markdown."""
    yield from stock_table(world)
    played = play({"": world}, options)
    for (link, memory), runs in groupby(played, lambda p: (p.run.conditions, p.memory)):
        block = list(runs)
        held = size(block[0].run.budget)
        yield f"\n{link_text(link)}; texture memory {memory} ({held})\n"
        yield from runs_table(block)
    yield f"\nStanding before pictures, {link_text(LINK)}, all memory\n"
    yield from bytes_table(world, options.policies)
    yield ""


def stock_table(world: World) -> Iterator[str]:
    """Sizes of the textures in each form, and the error with all files present."""
    yield "| form | textures | their texture memory | complete |"
    yield "|---|--:|--:|--:|"
    for form in (PTM, *world.other_forms):
        own = world.in_form(form)
        stock = own.catalogue
        fetched, held = size(int(stock.ends[:, -1].sum())), size(stock.whole)
        yield f"| {FORMS[form].about} | {fetched} | {held} | {complete(own):.2f} |"


def complete(world: World) -> float:
    """e over the walk with all files present."""
    views, last = world.views, np.append(world.catalogue.levels, 0)
    rows = views.error[np.arange(len(views.texture)), last[views.texture] + 1]
    of = np.repeat(np.arange(views.frames), np.diff(views.start))
    left = np.where(views.texture >= 0, rows, 0.0)
    frames: Floats = np.bincount(of, left, views.frames)
    return float(frames[world.track.view].mean())


def runs_table(block: list[RunResult]) -> Iterator[str]:
    """A row for each system, of one link and memory."""
    rival = next((p.measures.e.mean for p in block if p.run.policy == RIVAL), float("nan"))
    yield "| system | e | / best | p95 | received | requests | 50 %, s | 90 %, s | 99 %, s |"
    yield "|---" + "|--:" * 8 + "|"
    for each in block:
        m = each.measures
        until = " | ".join("–" if t is None else f"{t:.1f}" for t in m.final)
        yield (
            f"| {each.run.policy} | {m.e.mean:.2f} | {m.e.mean / rival:.2f} | {m.e.p95:.2f} | "
            f"{size(m.bytes)} | {m.requests:,} | {until} |"
        )


def bytes_table(world: World, policies: Sequence[PolicyEntry]) -> Iterator[str]:
    """e by bytes received, means over places."""
    places = standing_places(world)
    if not places:
        yield "Nobody stands still in this walk."
        return
    heads = " | ".join(f"e at {size(mark)}" for mark in MARKS)
    yield f"| system | {heads} | at the end | received |"
    yield "|---" + "|--:" * (len(MARKS) + 2) + "|"
    rows = {policy.name: by_bytes(world, policy, places) for policy in policies}
    rival = rows.get(RIVAL, ([float("nan")] * (len(MARKS) + 1), 0.0))[0]
    for name, (errors, received) in rows.items():
        cells = " | ".join(f"{e:.2f} ({e / r:.2f})" for e, r in zip(errors, rival, strict=True))
        yield f"| {name} | {cells} | {size(round(received))} |"


def standing_places(world: World) -> list[int]:
    """Frames in which the walker has just come to stand, spread over the walk."""
    begins = np.flatnonzero(world.track.still[1:] & ~world.track.still[:-1]) + 1
    chosen = begins[np.linspace(0, len(begins) - 1, min(PLACES, len(begins))).astype(int)]
    actual: list[int] = chosen.tolist()
    return actual


def by_bytes(world: World, policy: PolicyEntry, places: Sequence[int]) -> tuple[list[float], float]:
    """e at each of the `MARKS` and at the end, and the bytes by then."""
    own, actual = world.in_form(policy.form), []
    for frame in places:
        track = own.track.looking(slice(frame, None))
        stands = replace(own, track=track).standing(STANDS)
        run = simulate(stands, policy, LINK, own.catalogue.whole)
        at = np.searchsorted(run.fetched, MARKS, "right") - 1
        actual.append([*run.error[np.maximum(at, 0)], run.error[-1], run.fetched[-1]])
    *errors, received = np.mean(actual, axis=0).tolist()
    return errors, received


def rings(world: World) -> Iterator[str]:
    """e of `gpuii` with rings of several widths."""
    own = world.in_form(POLICIES["gpuii"].form)
    bandwidths = (512e3, 4e6)
    yield "| ring, m | " + " | ".join(link_text(Conditions(b)) for b in bandwidths) + " |"
    yield "|--:" * (1 + len(bandwidths)) + "|"
    for ring in RINGS:
        make: Callable[..., GpuiiClient] = partial(GpuiiClient, ring=ring)
        policy = replace(POLICIES["gpuii"], client=make)
        runs = (simulate(own, policy, Conditions(b), own.catalogue.whole // 10) for b in bandwidths)
        yield f"| {ring:g} | " + " | ".join(f"{run.error.mean():.2f}" for run in runs) + " |"


if __name__ == "__main__":
    main()
