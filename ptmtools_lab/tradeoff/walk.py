"""The effect of each knob on a visitor who walks through the building, as one common measure.

A setting changes one option. A copy of the database is built with it and walked through on the same
way, over the same links, with the same bytes of texture memory. The reference of e is always the
full picture of the original database, whatever the setting does to the textures.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from ptmtools.errors import InputError, PtmError
from ptmtools.link import Conditions, Trace
from ptmtools.options import option
from ptmtools.output.served import Served, read_served
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.warm_up import warm_building
from ptmtools.progress import Progress, silent
from ptmtools.quantities import MemorySize, count, size
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.rendering.records import Pyramids
from ptmtools.walk import Walk
from ptmtools_lab.catalogue import Catalogue, catalogue_of
from ptmtools_lab.comparing import SimulateOptions, apply_counting, budget_of, play, require_hints
from ptmtools_lab.forms import PTM
from ptmtools_lab.lossy import read_lossy
from ptmtools_lab.measures import SHARES
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.report import rate_text
from ptmtools_lab.tables import Drawing, limit_levels
from ptmtools_lab.tradeoff.experiment import Deadline, time_work
from ptmtools_lab.tradeoff.knobs import (
    BRIEF,
    KnobSetting,
    Own,
    build_again,
    compiled_and_timed,
    concerned_stages,
    own_options,
    settings,
    temporary_copy,
)
from ptmtools_lab.world import World, prepare

#: Share of the full picture whose time is reported.
FIRST = 0.9
#: The value of options that the walk decides.
AUTO = "auto"
#: Texture memory by `AUTO`: this share of the memory for the pictures of the walk, that is, for
#: what 95 % of them show. With all of it nothing has to be chosen; with a tenth of it every setting
#: shows the same blur.
_SHARE, _PICTURES = 0.5, 95
#: Links by `AUTO`: all that the walk shows arrives in this part of its duration; bit/s at most.
_LINKS = ((1.0, 512_000), (1 / 8, 4_000_000))

#: Policies for any database.
_OF_DATABASES = {name: policy for name, policy in POLICIES.items() if policy.form == PTM}


@dataclass(frozen=True)
class WalkOptions(SimulateOptions):
    """`SimulateOptions`, with links and memory that suit the walk by default."""

    policy: str = option("best", "Policies of the clients", choices=_OF_DATABASES, several=True)
    bandwidth: str = option(
        AUTO,
        "Bandwidth of the link in bit/s: 56k, 4M (k = 1,000, M = 1,000,000) or inf. Commas "
        "separate several values. auto: two links, on which the data of the walk take its whole "
        "duration and an eighth of it, at most 512k and 4M.",
        metavar="RATE[,RATE]",
    )
    memory: str = option(
        AUTO,
        "Texture memory: an amount (4MiB), a share of the memory of all textures (10%), or inf. "
        "Commas separate several values. auto: half of what the pictures of the walk need.",
        metavar="SIZE[,SIZE]",
    )

    def links(self, trace: Trace | None = None) -> list[Conditions]:
        """See `SimulateOptions.links`; none by `AUTO`."""
        return [] if self.bandwidth == AUTO else super().links(trace)

    @property
    def memories(self) -> list[MemorySize]:
        """See `SimulateOptions.memories`; none by `AUTO`."""
        return [] if self.memory == AUTO else super().memories

    def for_walk(self, world: World) -> WalkOptions:
        """These options with links and memory in place of `AUTO`."""
        memory, received = needs_of(world)
        seconds = max(float(world.track.time[-1] - world.track.time[0]), 1.0)
        rates = (min(8 * received / (part * seconds), limit) for part, limit in _LINKS)
        texts = dict.fromkeys(f"{max(float(f'{rate:.2g}'), 1):.0f}" for rate in rates)
        return replace(
            self,
            bandwidth=",".join(texts) if self.bandwidth == AUTO else self.bandwidth,
            memory=size(max(round(_SHARE * memory), 1)) if self.memory == AUTO else self.memory,
        )


def needs_of(world: World) -> tuple[int, int]:
    """Bytes of texture memory that `_PICTURES` of the pictures of a walk need at most, and bytes to
    receive for all of them: textures as levels, geometry and records of cells in sight."""
    views, stock = world.views, world.catalogue
    texture = views.texture >= 0
    level = np.where(views.need > 0, np.arange(views.need.shape[1]) + 1, 0).max(axis=1)
    view = np.repeat(np.arange(views.frames), np.diff(views.start))
    # (V, T) column that each view needs of each texture.
    column = np.zeros((views.frames, stock.texture_count), np.int64)
    np.maximum.at(column, (view[texture], views.texture[texture]), level[texture])
    column = np.minimum(column, stock.levels)
    textures = np.arange(stock.texture_count)
    memory = stock.memory[textures, column].sum(axis=1)
    cells = np.unique(views.cell[views.cell >= 0])
    files = stock.geometry_bytes[cells].sum() + stock.record_bytes[cells].sum()
    received = stock.ends[textures, column.max(axis=0, initial=0)].sum() + files + stock.index_bytes
    return int(np.percentile(memory[world.track.view], _PICTURES)), int(received)


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

    def outcome(self, case: Case) -> WalkOutcome | None:
        """The outcome of a case."""
        return next((seen for seen in self.seen if seen.case == case), None)


@dataclass(frozen=True)
class WalkTrade:
    """All settings tried on one walk.

    Attributes
    ----------
    seconds: duration of the walk.
    own: the unchanged database. trials: the settings, in the order of their knobs.
    untried: the names of settings that the time did not allow.
    """

    seconds: float
    own: WalkTrial
    trials: tuple[WalkTrial, ...]
    untried: tuple[str, ...] = ()

    @property
    def cases(self) -> list[Case]:
        """All cases, see `WalkOutcome.case`."""
        return [seen.case for seen in self.own.seen]


def try_settings(
    artifacts: Artifacts,
    walk: Walk,
    options: WalkOptions,
    knobs: Collection[str] = (),
    *,
    quick: bool = False,
    deadline: Deadline | None = None,
    progress: Progress = silent,
    tell: Callable[[str], None] = lambda line: None,
) -> WalkTrade:
    """Tries settings on a walk through a database, which is not changed: the first value of each
    knob, then the others, at least one, and as many as end before the deadline.

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
    db, deadline = artifacts.db.path, deadline or Deadline()
    served = read_served(db)
    require_hints(served, options.policies)
    recorded = own_options(artifacts)
    priced = {stage: of_stage for stage, of_stage in recorded.items() if artifacts.is_stored(stage)}
    chosen = list(settings(priced, _longest(served), knobs, quick=quick))
    if knobs and not chosen:
        raise InputError(
            "PTM-I701",
            f"has nothing to try for {', '.join(f'--option {name}' for name in knobs)}",
            file=db,
            remedy="build it with what these options change, such as --light bake",
        )
    original = prepare(served, walk, progress=progress)
    options = options.for_walk(original)
    progress(0, len(chosen), "trying settings")
    _warm_up()
    policies = ["", *dict.fromkeys(s.knob.policy for s in chosen if s.knob.policy)]
    trials = _Trials(db, recorded, _Walker(walk, original, options), policies)
    tell(_plan_text(options, walk, len(chosen), sum(map(trials.estimate, chosen)), deadline))
    tried: dict[int, WalkTrial] = {}
    for done, k in enumerate(by_turns(chosen)):
        if not tried or trials.estimate(chosen[k]) <= deadline.remaining:
            tried[k] = trials.try_setting(chosen[k])
        progress(done + 1, len(chosen), "trying settings")
    untried = tuple(setting.name for k, setting in enumerate(chosen) if k not in tried)
    in_order = tuple(tried[k] for k in sorted(tried))
    return WalkTrade(walk.duration, trials.unchanged, in_order, untried)


def _plan_text(
    options: WalkOptions, walk: Walk, number: int, seconds: float, deadline: Deadline
) -> str:
    allowed = deadline.remaining
    limit = "" if seconds < allowed else f", of which {minutes(allowed)} are allowed"
    where = " and ".join(rate_text(link.bandwidth) for link in options.links())
    return (
        f"{count(number, 'setting')} on a walk of {walk.duration:.0f} s at {where} with "
        f"{options.memory} of texture memory; about {minutes(seconds)}{limit}"
    )


@cache
def _warm_up() -> None:
    """Loads the kernels of builds, once a process: the first build that is measured, that of the
    unchanged database, would have to load them."""
    warm_building()


def require_prices(trade: WalkTrade, db: Path) -> None:
    """Raises InputError PTM-I701 if a setting could not be tried."""
    problems = [tried for tried in trade.trials if tried.problem]
    if problems:
        more = f", nor could {count(len(problems) - 1, 'more setting')}" if problems[1:] else ""
        raise InputError(
            "PTM-I701",
            f"{problems[0].name} could not be tested ({problems[0].problem}){more}",
            file=db,
            remedy="name the options to test with --option",
        )


def by_turns(chosen: Sequence[KnobSetting]) -> list[int]:
    """The numbers of settings, the first of each knob first, then the second of each."""
    turn: list[int] = []
    for k, setting in enumerate(chosen):
        turn.append(turn[-1] + 1 if k and chosen[k - 1].knob is setting.knob else 0)
    return sorted(range(len(chosen)), key=lambda k: turn[k])


class _Trials:
    """Tries settings, and estimates how long that takes from those tried before.

    Attributes
    ----------
    unchanged: the trial of the database itself.
    """

    def __init__(self, db: Path, recorded: Own, walker: _Walker, policies: Sequence[str]) -> None:
        self._db, self._own, self._walker = db, recorded, walker
        with temporary_copy(db) as copy:
            self._seconds = build_again(copy, recorded)
            served, begin = read_served(copy), time.perf_counter()
            world, drawing = time_work(
                lambda: comparison_world(served, walker.walk, walker.original)
            )
            drawn = time.perf_counter()
        outcomes, walking = compiled_and_timed(
            lambda: tuple(o for policy in policies for o in walker.walks(world, policy))
        )
        # Seconds of one core for the walks of a setting; wall-clock seconds by those of a core.
        self._walking = drawing + walking / len(policies)
        self._slowness = [(drawn - begin) / max(drawing, 1e-3)]
        build = sum(self._seconds.values())
        self.unchanged = WalkTrial("", "", "", build, served_bytes(world.catalogue), outcomes)

    def estimate(self, setting: KnobSetting) -> float:
        """Wall-clock seconds that a setting takes."""
        return fmean(self._slowness) * self._seconds_of(setting)

    def _seconds_of(self, setting: KnobSetting) -> float:
        stages = (self._seconds[s.name] for s in concerned_stages(setting.knob.stage, self._own))
        return sum(s if s >= BRIEF else 2 * s for s in stages) + self._walking

    def try_setting(self, setting: KnobSetting) -> WalkTrial:
        """The trial of a setting."""
        stage, words = setting.knob.stage, (setting.name, setting.own, setting.knob.option)
        begin = time.perf_counter()
        try:
            with temporary_copy(self._db) as copy:
                options = {**self._own, stage: setting.options}
                took = build_again(copy, {s: options[s] for s in concerned_stages(stage, options)})
                world = comparison_world(
                    read_served(copy), self._walker.walk, self._walker.original
                )
                outcomes = tuple(self._walker.walks(world, setting.knob.policy))
        except PtmError as fault:
            return WalkTrial(*words, 0, 0, problem=fault.message)
        self._slowness.append((time.perf_counter() - begin) / self._seconds_of(setting))
        build = sum({**self._seconds, **took}.values())
        return WalkTrial(*words, build, served_bytes(world.catalogue), outcomes)


class _Walker:
    """Walks the same way through databases built from the same model."""

    def __init__(self, walk: Walk, original: World, options: WalkOptions) -> None:
        self.walk, self.original, self._options = walk, original, options
        stock = apply_counting(original, options)
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
                result.run.policy,
                result.run.conditions.bandwidth,
                self._memory[result.memory],
                result.measures.e.mean,
                result.measures.e.p95,
                result.measures.bytes,
                result.measures.final[SHARES.index(FIRST)],
            )
            for result in play({"": apply_counting(world, options)}, options)
        ]


def comparison_world(served: Served, walk: Walk, original: World) -> World:
    """The world of a walk through a database, with the textures of ``original`` as the reference, a
    world of the same model and walk.

    If only the finest levels of its textures, or previews, are missing, the tables of the original
    hold the errors without them; with the same geometry no rays are cast again.
    """
    levels, lossy, full = read_pyramids(served), read_lossy(served), original.pyramids
    coarse = begins_with(full, levels)
    same = _same(served.surfaces, original.served.surfaces)
    if not coarse or len(lossy.state):
        levels = full if coarse and (levels.levels == full.levels).all() else levels
        drawing = Drawing(lossy, full=full, same_maps=same)
        return prepare(served, walk, levels, drawing=drawing)
    views = original.views if same else None
    world = prepare(served, walk, full, views=views, drawing=Drawing(lossy))
    return replace(
        world,
        pyramids=levels,
        catalogue=catalogue_of(served, levels.differences, levels.mean),
        views=limit_levels(world.views, levels.levels),
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


def _same(a: Any, b: Any) -> bool:
    """Whether two values are equal: arrays, or dataclasses of them such as `Surfaces`."""
    if is_dataclass(a) and type(a) is type(b):
        return all(_same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return np.array_equal(a, b)


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
