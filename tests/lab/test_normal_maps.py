"""Normal maps of materials in pictures: the light on a tilted face, against the formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ptmtools.coverage.options import AchOptions
from ptmtools.output.served import Served, read_served
from ptmtools.pipeline.build import build_scene
from ptmtools.rendering.drawing import ViewOptions, draw_view
from ptmtools.rendering.light import AMBIENT, LAMP
from tests.scene.bumpy import write_bumpy

#: In the first room; looks at its north wall, of which x is to the right.
EYE, WALL = (-2.1, 1.5, 0.8), (-2.1, 1.5, -2.0)


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Served:
    folder = tmp_path_factory.mktemp("bumpy")
    model = write_bumpy(folder / "model", {"room_a": "norm waves.png"})
    build_scene(model, folder / "db", AchOptions(samples=4, backend="embree"), workers=1)
    return read_served(folder / "db")


def picture(served: Served, *, lit: bool = False) -> np.ndarray:
    view = ViewOptions(eye=EYE, look=WALL, width=200, height=150, lit=lit)
    return draw_view(served, view).astype(np.float64)


def plain(served: Served) -> Served:
    return replace(served, surfaces=replace(served.surfaces, bumps=None))


def light(normal: tuple[float, float, float]) -> float:
    unit = np.array(normal) / np.linalg.norm(normal)
    return float(AMBIENT + (1 - AMBIENT) * ((1 + unit @ LAMP) / 2) ** 2)


@pytest.mark.parametrize(
    ("texel", "world"),
    [
        ((127.5, 127.5, 255), (0, 0, 1)),
        ((202.5, 127.5, 202.5), (1, 0, 1)),
        ((52.5, 127.5, 202.5), (-1, 0, 1)),
        ((127.5, 202.5, 202.5), (0, 1, 1)),
        ((127.5, 52.5, 202.5), (0, -1, 1)),
    ],
    ids=["level", "right", "left", "up", "down"],
)
def test_the_light_on_a_wall(
    served: Served,
    monkeypatch: pytest.MonkeyPatch,
    texel: tuple[float, ...],
    world: tuple[float, float, float],
) -> None:
    """The wall looks to z; x of its map is to the right and y up."""
    import ptmtools.rendering.normal_maps as drawing

    def sampled(sight, *_):  # type: ignore[no-untyped-def]
        return np.tile(np.array(texel, np.float64), (len(sight.ray), 1))

    before = picture(plain(served))[60:90, 80:120]
    monkeypatch.setattr(drawing, "_sampled", sampled)
    after = picture(served)[60:90, 80:120]
    expected = np.minimum(before * light(world) / light((0, 0, 1)), 255)
    assert np.abs(after - expected).max() <= 1.5


def test_a_scale_of_nothing_is_level(served: Served) -> None:
    bumps = served.surfaces.bumps
    assert bumps
    level = replace(served.surfaces, bumps=replace(bumps, scale=0 * bumps.scale))
    assert np.array_equal(picture(replace(served, surfaces=level)), picture(plain(served)))
    assert np.abs(picture(served) - picture(plain(served))).max() > 20


def test_lit_pictures_show_them_too(served: Served) -> None:
    difference = picture(served, lit=True) - picture(plain(served), lit=True)
    assert np.abs(difference).max() > 20
