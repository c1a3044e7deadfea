"""Features of OBJ and MTL."""

from __future__ import annotations

import numpy as np

from ptmtools.scene import Scene
from tests.scene.conftest import FACE, QUAD, Put, png
from tests.scene.features.registry import (
    ALPHA,
    FOUR,
    clamped,
    cut_out,
    feature,
    four,
    glossy,
    glowing,
    half,
    shown,
    the_quad,
    tinted,
    twice,
    untextured,
    vertex_colors,
)


def obj(put: Put, mtl: str = "", lines: str = FACE, head: str = "", **files: bytes) -> str:
    put("a.mtl", f"newmtl wall\n{mtl}\n")
    for name, data in files.items():
        put(name.replace("_png", ".png"), data)
    put("a.obj", f"mtllib a.mtl\n{head}{QUAD}usemtl wall\n{lines}")
    return "a.obj"


@feature("OBJ", "textures", "carried over", four)
def _(put: Put) -> str:
    return obj(put, "map_Kd four.png", four_png=png(FOUR))


@feature("OBJ", "images of emission", "carried over", glowing)
def _(put: Put) -> str:
    return obj(put, "Kd 0 0 0\nmap_Ke four.png", four_png=png(FOUR))


@feature("OBJ", "material colours", "carried over", tinted)
def _(put: Put) -> str:
    return obj(put, "Kd 1 0.5 0")


COLORED = "v 0 0 0 1 0 0\nv 10 0 0 0 1 0\nv 10 4 0 0 0 1\nv 0 4 0 0 0 0\n"


@feature("OBJ", "vertex colours", "carried over", vertex_colors)
def _(put: Put) -> str:
    put("a.obj", COLORED + "f 1 2 3 4\n")
    return "a.obj"


@feature("OBJ", "vertex colours", "carried over", vertex_colors)
def _colours_beyond_1(put: Put) -> str:
    """By rounding, and of a vertex that no face has."""
    put("a.obj", COLORED.replace("0 1 0 0", "0 1.000001 0 0", 1) + "f 1 2 3 4\nv 0 0 9 1.4 0 0\n")
    return "a.obj"


@feature("OBJ", "vertex colours", "carried over", vertex_colors)
def _colours_to_255(put: Put) -> str:
    """As some scanners write them; and they take the place of Kd."""
    put("a.mtl", "newmtl wall\nKd 0.2 0.2 0.2\n")
    rows = "v 0 0 0 255 0 0\nv 10 0 0 0 255 0\nv 10 4 0 0 0 255\nv 0 4 0 0 0 0\n"
    put("a.obj", f"mtllib a.mtl\n{rows}usemtl wall\nf 1 2 3 4\n")
    return "a.obj"


@feature("OBJ", "opacity", "carried over", half)
def _(put: Put) -> str:
    return obj(put, "d 0.5")


@feature("OBJ", "texture alpha", "carried over", cut_out)
def _(put: Put) -> str:
    return obj(put, "map_Kd four.png", four_png=png(np.dstack([FOUR, ALPHA])))


@feature("OBJ", "opacity maps", "baked", cut_out, "PTM-N215")
def _(put: Put) -> str:
    return obj(put, "map_Kd four.png\nmap_d mask.png", four_png=png(FOUR), mask_png=png(ALPHA))


def stencil(scene: Scene) -> None:
    """A mask without an image: the material's colour with its alpha."""
    assert scene.materials[0].color == (1.0, 0.5, 0.0)
    assert [shown(scene, u, 0.8) for u in (0.2, 0.8)] == [[255, 0], [255, 255]]


@feature("OBJ", "opacity maps", "baked", stencil, "PTM-N215")
def _mask_alone(put: Put) -> str:
    return obj(put, "Kd 1 0.5 0\nmap_d mask.png", mask_png=png(ALPHA))


@feature("OBJ", "texture transforms", "baked", twice, "PTM-N215")
def _(put: Put) -> str:
    return obj(put, "map_Kd -s 2 1 1 four.png", four_png=png(FOUR))


@feature("OBJ", "clamped textures", "carried over", clamped, "PTM-N215")
def _(put: Put) -> str:
    return obj(put, "map_Kd -clamp on -s 2 1 1 four.png", four_png=png(FOUR))


@feature("OBJ", "missing texture", "noted", untextured, "PTM-N204")
def _(put: Put) -> str:
    return obj(put, "map_Kd gone.png")


def suggested(scene: Scene) -> None:
    untextured(scene)
    (message,) = [note.message for note in scene.notes if note.code == "PTM-N203"]
    assert message == (
        "mtllib house.mtl: not found; if a.mtl is the library of the model, rename it to house.mtl"
    )


@feature("OBJ", "missing material library", "noted", suggested, "PTM-N203", "PTM-N207")
def _(put: Put) -> str:
    obj(put, "map_Kd four.png", four_png=png(FOUR))
    put("a.obj", f"mtllib house.mtl\n{QUAD}usemtl wall\n{FACE}")
    return "a.obj"


def not_suggested(scene: Scene) -> None:
    (message,) = [note.message for note in scene.notes if note.code == "PTM-N203"]
    assert message == "mtllib house.mtl: not found"


@feature("OBJ", "missing material library", "noted", not_suggested, "PTM-N203", "PTM-N207")
def _several_libraries(put: Put) -> str:
    """Which of them is meant nobody knows."""
    put("b.mtl", "newmtl wall\n")
    obj(put)
    put("a.obj", f"mtllib house.mtl\n{QUAD}usemtl wall\n{FACE}")
    return "a.obj"


@feature("OBJ", "points and lines", "noted", the_quad, "PTM-N215")
def _(put: Put) -> str:
    return obj(put, lines=f"l 1 2\np 1\n{FACE}")


@feature("OBJ", "polygons", "carried over", the_quad)
def _(put: Put) -> str:
    return obj(put)


@feature("OBJ", "metallic and roughness", "carried over", glossy)
def _(put: Put) -> str:
    return obj(put, "Pm 1\nPr 0.25")
