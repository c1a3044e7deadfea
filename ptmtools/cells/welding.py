"""Rows of numbers that are the same, to the last digit or but for that."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.merging import connected

#: A direction in no simple relation to the axes of any building.
_ACROSS = np.array([0.683, 0.577, 0.448])


def distinct(rows: Floats) -> Ints:
    """(n,) the first of the (n, k) rows that each is equal to; -0 is 0."""
    order = np.lexsort(rows.T)
    new = np.ones(len(order), dtype=np.bool_)
    new[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    first = np.empty(len(order), dtype=np.int64)
    first[order] = order[new][np.cumsum(new) - 1]  # the sort is stable
    return first


def welded(points: Floats, reach: float) -> Ints:
    """(n,) the first of the (n, 3) points that each is no farther from than ``reach``, directly or
    by way of others."""
    first = distinct(points)
    one_each = np.flatnonzero(first == np.arange(len(first)))
    # What is near in space is near along any direction.
    along = points[one_each] @ _ACROSS
    order = np.argsort(along, kind="stable")
    place, step = np.arange(len(order)), 1
    pairs = [np.zeros((2, 0), dtype=np.int64)]
    while len(place := place[place + step < len(order)]):
        pair = order[np.stack([place, place + step])]
        near = along[pair[1]] - along[pair[0]] <= reach
        place, pair = place[near], pair[:, near]
        apart = np.subtract(*points[one_each[pair]])
        pairs.append(pair[:, np.einsum("ij,ij->i", apart, apart) <= reach**2])
        step += 1
    one, other = np.concatenate(pairs, axis=1)
    group = connected(len(one_each), np.append(one, other), np.append(other, one))
    to = np.arange(len(points))
    to[one_each] = one_each[group]
    return to[first]
