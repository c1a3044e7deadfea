"""Reads COLLADA models, the exchange format of SketchUp, into a `ModelSource`.

pycollada (0.9.3) is not used because it drops polygons with holes, knows neither the names of the
nodes that place a geometry nor the opaque modes A_ZERO and RGB_ONE, refuses nodes that refer to
later ones, and reads the entities of a DOCTYPE. pymeshlab loses objects, units and which material
has which image.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools.progress import Progress, silent
from ptmtools.scene.collada.document import ColladaDocument, matrix_of
from ptmtools.scene.collada.material import ColladaMaterialReader
from ptmtools.scene.collada.mesh import Part, read_mesh
from ptmtools.scene.markup import floats
from ptmtools.scene.model import Camera
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import FAULTS, IngestOptions, damage, fault_of
from ptmtools.scene.placement import place_nodes
from ptmtools.scene.source import MeshArrays, ModelSource

#: From X up to Y up.
_X_UP = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
#: Largest number of controllers of controllers.
_DEEPEST = 8


def read_collada(
    path: Path, notes: IngestNotes, options: IngestOptions, progress: Progress = silent
) -> ModelSource:
    """Reads a COLLADA model.

    Raises InputError if it is damaged (PTM-I254) or has no face (PTM-I247); LimitError PTM-L203,
    before instances are made, for more triangles than ``options`` allow.
    """
    try:
        return _ColladaReader(ColladaDocument(path, notes)).read(options.max_triangles)
    except InputError:
        raise
    except FAULTS as error:
        raise damage(path, fault_of(error)) from None


class _ColladaReader:
    def __init__(self, document: ColladaDocument) -> None:
        self._document, self._notes = document, document.notes
        self._materials = ColladaMaterialReader(document)
        self._parts: dict[int, list[Part]] = {}
        self._children: dict[int, list[Element]] = {}
        self._instances: dict[int, list[tuple[Element, Element, Floats]]] = {}

    def read(self, limit: int) -> ModelSource:
        document, arrays, cameras = self._document, MeshArrays(), list[Camera]()
        axis = (document.root.findtext("asset/up_axis") or "").strip()
        turn = _X_UP if axis == "X_UP" else np.eye(4)
        placed = place_nodes(
            self._roots(), self._children_of, matrix_of, self._weight, limit, document.path
        )
        for node, frames in placed:
            name = node.get("name") or node.get("id") or ""
            for instance, geometry, inner in self._instances[id(node)]:
                parts = self._parts[id(geometry)]
                title = name or geometry.get("name") or geometry.get("id")
                first = arrays.add_objects(str(title), len(frames)) if parts else 0
                with np.errstate(all="ignore"):
                    world = turn @ frames @ inner
                for part in parts:
                    self._add(arrays, first, part, world, instance)
            for instance in node.findall("instance_camera"):
                cameras += self._cameras(instance, turn @ frames, name)
            if node.find("instance_light") is not None:
                self._notes.note("PTM-N215", "lights left out")
        if not arrays.names:
            raise InputError(
                "PTM-I247", "no faces", file=document.path, remedy="use a model with meshes"
            )
        return arrays.source(
            materials=self._materials.materials,
            cameras=tuple(cameras),
            metres=self._metres(),
            up=_UP.get(axis),
        )

    def _metres(self) -> float | None:
        unit = self._document.root.find("asset/unit")
        metres = 0.0 if unit is None else float(unit.get("meter", 0))
        return metres if math.isfinite(metres) and metres > 0 else None

    def _roots(self) -> list[Element]:
        """The nodes of the scene."""
        use = self._document.root.find("scene/instance_visual_scene")
        scene = self._document.root.find("library_visual_scenes/visual_scene")
        if use is not None:
            scene = self._document.follow(use.get("url"), "visual_scene")
        return [] if scene is None else scene.findall("node")

    def _children_of(self, node: Element) -> list[Element]:
        if id(node) not in self._children:
            instances = (
                self._document.follow(item.get("url"), "node")
                for item in node.findall("instance_node")
            )
            self._children[id(node)] = node.findall("node") + [
                n for n in instances if n is not None
            ]
        return self._children[id(node)]

    def _weight(self, node: Element) -> int:
        """The number of triangles of a node, and at least 1 for a camera."""
        count = len(node.findall("instance_camera"))
        self._instances[id(node)] = list(self._geometries(node))
        for _, geometry, _ in self._instances[id(node)]:
            if id(geometry) not in self._parts:
                self._parts[id(geometry)] = read_mesh(geometry, self._document)
            count += sum(len(part.triangles) for part in self._parts[id(geometry)])
        return count

    def _geometries(self, node: Element) -> Iterator[tuple[Element, Element, Floats]]:
        """The geometries of a node: their instance, their element, and (4, 4) to the node."""
        for instance in node:
            if instance.tag not in ("instance_geometry", "instance_controller"):
                continue
            matrix, url = np.eye(4), instance.get("url")
            element = self._document.follow(url, "geometry", "controller")
            for _ in range(_DEEPEST):
                if element is None or element.tag == "geometry":
                    break
                self._notes.note("PTM-N215", "skin or morph drawn in its rest pose")
                skin = element.find("skin")
                source = element.find("morph") if skin is None else skin
                if skin is not None and (shape := skin.findtext("bind_shape_matrix")):
                    matrix = matrix @ floats(shape).reshape(4, 4)
                url = None if source is None else source.get("source")
                element = self._document.follow(url, "geometry", "controller")
            if element is not None and element.tag == "geometry":
                yield instance, element, matrix

    def _add(
        self, arrays: MeshArrays, first: int, part: Part, frames: Floats, instance: Element
    ) -> None:
        """Adds the instances of a part."""
        binding = next(
            (i for i in instance.iter("instance_material") if i.get("symbol") == part.symbol), None
        )
        name = part.symbol if binding is None else binding.get("target", "")[1:]
        use, number = self._materials.read(name), None
        if binding is not None and use.coords:
            bound = {
                item.get("semantic"): int(item.get("input_set", 0))
                for item in binding.findall("bind_vertex_input")
            }
            number = bound.get(use.coords)
        uv = part.coordinates(number, self._document)
        material = self._materials.materials[use.index]
        if uv is None and material.texture is not None:
            message = f"faces of textured material {material.name} have no texture coordinates"
            self._notes.note("PTM-N229", message, "", len(part.triangles))
        arrays.add(
            first,
            part.points,
            part.triangles,
            frames=frames,
            uv=uv,
            material=use.index,
            colors=part.colors(self._document),
        )

    def _cameras(self, instance: Element, frames: Floats, name: str) -> Iterator[Camera]:
        camera = self._document.follow(instance.get("url"), "camera")
        optics = None if camera is None else camera.find("optics/technique_common/perspective")
        if camera is None:
            return
        values = {item.tag: float(item.text or "nan") for item in optics or ()}
        height = math.radians(values.get("yfov", 0.0))
        if "yfov" not in values and "xfov" in values:
            width = math.tan(math.radians(values["xfov"]) / 2)
            height = 2 * math.atan(width / (values.get("aspect_ratio") or 1.0))
        title = str(name or camera.get("name") or camera.get("id"))
        for frame in frames:
            yield from self._notes.camera(title, "", frame[:3, 3], -frame[:3, 2], height)


_UP: dict[str, Literal["y", "z"]] = {"X_UP": "y", "Y_UP": "y", "Z_UP": "z"}
