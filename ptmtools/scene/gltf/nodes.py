"""The nodes of a glTF scene: where in the world each is, and as often as it is drawn.

Sections 3.5.3 (transformations) and 3.10 (cameras), KHR_node_visibility, EXT_mesh_gpu_instancing.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.glb import natural
from ptmtools.scene.gltf.document import Document
from ptmtools.scene.model import Camera
from ptmtools.scene.source import Findings

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
            findings.say("PTM-N224", "not visible, and so is what hangs on it", f"node {node}")
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
            findings.say("PTM-N225", f"camera {name} has no perspective, skipped", f"node {node}")
            continue
        x, y, z = position.tolist()
        dx, dy, dz = (direction / length).tolist()
        found.append(Camera(name, (x, y, z), (dx, dy, dz), float(yfov)))
    return tuple(found)
