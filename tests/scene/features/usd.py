"""Features of USD."""

from __future__ import annotations

from typing import Any

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
    glossy,
    glowing,
    half,
    mirrored,
    seen,
    the_quad,
    three_quads,
    tinted,
    twice,
    vertex_colors,
)

#: Linear light of half of sRGB.
LIGHT = ((0.5 + 0.055) / 1.055) ** 2.4


def made() -> Any:
    from tests.scene.usd import usd_models

    return usd_models


def written(put: Put, stage: Any, **images: np.ndarray) -> str:
    for name, texels in images.items():
        put(f"{name}.png", png(texels))
    put("a.usda", stage.GetRootLayer().ExportToString())
    return "a.usda"


@feature("USD", "textures", "carried over", four)
def _(put: Put) -> str:
    on = made().stage()
    made().textured(on, "four.png")
    return written(put, on, four=FOUR)


@feature("USD", "images of emission", "carried over", glowing, "PTM-N215")
def _(put: Put) -> str:
    on = made().stage()
    image = made().rgb(made().texture(on, "/World/m/image", "four.png"))
    black = made().material(on, "/World/m", diffuseColor=(0, 0, 0), emissiveColor=image)
    made().bind(made().mesh(on, st=made().CORNERS), black)
    return written(put, on, four=FOUR)


@feature("USD", "material colours", "carried over", tinted, "PTM-N215")
def _(put: Put) -> str:
    on = made().stage()
    made().bind(made().mesh(on), made().material(on, "/World/m", diffuseColor=(1, LIGHT, 0)))
    return written(put, on)


@feature("USD", "vertex colours", "carried over", vertex_colors, "PTM-N215")
def _(put: Put) -> str:
    on = made().stage()
    corners = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)]
    made().colors(made().mesh(on), corners, "vertex")
    return written(put, on)


@feature("USD", "opacity", "carried over", half, "PTM-N215")
def _(put: Put) -> str:
    on = made().stage()
    made().bind(made().mesh(on), made().material(on, "/World/m", opacity=0.5))
    return written(put, on)


def with_alpha(on: Any, **inputs: Any) -> None:
    """A quad whose image is its opacity, too."""
    from pxr import Sdf

    quad = made().mesh(on, st=made().CORNERS)
    image = made().texture(on, "/World/m/image", "four.png")
    alpha = image.CreateOutput("a", Sdf.ValueTypeNames.Float)
    paint = made().material(on, "/World/m", diffuseColor=made().rgb(image), opacity=alpha, **inputs)
    made().bind(quad, paint)


@feature("USD", "texture alpha", "carried over", cut_out)
def _(put: Put) -> str:
    on = made().stage()
    with_alpha(on)
    return written(put, on, four=np.dstack([FOUR, ALPHA]))


def tested(scene: Scene) -> None:
    cut_out(scene)
    assert scene.materials[0].cutoff == 0.25


@feature("USD", "alpha cutoff", "carried over", tested)
def _(put: Put) -> str:
    on = made().stage()
    with_alpha(on, opacityThreshold=0.25)
    return written(put, on, four=np.dstack([FOUR, ALPHA]))


@feature("USD", "texture transforms", "baked", twice, "PTM-N215")
def _(put: Put) -> str:
    on = made().stage()
    coords = made().reader(on, "/World/m/st", "st")
    moved = made().shader(on, "/World/m/moved", "UsdTransform2d", in_=coords, scale=(2, 1))
    from pxr import Sdf

    quad = made().mesh(on, st=made().CORNERS)
    result = moved.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    image = made().texture(on, "/World/m/image", "four.png", st=result)
    made().bind(quad, made().material(on, "/World/m", diffuseColor=made().rgb(image)))
    return written(put, on, four=FOUR)


def repeating(on: Any, across: float, down: float, wrap: str) -> None:
    """Coordinates from the upper left corner, as a viewer of glTF would have them."""
    st = [(u * across, 1 - (1 - v) * down) for u, v in made().CORNERS]
    made().textured(on, "four.png", st, wrapS=wrap, wrapT=wrap)


@feature("USD", "clamped textures", "carried over", clamped)
def _(put: Put) -> str:
    on = made().stage()
    repeating(on, 2, 1, "clamp")
    return written(put, on, four=FOUR)


@feature("USD", "mirrored textures", "baked", mirrored, "PTM-N215")
def _(put: Put) -> str:
    on = made().stage()
    repeating(on, 2.5, 2, "mirror")
    return written(put, on, four=FOUR)


@feature("USD", "instances", "carried over", three_quads)
def _(put: Put) -> str:
    """Three of one prototype, as `three_quads` has them."""
    from pxr import Gf, UsdGeom

    on = made().stage()
    instancer = UsdGeom.PointInstancer.Define(on, "/World/wall")
    made().mesh(on, "/World/wall/wall")
    instancer.CreatePrototypesRel().SetTargets(["/World/wall/wall"])
    instancer.CreateProtoIndicesAttr([0, 0, 0])
    instancer.CreatePositionsAttr([Gf.Vec3f(0, 0, 0), Gf.Vec3f(0, 0, 5), Gf.Vec3f(0, 0, -5)])
    turns = [Gf.Quath(1, 0, 0, 0), Gf.Quath(0, 0, 0, 1), Gf.Quath(1, 0, 0, 0)]
    instancer.CreateOrientationsAttr(turns)
    instancer.CreateScalesAttr([Gf.Vec3f(1), Gf.Vec3f(1), Gf.Vec3f(2, 1, 1)])
    return written(put, on)


@feature("USD", "polygons", "carried over", the_quad)
def _(put: Put) -> str:
    on = made().stage()
    made().mesh(on)
    return written(put, on)


@feature("USD", "cameras", "carried over", seen)
def _(put: Put) -> str:
    from pxr import UsdGeom

    on = made().stage()
    made().mesh(on)
    camera = UsdGeom.Camera.Define(on, "/World/camera")
    camera.AddTranslateOp().Set((5, 2, 5))
    camera.CreateFocalLengthAttr(50.0)
    camera.CreateVerticalApertureAttr(2 * 50 * float(np.tan(0.4)))
    return written(put, on)


@feature("USD", "hidden nodes", "noted", the_quad, "PTM-N215")
def _(put: Put) -> str:
    on = made().stage()
    made().mesh(on)
    made().mesh(on, "/World/hidden").MakeInvisible()
    return written(put, on)


@feature("USD", "points and lines", "noted", the_quad, "PTM-N215")
def _(put: Put) -> str:
    from pxr import UsdGeom

    on = made().stage()
    made().mesh(on)
    curves = UsdGeom.BasisCurves.Define(on, "/World/line")
    curves.CreatePointsAttr([(0, 0, 0), (1, 0, 0)])
    curves.CreateCurveVertexCountsAttr([2])
    return written(put, on)


@feature("USD", "metallic and roughness", "carried over", glossy, "PTM-N215")
def _(put: Put) -> str:
    on = made().stage()
    metal = made().material(on, "/World/m", metallic=1.0, roughness=0.25)
    made().bind(made().mesh(on), metal)
    return written(put, on)
