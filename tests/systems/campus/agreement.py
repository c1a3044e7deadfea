"""Compares the index of a campus with itself and with its meshes.

`ptm validate` checks each file by itself and its references; only the writer can make these differ,
so its tests compare them here.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools_systems.campus.meshes import read_mesh
from ptmtools_systems.campus.model import (
    INDEX,
    LIGHT,
    Campus,
    CampusObject,
    mesh_file,
    texture_file,
)

#: Directions whose length differs from 1 by less are unit vectors: of six digits.
UNIT_SHARE = 1e-5


def disagreements(folder: Path) -> list[str]:
    """The differences, each as "KIND: where and what"; the index must match its schema."""
    document = json.loads((folder / INDEX).read_bytes())
    campus = Campus.from_document(document)
    lines = [*_names(campus), *_sums(campus, document), *_materials(campus)]
    for each in campus.objects:
        lines += [f"{line}, {each.name}" for line in _object(campus, each, folder)]
    return lines


def kinds(folder: Path) -> set[str]:
    """The kinds of the differences."""
    return {line.partition(":")[0] for line in disagreements(folder)}


def _names(campus: Campus) -> Iterator[str]:
    names = [each.name.lower() for each in campus.objects]
    if len(set(names)) < len(names):
        yield "name: two objects are named alike"
    for t in campus.textures:
        if t.file != texture_file(t.base, t.size, t.channel):
            yield f"name: {t.file} is not named after its base"


def _sums(campus: Campus, document: Mapping[str, Any]) -> Iterator[str]:
    if document["start"] != campus.start:
        yield f"sum: start is not {campus.start}"
    if document["presets"] != json.loads(json.dumps([vars(preset) for preset in campus.presets])):
        yield "sum: presets"


def _materials(campus: Campus) -> Iterator[str]:
    for material in campus.materials:
        if (material.base is None) != (not material.channels):
            yield f"texture: {material.name}: a base without channels, or channels without a base"
        if (material.cutoff is None) != (material.alpha != "mask"):
            yield f"texture: {material.name}: a cutoff without a mask, or a mask without one"
    lightmaps = [each.lightmap for each in campus.objects if each.lightmap is not None]
    if len(lightmaps) != (0 if campus.lightmaps == "none" else len(campus.objects)):
        yield f"lightmap: {len(lightmaps)} objects have one, lightmaps is {campus.lightmaps}"
    if len(set(lightmaps)) < len(lightmaps):
        yield "lightmap: two objects have the same"
    if {t.base for t in campus.textures if t.channel == LIGHT} - set(lightmaps):
        yield "lightmap: one is not used"


def _object(campus: Campus, each: CampusObject, folder: Path) -> Iterator[str]:
    low, high = np.array(each.box[:3]), np.array(each.box[3:])
    middle = np.array(each.barycentre)
    if not ((low <= middle) & (middle <= high)).all():
        yield "box: the barycentre is not in the box"
    eye, direction = map(np.array, each.viewpoint)
    if ((low <= eye) & (eye <= high)).all():
        yield "viewpoint: lies in the box"
    if abs(math.hypot(*direction) - 1) > UNIT_SHARE:
        yield "viewpoint: not a unit vector"
    faces = [mesh.faces for mesh in each.meshes]
    if len(faces) != campus.lods or faces != sorted(faces):
        yield "levels: a finer mesh has fewer faces, or there are other meshes"
    if [mesh.file for mesh in each.meshes] != [
        mesh_file(each.name, lod) for lod in range(len(faces))
    ]:
        yield "name: a mesh is not named after its object"
    files = [folder / mesh.file for mesh in each.meshes]
    if all(file.is_file() for file in files):
        meshes = [read_mesh(file.read_bytes()) for file in files]
        point = np.concatenate([p.point for primitives in meshes for p in primitives])
        if (*point.min(axis=0).tolist(), *point.max(axis=0).tolist()) != each.box:
            yield "mesh: the box is not that of the meshes"
        if [p.material for p in meshes[-1]] != list(each.materials):
            yield "mesh: the materials of the finest are not those of its object"
