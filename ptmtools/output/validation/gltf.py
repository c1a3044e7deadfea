"""The check of the GLBs: each is that of a cell or of a finer mesh of an object in one, and names
textures, representations and meshes that exist."""

from __future__ import annotations

from pathlib import PurePosixPath

from ptmtools.output.gltf_reader import ReadGlb, read_glb
from ptmtools.output.names import GLTF, GLTF_FOLDER
from ptmtools.output.representation import representations
from ptmtools.output.validation.files import ServedDatabase


def read_file(path: str, data: bytes) -> ReadGlb | None:
    """A GLB; None of other files."""
    return read_glb(data) if path.endswith(".glb") else None


def check_files(database: ServedDatabase) -> None:
    """Checks the names and the references of the GLBs."""
    hints = database.hints
    present = {path for path in database.files if PurePosixPath(path).match(f"{GLTF_FOLDER}/*.glb")}
    cell_of: dict[str, int] = {}
    if hints:
        cell_of = {path: cell for cell, path in enumerate(hints.urls(GLTF) or ())}
        meshes = hints.index.get("meshes", ()) if cell_of else ()
        cell_of |= {path: row["cell"] for row in meshes for path in row["files"]}
    expected = set(cell_of) if hints else present
    for path in sorted(expected ^ present):
        message = "is missing" if path in expected else "belongs to no cell and to no object"
        database.at(path).add("PTM-D699", message)
    for path in sorted(present):
        glb: ReadGlb | None = database.contents.get(path)
        if glb is None:
            continue
        if glb.name != PurePosixPath(path).stem or glb.cell != cell_of.get(path, glb.cell):
            database.at(path, "scene").add("PTM-D731", f"is named {glb.name!r}, cell {glb.cell}")
        materials = dict.fromkeys(primitive.material for primitive in glb.primitives)
        for material in materials:
            for url in (material.image, material.ptm, material.lightmap, material.normal_map):
                if url is not None:
                    database.resolve(path, url)
        if hints is None:
            continue
        numbers = [("texture", m.texture, "materials") for m in materials]
        numbers += [
            (kind.noun, p.extras.get(kind.member), p.place)
            for kind in representations()
            for p in glb.primitives
        ]
        numbers += [("mesh", m.mesh, "materials") for m in materials]
        numbers += [("lightmap", m.light, "materials") for m in materials]
        numbers += [
            (
                "normal map" if p.material.coords is None else "map of normals",
                p.material.normal,
                p.place,
            )
            for p in glb.primitives
        ]
        objects = {primitive.place: primitive.object for primitive in glb.primitives}
        lists = {
            "texture": hints.index["textures"],
            **{kind.noun: hints.index.get(kind.name, ()) for kind in representations()},
            "mesh": hints.index.get("meshes", ()),
            "lightmap": hints.index["textures"],
            "normal map": hints.index["textures"],
            "map of normals": hints.index["textures"],
        }
        for noun, number, place in numbers:
            if number is not None and not 0 <= number < len(lists[noun]):
                database.at(path, place).add("PTM-D704", f"the hints have no {noun} {number}")
            elif noun == "lightmap" and number is not None:
                if lists[noun][number].get("light") != glb.cell:
                    message = f"texture {number} of the hints is not the lightmap of this cell"
                    database.at(path, place).add("PTM-D731", message)
            elif noun == "normal map" and number is not None:
                if lists[noun][number].get("relief") != objects[place]:
                    message = f"texture {number} of the hints is not the normal map of the object"
                    database.at(path, place).add("PTM-D731", message)
            elif noun == "mesh" and number is not None:
                row = lists[noun][number]
                if row["cell"] != glb.cell or path in row["files"]:
                    message = f"mesh {number} of the hints is not that of an object of this cell"
                    database.at(path, place).add("PTM-D731", message)
