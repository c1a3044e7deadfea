"""Reads the nodes of glTF 2.0 models: transformations, instances, cameras and lamps.

Covers sections 3.5.3 (transformations) and 3.10 (cameras), KHR_node_visibility,
KHR_lights_punctual and EXT_mesh_gpu_instancing.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.glb import natural
from ptmtools.scene.colors import luminance
from ptmtools.scene.gltf.document import GltfDocument, place_of
from ptmtools.scene.gltf.material import finite
from ptmtools.scene.lights import MOST, Lamp, LampKind
from ptmtools.scene.model import Camera
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import FAULTS, fault_of

_INSTANCING, _LIGHTS = "EXT_mesh_gpu_instancing", "KHR_lights_punctual"
_DEFAULTS = {
    "TRANSLATION": (0.0, 0.0, 0.0),
    "ROTATION": (0.0, 0.0, 0.0, 1.0),
    "SCALE": (1.0, 1.0, 1.0),
}


def world_matrices(tree: dict[str, Any], notes: IngestNotes) -> dict[int, Floats]:
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
            notes.note(
                "PTM-N215", "invisible, dropped with its children", place_of("node", entry, node)
            )
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


def instance_count(document: GltfDocument, node: int) -> int:
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


def instances(document: GltfDocument, node: int) -> Floats:
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


def _instance_attributes(document: GltfDocument, node: int) -> dict[str, int] | None:
    extensions = document.tree["nodes"][node].get("extensions", {})
    attributes: dict[str, int] | None = extensions.get(_INSTANCING, {}).get("attributes")
    return attributes or None


def cameras(
    tree: dict[str, Any], world: dict[int, Floats], notes: IngestNotes
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
        result += notes.camera(
            name, place_of("node", entry, node), matrix[:3, 3], -matrix[:3, 2], yfov
        )
    return tuple(result)


#: By the names of KHR_lights_punctual.
_KINDS: dict[str, LampKind] = {"point": "point", "spot": "spot", "directional": "sun"}


def lamps(tree: dict[str, Any], world: dict[int, Floats], notes: IngestNotes) -> tuple[Lamp, ...]:
    """The lamps of the nodes (KHR_lights_punctual). One that is damaged is left out, with a
    note."""
    result = []
    for node, matrix in world.items():
        use = tree["nodes"][node].get("extensions", {}).get(_LIGHTS)
        if use is None:
            continue
        place = place_of("node", tree["nodes"][node], node)
        try:
            lamp = _lamp(tree["extensions"][_LIGHTS]["lights"][natural(use["light"])], matrix)
        except FAULTS as fault:
            notes.note("PTM-N215", f"lamp left out: {fault_of(fault)}", place)
            continue
        if lamp.intensity > MOST:
            notes.note("PTM-N215", f"intensity of a lamp reduced to {MOST:g}", place)
            lamp = replace(lamp, intensity=MOST)
        if lamp.intensity:
            result.append(lamp)
    return tuple(result)


def _lamp(entry: dict[str, Any], matrix: Floats) -> Lamp:
    """The lamp of a node, which shines along its -Z. Its range is a hint, and has no effect. Raises
    one of `FAULTS`."""
    kind = _KINDS[entry["type"]]
    color = np.array([finite(part) for part in entry.get("color", [1.0, 1.0, 1.0])])
    if largest := float(color.max()):
        color /= largest
    share = float(luminance(color))
    intensity = finite(entry.get("intensity", 1.0)) * largest * share
    red, green, blue = (color / (share or 1.0)).tolist()
    if not (np.abs(matrix[:3, 3]) <= MOST).all():
        raise ValueError(f"more than {MOST:g} m away")
    x, y, z = matrix[:3, 3].tolist()
    if kind == "point":
        return Lamp(kind, (x, y, z), intensity=intensity, color=(red, green, blue))
    with np.errstate(all="ignore"):
        way = -matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
    if not np.isfinite(way).all():
        raise ValueError("no direction")
    angles = entry.get("spot", {})
    outer = min(finite(angles.get("outerConeAngle", math.pi / 4)), math.pi / 2)
    inner = min(finite(angles.get("innerConeAngle", 0.0)), outer)
    dx, dy, dz = way.tolist()
    cone = math.cos(inner), math.cos(outer)
    return Lamp(kind, (x, y, z), (dx, dy, dz), intensity, cone, (red, green, blue))
