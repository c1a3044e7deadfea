"""From counts at sample points to hints, and how far they can be trusted.

A hint is a ratio, the pixels of one cell over all pixels, both summed over the sample points. Its
standard error comes from eight groups of points, by the linearised ratio (Cochran, *Sampling
Techniques*, 1977, §6.4). Where the groups are independently scrambled (``--tolerance``) it is
honest; where they are stretches of one sequence, which complement one another, it is too large,
by a factor of about two; of eight single points it is too small at times.

The error of a whole row is its total variation, half the sum of absolute differences. The distance
of each group's own hints from the mean says how that is distributed: a mean of R groups is closer
to the truth than a group to the mean by the square root of R - 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, Ints

#: Groups of sample points that the standard error is taken from.
GROUPS = 8
#: Student's t for GROUPS - 1 degrees of freedom, two-sided 95 %. One-sided would be 1.895, but
#: distances lean to one side: where two cells share the view, that bound held in 91 % of the cases.
STUDENT_T = 2.365
#: Rule of three: what did not happen in K trials happens in less than 3/K of all, at 95 %.
RULE_OF_THREE = 3.0


@dataclass(frozen=True)
class Row:
    """The hints of one cell, for each of the n cells of its PVS: see `Ach`.

    `uncertain` is NaN with fewer than eight points, which would not tell: of two it held in half of
    the cases.
    """

    value: Floats
    pixels: Floats
    error: Floats
    p95: Floats
    seen: Floats
    views: Floats
    uncertain: float


def shares(counts: Ints) -> Floats:
    """(…, n) counts over their sums; where that is 0, 1 for the first of the n.

    Each quotient is off by half a unit in its last place at most, so the exact sum of a row is
    within 1.2e-16 of 1.
    """
    total = counts.sum(axis=-1, keepdims=True)
    found = counts / np.maximum(total, 1)
    if found.shape[-1]:
        found[..., 0] += total[..., 0] == 0
    return np.asarray(found)


def estimate(at_points: Ints, in_views: Ints, group: Ints, unit: int) -> Row:
    """The hints from (K, n) weighted pixels at K points, each of the (K,) ``group``, and (6, n) of
    the same in each view; a pixel in the middle of a view weighs ``unit``."""
    total = in_views.sum(axis=0)
    value = shares(total)
    error, uncertain = spread(at_points, group)
    return Row(
        value=value,
        pixels=total / unit,
        error=np.where(total > 0, error, np.nan),
        p95=ninety_fifth(at_points),
        seen=np.count_nonzero(at_points, axis=0) / max(len(at_points), 1),
        views=shares(in_views).T,
        uncertain=uncertain,
    )


def spread(counts: Ints, group: Ints) -> tuple[Floats, float]:
    """(n,) standard errors of the shares of (K, n) counts, and a bound, at about 95 %, of the total
    variation between them and the truth; NaN where there is one group only, or for the bound fewer
    than `GROUPS`."""
    groups = int(group.max()) + 1 if len(group) else 0
    if groups < 2:
        return np.full(counts.shape[1], np.nan), float("nan")
    summed = np.zeros((groups, counts.shape[1]), dtype=np.int64)
    np.add.at(summed, group, counts)
    value, size = shares(summed.sum(axis=0)), summed.sum(axis=1)
    away = summed - value * size[:, None]
    mean = max(size.mean(), 1.0)
    error = np.sqrt((away**2).sum(axis=0) / (groups * (groups - 1))) / mean
    if groups < GROUPS:
        return error, float("nan")
    distance = np.abs(away).sum(axis=1) / (2 * mean)
    likely = distance.mean() + STUDENT_T * distance.std(ddof=1) * np.sqrt(1 + 1 / groups)
    return error, float(likely / np.sqrt(groups - 1))


def ninety_fifth(counts: Ints) -> Floats:
    """(n,) the least share that at least 95 % of the (K, n) points do not exceed."""
    if len(counts) == 0:
        return np.zeros(counts.shape[1])
    at_points = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    rank = -(-19 * len(counts) // 20) - 1
    return np.asarray(np.partition(at_points, rank, axis=0)[rank])


def grouped(count: int, in_stretches: bool = True) -> Ints:
    """(count,) the group of each of a sequence of points: eight stretches of equal length; or,
    where neighbours follow one another, every eighth point."""
    groups = min(GROUPS, count)
    if in_stretches:
        return np.arange(count) * groups // max(count, 1)
    return np.arange(count) % max(groups, 1)
