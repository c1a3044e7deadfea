"""The check of the GLBs: each is that of a cell or of a finer mesh of an object in one, and names
textures, representations and meshes that exist."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import PurePosixPath

from ptmtools.output.gltf_reader import ReadGlb, ReadPrimitive, read_glb
from ptmtools.output.names import GLTF, GLTF_FOLDER
from ptmtools.output.representation import representations
from ptmtools.output.validation.files import ReadHints, ServedDatabase


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
        database.place(path).add("PTM-D699", message)
    for path in sorted(present):
        glb: ReadGlb | None = database.contents.get(path)
        if glb is None:
            continue
        if glb.name != PurePosixPath(path).stem or glb.cell != cell_of.get(path, glb.cell):
            database.place(path, "scene").add("PTM-D731", f"is named {glb.name!r}, cell {glb.cell}")
        for material in dict.fromkeys(primitive.material for primitive in glb.primitives):
            for url in (material.image, material.ptm, material.lightmap, material.normal_map):
                if url is not None:
                    database.resolve(path, url)
        if hints is not None:
            faults = (f for p in glb.primitives for f in _faults(path, glb.cell, p, hints))
            for code, place, message in dict.fromkeys(faults):
                database.place(path, place).add(code, message)


def _faults(
    path: str, cell: int, primitive: ReadPrimitive, hints: ReadHints
) -> Iterator[tuple[str, str, str]]:
    """The code, place and message of each row of the hints that a primitive names wrongly."""
    material, textures = primitive.material, hints.index["textures"]
    meshes = hints.index.get("meshes", ())
    normals = "normal map" if material.coords is None else "map of normals"
    forms = [
        (f.noun, primitive.extras.get(f.member), hints.index.get(f.name, ()), primitive.place)
        for f in representations()
    ]
    for noun, number, rows, place in (
        ("texture", material.texture, textures, "materials"),
        *forms,
        ("mesh", material.mesh, meshes, "materials"),
        ("lightmap", material.light, textures, "materials"),
        ("probe", material.probe, textures, "materials"),
        (normals, material.normal, textures, primitive.place),
    ):
        if number is None:
            continue
        if not 0 <= number < len(rows):
            yield "PTM-D704", place, f"the hints have no {noun} {number}"
        elif noun == "lightmap" and rows[number].get("light") != cell:
            message = f"texture {number} of the hints is not the lightmap of this cell"
            yield "PTM-D731", place, message
        elif noun == "probe" and rows[number].get("probe", {}).get("cell") != cell:
            message = f"texture {number} of the hints is not the probe of this cell"
            yield "PTM-D731", place, message
        elif noun == "normal map" and rows[number].get("relief") != primitive.object:
            message = f"texture {number} of the hints is not the normal map of the object"
            yield "PTM-D731", place, message
        elif noun == "mesh" and (rows[number]["cell"] != cell or path in rows[number]["files"]):
            message = f"mesh {number} of the hints is not that of an object of this cell"
            yield "PTM-D731", place, message
