"""Reads glTF 2.0 (.glb and .gltf).

trimesh decodes accessors and the node graph. It is handed a reduced document in which every
primitive is a mesh and a node of its own, and texture coordinates are a plain attribute, because
it would otherwise (5.2) read only TEXCOORD_0, leave normalised integers unscaled, read sparse
accessors as zeros, drop the mesh and children of a camera's node, and name nodes at random.
Materials, samplers, images and cameras are read here from the JSON: trimesh keeps neither wrap
modes nor the images' own bytes. Metres and Y up are fixed by the format.
"""

from __future__ import annotations

import io
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError, LimitError
from ptmtools.scene.gltf_document import Document, damaged, natural, open_document
from ptmtools.scene.gltf_material import MaterialReader, Painted
from ptmtools.scene.model import Camera
from ptmtools.scene.reference import Folder
from ptmtools.scene.source import MAX_VERTICES, Findings, Source

#: Required extensions that change nothing that is read here, or that are read.
_HARMLESS = {
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
}
_TRIANGLES, _STRIP = 4, 5
_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_ITEMS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
#: The greatest value of each integer type, which normalised means 1.
_FULL = {5120: 127.0, 5121: 255.0, 5122: 32767.0, 5123: 65535.0}
_TRANSFORM = ("matrix", "translation", "rotation", "scale")


@dataclass(frozen=True)
class _Draw:
    """One primitive at one node."""

    node: int
    name: str
    primitive: dict[str, Any]
    place: str


def read_gltf(path: Path, folder: Folder, findings: Findings) -> Source:
    """Read a glTF model; InputError where it is damaged or needs what is not supported."""
    try:
        return _read(path, open_document(path, folder), folder, findings)
    except (
        LookupError,
        TypeError,
        ValueError,
        AttributeError,
        ArithmeticError,
        AssertionError,
    ) as error:
        # A document this deep has no end of ways to be malformed.
        what = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
        raise damaged(path, what.splitlines()[0] if what else type(error).__name__) from None


def _read(path: Path, document: Document, folder: Folder, findings: Findings) -> Source:
    tree = document.tree
    unsupported = sorted(
        name
        for name in tree.get("extensionsRequired", [])
        if name not in _HARMLESS and not name.startswith("KHR_materials_")
    )
    if unsupported:
        raise InputError(
            "PTM-I255",
            f"needs the glTF extension {unsupported[0]}, which is not read",
            file=path,
            remedy="export it without compression",
        )
    order = _reachable(tree)
    draws = _draws(path, tree, order, findings)
    if not draws:
        raise InputError("PTM-I247", "no faces", file=path, remedy="give a model with triangles")
    painter = MaterialReader(path, document, folder, findings)
    painted = [painter.read(draw.primitive.get("material")) for draw in draws]
    scene = _load(path, document, order, draws, painted)

    points: list[NDArray[np.float64]] = []
    triangles: list[NDArray[np.int64]] = []
    uv: list[NDArray[np.float64]] = []
    total = 0
    for index, (draw, paint) in enumerate(zip(draws, painted, strict=True)):
        matrix, name = scene.graph.get(f"draw{index}")
        mesh = scene.geometry[name]
        attributes = draw.primitive["attributes"]
        local = _values(mesh.vertices, tree["accessors"][attributes["POSITION"]])
        face = np.asarray(mesh.faces, dtype=np.int64).reshape(-1, 3)
        if len(face) and not 0 <= face.min() <= face.max() < len(local):
            raise damaged(path, "an index points beyond the vertices", draw.place)
        with np.errstate(all="ignore"):
            world = local @ matrix[:3, :3].T + matrix[:3, 3]
            if np.linalg.det(matrix[:3, :3]) < 0:  # a mirror turns faces over (section 3.7.4)
                face = face[:, ::-1]
        coord = _coords(mesh, tree, draw, paint)
        points.append(world)
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
        cameras=_cameras(tree, order, scene, findings),
        metres=1.0,
        up="y",
    )


def _reachable(tree: dict[str, Any]) -> list[int]:
    """Nodes of the scene, parents first; of the first scene if none is the default."""
    nodes = tree.get("nodes", [])
    scenes = tree.get("scenes", [])
    if scenes:
        roots = scenes[tree.get("scene", 0)].get("nodes", [])
    else:
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [i for i in range(len(nodes)) if i not in children]
    order: list[int] = []
    seen: set[int] = set()
    stack = list(reversed(roots))
    while stack:
        node = natural(stack.pop())
        if node in seen:
            raise ValueError(f"node {node} has two parents")
        seen.add(node)
        order.append(node)
        stack.extend(reversed(nodes[node].get("children", [])))
    return order


def _draws(path: Path, tree: dict[str, Any], order: list[int], findings: Findings) -> list[_Draw]:
    draws = []
    vertices = 0
    for node in order:
        entry = tree["nodes"][node]
        if "mesh" not in entry:
            continue
        mesh = tree["meshes"][entry["mesh"]]
        name = str(entry.get("name") or mesh.get("name") or f"node {node}")
        if "skin" in entry:
            findings.say("PTM-N224", "skin: taken in its rest pose", f"node {node}")
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
                raise InputError(
                    "PTM-I255",
                    "is compressed with Draco, which is not read",
                    file=path,
                    place=place,
                    remedy="export it without compression",
                )
            if "COLOR_0" in primitive["attributes"]:
                findings.say("PTM-N223", "vertex colours are not carried over", place)
            if primitive.get("targets"):
                findings.say("PTM-N224", "morph targets are not carried over", place)
            vertices += tree["accessors"][primitive["attributes"]["POSITION"]]["count"]
            draws.append(_Draw(node, name, primitive, place))
    if vertices > MAX_VERTICES:
        raise LimitError(
            "PTM-L200", f"more than {MAX_VERTICES} vertices", file=path, remedy="split the model"
        )
    return draws


def _load(
    path: Path, document: Document, order: list[int], draws: list[_Draw], painted: list[Painted]
) -> Any:
    """The trimesh scene of a reduced document: node i is called "i", draw k "drawk"."""
    import trimesh

    tree = document.tree
    needed: dict[int, int] = {}

    def accessor(index: int, place: str) -> int:
        _check_accessor(path, document, index, place)
        return needed.setdefault(index, len(needed))

    meshes = []
    for draw, paint in zip(draws, painted, strict=True):
        attributes = draw.primitive["attributes"]
        reduced: dict[str, Any] = {
            "attributes": {"POSITION": accessor(attributes["POSITION"], draw.place)},
            "mode": draw.primitive.get("mode", _TRIANGLES),
        }
        if paint.coords in attributes:
            reduced["attributes"]["_UV"] = accessor(attributes[paint.coords], draw.place)
        if "indices" in draw.primitive:
            reduced["indices"] = accessor(draw.primitive["indices"], draw.place)
        meshes.append({"primitives": [reduced]})

    place = {node: k for k, node in enumerate(order)}
    nodes: list[dict[str, Any]] = []
    for node in order:
        entry = tree["nodes"][node]
        nodes.append(
            {
                "name": str(node),
                "children": [place[child] for child in entry.get("children", [])],
                **{key: entry[key] for key in _TRANSFORM if key in entry},
            }
        )
    for index, draw in enumerate(draws):
        nodes[place[draw.node]]["children"].append(len(nodes))
        nodes.append({"name": f"draw{index}", "mesh": index})
    below = {child for node in nodes for child in node.get("children", [])}
    reduced_tree = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": str(i)} for i in range(len(document.buffers))],
        "bufferViews": tree.get("bufferViews", []),
        "accessors": [tree["accessors"][index] for index in needed],
        "meshes": meshes,
        "nodes": nodes,
        "scenes": [{"nodes": [i for i in range(len(nodes)) if i not in below]}],
    }
    return trimesh.load_scene(
        io.BytesIO(json.dumps(reduced_tree).encode()),
        file_type="gltf",
        resolver={str(i): buffer.data for i, buffer in enumerate(document.buffers)},
        process=False,
    )


def _check_accessor(path: Path, document: Document, index: int, place: str) -> None:
    """Refuse an accessor that leaves its view, or that trimesh would read as zeros."""
    accessor = document.tree["accessors"][index]
    if "sparse" in accessor or "bufferView" not in accessor:
        raise InputError(
            "PTM-I255",
            f"accessor {index} is sparse or has no buffer view, which is not read",
            file=path,
            place=place,
            remedy="export it without compression",
        )
    _, _, length = document.view(accessor["bufferView"])
    item = _BYTES[accessor["componentType"]] * _ITEMS[accessor["type"]]
    view = document.tree["bufferViews"][accessor["bufferView"]]
    stride = view.get("byteStride", item)
    count, start = accessor["count"], accessor.get("byteOffset", 0)
    if count < 1 or start < 0 or stride < item or start + (count - 1) * stride + item > length:
        raise damaged(path, f"accessor {index} ends beyond its buffer view", place)


def _values(stored: Any, accessor: dict[str, Any]) -> NDArray[np.float64]:
    """What the stored numbers mean: normalised integers are shares (section 3.6.2.2)."""
    values = np.asarray(stored, dtype=np.float64)
    if accessor.get("normalized"):
        values = np.maximum(values / _FULL[accessor["componentType"]], -1.0)
    return values


def _coords(mesh: Any, tree: dict[str, Any], draw: _Draw, paint: Painted) -> NDArray[np.float64]:
    """(n, 2) texture coordinates of a mesh's vertices, from the lower left; 0 without any."""
    if "_UV" not in mesh.vertex_attributes:
        return np.zeros((len(mesh.vertices), 2))
    accessor = tree["accessors"][draw.primitive["attributes"][paint.coords]]
    raw = _values(mesh.vertex_attributes["_UV"], accessor)
    if raw.shape != (len(mesh.vertices), 2):
        raise ValueError(f"{draw.place}: texture coordinates do not match the vertices")
    moved = raw @ paint.matrix[:, :2].T + paint.matrix[:, 2]
    return np.stack([moved[:, 0], 1.0 - moved[:, 1]], axis=1)


def _cameras(
    tree: dict[str, Any], order: list[int], scene: Any, findings: Findings
) -> tuple[Camera, ...]:
    cameras: list[Camera] = []
    for node in order:
        entry = tree["nodes"][node]
        if "camera" not in entry:
            continue
        given = tree["cameras"][entry["camera"]]
        name = str(entry.get("name") or given.get("name") or f"camera {len(cameras)}")
        matrix, _ = scene.graph.get(str(node))
        direction = -matrix[:3, 2]
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
