"""The stage that cuts the scene into convex leaves, cells of leaves, and portals (paper §3)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ptmtools.cells.options import SubdivideOptions
from ptmtools.lazy import Lazy
from ptmtools.pipeline.stage import Stage
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.quantities import count

if TYPE_CHECKING:
    from ptmtools.cells.model import Cells
    from ptmtools.scene.model import Scene


def _counts(cells: Cells) -> Mapping[str, Any]:
    return {
        "cells": cells.cell_count,
        "view_only": int((~cells.standing).sum()),
        "leaves": cells.leaf_count,
        "dropped": int((cells.leaf_cell < 0).sum()),
        "portals": cells.portal_count,
        "pieces": len(cells.triangle),
        "owners": cells.owners,
        "closed": cells.closed,
    }


def _summary(n: Mapping[str, Any]) -> str:
    leaves = ""
    if n["leaves"] != n["cells"]:
        leaves = f" of {count(n['leaves'], 'convex leaf', 'convex leaves')}"
    state = f"{'closed' if n['closed'] else 'open'} to the outside"
    view = f" ({n['view_only']:,} view-only, never entered)" if n.get("view_only") else ""
    return f"{count(n['cells'], 'cell')}{view}{leaves}, {count(n['portals'], 'portal')}; {state}"


def _fits_scene(cells: Cells, scene: Scene) -> str:
    foreign = (cells.triangle_source >= len(scene.triangles)).any()
    return "a piece belongs to no triangle of the scene" if foreign else ""


CELLS: Stage[Cells] = Stage(
    name="cells",
    about="Read a model and divide its space into cells and portals.",
    recipe=9,
    options=SubdivideOptions,
    reads=(SCENE,),
    changed="division ends where it saves visitors little (--gain); cells are walkable space, or "
    "space visible from it",
    artifact=Lazy("ptmtools.cells.model:Cells"),
    compute=Lazy("ptmtools.cells:subdivide"),
    counts=_counts,
    notes=lambda cells, _: cells.notes,
    summary=_summary,
    fits={SCENE: _fits_scene},
    from_model=True,
    one_thread=True,
)
