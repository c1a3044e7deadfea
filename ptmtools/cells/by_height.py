"""What is as high as something else, found without looking at all of it: a tower has many storeys,
and what is in one has nothing to do with the others."""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats, Ints


class ByHeight:
    """Things that reach from (n,) ``low`` to (n,) ``high``, metres: sorted by their lowest points
    among those that are about as high."""

    def __init__(self, low: Floats, high: Floats) -> None:
        self._low, self._high = low, high
        size = np.frexp(high - low)[1]
        order = np.lexsort((low, size))
        self._sizes, start = np.unique(size[order], return_index=True)
        self._groups = np.split(order, start[1:]) if len(start) else []

    def between(self, lowest: float, highest: float) -> Ints:
        """Those, ascending, of which something is between two heights, metres."""
        found = [np.zeros(0, dtype=np.int64)]
        for size, group in zip(self._sizes.tolist(), self._groups, strict=True):
            reach = np.searchsorted(self._low[group], [lowest - 2.0**size, highest], "right")
            found.append(group[slice(*reach)])
        about = np.sort(np.concatenate(found))
        meets = (self._high[about] >= lowest) & (self._low[about] <= highest)
        return np.asarray(about[meets])
