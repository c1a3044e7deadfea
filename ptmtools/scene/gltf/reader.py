"""Reads glTF 2.0 (.glb and .gltf).

The document is read here and not by trimesh, which (5.2) reads only TEXCOORD_0, leaves normalised
integers unscaled, drops the mesh and children of a camera's node, keeps neither wrap modes nor the
images' own bytes, and takes a time that grows with the third power of the graph's depth (six
minutes for a file of 100 KB). Metres and Y up are fixed by the format.

The nodes of a glTF scene: where in the world each is, and as often as it is drawn.

Sections 3.5.3 (transformations) and 3.10 (cameras), KHR_node_visibility,
EXT_mesh_gpu_instancing."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError, LimitError
from ptmtools.glb import COMPONENTS, meaning, natural
from ptmtools.scene.colors import encoded
from ptmtools.scene.gltf.document import Document, check_extensions, damaged, open_document
from ptmtools.scene.gltf.draco import EXTENSION as DRACO, Decoded, decode_primitives
from ptmtools.scene.gltf.material import MaterialReader, MaterialUse, TextureOf
from ptmtools.scene.model import Camera
from ptmtools.scene.notes import Findings
from ptmtools.scene.rows import Rows
from ptmtools.scene.source import MAX_VERTICES, Source, too_many_triangles

_INSTANCING = "EXT_mesh_gpu_instancing"
_DEFAULTS = {
    "TRANSLATION": (0.0, 0.0, 0.0),
    "ROTATION": (0.0, 0.0, 0.0, 1.0),
    "SCALE": (1.0, 1.0, 1.0),
}


def world_matrices(tree: dict[str, Any], findings: Findings) -> dict[int, Floats]:
    """(4, 4) local to world of each visible node of the scene, parents first; of the first scene if
    none is the default. Raises ValueError for a node with two parents."""
    nodes = tree.get("nodes", [])
    scenes = tree.get("scenes", [])
    if scenes:
        roots = scenes[tree.get("scene", 0)].get("nodes", [])
    else:
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [i for i in range(len(nodes)) if i not in children]
    world: dict[int, Floats] = {}
    stack = [(root, np.eye(4)) for root in reversed(roots)]
    while stack:
        node, above = stack.pop()
        if natural(node) in world:
            raise ValueError(f"node {node} has two parents")
        entry = nodes[node]
        visibility = entry.get("extensions", {}).get("KHR_node_visibility", {})
        if visibility.get("visible", True) is False:
            findings.note("PTM-N215", "not visible, and so is what hangs on it", f"node {node}")
            continue
        with np.errstate(all="ignore"):
            world[node] = above @ _local_matrix(entry)
        stack += [(child, world[node]) for child in reversed(entry.get("children", []))]
    return world


def _local_matrix(entry: dict[str, Any]) -> Floats:
    """(4, 4) of a node: its matrix, or scale, then rotation, then translation."""
    if "matrix" in entry:
        whole: Floats = np.array(entry["matrix"], dtype=np.float64).reshape(4, 4).T
        return whole
    parts = (
        np.array(entry.get(name.lower(), default), dtype=np.float64).reshape(1, len(default))
        for name, default in _DEFAULTS.items()
    )
    matrix: Floats = _matrices(*parts)[0]
    return matrix


def _matrices(translation: Floats, rotation: Floats, scale: Floats) -> Floats:
    """(n, 4, 4) of (n, 3) translations, (n, 4) quaternions x, y, z, w, and (n, 3) scales."""
    x, y, z, w = rotation.T
    norm = (rotation**2).sum(axis=1)
    s = np.divide(2, norm, out=np.zeros_like(norm), where=norm > 0)
    turn = np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    )
    local = np.tile(np.eye(4), (len(rotation), 1, 1))
    local[:, :3, :3] = np.moveaxis(turn, 2, 0) * scale[:, None]
    local[:, :3, 3] = translation
    return local


def instance_count(document: Document, node: int) -> int:
    """How often a node's mesh is drawn. Raises ValueError where its attributes disagree."""
    attributes = _instance_attributes(document, node)
    if attributes is None:
        return 1
    accessors = document.tree["accessors"]
    counts = {natural(accessors[natural(accessor)]["count"]) for accessor in attributes.values()}
    if len(counts) != 1:
        raise ValueError(f"node {node}: its instances have attributes of {len(counts)} lengths")
    count = counts.pop()
    if not count:
        raise ValueError(f"node {node}: no instances")
    return count


def instances(document: Document, node: int) -> Floats:
    """(n, 4, 4) from the mesh of a node to the node, for each time that it is drawn."""
    attributes = _instance_attributes(document, node)
    if attributes is None:
        return np.eye(4)[None]
    count = instance_count(document, node)
    parts = []
    for name, default in _DEFAULTS.items():
        if name not in attributes:
            parts.append(np.tile(np.array(default), (count, 1)))
            continue
        parts.append(document.values(attributes[name]))
        if parts[-1].shape[1] != len(default):
            raise ValueError(f"node {node}: {name} of {parts[-1].shape[1]} numbers")
    return _matrices(*parts)


def _instance_attributes(document: Document, node: int) -> dict[str, int] | None:
    extensions = document.tree["nodes"][node].get("extensions", {})
    found: dict[str, int] | None = extensions.get(_INSTANCING, {}).get("attributes")
    return found or None


def cameras(
    tree: dict[str, Any], world: dict[int, Floats], findings: Findings
) -> tuple[Camera, ...]:
    """The perspective cameras of the nodes."""
    found: list[Camera] = []
    for node, matrix in world.items():
        entry = tree["nodes"][node]
        if "camera" not in entry:
            continue
        given = tree["cameras"][entry["camera"]]
        name = str(entry.get("name") or given.get("name") or f"camera {len(found)}")
        direction = -matrix[:3, 2]
        with np.errstate(all="ignore"):
            length = float(np.linalg.norm(direction))
        position = matrix[:3, 3]
        yfov = given.get("perspective", {}).get("yfov", 0.0)
        usable = np.isfinite(position).all() and math.isfinite(length) and length > 0
        if not (usable and 0 < yfov < math.pi):
            findings.note("PTM-N215", f"camera {name} has no perspective, skipped", f"node {node}")
            continue
        x, y, z = position.tolist()
        dx, dy, dz = (direction / length).tolist()
        found.append(Camera(name, (x, y, z), (dx, dy, dz), float(yfov)))
    return tuple(found)


#: What is raised where a document is malformed: one this deep has no end of ways to be that.
_FAULTS = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
#: So many vertices may there be for each triangle that is allowed.
_VERTICES_A_TRIANGLE = 10


@dataclass(frozen=True)
class _Draw:
    """One primitive at one node, as often as that draws it."""

    node: int
    name: str
    primitive: dict[str, Any]
    place: str
    times: int
    triangles: int = 0

    @property
    def attributes(self) -> dict[str, int]:
        found: dict[str, int] = self.primitive["attributes"]
        return found

    @property
    def mode(self) -> int:
        return int(self.primitive.get("mode", _TRIANGLES))


@dataclass(frozen=True)
class _Mesh:
    """What a primitive consists of: (n, 3) points and (m, 3) triangles over them; (m, 3, 2) texture
    coordinates from the lower left and (m, 3, 3) colours of corners, if they have any."""

    points: Floats
    triangles: Ints
    uv: Floats
    colors: NDArray[np.uint8] | None


def read_gltf(
    path: Path,
    findings: Findings,
    max_triangles: int = MAX_VERTICES,
    texture_of: TextureOf | None = None,
) -> Source:
    """Read a glTF model, painted with another texture than that of the base colour where
    ``texture_of`` says so (`MaterialReader`).

    Raises InputError where it is damaged or needs what is not supported; LimitError for more
    vertices than int32 can number or more than ``max_triangles`` (PTM-L203), each as
    often as a node shows it, before anything is made of them, and for more that is compressed than
    can be meant (PTM-L204).
    """
    try:
        document = open_document(path, findings.folder)
        return _read(document, findings, max_triangles, texture_of)
    except _FAULTS as error:
        what = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
        raise damaged(path, what.splitlines()[0] if what else type(error).__name__) from None


def _read(
    document: Document, findings: Findings, max_triangles: int, texture_of: TextureOf | None
) -> Source:
    path, tree = document.path, document.tree
    check_extensions(tree, findings)
    world_of = world_matrices(tree, findings)
    drawn = (draw for node in world_of for draw in _draws(document, node, findings))
    draws = list(_limited(document, drawn, max_triangles))
    if not draws:
        raise InputError("PTM-I247", "no faces", file=path, remedy="give a model with triangles")
    painter = MaterialReader(document, findings, texture_of)
    painted = [
        painter.read(draw.primitive.get("material"), "COLOR_0" in draw.attributes) for draw in draws
    ]
    compressed = [_compressed(document, draw) for draw in draws]
    decoded = decode_primitives(document, (c["bufferView"] for c in compressed if c is not None))
    rows, first, step = Rows(), dict[int, int](), 0.0
    grids: dict[tuple[bool, int], float] = {}
    for draw, paint, told in zip(draws, painted, compressed, strict=True):
        try:
            values = _Values(document, draw, told, decoded)
            mesh = _mesh(values, draw, paint, findings)
            placed = instances(document, draw.node)
            key = (True, told["bufferView"]) if told else (False, draw.attributes["POSITION"])
            if key not in grids:
                grids[key] = values.step("POSITION")
            grid = grids[key]
        except ValueError as error:
            raise damaged(path, str(error), draw.place) from None
        if draw.node not in first:
            first[draw.node] = len(rows.names)
            rows.names += [draw.name] * draw.times
        with np.errstate(all="ignore"):
            frames = world_of[draw.node] @ placed
            scale = np.linalg.norm(frames[:, :3, :3], axis=1)
            step = max(step, grid * float(scale[np.isfinite(scale)].max(initial=0.0)))
        rows.add(
            frames, mesh.points, mesh.triangles, mesh.uv, paint.index, mesh.colors, first[draw.node]
        )
    return rows.source(
        materials=painter.materials,
        cameras=cameras(tree, world_of, findings),
        metres=1.0,
        up="y",
        step=step,
    )


def _draws(document: Document, node: int, findings: Findings) -> Iterator[_Draw]:
    """What a node draws."""
    tree = document.tree
    entry = tree["nodes"][node]
    if "mesh" not in entry:
        return
    mesh = tree["meshes"][entry["mesh"]]
    name = str(entry.get("name") or mesh.get("name") or f"node {node}")
    if "skin" in entry:
        findings.note("PTM-N215", "skin: shown in its rest pose", f"node {node}")
    times = instance_count(document, node)
    for k, primitive in enumerate(mesh["primitives"]):
        place = f"mesh {entry['mesh']}, primitive {k}"
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            findings.note("PTM-N215", f"primitive of mode {mode} (points or lines), skipped", place)
            continue
        if primitive.get("targets"):
            findings.note("PTM-N215", "morph targets are not carried over", place)
        yield _Draw(node, name, primitive, place, times)


def _limited(document: Document, draws: Iterable[_Draw], max_triangles: int) -> Iterator[_Draw]:
    """The same, as long as they are not too many. Raises LimitError PTM-L203."""
    most = min(MAX_VERTICES, _VERTICES_A_TRIANGLE * max_triangles)
    vertices = triangles = 0
    for draw in draws:
        accessors = document.tree["accessors"]
        points = corners = natural(accessors[draw.attributes["POSITION"]]["count"])
        if "indices" in draw.primitive:
            corners = natural(accessors[draw.primitive["indices"]]["count"])
        each = max(1, corners // 3 if draw.mode == _TRIANGLES else corners)
        if DRACO in draw.primitive.get("extensions", {}) and "indices" not in draw.primitive:
            each = max(1, 2 * points)  # it has its own; a surface has no more, by Euler
        vertices += points * draw.times
        triangles += each * draw.times
        if triangles > max_triangles:
            raise too_many_triangles(max_triangles, document.path)
        if vertices > most:
            raise LimitError(
                "PTM-L203",
                f"more than {most} vertices, counting shared ones once for each primitive",
                file=document.path,
                remedy="raise the limit (--max-triangles), or split the model",
            )
        yield replace(draw, triangles=each)


def _compressed(document: Document, draw: _Draw) -> dict[str, Any] | None:
    """What the primitive says of its compression, unless it has plain data, too."""
    found: dict[str, Any] | None = draw.primitive.get("extensions", {}).get(DRACO)
    plain = "bufferView" in document.tree["accessors"][draw.attributes["POSITION"]]
    return None if plain else found


class _Values:
    """The attributes and indices of a primitive, compressed or not."""

    def __init__(
        self,
        document: Document,
        draw: _Draw,
        told: dict[str, Any] | None,
        decoded: dict[int, Decoded],
    ) -> None:
        self._document, self._draw = document, draw
        self._ids = {} if told is None else told["attributes"]
        self._decoded = None if told is None else decoded[told["bufferView"]]

    def attribute(self, name: str, count: int | None = None) -> Floats | None:
        """(n, items) of an attribute, None if there is none; ValueError unless it has as many
        elements as it says, and ``count`` where that is given."""
        if name not in self._draw.attributes:
            return None
        index = self._draw.attributes[name]
        accessor = self._document.tree["accessors"][natural(index)]
        told = natural(accessor["count"])
        if count is not None and told != count:
            raise ValueError(f"{told} elements of {name} for {count} vertices")
        if self._decoded is None or name not in self._ids:
            return self._document.values(index)
        stored = self._decoded.attributes.get(self._ids[name])
        if stored is None or stored.ndim != 2 or len(stored) != told:
            raise ValueError(f"Draco has other elements of {name} than the accessor says")
        return meaning(stored, bool(accessor.get("normalized")))

    @property
    def decoded(self) -> bool:
        """Whether it was compressed with Draco."""
        return self._decoded is not None

    def step(self, name: str) -> float:
        """The step of the grid that an attribute lies on, as its accessor has it; 0 for floats."""
        if self._decoded is not None and name in self._ids:
            step = self._decoded.step(self._ids[name])
            if step is not None:
                return step
        accessor = self._document.tree["accessors"][self._draw.attributes[name]]
        kind = np.dtype(COMPONENTS[accessor["componentType"]])
        if kind.kind == "f":
            return 0.0
        return 1 / float(np.iinfo(kind).max) if accessor.get("normalized") else 1.0

    def indices(self, count: int) -> Ints:
        """(k,) of the corners over ``count`` vertices."""
        if self._decoded is not None:
            index = self._decoded.triangles.ravel()
            if len(index) // 3 > self._draw.triangles:
                raise ValueError(
                    f"Draco has {len(index) // 3} triangles, the accessors {self._draw.triangles}"
                )
        elif "indices" in self._draw.primitive:
            index = self._document.values(self._draw.primitive["indices"]).ravel().astype(np.int64)
        else:
            return np.arange(count)
        if not len(index) or not 0 <= index.min() <= index.max() < count:
            raise ValueError("an index points beyond the vertices")
        return index


def _mesh(values: _Values, draw: _Draw, paint: MaterialUse, findings: Findings) -> _Mesh:
    points = values.attribute("POSITION")
    if points is None:
        raise KeyError("POSITION")
    # Draco has triangles, whatever the primitive was.
    mode = _TRIANGLES if values.decoded else draw.mode
    triangles = _triangles(values.indices(len(points)), mode)
    uv, raw = np.zeros((len(points), 2)), values.attribute(paint.coords, len(points))
    if raw is not None:
        moved = raw @ paint.matrix[:, :2].T + paint.matrix[:, 2]
        uv = np.stack([moved[:, 0], 1.0 - moved[:, 1]], axis=1)
    colors, raw = None, values.attribute("COLOR_0", len(points))
    if raw is not None:
        colors = encoded(raw[:, :3] * paint.light)[triangles]
    if raw is not None and paint.see_through and not (raw[:, 3:] == 1).all():
        findings.note("PTM-N215", "opacities of vertices are not carried over", draw.place)
    return _Mesh(points, triangles, uv[triangles], colors)


def _triangles(index: Ints, mode: int) -> Ints:
    """(m, 3) of the corners of a list, a strip or a fan (section 3.7.2.1)."""
    if mode == _TRIANGLES:
        return index.reshape(-1, 3)
    if mode == _FAN:
        return np.stack([index[1:-1], index[2:], np.full(len(index) - 2, index[0])], axis=1)
    strip = np.stack([index[:-2], index[1:-1], index[2:]], axis=1)
    strip[1::2] = strip[1::2, ::-1]
    return strip
