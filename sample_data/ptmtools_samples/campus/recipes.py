"""Recipes of buildings, and their window styles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ptmtools_samples.campus.facade import FacadeLook
from ptmtools_samples.campus.openings import Style
from ptmtools_samples.campus.solids import Ring


@dataclass(frozen=True)
class Recipe:
    """A building: footprint, facades, roof, and attachments.

    ``roof``: kind, surface, and rise over run of sloped roofs. ``door_wall``: number of the wall
    with the entrance. ``extras``: names that `ptmtools_samples.campus.buildings` implements.
    """

    name: str
    label: str
    footprint: Callable[[], list[Ring]]
    look: FacadeLook
    roof: tuple[str, str] = ("flat", "roof_gravel")
    pitch: float = 0.8
    door_wall: int = 0
    extras: frozenset[str] = field(default_factory=frozenset)


SASH = Style(panes=(2, 3), depth=0.14, bar=0.05)
CASEMENT = Style(panes=(2, 2), transom=True)
CROSS = Style(panes=(2, 2), transom=True, depth=0.24, surround="frame", frame="paint_green")
NOBLE = Style(panes=(2, 3), depth=0.2, surround="pediment")
ROUND = Style(arched=True, depth=0.3, surround="keystone", frame="metal_dark", bar=0.08)
MODERN = Style(panes=(3, 1), frame="metal_dark", depth=0.12, sill=False)
RIBBON = Style(panes=(2, 2), frame="metal", depth=0.1, transom=True)
CURTAIN = Style(panes=(2, 2), frame="metal_dark", glass=("glass_sky",), depth=0.08, sill=False)
PLAIN = Style(panes=(2, 1), frame="paint_white", depth=0.18)
LINTEL = Style(panes=(3, 3), frame="metal_dark", depth=0.2, surround="lintel", transom=True)
SHOP = Style(
    panes=(2, 2), frame="metal_dark", depth=0.3, glass=("glass_dark", "glass_sky"), transom=True
)


def look(wall: str, style: Style, **more: object) -> FacadeLook:
    known = {"ground": wall, "ground_style": style, **more}
    return FacadeLook(wall=wall, style=style, **known)  # type: ignore[arg-type]


def recipe(
    name: str,
    label: str,
    footprint: Callable[[], list[Ring]],
    facade: FacadeLook,
    roof: str = "flat roof_gravel",
    extras: str = "",
    **more: Any,
) -> Recipe:
    kind, surface = roof.split()
    return Recipe(
        name, label, footprint, facade, (kind, surface), extras=frozenset(extras.split()), **more
    )
