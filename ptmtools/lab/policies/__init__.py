"""What clients there are, as a table: what each goes by, and what it needs to know.

To add one: a module with a `Client`, or a policy of the `engine`, and a line here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.lab.client import Client
from ptmtools.lab.forms import PTM
from ptmtools.lab.network import Link
from ptmtools.lab.policies import shares as around, shares as coverage
from ptmtools.lab.policies.apo import ApoClient
from ptmtools.lab.policies.engine import EngineClient, Policy
from ptmtools.lab.policies.oracle import Oracle
from ptmtools.lab.policies.paper import PaperClient, PaperOptions
from ptmtools.lab.policies.shares import BEST, Screen
from ptmtools.lab.policies.whole_files import GpuiiClient, LruClient
from ptmtools.lab.world import World


class Knows(Enum):
    """What a client must know, each beside what comes before it."""

    HINTS = "hints"
    CAMERA = "hints and camera"
    SCREEN = "hints, camera and an item buffer"
    FUTURE = "the future"


@dataclass(frozen=True)
class Declared:
    """A policy.

    Attributes
    ----------
    name, about: for `--policy`.
    knows: what it needs.
    client: makes a client of it, in a world, on a link, with a budget.
    options: its own options, if it has some; see `configured`.
    needs: a field that the records of cells must have, and how to get it; None: as they always are.
    form: in which it takes textures, a name in `ptmtools.lab.forms.FORMS`.
    """

    name: str
    about: str
    knows: Knows
    client: Callable[..., Client]
    needs: tuple[str, str] | None = None
    form: str = PTM
    options: PaperOptions | None = None

    def configured(self, options: PaperOptions) -> Declared:
        """The policy with other options, if it has some."""
        if self.options is None:
            return self
        return replace(self, options=options, client=partial(self.client, options=options))

    def limits(self, world: World, budget: int) -> Ints:
        """(F,) bytes of texture memory that a client with a budget may use in each frame."""
        whole = np.full(world.frames, budget, np.int64)
        return self.options.limits(world, budget) if self.options else whole


def _engine(
    make: Callable[[World], Policy], *, statistics: bool = False
) -> Callable[[World, Link, int], Client]:
    def client(world: World, link: Link, budget: int) -> Client:
        return EngineClient(world, link, budget, make(world), statistics=statistics)

    return client


def _same(policy: Policy, *, statistics: bool = False) -> Callable[[World, Link, int], Client]:
    return _engine(lambda _: policy, statistics=statistics)


_LIST = (
    Declared(
        "paper",
        "client of Marvie & Bouatouch, §6.1 and §6.2",
        Knows.CAMERA,
        PaperClient,
        options=PaperOptions(),
    ),
    Declared("lru", "whole files in order of use, with a cache", Knows.CAMERA, LruClient),
    Declared(
        "gpuii",
        "client of Englert et al., §3.3: interlaced images by rings around the camera",
        Knows.CAMERA,
        GpuiiClient,
        form="interlaced",
    ),
    Declared(
        "ach",
        "average coverage hints, in the engine that most policies share",
        Knows.CAMERA,
        _same(coverage.Weighted(coverage.coverage_shares)),
    ),
    Declared(
        "ach-views",
        "coverage hints of the six views",
        Knows.CAMERA,
        _same(coverage.Weighted(coverage.by_views), statistics=True),
    ),
    Declared(
        "ach-texture",
        "coverage hints of textures (`ptm ach --per-texture`)",
        Knows.CAMERA,
        _same(coverage.Weighted(coverage.by_texture)),
        needs=("textureShares", "measure it with `ptm ach DB --per-texture`, then `ptm emit DB`"),
    ),
    Declared(
        "distance",
        "nearest cells first",
        Knows.CAMERA,
        _same(coverage.Weighted(coverage.distance_shares)),
    ),
    Declared(
        "bbox",
        "screen area of boxes, without occlusion",
        Knows.CAMERA,
        _same(coverage.Weighted(coverage.by_box)),
    ),
    Declared("screen", "pixels of an item buffer", Knows.SCREEN, _same(Screen())),
    Declared(
        "screen+distance",
        "screen, and near cells",
        Knows.SCREEN,
        _same(Screen(around.by_distance)),
    ),
    Declared(
        "screen+ach",
        "screen, and average coverage hints",
        Knows.SCREEN,
        _same(Screen(around.by_coverage)),
    ),
    Declared(
        "screen+need",
        "screen, and the resolution needed in the cell",
        Knows.SCREEN,
        _same(Screen(around.by_need)),
        needs=("need", "measure it with `ptm emit DB --need 16`"),
    ),
    Declared("best", "policy of the viewer: screen, need and distance", Knows.SCREEN, _same(BEST)),
    Declared(
        "apo",
        "client of Lacoste et al., §4.2: octree textures level by level; other textures as in best",
        Knows.SCREEN,
        ApoClient,
        form="octree",
    ),
    Declared(
        "best+apo",
        "best, also for octree textures",
        Knows.SCREEN,
        _same(BEST),
        form="octree",
    ),
    Declared("oracle", "knows the walk; greedy", Knows.FUTURE, _engine(Oracle)),
    Declared(
        "oracle-exchange",
        "knows the walk; also exchanges levels in memory",
        Knows.FUTURE,
        _engine(partial(Oracle, exchanging=True)),
    ),
)
#: By name.
POLICIES = {policy.name: policy for policy in _LIST}

__all__ = ["POLICIES", "Declared", "Knows"]
