"""The stage that cuts the scene into convex leaves, cells of leaves, and portals (paper §3)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ptmtools.cells.options import SubdivideOptions
from ptmtools.lazy import Lazy
from ptmtools.pipeline.stage import Counts, Stage
from ptmtools.pipeline.stages.scene import SCENE
from ptmtools.quantities import count

if TYPE_CHECKING:
    from ptmtools.cells.model import Cells


class CellsStage(Stage["Cells"]):
    """See `ptmtools.cells.subdivide`."""

    name = "cells"
    about = "Read a model and divide its space into cells and portals."
    recipe = 14
    changed = "curved walls divide less, and gardens take no storeys from houses"
    options = SubdivideOptions
    reads = (SCENE,)
    artifact = Lazy("ptmtools.cells.model:Cells")
    from_model = True
    one_thread = True

    def compute(self, *args: Any) -> Cells:
        from ptmtools.cells import subdivide

        return subdivide(*args)

    def counts(self, cells: Cells) -> Counts:
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

    def notes(self, cells: Cells, options: SubdivideOptions) -> tuple[str, ...]:
        return cells.notes

    def summary(self, n: Counts) -> str:
        leaves = ""
        if n["leaves"] != n["cells"]:
            leaves = f" of {count(n['leaves'], 'convex leaf', 'convex leaves')}"
        state = f"{'closed' if n['closed'] else 'open'} to the outside"
        view = f" ({n['view_only']:,} view-only, never entered)" if n.get("view_only") else ""
        return (
            f"{count(n['cells'], 'cell')}{view}{leaves}, {count(n['portals'], 'portal')}; {state}"
        )

    def misfit(self, cells: Cells, source: Stage[Any], contents: Any) -> str:
        foreign = source is SCENE and (cells.triangle_source >= len(contents.triangles)).any()
        return "a piece belongs to no triangle of the scene" if foreign else ""


CELLS = CellsStage()
