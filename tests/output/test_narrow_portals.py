"""The check of portals hardly wider than the tolerance, whose own normals are rounded."""

from __future__ import annotations

import numpy as np
import pytest

from tests.output.solids import spatial_faults

#: Metres; the on-plane distance in a box of this size is 0.16 mm.
SIZE = 20.0
#: Of a box: counter-clockwise seen from outside, corners numbered by their bits x, y, z.
FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def faults(portal: np.ndarray) -> list[str]:
    """What the check says of a portal of a box from 0 to `SIZE`."""
    corners = SIZE * np.array([[n >> 2 & 1, n >> 1 & 1, n & 1] for n in range(8)], np.float64)
    leaf = {"points": corners.tolist(), "faces": FACES}
    record = {"leaves": [leaf], "portals": [{"polygon": portal.tolist()}]}
    return list(spatial_faults({0: record}, [], 0.0))


@pytest.mark.parametrize("width", [0.0005, 0.0008, 0.002, 0.5])
def test_a_narrow_portal_lies_in_its_face(width: float) -> None:
    """In x = 0, turned by a rounding of the coordinates, its normal into the box."""
    corners = np.array([[0, 5, 5], [0, 6, 5], [0, 6, 5 + width], [0, 5, 5 + width]], np.float64)
    corners[2:, 0] += 2e-6
    assert faults(corners) == []
    assert len(faults(corners[::-1])) == 1
    assert len(faults(corners + [0.001, 0.0, 0.0])) == 1
