"""The components of a texel, in the order in which all coders code them: as *planes*.

Green, red, blue, alpha; grey and alpha. Red refers to green, blue to both, the others to none.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def plane_order(components: int) -> NDArray[np.int64]:
    """Components (c,) in coding order."""
    return np.array([1, 0, 2, 3][:components] if components > 2 else range(components), np.int64)


def references(components: int) -> NDArray[np.int64]:
    """How many of the planes coded first each plane (c,) refers to."""
    return np.array([0, 1, 2, 0][:components] if components > 2 else [0] * components, np.int64)
