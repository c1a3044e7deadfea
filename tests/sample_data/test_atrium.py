"""The atrium: 250,000 triangles and 25 images, all within its walls, standing where they should."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pytest
from ptmtools_samples.atrium.building import HEIGHT, LENGTH, STOREYS, WALK, WIDTH
from ptmtools_samples.atrium.model import make_atrium
from ptmtools_samples.options import AtriumOptions

from tests.sample_data.conftest import Triangles


@pytest.fixture(scope="module")
def files() -> dict[str, Callable[[], bytes]]:
    return dict(make_atrium(AtriumOptions(size=16)))


@pytest.fixture(scope="module")
def atrium(
    files: dict[str, Callable[[], bytes]], read: Callable[[Iterable[str]], Triangles]
) -> Triangles:
    return read(files["atrium.obj"]().decode().splitlines())


def test_as_many_triangles_and_images_as_promised(
    files: dict[str, Callable[[], bytes]], atrium: Triangles
) -> None:
    images = [name for name in files if name.startswith("textures/")]
    assert len(atrium.corners) == pytest.approx(250_000, rel=0.02)
    assert len(images) == 25
    assert {f"textures/{name}.png" for name in atrium.materials} == set(images)


def test_everything_is_in_the_hall(atrium: Triangles) -> None:
    assert (atrium.corners.min(axis=(0, 1)) >= -1e-4).all()
    assert (atrium.corners.max(axis=(0, 1)) <= np.array([LENGTH, HEIGHT, WIDTH]) + 1e-4).all()
    assert np.isfinite(atrium.uv).all()


def test_the_court_is_open_and_the_walks_are_covered(atrium: Triangles) -> None:
    """Upwards from 1.7 m: the ceiling in the court, the vault of the upper walk beside it."""
    x = np.linspace(WALK + 4, LENGTH - WALK - 4, 12)
    court = np.stack([x, np.full(12, 1.7), np.full(12, WIDTH / 2)], axis=1)
    walk = np.stack([x, np.full(12, 1.7), np.full(12, WALK / 2)], axis=1)
    up = np.broadcast_to([0.0, 1.0, 0.0], (12, 3))
    assert atrium.distances(court, up) == pytest.approx(HEIGHT - 1.7, abs=1e-3)
    assert atrium.distances(walk, up) == pytest.approx(STOREYS[0][2] - 1.7, abs=1e-3)


def test_arches_can_be_walked_through(atrium: Triangles) -> None:
    """From the walk to the opposite wall, through the middle of each arch of the long side."""
    bay = (LENGTH - 2 * WALK) / 8
    x = WALK + bay * (np.arange(8) + 0.5)
    eyes = np.stack([x, np.full(8, 1.7), np.full(8, 1.0)], axis=1)
    across = np.broadcast_to([0.0, 0.0, 1.0], (8, 3))
    distance = atrium.distances(eyes, across)
    assert np.median(distance) > WIDTH - WALK, "vases may stand in the way, arches may not"
    assert (distance > WALK + 1).all()


def test_drapes_hang_and_vases_stand(atrium: Triangles) -> None:
    for name in np.unique(atrium.objects):
        part = atrium.where(atrium.objects == name).corners.reshape(-1, 3)
        if name.startswith("vase"):
            assert part[:, 1].min() == pytest.approx(0, abs=1e-4)
        if name.startswith("drape"):
            assert part[:, 1].min() > 2.5, "above heads"


def test_the_same_again_and_another_seed(files: dict[str, Callable[[], bytes]]) -> None:
    again = dict(make_atrium(AtriumOptions(size=16)))
    other = dict(make_atrium(AtriumOptions(size=16, seed=2)))
    for name in ("textures/granite.png", "textures/fresco_3.png", "atrium.obj"):
        assert files[name]() == again[name]() != other[name]()
