"""A summary of a PVS: sizes of the sets, most expensive portals, leaks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ptmtools.cells.model import Cells
from ptmtools.quantities import count
from ptmtools.visibility.model import Pvs

#: Portals listed by the work that they took.
COSTLIEST = 10
#: Shares of the cells for which the sizes of their sets are reported.
QUANTILES = (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0)
#: Leaks that are listed without ``-v``.
SHOWN_LEAKS = 5


@dataclass(frozen=True)
class PortalFacts:
    """One portal: its number, the two cells that it joins, its area in m² truly open, and its
    centre, (x, y, z) metres, world coordinates, the mean of its vertices."""

    portal: int
    cells: tuple[int, int]
    area: float
    centre: tuple[float, float, float]


@dataclass(frozen=True)
class CostlyPortal(PortalFacts):
    """A portal with the operations that its search took, and whether the budget ended it."""

    operations: int
    cut: bool


@dataclass(frozen=True)
class LeakingPortal(PortalFacts):
    """A portal with a row of `Pvs.leak`: a cell, how many it sees, and how many through this."""

    cell: int
    sees: int
    through: int


@dataclass(frozen=True)
class PvsReport:
    """The result of `report`.

    Attributes
    ----------
    cells, portals: their numbers. doors: number of portals between two cells.
    sizes: share of the cells → cells that this share of them sees at most, for `QUANTILES`.
    average: cells that a cell sees, itself included.
    operations, fallbacks, ties, decided, opened: totals of what `Pvs` counts for each portal.
    costliest: the portals that took most work, most first. leaks: those that see most first.
    conservative: as in `Pvs`.
    """

    cells: int
    portals: int
    doors: int
    sizes: tuple[tuple[float, int], ...]
    average: float
    operations: int
    fallbacks: int
    ties: int
    decided: int
    opened: int
    costliest: tuple[CostlyPortal, ...]
    leaks: tuple[LeakingPortal, ...]
    conservative: bool


def report(cells: Cells, pvs: Pvs) -> PvsReport:
    """The summary of the PVS of a subdivision."""
    sees = np.sort(np.diff(pvs.start))
    count = len(sees)
    at = [min(count - 1, int(np.ceil(q * count)) - 1) if q else 0 for q in QUANTILES]
    order = np.lexsort((np.arange(len(pvs.work)), -pvs.work))[:COSTLIEST]
    ends = cells.portal_cell
    return PvsReport(
        cells=count,
        portals=cells.portal_count,
        doors=int(np.count_nonzero((ends[:, 0] != ends[:, 1]) & (ends >= 0).all(axis=1))),
        sizes=tuple((q, int(sees[i])) for q, i in zip(QUANTILES, at, strict=True) if count),
        average=float(sees.mean()) if count else 0.0,
        operations=int(pvs.work.sum()),
        fallbacks=pvs.fallbacks,
        ties=int(pvs.ties.sum()),
        decided=int(pvs.decided.sum()),
        opened=int(pvs.opened.sum()),
        costliest=tuple(
            CostlyPortal(**_facts(cells, int(k)), operations=int(pvs.work[k]), cut=bool(pvs.cut[k]))
            for k in order
        ),
        leaks=tuple(
            LeakingPortal(**_facts(cells, portal), cell=cell, sees=sees, through=through)
            for cell, sees, portal, through in pvs.leak.tolist()
        ),
        conservative=pvs.conservative,
    )


def _facts(cells: Cells, k: int) -> dict[str, Any]:
    a, b = (int(cells.leaf_cell[leaf]) for leaf in cells.portal_leaf[k])
    return {
        "portal": k,
        "cells": (a, b),
        "area": float(cells.portal_area[k]),
        "centre": tuple(cells.portal(k).mean(axis=0).tolist()),
    }


def report_lines(report: PvsReport, *, verbose: bool = False) -> Iterator[str]:
    """The report as text; with ``verbose``, all leaks."""
    yield (
        f"{count(report.cells, 'cell')}, {count(report.portals, 'portal')} (openings), "
        f"{report.doors:,} of them between cells; a cell sees {report.average:.1f} cells on "
        "average, including itself"
    )
    if not report.conservative:
        yield "sampled: cells that no random line reached are missing"
    if report.cells > 1:
        yield "cells visible from a cell: " + ", ".join(_share(*size) for size in report.sizes)
    if report.costliest:
        cut = f"; budget spent at {count(report.fallbacks, 'portal')}" if report.fallbacks else ""
        yield f"{report.operations:,} operations{cut}"
        if report.ties:
            yield _near_ties(report)
        yield "most expensive portals, with their operations:"
        for portal in report.costliest:
            cut = ", budget spent" if portal.cut else ""
            yield f"  {portal.operations:10,}  {_place(portal)}{cut}"
    if not report.leaks:
        if report.cells > 1:
            yield (
                "no leaks: no cell sees an unusually large part of the building through a single "
                "opening"
            )
        return
    yield "cells whose visible set is more than three times the median, each with the smallest"
    yield "opening through which at least half of its set is visible (an unintended gap?):"
    shown = len(report.leaks) if verbose else SHOWN_LEAKS
    for leak in report.leaks[:shown]:
        yield (
            f"  cell {leak.cell} sees {leak.sees:,} cells, {leak.through:,} of them through "
            f"{_place(leak)}"
        )
    if len(report.leaks) > shown:
        yield f"  … and {len(report.leaks) - shown} more; -v shows them"


def _near_ties(report: PvsReport) -> str:
    """The outcome of the lines of sight that double precision cannot decide."""
    ties = count(report.ties, "near tie") + " (lines of sight that graze an edge)"
    if not report.decided:
        return f"{ties}; the result does not depend on any"
    return (
        f"{ties}; {report.decided:,} could change the result and were checked in higher precision: "
        f"{report.decided - report.opened:,} blocked, {report.opened:,} visible"
    )


def _share(share: float, sees: int) -> str:
    """The most cells that this share of the cells see."""
    match share:
        case 0.0:
            return f"minimum {sees:,}"
        case 0.5:
            return f"median {sees:,}"
        case 1.0:
            return f"maximum {sees:,}"
    return f"{share:.0%} of cells ≤ {sees:,}"


def _place(portal: PortalFacts) -> str:
    a, b = portal.cells
    where = f"between cells {a} and {b}" if a != b else f"inside cell {a}"
    at = ",".join(f"{c:.2f}" for c in portal.centre)
    return f"portal {portal.portal} {where}, {portal.area:.3g} m² at {at}"
