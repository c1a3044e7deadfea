"""Simulates every combination of policies, links and amounts of texture memory on some walks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import ClassVar, Literal

from ptmtools.errors import InputError
from ptmtools.link import Conditions, Trace
from ptmtools.options import option
from ptmtools.output.served import Served
from ptmtools.progress import Progress, silent
from ptmtools.quantities import MemorySize, parse_bandwidth, parse_duration, parse_memory
from ptmtools_lab.campus.simulation import CAMPUS_POLICIES, CampusPolicy, measure_campus_walk
from ptmtools_lab.campus.world import CampusWorld
from ptmtools_lab.forms import FORMS, PTM
from ptmtools_lab.measures import STANDS, Flip, Measures, measure
from ptmtools_lab.policies import POLICIES, PolicyEntry
from ptmtools_lab.policies.paper import PaperOptions
from ptmtools_lab.simulation import WalkRun, simulate
from ptmtools_lab.world import World


@dataclass(frozen=True)
class SimulateOptions:
    """Options of `play`.

    Raises InputError: PTM-I701 a policy shows relief without ``lit``, or a campus with it; PTM-I111
    an impossible link or an unreadable quantity.
    """

    heading: ClassVar[str] = "Clients and link"

    policy: str = option(
        "paper,ach,best,oracle",
        "Policies of the clients",
        choices={**POLICIES, **CAMPUS_POLICIES},
        several=True,
    )
    bandwidth: str = option(
        "512k,4M",
        "Bandwidth of the link in bit/s: 56k, 4M (k = 1,000, M = 1,000,000) or inf. Commas "
        "separate several values.",
        metavar="RATE[,RATE]",
    )
    latency: str = option(
        "100ms",
        "Time from a request to the first byte of its response: 100ms or 0.1.",
        metavar="TIME",
    )
    overhead: int = option(300, "Size of the headers of a request.", metavar="BYTES")
    protocol: Literal["h1", "h2"] = option(
        "h1", "Six connections that share the link (h1), or one connection with priorities (h2)."
    )
    memory: str = option(
        "4MiB,10%",
        "Texture memory: an amount (4MiB), a share of the memory of all textures (10%), or inf. "
        "Commas separate several values.",
        metavar="SIZE[,SIZE]",
    )
    paper_bytes: bool = option(
        False,
        "Count three bytes per RGB texel, as the paper does, not four as graphics processors do.",
    )
    one_range: bool = option(False, "Request one range of a file at a time, as browsers do.")
    lit: bool = option(
        False,
        "Light the scene with a lamp, so that relief is visible; policies of octree textures "
        "need it.",
    )

    def __post_init__(self) -> None:
        self.links()
        self.memories  # noqa: B018 - both raise for what cannot be read
        unseen = [p.name for p in self.policies if FORMS[p.form].octrees]
        if unseen and not self.lit:
            raise InputError(
                "PTM-I701",
                f"policy {unseen[0]} fetches relief, which only lit pictures show",
                remedy="use --lit, too",
            )
        if self.campus_policies and self.lit:
            raise InputError(
                "PTM-I701",
                f"policy {self.campus_policies[0].name} shows nothing lit",
                remedy="leave out --lit, or that policy",
            )

    @property
    def policies(self) -> list[PolicyEntry]:
        """Policies of clients of the database, in the order given."""
        return [POLICIES[name] for name in _parts(self.policy) if name in POLICIES]

    @property
    def campus_policies(self) -> list[CampusPolicy]:
        """Policies of clients of a campus, in the order given."""
        return [CAMPUS_POLICIES[name] for name in _parts(self.policy) if name in CAMPUS_POLICIES]

    @property
    def memories(self) -> list[MemorySize]:
        """Amounts of texture memory in the order given; raises InputError PTM-I111."""
        return [parse_memory(part) for part in _parts(self.memory)]

    def links(self, trace: Trace | None = None) -> list[Conditions]:
        """A link for each different bandwidth, all with the same trace; raises InputError
        PTM-I111."""
        latency = parse_duration(self.latency)
        bandwidths = dict.fromkeys(parse_bandwidth(part) for part in _parts(self.bandwidth))
        return [
            Conditions(bandwidth, latency, self.overhead, self.protocol, trace=trace)
            for bandwidth in bandwidths
        ]


@dataclass(frozen=True)
class RunResult:
    """A run with its measures, and its place among the others.

    Attributes
    ----------
    walk, memory: their names.
    flip: mean FLIP of some frames, if requested.
    """

    walk: str
    memory: str
    run: WalkRun
    measures: Measures
    flip: float | None = None


def require_hints(served: Served, policies: Sequence[PolicyEntry]) -> None:
    """Raises InputError PTM-I701 if the records lack a field that a policy needs, or the textures
    are not available in its form."""
    for policy in policies:
        form = FORMS[policy.form]
        available = {*served.index, *served.index.get("textureSets", ())}
        if form.needs and form.needs[0] not in available:
            raise InputError(
                "PTM-I701",
                f"policy {policy.name} needs {form.about}, which the database does not have",
                file=served.folder,
                remedy=form.needs[1],
            )
        if policy.needs and any(policy.needs[0] not in record for record in served.records):
            raise InputError(
                "PTM-I701",
                f"policy {policy.name} needs {policy.needs[0]}, which the hints do not have",
                file=served.folder,
                remedy=policy.needs[1],
            )


def apply_counting(world: World, options: SimulateOptions) -> World:
    """The world with texture memory and requested ranges as the options define them."""
    world = world.change_all(lambda w: replace(w, one_range=w.one_range or options.one_range))
    return world.change_all(World.counted_by_paper) if options.paper_bytes else world


def budget_of(world: World, memory: MemorySize, form: str = PTM) -> int:
    """Bytes of texture memory. A share is relative to all `.ptm`s, whatever the form of the
    textures; no limit is the memory of all textures in that form."""
    limit = memory.limit_of(world.catalogue.whole)
    return world.in_form(form).catalogue.whole if limit is None else limit


def play(
    worlds: Mapping[str, World],
    options: SimulateOptions,
    trace: Trace | None = None,
    progress: Progress = silent,
    *,
    flip: bool = False,
    campuses: Mapping[str, CampusWorld] = MappingProxyType({}),
    paper: PaperOptions | None = None,
) -> list[RunResult]:
    """Simulates all runs, ordered by link, memory, policy, walk; those of a campus after the
    others.

    Parameters
    ----------
    flip: also measure FLIP, for clients of the database.
    campuses: for policies of a campus, each walk through it.
    paper: options of the policy `paper`.

    Raises
    ------
    KeyError: a policy is of a campus, and a walk is missing in ``campuses``.
    InputError: PTM-I701 a policy's hints, or the textures in its form, are missing; PTM-I111.
    MissingComponentError: PTM-M100 with ``flip``, without flip-evaluator.
    """
    configured = [policy.with_options(paper or PaperOptions()) for policy in options.policies]
    policies: list[PolicyEntry | CampusPolicy] = [*configured, *options.campus_policies]
    cases = [
        (link, memory, policy, name)
        for link in options.links(trace)
        for memory in options.memories
        for policy in policies
        for name in worlds
    ]
    for world in worlds.values():
        require_hints(world.served, options.policies)
    in_form = {
        (name, p.form): w.in_form(p.form) for name, w in worlds.items() for p in options.policies
    }
    standing = {key: world.standing(STANDS) for key, world in in_form.items()}
    flips = {key: Flip(world) for key, world in in_form.items()} if flip else {}
    result = []
    for done, (link, memory, policy, name) in enumerate(cases):
        progress(done, len(cases), "simulating")
        if isinstance(policy, CampusPolicy):
            limit = memory.limit_of(worlds[name].catalogue.whole)
            outcome = measure_campus_walk(campuses[name], worlds[name], policy, link, limit)
            result.append(RunResult(name, memory.text, *outcome))
            continue
        key = name, policy.form
        world, budget = in_form[key], budget_of(worlds[name], memory, policy.form)
        run = simulate(world, policy, link, budget)
        standing_run = simulate(standing[key], policy, link, budget)
        seen = float(flips[key].each(run).mean()) if flip else None
        result.append(RunResult(name, memory.text, run, measure(run, world, standing_run), seen))
    return result


def _parts(text: str) -> list[str]:
    """The parts of a list, each once."""
    return list(dict.fromkeys(part.strip() for part in text.split(",")))
