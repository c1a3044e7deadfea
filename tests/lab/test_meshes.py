"""Gains of finer meshes, as docs/formats/client.md defines them."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.rendering.rays import Frustum
from ptmtools.site.client import BEHIND, GROSS, NEAREST, SEEN
from ptmtools_lab.catalogue import Meshes, meshes_of

#: A cube of 2 m in cell 3 with two finer meshes, and one of 20 cm in cell 0 with one.
ROWS = (
    {"cell": 3, "box": [9, -1, -1, 11, 1, 1], "errors": [0.1, 0.01, 0.0]},
    {"cell": 0, "box": [9.9, -0.1, -0.1, 10.1, 0.1, 0.1], "errors": [0.1, 0.0]},
)


@pytest.fixture
def meshes() -> Meshes:
    return meshes_of(ROWS, ((5, 70), (9,)))


def gains(meshes: Meshes, x: float, *there: int, ahead: float = 1.0) -> list[float]:
    frustum = Frustum(np.array([x, 0.0, 0.0]), np.array([ahead, 0.0, 0.0]), 1.0, 1.5)
    present = np.isin(np.arange(len(meshes.mesh)), there)
    result: list[float] = meshes.gains(present, frustum, NEAREST, BEHIND).tolist()
    return result


def worth(error: float) -> float:
    return error / (error + GROSS)


def test_the_files_of_an_index(meshes: Meshes) -> None:
    assert meshes.mesh.tolist() == [0, 0, 1]
    assert meshes.cell.tolist() == [3, 3, 0]
    assert meshes.bytes.tolist() == [5, 70, 9]
    assert meshes.error.tolist() == [0.01, 0, 0]
    assert meshes.coarsest.tolist() == [0.1, 0.1, 0.1]
    assert meshes.finest.tolist() == [False, True, True]
    assert gains(meshes_of((), ()), 0.0) == []


def test_by_share_and_severity(meshes: Meshes) -> None:
    first, second, small = gains(meshes, 5.0)
    share = 3 / 4**2
    assert first == pytest.approx(share * (worth(0.1 / 4) - worth(0.01 / 4)))
    assert second == pytest.approx(share * worth(0.1 / 4))
    assert small == pytest.approx(0.03 / 4.9**2 * worth(0.1 / 4.9))
    behind = gains(meshes, 5.0, ahead=-1.0)
    assert behind == pytest.approx([BEHIND * first, BEHIND * second, BEHIND * small])


def test_beside_what_is_there(meshes: Meshes) -> None:
    _, second, _ = gains(meshes, 5.0, 0)
    assert second == pytest.approx(3 / 4**2 * worth(0.01 / 4))
    assert gains(meshes, 5.0, 0)[0] == 0
    assert gains(meshes, 5.0, 1)[:2] == [0, 0]
    assert gains(meshes, 5.0, 0, 1, 2) == [0, 0, 0]


def test_an_error_that_cannot_be_seen(meshes: Meshes) -> None:
    least = 0.1 / SEEN
    assert gains(meshes, 9 - 0.99 * least)[1] > 0
    assert gains(meshes, 9 - 1.01 * least)[1] == 0
    assert gains(meshes, 9 - 0.5 * least, 0)[1] == 0


def test_within_the_box(meshes: Meshes) -> None:
    assert gains(meshes, 10.0)[1] == pytest.approx(worth(0.1 / NEAREST))
