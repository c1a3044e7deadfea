"""Features of COLLADA."""

from __future__ import annotations

import numpy as np

from ptmtools.scene import Scene
from tests.scene.conftest import Put, png
from tests.scene.features.registry import (
    ALPHA,
    FOUR,
    cut_out,
    feature,
    four,
    glowing,
    half,
    mirrored,
    seen,
    the_quad,
    three_quads,
    tinted,
    vertex_colors,
)
from tests.scene.test_collada import (
    BOUND,
    IMAGE,
    INPUTS,
    TEXCOORD,
    TEXTURE,
    TRIANGLES,
    dae,
)

RGBA = np.dstack([FOUR, ALPHA])


def collada(put: Put, shader: str = "", pixels: np.ndarray = FOUR, **parts: str) -> str:
    put("a.png", png(pixels))
    nodes = parts.pop("nodes", BOUND.format(0))
    put("a.dae", dae(nodes=nodes, shader=shader, **{"before": IMAGE, **parts}))
    return "a.dae"


@feature("COLLADA", "textures", "carried over", four)
def _(put: Put) -> str:
    return collada(put, TEXTURE)


@feature("COLLADA", "material colours", "carried over", tinted)
def _(put: Put) -> str:
    return collada(put, "<diffuse><color>1 0.5 0 1</color></diffuse>")


@feature("COLLADA", "vertex colours", "carried over", vertex_colors)
def _(put: Put) -> str:
    color = '<input semantic="COLOR" source="#c" offset="0"/>'
    text = dae(TRIANGLES.format(inputs=INPUTS + TEXCOORD.format("t0", 0) + color), BOUND.format(0))
    put("a.dae", text.replace("1 0 0 0 1 0 0 0 1 1 1 1", "1 0 0 0 1 0 0 0 1 0 0 0"))
    return "a.dae"


@feature("COLLADA", "opacity", "carried over", half)
def _(put: Put) -> str:
    return collada(put, "<transparency><float>0.5</float></transparency>")


@feature("COLLADA", "texture alpha", "carried over", cut_out)
def _(put: Put) -> str:
    return collada(put, TEXTURE, RGBA)


@feature("COLLADA", "opacity maps", "baked", cut_out, "PTM-N215")
def _(put: Put) -> str:
    put("mask.png", png(RGBA[..., 3]))
    mask = '<transparent opaque="RGB_ONE"><texture texture="mask" texcoord="UV"/></transparent>'
    image = '<newparam sid="g"><surface><init_from>mask</init_from></surface></newparam>'
    collada(put, TEXTURE + mask, before=IMAGE + image)
    text = (put("a", "").parent / "a.dae").read_text()
    added = "<image id='mask'><init_from>mask.png</init_from></image></library_images>"
    put("a.dae", text.replace("</library_images>", added))
    return "a.dae"


@feature("COLLADA", "images of emission", "carried over", glowing)
def _(put: Put) -> str:
    dark = "<diffuse><color>0 0 0 1</color></diffuse>"
    return collada(put, dark + TEXTURE.replace("diffuse", "emission"))


@feature("COLLADA", "mirrored textures", "baked", mirrored, "PTM-N215")
def _(put: Put) -> str:
    wraps = "<wrap_s>MIRROR</wrap_s><wrap_t>MIRROR</wrap_t>"
    put("a.png", png(FOUR))
    text = dae(nodes=BOUND.format(0), shader=TEXTURE, before=IMAGE.format(wraps))
    put("a.dae", text.replace("0 0 1 0 1 1 0 1", "0 -1 2.5 -1 2.5 1 0 1"))
    return "a.dae"


@feature("COLLADA", "unlit materials", "carried over", four)
def _(put: Put) -> str:
    return collada(put, TEXTURE.replace("diffuse", "emission"), model="constant")


def shiny(scene: Scene) -> None:
    (material,) = scene.materials
    assert (material.metallic, material.roughness) == (0, 0.8)


@feature("COLLADA", "metallic and roughness", "carried over", shiny)
def _(put: Put) -> str:
    light = "<specular><color>1 1 1 1</color></specular><shininess><float>40</float></shininess>"
    return collada(put, light, model="phong")


@feature("COLLADA", "polygons", "carried over", the_quad)
def _(put: Put) -> str:
    put("a.dae", dae(f"<polygons>{INPUTS}<p>0 1 2 3</p></polygons>", BOUND.format(0)))
    return "a.dae"


@feature("COLLADA", "triangle strips and fans", "carried over", the_quad)
def _(put: Put) -> str:
    put("a.dae", dae(f"<tristrips>{INPUTS}<p>0 1 3 2</p></tristrips>", BOUND.format(0)))
    return "a.dae"


@feature("COLLADA", "instances", "carried over", three_quads)
def _(put: Put) -> str:
    wall = BOUND.format(0).replace('id="n" name="wall"', 'id="door" name="wall"')
    use = '{}<instance_node url="#door"/></node>'
    nodes = "".join(
        use.format(f"<node>{place}")
        for place in (
            "",
            "<translate>0 0 5</translate><rotate>0 0 1 180</rotate>",
            "<translate>0 0 -5</translate><scale>2 1 1</scale>",
        )
    )
    return collada(put, nodes=nodes, more=f"<library_nodes>{wall}</library_nodes>")


CAMERA = (
    '<library_cameras><camera id="k"><optics><technique_common><perspective>'
    "<yfov>45.8366236</yfov></perspective></technique_common></optics></camera></library_cameras>"
)


@feature("COLLADA", "cameras", "carried over", seen)
def _(put: Put) -> str:
    nodes = BOUND.format(0) + '<node name="eye"><instance_camera url="#k"/></node>'
    return collada(put, nodes=nodes, more=CAMERA)


@feature("COLLADA", "skins and morph targets", "noted", the_quad, "PTM-N215")
def _(put: Put) -> str:
    skin = '<library_controllers><controller id="s"><skin source="#g"/></controller>'
    nodes = BOUND.format(0).replace("instance_geometry", "instance_controller")
    more = f"{skin}</library_controllers>"
    return collada(put, nodes=nodes.replace("#g", "#s"), more=more)
