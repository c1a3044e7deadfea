"""The policies of clients as a table: the strategy of each.

To add one, add a module with a `Client`, or a policy of the `engine`, and a line here, or an entry
point of the group ``ptmtools.policies`` in another package (`ptmtools.plugins`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ptmtools import plugins
from ptmtools.arrays import Ints
from ptmtools.errors import MissingComponentError
from ptmtools_lab.client import Client
from ptmtools_lab.forms import PTM
from ptmtools_lab.network import FluidLink
from ptmtools_lab.policies import shares
from ptmtools_lab.policies.apo import ApoClient
from ptmtools_lab.policies.engine import EngineClient, Oracle, Policy
from ptmtools_lab.policies.paper import PaperClient, PaperOptions
from ptmtools_lab.policies.shares import BEST, ScreenPolicy, Weighted
from ptmtools_lab.policies.whole_files import GpuiiClient, LruClient, WholeClient
from ptmtools_lab.world import World


@dataclass(frozen=True)
class PolicyEntry:
    """A policy.

    Attributes
    ----------
    name, about: for `--policy`.
    client: makes a client, in a world, on a link, with a budget.
    options: its own options, if any; see `configured`.
    needs: a field that the records of cells must have, and how to get it; None: no optional field.
    form: form of its textures, a name in `ptmtools_lab.forms.FORMS`.
    previews: whether its clients show previews, and begin with the opening of the site; those of
        others have the `.ptm`s only.
    """

    name: str
    about: str
    client: Callable[..., Client]
    needs: tuple[str, str] | None = None
    form: str = PTM
    previews: bool = False
    options: PaperOptions | None = None

    def with_options(self, options: PaperOptions) -> PolicyEntry:
        """The policy with other options, if it has any."""
        if self.options is None:
            return self
        return replace(self, options=options, client=partial(self.client, options=options))

    def in_world(self, world: World) -> World:
        """The world as its clients know it: textures in their form. Raises InputError PTM-I701 if
        the world was not prepared for that form."""
        world = world.in_form(self.form)
        if self.previews:
            return world
        return replace(world, catalogue=world.catalogue.without_previews, opening=())

    def limits(self, world: World, budget: int) -> Ints:
        """(F,) bytes of texture memory that a client with a budget may use in each frame."""
        whole = np.full(world.frames, budget, np.int64)
        return self.options.limits(world, budget) if self.options else whole


def _engine(policy: Policy, *, statistics: bool = False) -> Callable[..., Client]:
    return partial(EngineClient, policy=policy, statistics=statistics)


def _oracle(world: World, link: FluidLink, budget: int, *, exchanging: bool = False) -> Client:
    return EngineClient(world, link, budget, Oracle(world, exchanging=exchanging))


_LIST = (
    PolicyEntry(
        "paper", "client of Marvie & Bouatouch, §6.1 and §6.2", PaperClient, options=PaperOptions()
    ),
    PolicyEntry("lru", "whole files in order of use, with a cache", LruClient),
    PolicyEntry("whole", "as lru, without levels: textures whole or not at all", WholeClient),
    PolicyEntry(
        "gpuii",
        "client of Englert et al., §3.3: interlaced images, in rings around the camera",
        GpuiiClient,
        form="interlaced",
    ),
    PolicyEntry(
        "ach",
        "average coverage hints, with the loader that most policies share",
        _engine(Weighted(shares.coverage_shares)),
    ),
    PolicyEntry(
        "ach-views",
        "coverage hints of the six views",
        _engine(Weighted(shares.by_views), statistics=True),
    ),
    PolicyEntry(
        "ach-texture",
        "coverage hints of textures (`ptm ach --per-texture`)",
        _engine(Weighted(shares.by_texture)),
        needs=("textureShares", "measure it with `ptm ach DB --per-texture`, then `ptm emit DB`"),
    ),
    PolicyEntry("distance", "nearest cells first", _engine(Weighted(shares.distance_shares))),
    PolicyEntry(
        "bbox", "screen area of bounding boxes, without occlusion", _engine(Weighted(shares.by_box))
    ),
    PolicyEntry(
        "screen", "screen area of each texture, from an item buffer", _engine(ScreenPolicy())
    ),
    PolicyEntry(
        "screen+distance", "screen area and distance", _engine(ScreenPolicy(shares.by_distance))
    ),
    PolicyEntry(
        "screen+ach",
        "screen area and average coverage hints",
        _engine(ScreenPolicy(shares.by_coverage)),
    ),
    PolicyEntry(
        "screen+need",
        "screen area and the resolution needed in the cell",
        _engine(ScreenPolicy(shares.by_need)),
        needs=("need", "measure it with `ptm emit DB --need 16`"),
    ),
    PolicyEntry(
        "best",
        "policy of the viewer: screen area, needed resolution and distance, also for previews",
        _engine(BEST),
        previews=True,
    ),
    PolicyEntry("best-exact", "best without previews", _engine(BEST)),
    PolicyEntry(
        "apo",
        "client of Lacoste et al., §4.2: octree textures level by level; other textures as in best",
        ApoClient,
        form="octree",
    ),
    PolicyEntry("best+apo", "best, also for octree textures", _engine(BEST), form="octree"),
    PolicyEntry("oracle", "greedy, with knowledge of the whole walk", _oracle, previews=True),
    PolicyEntry(
        "oracle-exchange",
        "as oracle, but also exchanges levels in memory",
        partial(_oracle, exchanging=True),
        previews=True,
    ),
)


def named_policies() -> dict[str, PolicyEntry]:
    """The policies of ptmtools by name, then those of other packages.

    Raises MissingComponentError: PTM-M110 as `plugins.declarations`, or a name is taken.
    """
    table = {policy.name: policy for policy in _LIST}
    for policy in plugins.declarations("policies", PolicyEntry).values():
        if table.setdefault(policy.name, policy) is not policy:
            raise MissingComponentError(
                "PTM-M110",
                f"a plug-in declares the policy {policy.name!r}, which ptmtools has",
                remedy="update or uninstall that package",
            )
    return table


POLICIES = named_policies()

__all__ = ["POLICIES", "PolicyEntry", "named_policies"]
