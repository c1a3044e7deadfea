"""The policies of clients as a table: the strategy of each.

To add one, add a module with a `Client`, or a policy of the `engine`, and a line here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ptmtools.arrays import Ints
from ptmtools.lab.client import Client
from ptmtools.lab.forms import PTM
from ptmtools.lab.network import Link
from ptmtools.lab.policies import shares
from ptmtools.lab.policies.apo import ApoClient
from ptmtools.lab.policies.engine import EngineClient, Policy
from ptmtools.lab.policies.oracle import Oracle
from ptmtools.lab.policies.paper import PaperClient, PaperOptions
from ptmtools.lab.policies.shares import BEST, Screen
from ptmtools.lab.policies.whole_files import GpuiiClient, LruClient
from ptmtools.lab.world import World


@dataclass(frozen=True)
class PolicyEntry:
    """A policy.

    Attributes
    ----------
    name, about: for `--policy`.
    client: makes a client, in a world, on a link, with a budget.
    options: its own options, if any; see `configured`.
    needs: a field that the records of cells must have, and how to get it; None: no optional field.
    form: form of its textures, a name in `ptmtools.lab.forms.FORMS`.
    """

    name: str
    about: str
    client: Callable[..., Client]
    needs: tuple[str, str] | None = None
    form: str = PTM
    options: PaperOptions | None = None

    def configured(self, options: PaperOptions) -> PolicyEntry:
        """The policy with other options, if it has any."""
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
    PolicyEntry(
        "paper", "client of Marvie & Bouatouch, §6.1 and §6.2", PaperClient, options=PaperOptions()
    ),
    PolicyEntry("lru", "whole files in order of use, with a cache", LruClient),
    PolicyEntry(
        "gpuii",
        "client of Englert et al., §3.3: interlaced images by rings around the camera",
        GpuiiClient,
        form="interlaced",
    ),
    PolicyEntry(
        "ach",
        "average coverage hints, in the engine that most policies share",
        _same(shares.Weighted(shares.coverage_shares)),
    ),
    PolicyEntry(
        "ach-views",
        "coverage hints of the six views",
        _same(shares.Weighted(shares.by_views), statistics=True),
    ),
    PolicyEntry(
        "ach-texture",
        "coverage hints of textures (`ptm ach --per-texture`)",
        _same(shares.Weighted(shares.by_texture)),
        needs=("textureShares", "measure it with `ptm ach DB --per-texture`, then `ptm emit DB`"),
    ),
    PolicyEntry("distance", "nearest cells first", _same(shares.Weighted(shares.distance_shares))),
    PolicyEntry(
        "bbox", "screen area of boxes, without occlusion", _same(shares.Weighted(shares.by_box))
    ),
    PolicyEntry("screen", "pixels of an item buffer", _same(Screen())),
    PolicyEntry("screen+distance", "screen, and near cells", _same(Screen(shares.by_distance))),
    PolicyEntry(
        "screen+ach", "screen, and average coverage hints", _same(Screen(shares.by_coverage))
    ),
    PolicyEntry(
        "screen+need",
        "screen, and the resolution needed in the cell",
        _same(Screen(shares.by_need)),
        needs=("need", "measure it with `ptm emit DB --need 16`"),
    ),
    PolicyEntry("best", "policy of the viewer: screen, need and distance", _same(BEST)),
    PolicyEntry(
        "apo",
        "client of Lacoste et al., §4.2: octree textures level by level; other textures as in best",
        ApoClient,
        form="octree",
    ),
    PolicyEntry("best+apo", "best, also for octree textures", _same(BEST), form="octree"),
    PolicyEntry("oracle", "knows the walk; greedy", _engine(Oracle)),
    PolicyEntry(
        "oracle-exchange",
        "knows the walk; also exchanges levels in memory",
        _engine(partial(Oracle, exchanging=True)),
    ),
)
#: Policies by name.
POLICIES = {policy.name: policy for policy in _LIST}

__all__ = ["POLICIES", "PolicyEntry"]
