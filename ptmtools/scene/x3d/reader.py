"""Reads VRML97 and X3D models into a `ModelSource`.

pymeshlab is not used because it loses objects and materials, and which face has which image, and
reads no boxes or other solids; trimesh knows neither format.

A model may consist of many files (Inline), each of which is parsed once. Sensors, scripts,
interpolators, sounds and backgrounds have no effect.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.errors import InputError
from ptmtools.progress import Progress, silent
from ptmtools.scene.model import Camera
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import FAULTS, IngestOptions, damage, fault_of
from ptmtools.scene.placement import place_nodes, rotation, translation
from ptmtools.scene.source import MeshArrays, ModelSource
from ptmtools.scene.x3d.appearance import AppearanceReader
from ptmtools.scene.x3d.classic import parse_classic
from ptmtools.scene.x3d.geometry import Faces, read_geometry
from ptmtools.scene.x3d.nodes import X3dNode, parse_x3d

_ZERO, _ONE, _STILL = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.0, 0.0, 1.0, 0.0)
_TRANSFORMS = ("Transform", "CADPart", "HAnimJoint", "HAnimSite")
_SUFFIXES = (".wrl", ".wrz", ".vrml", ".x3d", ".x3dv")
_LIGHTS = ("PointLight", "SpotLight", "DirectionalLight")
#: Prototypes of the XML encoding, which are not expanded.
_PROTOTYPES = ("ProtoDeclare", "ExternProtoDeclare", "ProtoInstance")


def read_x3d(
    path: Path, notes: IngestNotes, options: IngestOptions, progress: Progress = silent
) -> ModelSource:
    """Reads a VRML97 or X3D model.

    Raises InputError if it or a file of its own is damaged (PTM-I254), or it has no face
    (PTM-I247); LimitError PTM-L203, before instances are made, for more triangles than ``options``
    allow, and PTM-L204.
    """
    return _SceneReader(path, notes).read(options.max_triangles)


class _SceneReader:
    def __init__(self, path: Path, notes: IngestNotes) -> None:
        self._path, self._notes = path, notes
        self._files: dict[Path, list[X3dNode]] = {}
        self._below: dict[int, list[X3dNode]] = {}
        self._names: dict[int, str] = {}
        self._faces: dict[int, Faces | None] = {}
        self._appearances = AppearanceReader(notes)

    def read(self, limit: int) -> ModelSource:
        """The triangles of all shapes."""
        arrays, cameras = MeshArrays(), list[Camera]()
        try:
            roots = self._parse(self._path)
            for root in roots:
                self._names[id(root)] = root.name
            args = self._children, self._matrix, self._weight, limit, self._path
            for node, frames in place_nodes(roots, *args):
                if node.type == "Shape":
                    self._add(arrays, node, frames)
                elif node.type == "Viewpoint":
                    cameras += self._cameras(node, frames)
        except InputError:
            raise
        except FAULTS as error:
            raise damage(self._path, fault_of(error)) from None
        if not arrays.names:
            raise InputError(
                "PTM-I247", "no faces", file=self._path, remedy="use a model with faces"
            )
        return arrays.source(materials=self._appearances.materials, cameras=tuple(cameras))

    def _parse(self, file: Path) -> list[X3dNode]:
        """The nodes of a file, the same at each call. Raises InputError PTM-I254."""
        key = file.resolve()
        if key not in self._files:
            try:
                xml = file.suffix.lower() == ".x3d"
                self._files[key] = parse_x3d(file) if xml else parse_classic(file, self._notes)
            except InputError:
                raise
            except FAULTS as error:
                raise damage(file, fault_of(error)) from None
        return self._files[key]

    def _children(self, node: X3dNode) -> list[X3dNode]:
        """The nodes below a node that are drawn."""
        if id(node) not in self._below:
            below = self._below[id(node)] = self._nodes_below(node)
            for child in below:
                self._names.setdefault(id(child), child.name or self._names[id(node)])
        return self._below[id(node)]

    def _nodes_below(self, node: X3dNode) -> list[X3dNode]:
        if node.type == "Inline":
            urls = [url for url in node.texts("url") if url.strip()]
            what, place = f"Inline {urls[0] if urls else ''}", node.file.name
            folder = node.file.parent
            file = self._notes.locate_first(urls or [""], what, place, folder)
            if file is not None and file.suffix.lower() not in _SUFFIXES:
                self._notes.miss("PTM-N214", f"{what}: of another format", place)
                file = None
            return [] if file is None else self._parse(file)
        if node.type in _PROTOTYPES:
            self._notes.note("PTM-N215", f"{node.type}: not drawn", node.file.name)
            return []
        if node.type in _LIGHTS:
            self._notes.note("PTM-N215", "lights left out", node.file.name)
        field = {"Switch": "choice", "LOD": "level"}.get(node.type, "children")
        below = node.nodes(field) or node.nodes("children")
        if node.type == "LOD":
            return below[:1]
        if node.type == "Switch":
            choice = int(node.number("whichChoice", -1))
            return below[choice : choice + 1] if choice >= 0 else []
        return below + node.nodes("shape")

    def _matrix(self, node: X3dNode) -> Floats:
        """(4, 4) from a node to its parent."""
        if node.type not in _TRANSFORMS:
            return np.eye(4)
        centre = node.vector("center", _ZERO)
        turn, slant = (
            rotation(values[:3], values[3])
            for values in (node.vector(name, _STILL) for name in ("rotation", "scaleOrientation"))
        )
        scale = slant @ np.diag([*node.vector("scale", _ONE), 1.0]) @ slant.T
        place = translation(node.vector("translation", _ZERO) + centre)
        return place @ turn @ scale @ translation(-centre)

    def _weight(self, node: X3dNode) -> int:
        """The number of triangles of a shape; 1 of a camera."""
        if node.type != "Shape":
            return int(node.type == "Viewpoint")
        geometry = node.node("geometry")
        if geometry is None:
            return 0
        if id(geometry) not in self._faces:
            self._faces[id(geometry)] = read_geometry(geometry, self._notes)
        faces = self._faces[id(geometry)]
        return 0 if faces is None else len(faces.triangles)

    def _add(self, arrays: MeshArrays, node: X3dNode, frames: Floats) -> None:
        """Adds the instances of a shape."""
        geometry = node.node("geometry")
        faces = None if geometry is None else self._faces[id(geometry)]
        if geometry is None or faces is None:
            return
        material, matrix = self._appearances.read(
            node.node("appearance"), solid=faces.solid, colored=faces.colors is not None
        )
        name = self._names[id(node)] or geometry.name or f"shape {len(arrays.names)}"
        with np.errstate(all="ignore"):
            uv = faces.uv @ matrix[:, :2].T + matrix[:, 2]
        arrays.add(
            arrays.add_objects(name, len(frames)),
            faces.points,
            faces.triangles,
            frames=frames,
            uv=uv,
            material=material,
            colors=faces.colors,
        )

    def _cameras(self, node: X3dNode, frames: Floats) -> list[Camera]:
        turn = node.vector("orientation", _STILL)
        place = translation(node.vector("position", (0.0, 0.0, 10.0)))
        view = node.number("fieldOfView", np.pi / 4)
        name = node.name or next(iter(node.texts("description")), "") or "viewpoint"
        result: list[Camera] = []
        for frame in frames @ place @ rotation(turn[:3], turn[3]):
            result += self._notes.camera(name, "", frame[:3, 3], -frame[:3, 2], view)
        return result
