"""Features of IFC."""

from __future__ import annotations

from typing import Any

from ptmtools.scene import Scene
from tests.scene.conftest import Put
from tests.scene.features.registry import feature, glossy, half


def written(put: Put, made: Any, name: str = "a.ifc") -> str:
    made.write(put(name, ""))
    return name


def building() -> Any:
    from tests.scene.ifc.ifc_house import Ifc

    return Ifc()


def brick(scene: Scene) -> None:
    assert scene.materials[0].color == (1.0, 0.5, 0.0)


@feature("IFC", "material colours", "carried over", brick)
def _(put: Put) -> str:
    made = building()
    made.box("IfcWall", "W", (0, 0, 0), (5, 1, 3), style=made.style("Brick", (1.0, 0.5, 0.0), None))
    return written(put, made)


@feature("IFC", "opacity", "carried over", half)
def _(put: Put) -> str:
    made = building()
    made.box("IfcWall", "W", (0, 0, 0), (5, 1, 3), style=made.style("Glass", (1.0, 1, 1), 0.5))
    return written(put, made)


def classes_decide(scene: Scene) -> None:
    kinds = dict(zip(scene.objects, scene.kinds, strict=True))
    assert kinds == {"IfcWall W": "structural", "IfcDoor D": "door", "IfcRailing R": "detail"}


@feature("IFC", "product classes", "carried over", classes_decide)
def _(put: Put) -> str:
    made = building()
    for n, (kind, name) in enumerate((("IfcWall", "W"), ("IfcDoor", "D"), ("IfcRailing", "R"))):
        made.box(kind, name, (6 * n, 0, 0), (6 * n + 5, 1, 3))
    return written(put, made)


def two_storeys(scene: Scene) -> None:
    actual = [(storey.name, round(storey.height, 6)) for storey in scene.storeys]
    assert actual == [("EG", 0.0), ("OG", 3.0)]


@feature("IFC", "storey names", "carried over", two_storeys)
def _(put: Put) -> str:
    made = building()
    for name, height in (("EG", 0.0), ("OG", 3.0)):
        storey = made.storey(name, height)
        made.box("IfcWall", f"W {name}", (0, 0, 0), (5, 1, 2.5), storey)
    return written(put, made)


def one_wall(scene: Scene) -> None:
    assert scene.objects == ("IfcWall W",)


@feature("IFC", "hidden nodes", "noted", one_wall, "PTM-N215")
def _(put: Put) -> str:
    """A space, which is no thing."""
    made = building()
    made.box("IfcWall", "W", (0, 0, 0), (5, 1, 3))
    made.box("IfcSpace", "S", (0, 1, 0), (5, 5, 3))
    return written(put, made)


@feature("IFC", "metallic and roughness", "carried over", glossy)
def _(put: Put) -> str:
    made = building()
    highlight = made.file.create_entity("IfcSpecularRoughness", 0.25)
    rendering = {"ReflectanceMethod": "METAL", "SpecularHighlight": highlight}
    style = made.style("Steel", (1.0, 1, 1), **rendering)
    made.box("IfcWall", "W", (0, 0, 0), (5, 1, 3), style=style)
    return written(put, made)
