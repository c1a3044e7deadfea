"""Policies, links and amounts of texture memory, all with all, on some walks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import ClassVar, Literal

from ptmtools.errors import InputError
from ptmtools.lab.campus.simulation import CAMPUS_POLICIES, CampusPolicy, walk_beside
from ptmtools.lab.campus.world import CampusWorld
from ptmtools.lab.forms import FORMS, PTM
from ptmtools.lab.measures import STANDS, Flip, Measures, measure
from ptmtools.lab.policies import POLICIES, Declared
from ptmtools.lab.policies.paper import PaperOptions
from ptmtools.lab.simulation import Run, simulate
from ptmtools.lab.world import World
from ptmtools.link import Conditions, Trace
from ptmtools.options import option
from ptmtools.output.served import Served
from ptmtools.progress import Progress, silent
from ptmtools.quantities import MemorySize, parse_bandwidth, parse_duration, parse_memory


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
        "Bandwidth of the link in bit/s: 56k, 4M (powers of ten) or inf. Commas separate several "
        "values.",
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
        "Texture memory: 4MiB, 10% of that of all textures, or inf. Commas separate several "
        "values.",
        metavar="SIZE[,SIZE]",
    )
    paper_bytes: bool = option(
        False,
        "Count three bytes per RGB texel, as the paper does, not four as graphics processors do.",
    )
    one_range: bool = option(False, "Request one range of a file at a time, as browsers do.")
    lit: bool = option(
        False, "Light the pictures, so that relief is visible; policies of octree textures need it."
    )

    def __post_init__(self) -> None:
        self.links()
        self.memories  # noqa: B018 - both raise for what cannot be read
        unseen = [p.name for p in self.policies if FORMS[p.form].octrees]
        if unseen and not self.lit:
            raise InputError(
                "PTM-I701",
                f"policy {unseen[0]} fetches relief, which only lit pictures show",
                remedy="give --lit, too",
            )
        if self.campus_policies and self.lit:
            raise InputError(
                "PTM-I701",
                f"policy {self.campus_policies[0].name} shows nothing lit",
                remedy="leave out --lit, or that policy",
            )

    @property
    def policies(self) -> list[Declared]:
        """Those of clients of the database, in the order given."""
        return [POLICIES[name] for name in _parts(self.policy) if name in POLICIES]

    @property
    def campus_policies(self) -> list[CampusPolicy]:
        """Those of clients of a campus, in the order given."""
        return [CAMPUS_POLICIES[name] for name in _parts(self.policy) if name in CAMPUS_POLICIES]

    @property
    def memories(self) -> list[MemorySize]:
        """In the order given; raises InputError PTM-I111."""
        return [parse_memory(part) for part in _parts(self.memory)]

    def links(self, trace: Trace | None = None) -> list[Conditions]:
        """A link for each bandwidth, however it is written, all as the trace says; raises
        InputError PTM-I111."""
        latency = parse_duration(self.latency)
        bandwidths = dict.fromkeys(parse_bandwidth(part) for part in _parts(self.bandwidth))
        return [
            Conditions(bandwidth, latency, self.overhead, self.protocol, trace=trace)
            for bandwidth in bandwidths
        ]


@dataclass(frozen=True)
class Played:
    """A run and its place among the others.

    Attributes
    ----------
    walk, memory: what they are called.
    flip: mean FLIP of some frames, if it was asked for.
    """

    walk: str
    memory: str
    run: Run
    measures: Measures
    flip: float | None = None


def require_hints(served: Served, policies: Sequence[Declared]) -> None:
    """Raises InputError PTM-I701 if the records lack what a policy needs, or the textures are not
    there in its form."""
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


def counted(world: World, options: SimulateOptions) -> World:
    """The world with texture memory counted, and ranges asked for, as the options say."""
    world = world.changed(lambda w: replace(w, one_range=w.one_range or options.one_range))
    return world.changed(World.counted_by_paper) if options.paper_bytes else world


def budget_of(world: World, memory: MemorySize, form: str = PTM) -> int:
    """Bytes of texture memory: a share is of what all `.ptm`s take, in whatever form clients take
    textures; no limit is what all take in that form."""
    held = memory.of(world.catalogue.whole)
    return world.in_form(form).catalogue.whole if held is None else held


def play(
    worlds: Mapping[str, World],
    options: SimulateOptions,
    trace: Trace | None = None,
    progress: Progress = silent,
    *,
    flip: bool = False,
    campuses: Mapping[str, CampusWorld] = MappingProxyType({}),
    paper: PaperOptions | None = None,
) -> list[Played]:
    """All runs: by link, memory, policy, walk; those of a campus after the others.

    Parameters
    ----------
    flip: also measure that, of clients of the database.
    campuses: each walk through a campus, where a policy is of one.
    paper: options of the policy `paper`.

    Raises
    ------
    KeyError: a policy is of a campus, and a walk has none.
    InputError: PTM-I701 a policy's hints, or the textures in its form, are not there; PTM-I111.
    MissingComponentError: PTM-M100 with ``flip``, without flip-evaluator.
    """
    own = [policy.configured(paper or PaperOptions()) for policy in options.policies]
    policies: list[Declared | CampusPolicy] = [*own, *options.campus_policies]
    cases = [
        (link, memory, policy, name)
        for link in options.links(trace)
        for memory in options.memories
        for policy in policies
        for name in worlds
    ]
    for world in worlds.values():
        require_hints(world.served, options.policies)
    taken = {
        (name, p.form): w.in_form(p.form) for name, w in worlds.items() for p in options.policies
    }
    standing = {of: world.standing(STANDS) for of, world in taken.items()}
    looks = {of: Flip(world) for of, world in taken.items()} if flip else {}
    result = []
    for done, (link, memory, policy, name) in enumerate(cases):
        progress(done, len(cases), "simulating")
        if isinstance(policy, CampusPolicy):
            held = memory.of(worlds[name].catalogue.whole)
            both = walk_beside(campuses[name], worlds[name], policy, link, held)
            result.append(Played(name, memory.text, *both))
            continue
        of = name, policy.form
        world, budget = taken[of], budget_of(worlds[name], memory, policy.form)
        run = simulate(world, policy, link, budget)
        stood = simulate(standing[of], policy, link, budget)
        seen = float(looks[of].each(run).mean()) if flip else None
        result.append(Played(name, memory.text, run, measure(run, world, stood), seen))
    return result


def _parts(text: str) -> list[str]:
    """Each once."""
    return list(dict.fromkeys(part.strip() for part in text.split(",")))
