"""Reads the nodes and primitives of glTF 2.0 models (.glb and .gltf) into a `Source`.

Covers sections 3.5.3 (transformations), 3.7.2 (meshes) and 3.10 (cameras), KHR_node_visibility,
KHR_lights_punctual and EXT_mesh_gpu_instancing. The unit is the metre and Y is up by specification.

trimesh (5.2) is not used because it reads only TEXCOORD_0, leaves normalised integers unscaled,
drops the mesh and children of a camera's node, keeps neither wrap modes nor the bytes of images,
and takes a time that grows with the third power of the graph's depth (six minutes for a file of
100 KB).
"""

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
from ptmtools.scene.colors import encoded, luminance
from ptmtools.scene.gltf.document import Document, check_extensions, damaged, open_document
from ptmtools.scene.gltf.draco import EXTENSION as DRACO, Decoded, decode_primitives
from ptmtools.scene.gltf.material import MaterialReader, MaterialUse, TextureOf, finite
from ptmtools.scene.lights import Lamp, LampKind
from ptmtools.scene.model import Camera
from ptmtools.scene.notes import Findings
from ptmtools.scene.source import MAX_VERTICES, Rows, Source, too_many_triangles

_INSTANCING, _LIGHTS = "EXT_mesh_gpu_instancing", "KHR_lights_punctual"
_DEFAULTS = {
    "TRANSLATION": (0.0, 0.0, 0.0),
    "ROTATION": (0.0, 0.0, 0.0, 1.0),
    "SCALE": (1.0, 1.0, 1.0),
}


def world_matrices(tree: dict[str, Any], findings: Findings) -> dict[int, Floats]:
    """(4, 4) local to world of each visible node of the default scene, else of the first one,
    parents first. Raises ValueError for a node with two parents."""
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
        node, parent = stack.pop()
        if natural(node) in world:
            raise ValueError(f"node {node} has two parents")
        entry = nodes[node]
        visibility = entry.get("extensions", {}).get("KHR_node_visibility", {})
        if visibility.get("visible", True) is False:
            findings.note("PTM-N215", "invisible, dropped with its children", f"node {node}")
            continue
        with np.errstate(all="ignore"):
            world[node] = parent @ _local_matrix(entry)
        stack += [(child, world[node]) for child in reversed(entry.get("children", []))]
    return world


def _local_matrix(entry: dict[str, Any]) -> Floats:
    """(4, 4) of a node: its matrix, or scale, then rotation, then translation."""
    if "matrix" in entry:
        return np.array(entry["matrix"], dtype=np.float64).reshape(4, 4).T
    parts = (
        np.array(entry.get(name.lower(), default), dtype=np.float64).reshape(1, len(default))
        for name, default in _DEFAULTS.items()
    )
    return np.asarray(_matrices(*parts)[0])


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
    """The number of instances of a node's mesh. Raises ValueError if its attributes disagree."""
    attributes = _instance_attributes(document, node)
    if attributes is None:
        return 1
    accessors = document.tree["accessors"]
    counts = {natural(accessors[natural(accessor)]["count"]) for accessor in attributes.values()}
    if len(counts) != 1:
        raise ValueError(f"node {node}: attributes of instances differ in length")
    count = counts.pop()
    if not count:
        raise ValueError(f"node {node}: no instances")
    return count


def instances(document: Document, node: int) -> Floats:
    """(n, 4, 4) from the mesh of a node to the node, for each instance."""
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
    attributes: dict[str, int] | None = extensions.get(_INSTANCING, {}).get("attributes")
    return attributes or None


def cameras(
    tree: dict[str, Any], world: dict[int, Floats], findings: Findings
) -> tuple[Camera, ...]:
    """The perspective cameras of the nodes."""
    result: list[Camera] = []
    for node, matrix in world.items():
        entry = tree["nodes"][node]
        if "camera" not in entry:
            continue
        definition = tree["cameras"][entry["camera"]]
        name = str(entry.get("name") or definition.get("name") or f"camera {len(result)}")
        yfov = definition.get("perspective", {}).get("yfov", 0.0)
        result += findings.camera(name, f"node {node}", matrix[:3, 3], -matrix[:3, 2], yfov)
    return tuple(result)


def lamps(tree: dict[str, Any], world: dict[int, Floats]) -> tuple[Lamp, ...]:
    """The lamps of the nodes (KHR_lights_punctual), which shine along -Z. Their ranges are hints,
    and have no effect."""
    kinds: dict[str, LampKind] = {"point": "point", "spot": "spot", "directional": "sun"}
    result = []
    for node, matrix in world.items():
        use = tree["nodes"][node].get("extensions", {}).get(_LIGHTS)
        if use is None:
            continue
        entry = tree["extensions"][_LIGHTS]["lights"][natural(use["light"])]
        color = np.array([finite(part) for part in entry.get("color", [1.0, 1.0, 1.0])])
        intensity = finite(entry.get("intensity", 1.0)) * float(luminance(color))
        with np.errstate(all="ignore"):
            way = -matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
        if not (intensity and np.isfinite(way).all() and np.isfinite(matrix[:3, 3]).all()):
            continue
        angles = entry.get("spot", {})
        outer = min(finite(angles.get("outerConeAngle", math.pi / 4)), math.pi / 2)
        inner = min(finite(angles.get("innerConeAngle", 0.0)), outer)
        x, y, z = matrix[:3, 3].tolist()
        dx, dy, dz = way.tolist()
        cone = math.cos(inner), math.cos(outer)
        result.append(Lamp(kinds[entry["type"]], (x, y, z), (dx, dy, dz), intensity, cone))
    return tuple(result)


#: Exceptions of malformed documents, which can be malformed in any place.
_FAULTS = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
#: Largest number of vertices per allowed triangle.
_VERTICES_PER_TRIANGLE = 10


@dataclass(frozen=True)
class _Draw:
    """A primitive of a node, with its number of instances and of triangles in each."""

    node: int
    name: str
    primitive: dict[str, Any]
    place: str
    instances: int
    triangles: int = 0

    @property
    def attributes(self) -> dict[str, int]:
        attributes: dict[str, int] = self.primitive["attributes"]
        return attributes

    @property
    def mode(self) -> int:
        return int(self.primitive.get("mode", _TRIANGLES))


def read_gltf(
    path: Path,
    findings: Findings,
    max_triangles: int = MAX_VERTICES,
    texture_of: TextureOf | None = None,
) -> Source:
    """Reads a glTF model; ``texture_of`` as in `MaterialReader`.

    Raises InputError if it is damaged or requires an unsupported extension; LimitError, before
    arrays are allocated, for more vertices than int32 can number (PTM-L203) or more triangles than
    ``max_triangles`` (PTM-L203), instances included, and for too much decompressed data (PTM-L204).
    """
    try:
        document = open_document(path, findings.folder)
        return _read(document, findings, max_triangles, texture_of)
    except _FAULTS as error:
        text = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
        raise damaged(path, text.splitlines()[0] if text else type(error).__name__) from None


def _read(
    document: Document, findings: Findings, max_triangles: int, texture_of: TextureOf | None
) -> Source:
    path, tree = document.path, document.tree
    check_extensions(tree, findings)
    world_of = world_matrices(tree, findings)
    every = (draw for node in world_of for draw in _draws(document, node, findings))
    draws = list(_limited(document, every, max_triangles))
    if not draws:
        raise InputError("PTM-I247", "no faces", file=path, remedy="use a model with triangles")
    materials = MaterialReader(document, findings, texture_of)
    uses = [
        materials.read(draw.primitive.get("material"), "COLOR_0" in draw.attributes)
        for draw in draws
    ]
    compressed = [_compressed(document, draw) for draw in draws]
    decoded = decode_primitives(document, (c["bufferView"] for c in compressed if c is not None))
    rows, first, step = Rows(), dict[int, int](), 0.0
    grids: dict[tuple[bool, int], float] = {}
    for draw, use, draco in zip(draws, uses, compressed, strict=True):
        try:
            values = _Values(document, draw, draco, decoded)
            points, triangles, uv, colors = _mesh(values, draw, use, findings)
            normal_uv = None
            if use.normal_coords is not None and use.normal_matrix is not None:
                count = len(points)
                own = _coordinates(values, use.normal_coords, use.normal_matrix, count)
                normal_uv = own[triangles]
            placed = instances(document, draw.node)
            key = (True, draco["bufferView"]) if draco else (False, draw.attributes["POSITION"])
            if key not in grids:
                grids[key] = values.step("POSITION")
            grid = grids[key]
        except ValueError as error:
            raise damaged(path, str(error), draw.place) from None
        if draw.node not in first:
            first[draw.node] = len(rows.names)
            rows.names += [draw.name] * draw.instances
        with np.errstate(all="ignore"):
            frames = world_of[draw.node] @ placed
            scale = np.linalg.norm(frames[:, :3, :3], axis=1)
            step = max(step, grid * float(scale[np.isfinite(scale)].max(initial=0.0)))
        rows.add(frames, points, triangles, uv, use.index, colors, first[draw.node], normal_uv)
    return rows.source(
        materials=materials.materials,
        cameras=cameras(tree, world_of, findings),
        lamps=lamps(tree, world_of),
        metres=1.0,
        up="y",
        step=step,
    )


def _draws(document: Document, node: int, findings: Findings) -> Iterator[_Draw]:
    """The primitives of a node."""
    tree = document.tree
    entry = tree["nodes"][node]
    if "mesh" not in entry:
        return
    mesh = tree["meshes"][entry["mesh"]]
    name = str(entry.get("name") or mesh.get("name") or f"node {node}")
    if "skin" in entry:
        findings.note("PTM-N215", "skin drawn in its rest pose", f"node {node}")
    count = instance_count(document, node)
    for k, primitive in enumerate(mesh["primitives"]):
        place = f"mesh {entry['mesh']}, primitive {k}"
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            findings.note("PTM-N215", f"primitive of mode {mode} (points or lines), skipped", place)
            continue
        if primitive.get("targets"):
            findings.note("PTM-N215", "morph targets dropped", place)
        yield _Draw(node, name, primitive, place, count)


def _limited(document: Document, draws: Iterable[_Draw], max_triangles: int) -> Iterator[_Draw]:
    """The same primitives with their counts of triangles. Raises LimitError PTM-L203."""
    most = min(MAX_VERTICES, _VERTICES_PER_TRIANGLE * max_triangles)
    vertices = triangles = 0
    for draw in draws:
        accessors = document.tree["accessors"]
        points = corners = natural(accessors[draw.attributes["POSITION"]]["count"])
        if "indices" in draw.primitive:
            corners = natural(accessors[draw.primitive["indices"]]["count"])
        each = max(1, corners // 3 if draw.mode == _TRIANGLES else corners)
        if DRACO in draw.primitive.get("extensions", {}) and "indices" not in draw.primitive:
            each = max(1, 2 * points)  # the stream has the indices; Euler's bound of a surface
        vertices += points * draw.instances
        triangles += each * draw.instances
        if triangles > max_triangles:
            raise too_many_triangles(max_triangles, document.path)
        if vertices > most:
            raise LimitError(
                "PTM-L203",
                f"more than {most} vertices, shared ones counted for each primitive",
                file=document.path,
                remedy="raise the limit (--max-triangles), or split the model",
            )
        yield replace(draw, triangles=each)


def _compressed(document: Document, draw: _Draw) -> dict[str, Any] | None:
    """The Draco extension of a primitive, unless it also has uncompressed data."""
    draco: dict[str, Any] | None = draw.primitive.get("extensions", {}).get(DRACO)
    plain = "bufferView" in document.tree["accessors"][draw.attributes["POSITION"]]
    return None if plain else draco


class _Values:
    """The attributes and indices of a primitive, compressed or not."""

    def __init__(
        self,
        document: Document,
        draw: _Draw,
        draco: dict[str, Any] | None,
        decoded: dict[int, Decoded],
    ) -> None:
        self._document, self._draw = document, draw
        self._ids = {} if draco is None else draco["attributes"]
        self._decoded = None if draco is None else decoded[draco["bufferView"]]

    def attribute(self, name: str, count: int | None = None) -> Floats | None:
        """(n, items) of an attribute, None without it; ValueError unless it has the number of
        elements of its accessor, and ``count`` elements if that is given."""
        if name not in self._draw.attributes:
            return None
        index = self._draw.attributes[name]
        accessor = self._document.tree["accessors"][natural(index)]
        length = natural(accessor["count"])
        if count is not None and length != count:
            raise ValueError(f"{length} elements of {name} for {count} vertices")
        if self._decoded is None or name not in self._ids:
            return self._document.values(index)
        stored = self._decoded.attributes.get(self._ids[name])
        if stored is None or stored.ndim != 2 or len(stored) != length:
            raise ValueError(f"the elements of {name} in Draco differ from the accessor")
        return meaning(stored, bool(accessor.get("normalized")))

    @property
    def decoded(self) -> bool:
        """Whether the primitive was compressed with Draco."""
        return self._decoded is not None

    def step(self, name: str) -> float:
        """The step of the grid of an attribute, in the values of its accessor; 0 for floats."""
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
            raise ValueError("an index exceeds the vertices")
        return index


def _mesh(
    values: _Values, draw: _Draw, use: MaterialUse, findings: Findings
) -> tuple[Floats, Ints, Floats, NDArray[np.uint8] | None]:
    """The arrays of a primitive: (n, 3) points and (m, 3) triangles over them; (m, 3, 2) texture
    coordinates from the lower left and (m, 3, 3) colours of corners, if it has any."""
    points = values.attribute("POSITION")
    if points is None:
        raise KeyError("POSITION")
    # Draco always encodes triangles.
    mode = _TRIANGLES if values.decoded else draw.mode
    triangles = _triangles(values.indices(len(points)), mode)
    uv = _coordinates(values, use.coords, use.matrix, len(points))
    colors, raw = None, values.attribute("COLOR_0", len(points))
    if raw is not None:
        colors = encoded(raw[:, :3] * use.light)[triangles]
        if use.see_through and not (raw[:, 3:] == 1).all():
            findings.note("PTM-N215", "opacities of vertices dropped", draw.place)
    return points, triangles, uv[triangles], colors


def _coordinates(values: _Values, name: str, matrix: Floats, count: int) -> Floats:
    """(n, 2) texture coordinates from the lower left, transformed; 0 without the attribute."""
    raw = values.attribute(name, count)
    if raw is None:
        return np.zeros((count, 2))
    moved = raw @ matrix[:, :2].T + matrix[:, 2]
    return np.stack([moved[:, 0], 1.0 - moved[:, 1]], axis=1)


def _triangles(index: Ints, mode: int) -> Ints:
    """(m, 3) of the corners of a list, a strip or a fan (section 3.7.2.1)."""
    if mode == _TRIANGLES:
        return index.reshape(-1, 3)
    if mode == _FAN:
        return np.stack([index[1:-1], index[2:], np.full(len(index) - 2, index[0])], axis=1)
    strip = np.stack([index[:-2], index[1:-1], index[2:]], axis=1)
    strip[1::2] = strip[1::2, ::-1]
    return strip
