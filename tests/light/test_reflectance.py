"""What faces show of their images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.light.reflectance import SmallImages, image_colors
from ptmtools.scene.model import Material
from tests.light.test_cells import room, scene_of

RED, BLUE = (255, 0, 0), (0, 0, 255)


@pytest.mark.parametrize(
    ("uv", "color"),
    [
        ([(0.1, 0.2), (0.4, 0.2), (0.4, 0.8)], (1, 0, 0)),
        ([(0.9, 0.2), (0.6, 0.2), (0.6, 0.8)], (0, 0, 1)),
        ([(2.1, -3), (2.2, -3), (2.2, -3.1)], (1, 0, 0)),
        ([(0.6, 0.5)] * 3, (0, 0, 1)),
        ([(0, 0), (8, 0), (8, 8)], (0.5, 0, 0.25)),
        ([(0, 0), (1, 0), (1, 1)], (0.5, 0, 0.25)),
    ],
)
def test_a_face_has_the_colour_of_its_part_of_an_atlas(
    uv: list[tuple[float, float]], color: tuple[float, float, float]
) -> None:
    """Of half red and half blue; where it shows most of it or repeats it, the mean as given."""
    atlas = np.full((32, 64, 3), RED, np.uint8)
    atlas[:, 32:] = BLUE
    corner = room()
    scene = replace(
        scene_of(corner),
        materials=(Material("atlas", image=0),),
        uv=np.tile(np.array(uv, float), (len(corner), 1, 1)),
    )
    images = SmallImages.of_texels([atlas])
    colors = image_colors(scene, images, np.array([[0.5, 0.0, 0.25]]))
    # The blue of the whole is half as bright as that of the small image.
    expected = np.array(color) * ((1, 1, 0.5) if max(color) == 1 else 1)
    np.testing.assert_allclose(colors, np.tile(expected, (len(corner), 1)), atol=1e-6)


def test_a_face_without_an_image_is_white() -> None:
    colors = image_colors(scene_of(room()), SmallImages.of_texels([]), np.zeros((0, 3)))
    assert (colors == 1).all()
