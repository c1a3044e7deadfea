"""The check of the GLBs: each is that of its cell, and names textures and octrees that exist."""

from __future__ import annotations

from pathlib import PurePosixPath

from ptmtools.output.gltf_reader import ReadGlb, read_glb
from ptmtools.output.names import GLTF, GLTF_FOLDER, cell_name
from ptmtools.output.validation.files import ServedDatabase


def read_file(path: str, data: bytes) -> ReadGlb | None:
    """A GLB; None of other files."""
    return read_glb(data) if path.endswith(".glb") else None


def check_files(database: ServedDatabase) -> None:
    """Checks the names and the references of the GLBs."""
    hints = database.hints
    present = {path for path in database.files if PurePosixPath(path).match(f"{GLTF_FOLDER}/*.glb")}
    expected = set(hints.urls(GLTF) or ()) if hints else present
    for path in sorted(expected ^ present):
        message = "is missing" if path in expected else "belongs to no cell"
        database.at(path).add("PTM-D699", message)
    for path in sorted(present):
        glb: ReadGlb | None = database.contents.get(path)
        if glb is None:
            continue
        if not glb.name == PurePosixPath(path).stem == cell_name(glb.cell):
            database.at(path, "scene").add("PTM-D731", f"is named {glb.name!r}, cell {glb.cell}")
        materials = dict.fromkeys(primitive.material for primitive in glb.primitives)
        for material in materials:
            for url in (material.image, material.ptm):
                if url is not None:
                    database.resolve(path, url)
        if hints is None:
            continue
        numbers = [("texture", m.texture, "materials") for m in materials]
        numbers += [("octree texture", p.octree, p.place) for p in glb.primitives]
        lists = {
            "texture": hints.index["textures"],
            "octree texture": hints.index.get("octrees", ()),
        }
        for noun, number, place in numbers:
            if number is not None and not 0 <= number < len(lists[noun]):
                database.at(path, place).add("PTM-D704", f"the hints have no {noun} {number}")
