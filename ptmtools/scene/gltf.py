"""Reads glTF 2.0 (.glb and .gltf).

The document is read here and not by trimesh, which (5.2) reads only TEXCOORD_0, leaves normalised
integers unscaled, drops the mesh and children of a camera's node, keeps neither wrap modes nor the
images' own bytes, and takes a time that grows with the third power of the graph's depth (six
minutes for a file of 100 KB). Metres and Y up are fixed by the format.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError
from ptmtools.glb import natural
from ptmtools.scene.gltf_document import Document, damaged, open_document
from ptmtools.scene.gltf_material import MaterialReader, Painted
from ptmtools.scene.model import Camera
from ptmtools.scene.source import MAX_VERTICES, Findings, Source, too_many_triangles

#: Required extensions that change nothing that is read here, or that are read.
_HARMLESS = {
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
}
#: What is raised where a document is malformed: one this deep has no end of ways to be that.
_FAULTS = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)
_TRIANGLES, _STRIP = 4, 5
#: So many vertices may there be for each triangle that is allowed.
_VERTICES_A_TRIANGLE = 10


@dataclass(frozen=True)
class _Draw:
    """One primitive at one node."""

    node: int
    name: str
    primitive: dict[str, Any]
    place: str


def read_gltf(path: Path, findings: Findings, max_triangles: int = MAX_VERTICES) -> Source:
    """Read a glTF model.

    Raises InputError where it is damaged or needs what is not supported; LimitError for more
    vertices than int32 can number (PTM-L200) or more than ``max_triangles`` (PTM-L203), each as
    often as a node shows it, before anything is made of them.
    """
    try:
        return _read(open_document(path, findings.folder), findings, max_triangles)
    except _FAULTS as error:
        what = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
        raise damaged(path, what.splitlines()[0] if what else type(error).__name__) from None


def _read(document: Document, findings: Findings, max_triangles: int) -> Source:
    path, tree = document.path, document.tree
    unsupported = sorted(
        name
        for name in tree.get("extensionsRequired", [])
        if name not in _HARMLESS and not name.startswith("KHR_materials_")
    )
    if unsupported:
        raise _unread(path, f"needs the glTF extension {unsupported[0]}")
    world_of = _world_matrices(tree)
    draws = _draws(document, world_of, findings, max_triangles)
    if not draws:
        raise InputError("PTM-I247", "no faces", file=path, remedy="give a model with triangles")
    painter = MaterialReader(document, findings)
    painted = [painter.read(draw.primitive.get("material")) for draw in draws]
    points: list[NDArray[np.float64]] = []
    triangles: list[NDArray[np.int64]] = []
    uv: list[NDArray[np.float64]] = []
    total = 0
    for draw, paint in zip(draws, painted, strict=True):
        matrix = world_of[draw.node]
        try:
            local = document.values(draw.primitive["attributes"]["POSITION"])
            face = _faces(document, draw, len(local))
            coord = _coords(document, draw, paint, len(local))
        except NotImplementedError as error:
            raise _unread(path, str(error), draw.place) from None
        except ValueError as error:
            raise damaged(path, str(error), draw.place) from None
        with np.errstate(all="ignore"):
            points.append(local @ matrix[:3, :3].T + matrix[:3, 3])
            if np.linalg.det(matrix[:3, :3]) < 0:  # a mirror turns faces over (section 3.7.4)
                face = face[:, ::-1]
        triangles.append(face + total)
        uv.append(coord[face])
        total += len(local)
    counts = np.array([len(face) for face in triangles])
    names = {draw.node: draw.name for draw in draws}
    number = {node: i for i, node in enumerate(names)}
    return Source(
        points=np.concatenate(points),
        triangles=np.concatenate(triangles),
        uv=np.concatenate(uv),
        triangle_object=np.repeat(np.array([number[draw.node] for draw in draws]), counts),
        triangle_material=np.repeat(np.array([paint.index for paint in painted]), counts),
        objects=tuple(names.values()),
        materials=painter.materials,
        cameras=_cameras(tree, world_of, findings),
        metres=1.0,
        up="y",
    )


def _unread(path: Path, what: str, place: str | None = None) -> InputError:
    """The error for what glTF allows and is not read here."""
    return InputError(
        "PTM-I255",
        f"{what}, which is not read",
        file=path,
        place=place,
        remedy="export it without compression",
    )


def _world_matrices(tree: dict[str, Any]) -> dict[int, NDArray[np.float64]]:
    """(4, 4) local to world of each node of the scene (section 3.5.3), parents first; of the first
    scene if none is the default."""
    nodes = tree.get("nodes", [])
    scenes = tree.get("scenes", [])
    if scenes:
        roots = scenes[tree.get("scene", 0)].get("nodes", [])
    else:
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [i for i in range(len(nodes)) if i not in children]
    world: dict[int, NDArray[np.float64]] = {}
    stack = [(root, np.eye(4)) for root in reversed(roots)]
    while stack:
        node, above = stack.pop()
        if natural(node) in world:
            raise ValueError(f"node {node} has two parents")
        with np.errstate(all="ignore"):
            world[node] = above @ _local_matrix(nodes[node])
        stack += [(child, world[node]) for child in reversed(nodes[node].get("children", []))]
    return world


def _draws(
    document: Document, order: Iterable[int], findings: Findings, max_triangles: int
) -> list[_Draw]:
    path, tree, draws = document.path, document.tree, []
    vertices = triangles = 0
    for node in order:
        entry = tree["nodes"][node]
        if "mesh" not in entry:
            continue
        mesh = tree["meshes"][entry["mesh"]]
        name = str(entry.get("name") or mesh.get("name") or f"node {node}")
        if "skin" in entry:
            findings.say("PTM-N224", "skin: shown in its rest pose", f"node {node}")
        if "EXT_mesh_gpu_instancing" in entry.get("extensions", {}):
            findings.miss("PTM-N224", "EXT_mesh_gpu_instancing: one instance only", f"node {node}")
        for k, primitive in enumerate(mesh["primitives"]):
            place = f"mesh {entry['mesh']}, primitive {k}"
            mode = primitive.get("mode", _TRIANGLES)
            if mode not in (_TRIANGLES, _STRIP):
                drawn = "points or lines" if mode < _TRIANGLES else "a triangle fan"
                say = findings.say if mode < _TRIANGLES else findings.miss
                say("PTM-N219", f"primitive of mode {mode} ({drawn}), skipped", place)
                continue
            if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
                raise _unread(path, "is compressed with Draco", place)
            if "COLOR_0" in primitive["attributes"]:
                findings.say("PTM-N223", "vertex colours are not carried over", place)
            if primitive.get("targets"):
                findings.say("PTM-N224", "morph targets are not carried over", place)
            points = natural(tree["accessors"][primitive["attributes"]["POSITION"]]["count"])
            corners = points
            if "indices" in primitive:
                corners = natural(tree["accessors"][primitive["indices"]]["count"])
            vertices += points
            triangles += corners // 3 if mode == _TRIANGLES else corners
            if triangles > max_triangles:
                raise too_many_triangles(max_triangles, path)
            draws.append(_Draw(node, name, primitive, place))
    most = min(MAX_VERTICES, _VERTICES_A_TRIANGLE * max_triangles)
    if vertices > most:
        raise LimitError(
            "PTM-L200",
            f"more than {most} vertices, counting shared ones once for each primitive",
            file=path,
            remedy="raise the limit (--max-triangles), or split the model",
        )
    return draws


def _local_matrix(entry: dict[str, Any]) -> NDArray[np.float64]:
    """(4, 4) of a node: its matrix, or scale, then rotation, then translation."""
    if "matrix" in entry:
        return np.array(entry["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = np.array(entry.get("rotation", [0, 0, 0, 1]), dtype=np.float64).tolist()
    n = x * x + y * y + z * z + w * w
    s = 2 / n if n > 0 else 0.0
    local = np.eye(4)
    local[:3, :3] = [
        [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
    ]
    local[:3, :3] *= np.array(entry.get("scale", [1, 1, 1]), dtype=np.float64).reshape(3)
    local[:3, 3] = np.array(entry.get("translation", [0, 0, 0]), dtype=np.float64).reshape(3)
    return local


def _faces(document: Document, draw: _Draw, count: int) -> NDArray[np.int64]:
    """(T, 3) triangles of a primitive over its ``count`` vertices."""
    index = np.arange(count)
    if "indices" in draw.primitive:
        index = document.values(draw.primitive["indices"]).ravel().astype(np.int64)
        if not 0 <= index.min() <= index.max() < count:
            raise ValueError("an index points beyond the vertices")
    if draw.primitive.get("mode", _TRIANGLES) == _TRIANGLES:
        return index.reshape(-1, 3)
    strip = np.stack([index[:-2], index[1:-1], index[2:]], axis=1)
    strip[1::2] = strip[1::2, ::-1]
    return strip


def _coords(document: Document, draw: _Draw, paint: Painted, count: int) -> NDArray[np.float64]:
    """(n, 2) texture coordinates of a primitive's vertices, from the lower left; 0 without any."""
    attributes = draw.primitive["attributes"]
    if paint.coords not in attributes:
        return np.zeros((count, 2))
    if document.tree["accessors"][attributes[paint.coords]]["count"] != count:
        raise ValueError("texture coordinates do not match the vertices")
    raw = document.values(attributes[paint.coords])
    moved = raw @ paint.matrix[:, :2].T + paint.matrix[:, 2]
    return np.stack([moved[:, 0], 1.0 - moved[:, 1]], axis=1)


def _cameras(
    tree: dict[str, Any], world: dict[int, NDArray[np.float64]], findings: Findings
) -> tuple[Camera, ...]:
    cameras: list[Camera] = []
    for node, matrix in world.items():
        entry = tree["nodes"][node]
        if "camera" not in entry:
            continue
        given = tree["cameras"][entry["camera"]]
        name = str(entry.get("name") or given.get("name") or f"camera {len(cameras)}")
        direction = -matrix[:3, 2]
        with np.errstate(all="ignore"):
            length = float(np.linalg.norm(direction))
        position = matrix[:3, 3]
        yfov = given.get("perspective", {}).get("yfov", 0.0)
        usable = np.isfinite(position).all() and math.isfinite(length) and length > 0
        if not (usable and 0 < yfov < math.pi):
            findings.say("PTM-N225", f"camera {name} has no perspective, skipped", f"node {node}")
            continue
        x, y, z = position.tolist()
        dx, dy, dz = (direction / length).tolist()
        cameras.append(Camera(name, (x, y, z), (dx, dy, dz), float(yfov)))
    return tuple(cameras)
