"""Features of VRML97 and X3D."""

from __future__ import annotations

import numpy as np

from ptmtools.scene import Scene
from tests.scene.conftest import Put, png
from tests.scene.features.registry import (
    ALPHA,
    FOUR,
    clamped,
    cut_out,
    feature,
    four,
    half,
    seen,
    the_quad,
    three_quads,
    tinted,
    twice,
    vertex_colors,
)
from tests.scene.test_x3d import HEAD, QUAD, shape

IMAGE = 'texture ImageTexture { url "a.png" }'
COORDS = "texCoord TextureCoordinate { point [ 0 0, 1 0, 1 1, 0 1 ] }"
MATERIAL = "material Material { }"


def vrml(put: Put, look: str = MATERIAL, more: str = COORDS, after: str = "") -> str:
    face = f"geometry IndexedFaceSet {{ {QUAD} coordIndex [ 0 1 2 3 -1 ] {more} }}"
    put("a.png", png(FOUR))
    put("a.wrl", HEAD + shape(face, f"appearance Appearance {{ {look} }}") + after)
    return "a.wrl"


@feature("VRML, X3D", "textures", "carried over", four)
def _(put: Put) -> str:
    return vrml(put, MATERIAL + IMAGE)


@feature("VRML, X3D", "material colours", "carried over", tinted)
def _(put: Put) -> str:
    return vrml(put, "material Material { diffuseColor 1 .5 0 }")


@feature("VRML, X3D", "vertex colours", "carried over", vertex_colors)
def _(put: Put) -> str:
    return vrml(put, more="color Color { color [ 1 0 0, 0 1 0, 0 0 1, 0 0 0 ] }")


@feature("VRML, X3D", "opacity", "carried over", half)
def _(put: Put) -> str:
    return vrml(put, "material Material { transparency .5 }")


@feature("VRML, X3D", "texture alpha", "carried over", cut_out)
def _(put: Put) -> str:
    vrml(put, MATERIAL + IMAGE)
    put("a.png", png(np.dstack([FOUR, ALPHA])))
    return "a.wrl"


@feature("VRML, X3D", "texture transforms", "carried over", twice)
def _(put: Put) -> str:
    return vrml(put, f"{IMAGE} textureTransform TextureTransform {{ scale 2 1 }}")


@feature("VRML, X3D", "clamped textures", "carried over", clamped)
def _(put: Put) -> str:
    image = IMAGE.replace("}", "repeatS FALSE repeatT FALSE }")
    return vrml(put, f"{image} textureTransform TextureTransform {{ scale 2 1 }}")


@feature("VRML, X3D", "unlit materials", "carried over", four)
def _(put: Put) -> str:
    return vrml(put, IMAGE)


@feature("VRML, X3D", "polygons", "carried over", the_quad)
def _(put: Put) -> str:
    return vrml(put)


@feature("VRML, X3D", "triangle strips and fans", "carried over", the_quad)
def _(put: Put) -> str:
    points = "<Coordinate point='0 0 0 10 0 0 0 4 0 10 4 0'/>"
    strip = f"<TriangleStripSet stripCount='4'>{points}</TriangleStripSet>"
    put("a.x3d", f"<X3D><Scene><Shape>{strip}</Shape></Scene></X3D>")
    return "a.x3d"


@feature("VRML, X3D", "instances", "carried over", three_quads)
def _(put: Put) -> str:
    face = f"geometry IndexedFaceSet {{ {QUAD} coordIndex [ 0 1 2 3 -1 ] }}"
    turned = "translation 0 0 5 rotation 0 0 1 3.14159265358979"
    use = "Transform {{ {} children USE wall }}"
    text = f"DEF wall {shape(face)} {use.format(turned)} "
    put("a.wrl", HEAD + text + use.format("translation 0 0 -5 scale 2 1 1"))
    return "a.wrl"


@feature("VRML, X3D", "cameras", "carried over", seen)
def _(put: Put) -> str:
    return vrml(put, after="Viewpoint { fieldOfView 0.8 }")


def shiny(scene: Scene) -> None:
    (material,) = scene.materials
    assert (material.metallic, material.roughness) == (0, 0.642)


@feature("VRML, X3D", "metallic and roughness", "carried over", shiny)
def _(put: Put) -> str:
    return vrml(put, "material Material { shininess 1 specularColor 1 1 1 }")
