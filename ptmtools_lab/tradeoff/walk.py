"""The effect of each knob on a visitor who walks through the building, as one common measure.

A setting changes one option. A copy of the database is built with it and walked through on the same
way, over the same links, with the same bytes of texture memory. The reference of e is always the
full picture of the original database, whatever the setting does to the textures.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.errors import InputError, PtmError
from ptmtools.options import option
from ptmtools.output.served import Served, read_served
from ptmtools.pipeline.stage import Artifacts
from ptmtools.pipeline.warm_up import warm_building
from ptmtools.progress import Progress, silent
from ptmtools.quantities import count
from ptmtools.rendering.lossy import read_lossy
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.rendering.records import Pyramids
from ptmtools.walk import Walk
from ptmtools_lab.catalogue import Catalogue, catalogue_of
from ptmtools_lab.comparing import SimulateOptions, budget_of, counted, play, require_hints
from ptmtools_lab.forms import PTM
from ptmtools_lab.measures import SHARES
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.tables import limited
from ptmtools_lab.tradeoff.knobs import (
    Own,
    Seconds,
    Setting,
    build_again,
    concerned,
    copied,
    own_options,
    settings,
)
from ptmtools_lab.world import World, prepare

#: Share of the full picture whose time is reported.
FIRST = 0.9


#: Policies for any database.
_OF_DATABASES = {name: policy for name, policy in POLICIES.items() if policy.form == PTM}


@dataclass(frozen=True)
class WalkOptions(SimulateOptions):
    """`SimulateOptions` with other defaults."""

    policy: str = option("best", "Policies of the clients", choices=_OF_DATABASES, several=True)
    memory: str = option(
        "10%",
        "Texture memory: an amount (4MiB), a share of the memory of all textures (10%), or inf. "
        "Commas separate several values.",
        metavar="SIZE[,SIZE]",
    )


#: Policy of the client, bandwidth of the link (bit/s, None for no limit), texture memory.
Case = tuple[str, float | None, str]


@dataclass(frozen=True)
class WalkOutcome:
    """Outcome of a walk.

    Attributes
    ----------
    policy, bandwidth, memory: see `Case`.
    e, p95: mean over the walk, and what 95 % of the frames do not exceed; 0 to 255.
    fetched: bytes received on the walk.
    first: s until `FIRST` of the first picture has arrived; None if it never has.
    """

    policy: str
    bandwidth: float | None
    memory: str
    e: float
    p95: float
    fetched: int
    first: float | None

    @property
    def case(self) -> Case:
        """The key of comparable outcomes."""
        return self.policy, self.bandwidth, self.memory


@dataclass(frozen=True)
class WalkTrial:
    """Outcomes of a setting.

    Attributes
    ----------
    name, own: the setting and the database's own value, as a user gives them; both are empty for
        the unchanged database.
    option: the option of the setting.
    build: seconds of one core for all stages after the scene.
    served: bytes that clients of the hints can fetch.
    seen: the outcome of each case.
    problem: why the setting cannot be tried; "" if it was.
    """

    name: str
    own: str
    option: str
    build: float
    served: int
    seen: tuple[WalkOutcome, ...] = ()
    problem: str = ""

    def by(self, case: Case) -> WalkOutcome | None:
        """The outcome of a case."""
        return next((seen for seen in self.seen if seen.case == case), None)


@dataclass(frozen=True)
class WalkTrade:
    """All settings tried on one walk.

    Attributes
    ----------
    seconds: duration of the walk.
    own: the unchanged database. trials: the settings, in the order of their knobs.
    """

    seconds: float
    own: WalkTrial
    trials: tuple[WalkTrial, ...]

    @property
    def cases(self) -> list[Case]:
        """All cases, see `WalkOutcome.case`."""
        return [seen.case for seen in self.own.seen]


def try_settings(
    db: Path,
    artifacts: Artifacts,
    walk: Walk,
    options: WalkOptions,
    knobs: Collection[str] = (),
    *,
    quick: bool = False,
    progress: Progress = silent,
    tell: Callable[[str], None] = lambda line: None,
) -> WalkTrade:
    """Tries settings on a walk through a database, which is not changed.

    Parameters
    ----------
    artifacts: those of the database. options: clients and links.
    knobs, quick: see `settings`.
    tell: receives a line on the settings and the expected time, once that is known.

    Raises
    ------
    DatabaseError: PTM-D004, PTM-D008 a stage has not run, or not by this release; those of
        `read_served`.
    InputError: PTM-I700 the walk leads elsewhere; PTM-I701 a policy's hints are missing, or none of
        the ``knobs`` has another setting.
    """
    served = read_served(db)
    require_hints(served, options.policies)
    own = own_options(artifacts)
    chosen = list(settings(own, _longest(served), knobs, quick=quick))
    if knobs and not chosen:
        raise InputError(
            "PTM-I701",
            f"has nothing to try for {', '.join(f'--option {name}' for name in knobs)}",
            file=db,
            remedy="build it with what these options change, such as --light bake",
        )
    begin = time.perf_counter()
    original = prepare(served, walk, progress=progress)
    preparing = time.perf_counter() - begin
    progress(0, len(chosen), "trying settings")
    warm_building()
    with copied(db) as copy:
        seconds = build_again(copy, own)
    least = sum(
        preparing + sum(seconds[s.name] for s in concerned(setting.knob.stage, own))
        for setting in chosen
    )
    number = count(len(chosen), "setting")
    tell(f"{number} on a walk of {walk.duration:.0f} s; about {minutes(least)}")
    walker = _Walker(walk, original, options)
    others = list(dict.fromkeys(s.knob.policy for s in chosen if s.knob.policy))
    seen = [s for policy in ("", *others) for s in walker.walks(original, policy)]
    trials = []
    for done, setting in enumerate(chosen):
        with copied(db) as copy:
            trials.append(_try_setting(copy, setting, own, seconds, walker))
        progress(done + 1, len(chosen), "trying settings")
    unchanged = WalkTrial(
        "", "", "", sum(seconds.values()), served_bytes(original.catalogue), tuple(seen)
    )
    return WalkTrade(walk.duration, unchanged, tuple(trials))


class _Walker:
    """Walks the same way through databases built from the same model."""

    def __init__(self, walk: Walk, original: World, options: WalkOptions) -> None:
        self.walk, self.original, self._options = walk, original, options
        stock = counted(original, options)
        # The same bytes for all databases.
        self._memory = {
            str(max(budget_of(stock, m), 1)): m.text for m in dict.fromkeys(options.memories)
        }

    def walks(self, world: World, policy: str = "") -> list[WalkOutcome]:
        """Outcomes of a policy, or of those of the options."""
        options = replace(
            self._options,
            policy=policy or self._options.policy,
            memory=",".join(self._memory),
        )
        return [
            WalkOutcome(
                each.run.policy,
                each.run.conditions.bandwidth,
                self._memory[each.memory],
                each.measures.e.mean,
                each.measures.e.p95,
                each.measures.bytes,
                each.measures.final[SHARES.index(FIRST)],
            )
            for each in play({"": counted(world, options)}, options)
        ]


def _try_setting(
    copy: Path, setting: Setting, own: Own, seconds: Seconds, walker: _Walker
) -> WalkTrial:
    stage, words = setting.knob.stage, (setting.name, setting.own, setting.knob.option)
    try:
        options = {**own, stage: setting.options}
        took = build_again(copy, {each: options[each] for each in concerned(stage, options)})
        world = compared(read_served(copy), walker.walk, walker.original)
        seen = walker.walks(world, setting.knob.policy)
    except PtmError as fault:
        return WalkTrial(*words, 0, 0, problem=fault.message)
    build = sum({**seconds, **took}.values())
    return WalkTrial(*words, build, served_bytes(world.catalogue), tuple(seen))


def compared(served: Served, walk: Walk, original: World) -> World:
    """The world of a walk through a database, with the textures of ``original`` as the reference, a
    world of the same model and walk.

    If only the finest levels of its textures, or previews, are missing, the tables of the original
    hold the errors without them; with the same geometry no rays are cast again.
    """
    own, lossy, full = read_pyramids(served), read_lossy(served), original.pyramids
    coarse = begins_with(full, own)
    same = _same(served.surfaces, original.served.surfaces)
    if not coarse or len(lossy.state):
        own = full if coarse and (own.levels == full.levels).all() else own
        return prepare(served, walk, own, full=full, same_maps=same, lossy=lossy)
    views = original.views if same else None
    world = prepare(served, walk, full, views=views, lossy=lossy)
    return replace(
        world,
        pyramids=own,
        catalogue=catalogue_of(served, own.differences, own.mean),
        views=limited(world.views, own.levels),
    )


def begins_with(full: Pyramids, few: Pyramids) -> bool:
    """Whether the textures of ``few`` are the coarsest levels of those of ``full``."""
    if len(few.levels) != len(full.levels) or (few.levels > full.levels).any():
        return False
    for t, levels in enumerate(few.levels.tolist()):
        if (few.size[t, :levels] != full.size[t, :levels]).any():
            return False
        length = 3 * int(few.size[t, :levels].prod(axis=1).sum())
        a, b = int(few.start[t, 0]), int(full.start[t, 0])
        if (few.texel[a : a + length] != full.texel[b : b + length]).any():
            return False
    return True


def _same(one: Any, other: Any) -> bool:
    """Whether two values are equal: arrays, or dataclasses of them such as `Surfaces`."""
    if is_dataclass(one) and type(one) is type(other):
        return all(_same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    return np.array_equal(one, other)


def _longest(served: Served) -> int:
    """The longest side of a texture, texels."""
    return max((max(t["width"], t["height"]) for t in served.index["textures"]), default=0)


def served_bytes(stock: Catalogue) -> int:
    """Bytes that clients of the hints can fetch."""
    documents = stock.index_bytes + stock.statistics_bytes + int(stock.record_bytes.sum())
    textures = int(stock.ends[:, -1].sum() + stock.previews.bytes.sum())
    return documents + int(stock.geometry_bytes.sum() + stock.meshes.bytes.sum()) + textures


def minutes(seconds: float) -> str:
    """A duration in seconds or minutes."""
    return f"{seconds:.0f} s" if seconds < 90 else f"{seconds / 60:.0f} minutes"
