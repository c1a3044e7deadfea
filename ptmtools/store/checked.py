"""Arrays that were stored, held against what they must be before anything counts by them.

A database may come from elsewhere, and its checksums with it. Compiled loops do not look whether
an index is within an array: whoever reads arrays back does, once. Each function raises ValueError
and names the array.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Arrays = Mapping[str, NDArray[np.generic]]


class Stored:
    """The arrays of an artifact, by name.

    Parameters
    ----------
    arrays: as they were read; KeyError for one that is asked for and not there.
    """

    def __init__(self, arrays: Arrays) -> None:
        self._arrays = arrays

    def array(
        self, name: str, dtype: type[np.generic], *shape: int | None, finite: bool = False
    ) -> NDArray[Any]:
        """An array of a type and shape; None is a side of any length. Numbers of another type of
        the same kind are converted. With ``finite`` they have neither NaN nor infinities."""
        found = np.asarray(self._arrays[name])
        if found.dtype.kind != np.dtype(dtype).kind:
            raise ValueError(f"{name} has elements of type {found.dtype}")
        same = len(found.shape) == len(shape) and all(
            side in (None, there) for side, there in zip(shape, found.shape, strict=True)
        )
        if not same:
            raise ValueError(f"{name} has the shape {found.shape}")
        if finite and not np.isfinite(found).all():
            raise ValueError(f"{name} has numbers that are not finite")
        return found.astype(dtype, copy=False)

    def indices(
        self, name: str, dtype: type[np.integer[Any]], *shape: int | None, low: int = 0, high: int
    ) -> NDArray[Any]:
        """An array of integers from ``low`` to below ``high``."""
        found = self.array(name, dtype, *shape)
        if found.size and not low <= int(found.min()) <= int(found.max()) < high:
            raise ValueError(f"{name} has an index out of range")
        return found

    def starts(self, name: str, rows: int | None, total: int) -> NDArray[np.int64]:
        """Where the rows of a CSR begin, (rows + 1,): ascending from 0 to ``total``."""
        found = self.array(name, np.int64, None if rows is None else rows + 1)
        if not len(found) or found[0] != 0 or found[-1] != total or (np.diff(found) < 0).any():
            raise ValueError(f"{name} does not divide {total} entries")
        return found


def texts(values: Any, name: str) -> tuple[str, ...]:
    """A list of texts."""
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise ValueError(f"{name} are not texts")
    return tuple(values)
