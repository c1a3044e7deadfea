"""The client of a campus as a policy beside those of a database of the same model: the same walks,
links, pictures and measures.

Its lightmaps are left out: the other clients have no light. What it may take is graphics memory
for meshes and textures, that of the others is for textures alone. What is counted of levels of
textures, or of cells, has no meaning here, and is NaN.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan

import numpy as np

from ptmtools.arrays import Bools
from ptmtools.campus.model import Quality
from ptmtools.walkthrough.campus.options import QUALITIES, CampusWalkOptions
from ptmtools.walkthrough.campus.simulation import simulate_campus
from ptmtools.walkthrough.campus.world import CampusWorld
from ptmtools.walkthrough.measures import STANDS, Measures, measure, seconds_to
from ptmtools.walkthrough.network import Conditions
from ptmtools.walkthrough.simulation import Run
from ptmtools.walkthrough.world import World


@dataclass(frozen=True)
class CampusPolicy:
    """A client of a campus, with a preset; ``name`` and ``about`` are for `--policy`."""

    name: str
    about: str
    quality: Quality


#: By name.
CAMPUS_POLICIES = {
    f"campus-{name}": CampusPolicy(
        f"campus-{name}",
        f"objects of --campus, the nearest in full, {choice.about}",
        choice.quality,
    )
    for name, choice in QUALITIES.items()
}


def walk_beside(
    place: CampusWorld, world: World, policy: CampusPolicy, link: Conditions, budget: int | None
) -> tuple[Run, Measures]:
    """A run through a campus, and its measures; ``world`` is the same walk through the database."""
    tables = place.tables
    if tables is None:
        raise ValueError("the errors of the campus are not tabulated")
    run = _run(place, world.still, policy, link, budget)
    stands = place.standing(STANDS)
    standing = _run(stands, np.ones(stands.frames, np.bool_), policy, link, budget)
    nothing = np.zeros(place.stock.objects, np.int64), np.zeros(len(place.stock.bases), np.int64)
    left = tables.wrong(int(place.view[0]), *nothing)
    measures = replace(
        measure(run, world, standing),
        waste=nan,
        stalls=nan,
        uploads=nan,
        switches=nan,
        final=seconds_to(standing, left),
    )
    return run, measures


def _run(
    place: CampusWorld, still: Bools, policy: CampusPolicy, link: Conditions, budget: int | None
) -> Run:
    memory = "inf" if budget is None else str(max(budget, 1))
    options = CampusWalkOptions(memory=memory, lightmaps=False)
    run = simulate_campus(place, policy.quality, options, conditions=link)
    frames = place.frames
    unknown = np.full(frames, nan)
    return Run(
        policy=policy.name,
        conditions=link,
        budget=int(run.memory.max()) if budget is None else budget,
        time=run.time,
        still=still,
        error=run.error,
        square=unknown,
        missing=unknown,
        quality=unknown,
        memory=run.memory,
        fetched=run.fetched,
        column=np.zeros((frames, 0), np.int64),
        there=np.zeros((frames, 0), np.bool_),
        body=run.body,
        overhead=run.overhead,
        cancelled=0.0,
        documents=0,
        useful=nan,
        uploads=0,
        switches=0,
        requests=run.requests,
        stalls=0,
        overruns=0 if budget is None else int((run.memory > budget).sum()),
    )
