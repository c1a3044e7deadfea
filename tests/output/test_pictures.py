"""Viewpoints look where pictures are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ptmtools.cells.model import Cells
from ptmtools.output import EmitOptions, GivenViewpoint, TextureRecord
from ptmtools.output.model import Viewpoint
from ptmtools.output.viewpoints import place_viewpoints
from ptmtools.output.views import DIRECTIONS, Panoramas
from ptmtools.scene.model import Material, Scene, SourceImage
from ptmtools.texture.detail import Detail
from ptmtools.texture.model import Level
from tests.conftest import scene_of

CORRIDOR = 6
MATERIALS = (
    Material("plain"),
    Material("painting", image=0),
    Material("plaster", image=1),
    Material("pane", opacity=0.3, transparent=True),
)
IMAGES = tuple(SourceImage(f"{name}.png", name * 64, bytes) for name in "ab")


def detail(contrast: float) -> Detail:
    return Detail((0.0, 255 * contrast), (0, 0, 0))


def record(image: int, side: int, contrast: float) -> TextureRecord:
    levels = Level(1, 1, 0, 1, 0, (1, 1), 3), Level(2, 2, 1, 1, 0, (1, 1), 15)
    return TextureRecord(image, "", None, side, side, 3, levels, "", detail=detail(contrast))


PAINTING, PLASTER = record(0, 512, 0.1), record(1, 512, 0.005)


def hung(scene: Scene, *pictures: tuple[int, np.ndarray]) -> Scene:
    """A scene with quadrilaterals of these materials besides."""
    faces = scene_of([quad for _, quad in pictures], material=[m for m, _ in pictures])
    return replace(
        scene,
        points=np.concatenate([scene.points, faces.points]),
        triangles=np.concatenate([scene.triangles, faces.triangles + len(scene.points)]).astype(
            np.int32
        ),
        uv=np.concatenate([scene.uv, faces.uv]),
        triangle_object=np.append(scene.triangle_object, faces.triangle_object * 0),
        triangle_material=np.append(scene.triangle_material, faces.triangle_material),
        two_sided=np.append(scene.two_sided, faces.two_sided),
        materials=MATERIALS,
        images=IMAGES,
    )


def in_view(view: Viewpoint, point: tuple[float, float, float]) -> bool:
    """Within 37° of where it looks."""
    to = np.array(point) - view.position
    return bool(to @ view.direction > 0.8 * np.linalg.norm(to))


def across(x: float, half: float = 0.6, middle: float = 0.0) -> np.ndarray:
    """An upright square at this x."""
    corners = [(-half, -half), (-half, half), (half, half), (half, -half)]
    return np.array([[x, 1.6 + y, middle + z] for y, z in corners])


@pytest.fixture
def corridor(room_row: Callable[[int], tuple[Scene, Cells]]) -> tuple[Scene, Cells]:
    """A row of rooms, open into each other, with a painting on its near end."""
    scene, cells = room_row(CORRIDOR)
    return hung(scene, (1, across(0.01))), cells


def test_the_picture_and_not_the_long_corridor(corridor: tuple[Scene, Cells]) -> None:
    scene, cells = corridor
    views, _ = place_viewpoints(scene, cells, EmitOptions(), (PAINTING,))
    first = next(v for v in views if v.cell == 0)
    assert in_view(first, (0, 1.6, 0)), "the painting"
    without, _ = place_viewpoints(scene, cells, EmitOptions())
    first = next(v for v in without if v.cell == 0)
    assert first.direction[0] > 0.9, "the corridor"
    asked = EmitOptions(
        viewpoints=(GivenViewpoint((2.5, 1.6, 0)), GivenViewpoint((2.5, 1.6, 0), -90))
    )
    chosen, given = place_viewpoints(scene, cells, asked, (PAINTING,))[0][:2]
    assert in_view(chosen, (0, 1.6, 0))
    assert given.direction[0] > 0.9, "as it was given"


def test_where_most_is_to_be_seen_comes_first(
    room_row: Callable[[int], tuple[Scene, Cells]],
) -> None:
    """All rooms are alike but for the pictures of the fifth, and one in the third."""
    scene, cells = room_row(CORRIDOR)
    wall = across(0, 0.5)[:, [2, 1, 0]] * [1, 1, 0]
    hangs = [(1, 17.0), (2, 19.0), (1, 10.0)]
    scene = hung(scene, *((m, wall + [x, 0, 1.99]) for m, x in hangs))
    records = PAINTING, replace(PLASTER, detail=detail(0.1))
    views, _ = place_viewpoints(scene, cells, EmitOptions(), records)
    assert views[0].cell == 4
    assert in_view(views[0], (17, 1.6, 2))
    assert in_view(views[0], (19, 1.6, 2))
    assert in_view(next(v for v in views if v.cell == 2), (10, 1.6, 2))
    one, _ = place_viewpoints(scene, cells, EmitOptions(viewpoint_count=0), records)
    assert one == views[:1]
    again, _ = place_viewpoints(scene, cells, EmitOptions(), records)
    assert again == views
    bare, _ = place_viewpoints(scene, cells, EmitOptions())
    plain = replace(scene, triangle_material=scene.triangle_material * 0)
    assert place_viewpoints(plain, cells, EmitOptions(), records)[0] == bare
    assert bare[0].cell != 4


def test_plaster_is_no_picture(corridor: tuple[Scene, Cells]) -> None:
    """A wall of plaster against a painting on the other side, seen through a pane."""
    scene, _ = corridor
    scene = hung(scene, (2, across(4.6, 1.0)), (3, across(1.0, 1.0)))
    middle = np.array([[2.3, 1.6, 0.0]])
    worth = Panoramas(scene, (PAINTING, PLASTER)).worth(middle)[0]
    left, right = worth[DIRECTIONS // 4], worth[3 * DIRECTIONS // 4]
    assert left > 2 * right > 0
    alike = Panoramas(scene, (PAINTING, replace(PLASTER, detail=detail(0.1)))).worth(middle)[0]
    assert alike[3 * DIRECTIONS // 4] == pytest.approx(20 * right)


def test_no_more_texels_than_there_are(corridor: tuple[Scene, Cells]) -> None:
    """A wall close to the eye, of 16 texels, and one of a tile of 64, repeated: both are worth what
    the texture has, and no more."""
    scene, _ = corridor
    for side, repeats in ((4, 1), (8, 40)):
        walled = hung(scene, (2, across(4.0, 1.5)))
        walled = replace(walled, uv=walled.uv * repeats)
        worth = Panoramas(walled, (record(1, side, 0.1),)).worth(np.array([[1.8, 1.6, 0.0]]))
        assert worth[0, 3 * DIRECTIONS // 4] == pytest.approx(0.1 * np.cbrt(side**2), rel=0.3)
        assert worth.max() <= 0.1 * np.cbrt(side**2) * (1 + 1e-9)


def test_nose_to_the_wall(corridor: tuple[Scene, Cells]) -> None:
    scene, _ = corridor
    places = np.array([[1.0, 1.6, 0.0], [2.5, 1.6, 0.0]])
    near, far = Panoramas(scene, (PAINTING,)).worth(places)[:, DIRECTIONS // 4]
    assert near == 0 < far


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_far_from_the_origin(corridor: tuple[Scene, Cells], scale: float) -> None:
    """Texels do not depend on where a model is; how near a wall is, is a matter of metres."""
    scene, _ = corridor
    place = np.array([[2.5, 1.6, 0.0]])
    here = Panoramas(scene, (PAINTING,)).worth(place)
    off = np.array([scale * 100, 0, 0])
    there = Panoramas(replace(scene, points=scene.points + off), (PAINTING,)).worth(place + off)
    np.testing.assert_allclose(there, here, rtol=1e-2, atol=1e-3 * here.max())
