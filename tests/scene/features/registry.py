"""Support for each feature of a format, and its effect on the picture.

Outcomes are those of the formats' specifications: glTF 2.0 and its extensions, the OBJ and MTL
appendices of Wavefront's manual, and, for colours of vertices in OBJ, what scanners write.
`docs/guide/prepare.md` has them as a table, which `test_features.py` holds against these.
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal

import numpy as np
from PIL import Image

from ptmtools.scene import Scene
from tests.scene.conftest import Put

Outcome = Literal["carried over", "baked", "noted", "refused"]


@dataclass(frozen=True)
class Feature:
    """A model with one feature.

    Attributes
    ----------
    form: of the file, as the table's columns are called.
    name: of the feature, as its rows are called.
    outcome: what becomes of it.
    make: writes the model into the test's folder and returns its name.
    check: of the scene that it becomes; of one that is refused, of the error's text.
    codes: of the notes or the error that tell of it, the first of the feature itself.
    """

    form: str
    name: str
    outcome: Outcome
    make: Callable[[Put], str]
    check: Callable[[Any], object]
    codes: tuple[str, ...] = ()


FEATURES: list[Feature] = []
#: The modules beside this one, each with the features of one format.
FORMS = ("obj", "gltf", "ply", "usd", "ifc", "collada", "x3d")


def glossy(scene: Scene) -> None:
    (material,) = scene.materials
    assert (material.metallic, material.roughness) == (1, 0.25)


def all_features() -> list[Feature]:
    """Those of all formats."""
    for form in FORMS:
        import_module(f"tests.scene.features.{form}")
    return FEATURES


def feature(
    form: str, name: str, outcome: Outcome, check: Callable[[Any], object], *codes: str
) -> Callable[[Callable[[Put], str]], Callable[[Put], str]]:
    """Makes a feature of a function that writes its model."""

    def add(make: Callable[[Put], str]) -> Callable[[Put], str]:
        FEATURES.append(Feature(form, name, outcome, make, check, codes))
        return make

    return add


# What is seen of a quadrilateral of 10 × 4 m


def the_quad(scene: Scene) -> None:
    """10 × 4 m, of two triangles that face the same way."""
    assert len(scene.triangles) == 2
    assert sorted(np.ptp(scene.points, axis=0).round(5)) == [0, 4, 10]
    normals = np.cross(*np.moveaxis(scene.corners[:, 1:] - scene.corners[:, :1], 1, 0))
    assert np.allclose(normals[0], normals[1])


def at_corners(scene: Scene, values: np.ndarray) -> dict[tuple[float, ...], tuple[float, ...]]:
    """Values of corners by place: metres from the lower left corner of the model."""
    low = scene.points.min(axis=0)
    places = (scene.corners - low).reshape(-1, 3).round(4).tolist()
    rows = values.reshape(len(places), -1).round(4).tolist()
    return {tuple(p): tuple(v) for p, v in zip(places, rows, strict=True)}


def shown(scene: Scene, u: float, v: float) -> list[int]:
    """The texel of the first material at a place of the model, of 10 × 4 m, from its lower left:
    what a viewer would show there, nearest."""
    at = at_corners(scene, scene.uv)
    origin, right, up = (np.array(at[place]) for place in ((0, 0, 0), (10, 0, 0), (0, 4, 0)))
    place = origin + u * (right - origin) + v * (up - origin)
    material = scene.materials[0]
    with Image.open(io.BytesIO(scene.images[material.image].load())) as image:
        pixels = np.asarray(image)
    height, width = pixels.shape[:2]
    x, y = int(np.floor(place[0] * width)), int(np.floor((1 - place[1]) * height))
    x = int(np.clip(x, 0, width - 1)) if material.wrap_s == "clamp" else x % width
    y = int(np.clip(y, 0, height - 1)) if material.wrap_t == "clamp" else y % height
    return pixels[y, x].tolist()


#: 2 × 2 texels: red and green above, blue and white below.
RED, GREEN, BLUE, WHITE = [255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]
FOUR = np.array([[RED, GREEN], [BLUE, WHITE]], np.uint8)


def four(scene: Scene) -> None:
    """The image, upright, over the whole quad."""
    the_quad(scene)
    quarters = [shown(scene, u, v)[:3] for u, v in ((0.2, 0.8), (0.8, 0.8), (0.2, 0.2), (0.8, 0.2))]
    assert quarters == [RED, GREEN, BLUE, WHITE]


def glowing(scene: Scene) -> None:
    """The image as it is, whatever the light."""
    four(scene)
    assert scene.lights is not None
    assert scene.lights.unlit.tolist() == [True]
    assert np.allclose(scene.lights.glow, 0.5)


ALPHA = np.array([[0, 255], [255, 51]], np.uint8)


def tinted(scene: Scene) -> None:
    assert np.allclose(scene.materials[0].color, (1.0, 0.5, 0.0), atol=1e-6)


def vertex_colors(scene: Scene) -> None:
    the_quad(scene)
    assert scene.colors is not None
    assert at_corners(scene, scene.colors) == {
        (0, 0, 0): (255, 0, 0),
        (10, 0, 0): (0, 255, 0),
        (10, 4, 0): (0, 0, 255),
        (0, 4, 0): (0, 0, 0),
    }
    assert scene.materials[0].color == (1, 1, 1)


def half(scene: Scene) -> None:
    assert scene.materials[0].opacity == 0.5
    assert not scene.opaque.any()


def cut_out(scene: Scene) -> None:
    four(scene)
    assert scene.materials[0].transparent
    alpha = [shown(scene, u, v)[3] for u, v in ((0.2, 0.8), (0.8, 0.8), (0.2, 0.2), (0.8, 0.2))]
    assert alpha == [0, 255, 255, 51]


def twice(scene: Scene) -> None:
    the_quad(scene)
    assert [shown(scene, u, 0.8) for u in (0.1, 0.4, 0.6, 0.9)] == [RED, GREEN, RED, GREEN]


def clamped(scene: Scene) -> None:
    assert [shown(scene, u, 0.9) for u in (0.2, 0.4, 0.9)] == [RED, GREEN, GREEN]


def untextured(scene: Scene) -> None:
    the_quad(scene)
    assert scene.materials[0].image < 0


def mirrored(scene: Scene) -> None:
    the_quad(scene)
    row = [shown(scene, u, 0.9) for u in (0.05, 0.3, 0.42, 0.55, 0.7, 0.95)]
    assert row == [RED, GREEN, GREEN, GREEN, RED, RED]
    column = [shown(scene, 0.05, v) for v in (0.9, 0.6, 0.4, 0.1)]
    assert column == [RED, BLUE, BLUE, RED]


def seen(scene: Scene) -> None:
    (camera,) = scene.cameras
    assert np.allclose(camera.direction, [0, 0, -1])
    assert np.isclose(camera.field_of_view, 0.8)


def three_quads(scene: Scene) -> None:
    """One as it is, one turned by half about z in front of it, one twice as wide behind."""
    assert len(scene.objects) == 3
    assert len(set(scene.objects)) == 1
    model = scene.corners + scene.space.origin
    boxes = [
        (q.reshape(-1, 3).min(axis=0), q.reshape(-1, 3).max(axis=0))
        for q in (model[:2], model[2:4], model[4:])
    ]
    expected = [([0, 0, 0], [10, 4, 0]), ([-10, -4, 5], [0, 0, 5]), ([0, 0, -5], [20, 4, -5])]
    assert np.allclose(boxes, expected, atol=1e-3)
