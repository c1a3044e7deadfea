"""Reads the primitives of glTF 2.0 models (section 3.7.2) into a `ModelSource`.

trimesh (5.2) is not used because it reads only TEXCOORD_0, leaves normalised integers unscaled,
drops the mesh and children of a camera's node, keeps neither wrap modes nor the bytes of images,
and takes a time that grows with the third power of the graph's depth (six minutes for a file of
100 KB).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError, LimitError
from ptmtools.glb import COMPONENTS, meaning, natural
from ptmtools.progress import Progress, silent
from ptmtools.scene.colors import encode_srgb
from ptmtools.scene.gltf.compression import DRACO, DracoPrimitive, decode_primitives
from ptmtools.scene.gltf.document import (
    GltfDocument,
    check_extensions,
    damage,
    document_json,
    open_document,
    place_of,
)
from ptmtools.scene.gltf.material import GltfMaterialReader, MaterialUse, TextureOf
from ptmtools.scene.gltf.nodes import cameras, instance_count, instances, lamps, world_matrices
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import (
    FAULTS,
    MAX_VERTICES,
    IngestOptions,
    fault_of,
    too_many_triangles,
)
from ptmtools.scene.source import MeshArrays, ModelSource, Purpose, SecondReading

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
    notes: IngestNotes,
    options: IngestOptions,
    progress: Progress = silent,
    texture_of: TextureOf | None = None,
) -> ModelSource:
    """Reads a glTF model; ``texture_of`` as in `GltfMaterialReader`.

    Raises InputError if it is damaged or requires an unsupported extension; LimitError, before
    arrays are allocated, for more vertices than int32 can number (PTM-L203) or more triangles than
    ``options`` allow (PTM-L203), instances included, and for too much decompressed data (PTM-L204).
    """
    try:
        document = open_document(path, notes.folder)
        normals = options.normal_maps == "draw"
        materials = GltfMaterialReader(document, notes, texture_of, normals=normals)
        return _read(document, notes, options.max_triangles, materials)
    except InputError:
        raise
    except FAULTS as error:
        raise damage(path, fault_of(error)) from None


#: The textures of a second reading.
_OTHER_TEXTURES: dict[Purpose, TextureOf] = {
    "lightmap": lambda entry: entry.get("occlusionTexture"),
    "reflection": lambda entry: entry.get("pbrMetallicRoughness", {}).get(
        "metallicRoughnessTexture"
    ),
}


def read_again(path: Path, options: IngestOptions, purpose: Purpose) -> SecondReading | None:
    """A glTF with other textures; None if no material has such a texture. Raises as `read_gltf`."""
    texture_of = _OTHER_TEXTURES[purpose]
    materials = document_json(path).get("materials", [])
    if not any(texture_of(entry) for entry in materials if type(entry) is dict):
        return None
    asked: list[bool] = []

    def ask(entry: dict[str, Any]) -> dict[str, Any] | None:
        use = texture_of(entry)
        asked.append(use is not None)
        return use

    notes = IngestNotes(path, options.allow_outside)
    source = read_gltf(path, notes, options, texture_of=ask)
    missing = tuple(note for note in notes.entries if note.code in ("PTM-N204", "PTM-N205"))
    return SecondReading(source, tuple(asked), missing, tuple(notes.folder.sought))


def _read(
    document: GltfDocument, notes: IngestNotes, max_triangles: int, materials: GltfMaterialReader
) -> ModelSource:
    path, tree = document.path, document.tree
    check_extensions(tree, notes)
    world_of = world_matrices(tree, notes)
    every = (draw for node in world_of for draw in _draws(document, node, notes))
    draws = list(_count_triangles(document, every, max_triangles))
    if not draws:
        raise InputError("PTM-I247", "no faces", file=path, remedy="use a model with triangles")
    uses = [
        materials.read(draw.primitive.get("material"), "COLOR_0" in draw.attributes)
        for draw in draws
    ]
    compressed = [_draco_of(document, draw) for draw in draws]
    decoded = decode_primitives(document, (c["bufferView"] for c in compressed if c is not None))
    arrays, first, step = MeshArrays(), dict[int, int](), 0.0
    grids: dict[tuple[bool, int], float] = {}
    for draw, use, draco in zip(draws, uses, compressed, strict=True):
        try:
            values = _Values(document, draw, draco, decoded)
            points, triangles, uv, colors = _mesh(values, draw, use, notes)
            normal_uv = None
            if use.normal_coords is not None and use.normal_matrix is not None:
                count = len(points)
                place = use.normal_coords, use.normal_matrix
                normal_coords = _coordinates(values, *place, count, optional=True)
                normal_uv = normal_coords[triangles]
            placed = instances(document, draw.node)
            key = (True, draco["bufferView"]) if draco else (False, draw.attributes["POSITION"])
            if key not in grids:
                grids[key] = values.step("POSITION")
            grid = grids[key]
        except ValueError as error:
            raise damage(path, str(error), draw.place) from None
        if draw.node not in first:
            first[draw.node] = arrays.add_objects(draw.name, draw.instances)
        with np.errstate(all="ignore"):
            frames = world_of[draw.node] @ placed
            scale = np.linalg.norm(frames[:, :3, :3], axis=1)
            step = max(step, grid * float(scale[np.isfinite(scale)].max(initial=0.0)))
        arrays.add(
            first[draw.node],
            points,
            triangles,
            frames=frames,
            uv=uv,
            material=use.index,
            colors=colors,
            normal_uv=normal_uv,
        )
    return arrays.source(
        materials=materials.materials,
        cameras=cameras(tree, world_of, notes),
        lamps=lamps(tree, world_of, notes),
        step=step,
    )


def _draws(document: GltfDocument, node: int, notes: IngestNotes) -> Iterator[_Draw]:
    """The primitives of a node."""
    tree = document.tree
    entry = tree["nodes"][node]
    if "mesh" not in entry:
        return
    mesh = tree["meshes"][entry["mesh"]]
    name = str(entry.get("name") or mesh.get("name") or f"node {node}")
    if "skin" in entry:
        notes.note("PTM-N215", "skin drawn in its rest pose", place_of("node", entry, node))
    count = instance_count(document, node)
    for k, primitive in enumerate(mesh["primitives"]):
        place = f"{place_of('mesh', mesh, entry['mesh'])}, primitive {k}"
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            notes.note("PTM-N215", f"primitive of mode {mode} (points or lines), skipped", place)
            continue
        if primitive.get("targets"):
            notes.note("PTM-N215", "morph targets dropped", place)
        yield _Draw(node, name, primitive, place, count)


def _count_triangles(
    document: GltfDocument, draws: Iterable[_Draw], max_triangles: int
) -> Iterator[_Draw]:
    """The same primitives with their counts of triangles. Raises LimitError PTM-L203."""
    limit = min(MAX_VERTICES, _VERTICES_PER_TRIANGLE * max_triangles)
    vertices = triangles = 0
    for draw in draws:
        accessors = document.tree["accessors"]
        points = corners = natural(accessors[draw.attributes["POSITION"]]["count"])
        if "indices" in draw.primitive:
            corners = natural(accessors[draw.primitive["indices"]]["count"])
        bound = max(1, corners // 3 if draw.mode == _TRIANGLES else corners)
        if DRACO in draw.primitive.get("extensions", {}) and "indices" not in draw.primitive:
            bound = max(1, 2 * points)  # the stream has the indices; Euler's bound of a surface
        vertices += points * draw.instances
        triangles += bound * draw.instances
        if triangles > max_triangles:
            raise too_many_triangles(max_triangles, document.path)
        if vertices > limit:
            raise LimitError(
                "PTM-L203",
                f"more than {limit} vertices, shared ones counted for each primitive",
                file=document.path,
                remedy="raise the limit (--max-triangles), or split the model",
            )
        yield replace(draw, triangles=bound)


def _draco_of(document: GltfDocument, draw: _Draw) -> dict[str, Any] | None:
    """The Draco extension of a primitive, unless it also has uncompressed data."""
    draco: dict[str, Any] | None = draw.primitive.get("extensions", {}).get(DRACO)
    plain = "bufferView" in document.tree["accessors"][draw.attributes["POSITION"]]
    return None if plain else draco


class _Values:
    """The attributes and indices of a primitive, compressed or not."""

    def __init__(
        self,
        document: GltfDocument,
        draw: _Draw,
        draco: dict[str, Any] | None,
        decoded: dict[int, DracoPrimitive],
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
    def uses_draco(self) -> bool:
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
    values: _Values, draw: _Draw, use: MaterialUse, notes: IngestNotes
) -> tuple[Floats, Ints, Floats, NDArray[np.uint8] | None]:
    """The arrays of a primitive: (n, 3) points and (m, 3) triangles over them; (m, 3, 2) texture
    coordinates from the lower left and (m, 3, 3) colours of corners, if it has any."""
    points = values.attribute("POSITION")
    if points is None:
        raise KeyError("POSITION")
    # Draco always encodes triangles.
    mode = _TRIANGLES if values.uses_draco else draw.mode
    triangles = _triangles(values.indices(len(points)), mode)
    place = use.coords, use.matrix
    uv = _coordinates(values, *place, len(points), optional=use.optional)
    colors, raw = None, values.attribute("COLOR_0", len(points))
    if raw is not None:
        colors = encode_srgb(raw[:, :3] * use.light)[triangles]
        if use.see_through and not (raw[:, 3:] == 1).all():
            notes.note("PTM-N215", "opacities of vertices dropped", draw.place)
    return points, triangles, uv[triangles], colors


def _coordinates(
    values: _Values, name: str, matrix: Floats, count: int, *, optional: bool = False
) -> Floats:
    """(n, 2) texture coordinates from the lower left, transformed; 0 without the attribute. With
    ``optional`` NaN without it, and if it is damaged."""
    try:
        raw = values.attribute(name, count)
        moved = None if raw is None else raw @ matrix[:, :2].T + matrix[:, 2]
    except FAULTS:
        if not optional:
            raise
        moved = None
    if moved is None:
        return np.full((count, 2), np.nan if optional else 0.0)
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
