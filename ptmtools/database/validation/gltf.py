"""What the glTF files must satisfy: each by itself, and beside the hints and the VRML files.

A GLB has the shapes of its cell's VRML file, in the same order and bit for bit: the same triangles,
texture coordinates turned upside down, the same images and sides. `gltf/hints.json` is
`hints.json` with other URLs.
"""

from __future__ import annotations

import json
import posixpath
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.gltf.cell import flipped
from ptmtools.database.gltf.container import GlbError
from ptmtools.database.gltf.material import WRAPS, linear
from ptmtools.database.gltf.names import GLTF_FOLDER, GLTF_HINTS, UP
from ptmtools.database.gltf.reader import ReadGlb, ReadMaterial, read_glb
from ptmtools.database.names import CELL_FOLDER, HINTS, cell_name
from ptmtools.database.validation.findings import Findings
from ptmtools.database.vrml import Document, Node

#: How far a colour may be off that went through the decimals of VRML.
_SLACK = 1e-5


class GltfCheck:
    """The check of one database's glTF files, if it has any.

    ``served`` is the folder's name in findings, "www".
    """

    def __init__(self, served: str, found: Findings) -> None:
        self._served = served
        self._found = found
        self._cells: dict[str, ReadGlb] = {}
        self._hints: dict[str, bytes] = {}

    def read(self, name: str, data: bytes) -> None:
        """Takes a file, named relative to the database, if it is one to be compared."""
        path = name.removeprefix(f"{self._served}/")
        if path in (HINTS, GLTF_HINTS):
            self._hints[path] = data
        elif posixpath.dirname(path) == GLTF_FOLDER and path.endswith(".glb"):
            try:
                self._cells[_stem(path)] = read_glb(data)
            except GlbError as fault:
                self._found.add(fault.code, name, fault.place, fault.message)

    def compare(
        self,
        files: Collection[str],
        documents: Mapping[str, Document],
        resolve: Callable[[str, str], str | None],
    ) -> None:
        """Holds what was read against the other files.

        Parameters
        ----------
        files: all that is served, relative to the served folder.
        documents: the VRML files, by their names relative to the database.
        resolve: takes a file's name and a URL in it; tells a URL that names no file.
        """
        if not any(path.startswith(f"{GLTF_FOLDER}/") for path in files):
            return
        wanted, there = _stems(files, CELL_FOLDER, ".wrl"), _stems(files, GLTF_FOLDER, ".glb")
        for stem in sorted(wanted ^ there):
            what = "is missing" if stem in wanted else "belongs to no cell"
            self._found.add("PTM-D730", f"{self._served}/{GLTF_FOLDER}/{stem}.glb", "", what)
        textures = self._compare_hints()
        for stem, cell in self._cells.items():
            name = f"{self._served}/{GLTF_FOLDER}/{stem}.glb"
            if not cell.name == stem == cell_name(cell.cell):
                told = f"says that it is {cell.name!r}, cell {cell.cell}"
                self._found.add("PTM-D732", name, "scene", told)
            self._check_textures(cell, name, textures, resolve)
            document = documents.get(f"{self._served}/{CELL_FOLDER}/{stem}.wrl")
            if document is not None:
                self._compare_shapes(cell, name, document.of_type("Shape"))

    def _compare_hints(self) -> list[Any] | None:
        """The textures of `hints.json`, if that can be read."""
        name = f"{self._served}/{GLTF_HINTS}"
        if GLTF_HINTS not in self._hints:
            self._found.add("PTM-D730", name, "", "is missing")
        try:
            other = json.loads(self._hints[HINTS])
            for cell in other["cells"]:
                cell["url"] = f"{cell['name']}.glb"
            for record in other["textures"]:
                for url in ("file", "fallback"):
                    record[url] = UP + record[url] if record[url] is not None else None
        except (KeyError, TypeError, ValueError, RecursionError):
            return None  # told by the check of that file
        if GLTF_HINTS in self._hints:
            try:
                own = json.loads(self._hints[GLTF_HINTS])
            except (ValueError, RecursionError) as fault:
                self._found.add("PTM-D737", name, "", f"damaged: {fault}")
            else:
                if place := _difference(own, other):
                    self._found.add("PTM-D737", name, place, f"not as in {HINTS}")
        return list(other["textures"])

    def _check_textures(
        self,
        cell: ReadGlb,
        name: str,
        textures: list[Any] | None,
        resolve: Callable[[str, str], str | None],
    ) -> None:
        for material in dict.fromkeys(primitive.material for primitive in cell.primitives):
            for url in (material.image, material.ptm):
                if url is not None:
                    resolve(name, url)
            if textures is None or material.texture is None:
                continue
            if not 0 <= material.texture < len(textures):
                told = f"the hints have no texture {material.texture}"
                self._found.add("PTM-D736", name, "materials", told)
                continue
            record = textures[material.texture]
            if (material.ptm, material.image) != (record["file"], record["fallback"]):
                told = f"{material.ptm} and {material.image} are not texture {material.texture}"
                self._found.add("PTM-D736", name, "materials", told)
            elif material.blends and material.factor[3] == 1 and record.get("components") in (1, 3):
                told = f"blends, but texture {material.texture} is opaque"
                self._found.add("PTM-D739", name, "materials", told)

    def _compare_shapes(self, cell: ReadGlb, name: str, shapes: list[Node]) -> None:
        if len(shapes) != len(cell.primitives):
            told = f"{len(cell.primitives)} primitives for {len(shapes)} shapes"
            self._found.add("PTM-D738", name, "", told)
            return
        for primitive, shape in zip(cell.primitives, shapes, strict=True):
            geometry = _child(shape, "geometry")
            corners = _corners(geometry, "coord", "coordIndex")
            held = primitive.point[primitive.triangle]
            if corners is not None and not np.array_equal(corners.astype(np.float32), held):
                told = f"not the triangles of {shape.name}"
                self._found.add("PTM-D738", name, primitive.place, told)
            uv = None if primitive.uv is None else primitive.uv[primitive.triangle]
            mapped = _corners(geometry, "texCoord", "texCoordIndex")
            if mapped is None:
                same = uv is None or "texCoord" in geometry
            else:
                same = uv is not None and np.array_equal(flipped(mapped.astype(np.float32)), uv)
            if not same:
                told = f"not the texture coordinates of {shape.name}"
                self._found.add("PTM-D738", name, primitive.place, told)
            if fault := _other_look(primitive.material, shape):
                self._found.add("PTM-D739", name, primitive.place, f"{fault} {shape.name}")


def _other_look(material: ReadMaterial, shape: Node) -> str:
    """In what a material differs from a VRML shape; "" if it does not."""
    geometry, look = _child(shape, "geometry"), _child(shape, "appearance")
    if material.two_sided == geometry.get("solid", True):
        return "not the sides of"
    texture, surface = _child(look, "texture"), _child(look, "material")
    urls = [url for url in texture.get("url", ()) if isinstance(url, str)]
    if sorted(urls) != sorted(url for url in (material.image, material.ptm) if url is not None):
        return "not the images of"
    wrap = tuple(
        WRAPS["repeat" if texture.get(name, True) else "clamp"] for name in ("repeatS", "repeatT")
    )
    if material.wrap != wrap:
        return "does not wrap as"
    color = surface.get("diffuseColor")
    if color is None:
        color = _child(geometry, "color").get("color", np.ones((1, 3)))
    wanted = np.array(
        [*(linear(float(c)) for c in np.ravel(color)[:3]), 1 - _scalar(surface, "transparency")]
    )
    factor = np.array(material.factor, dtype=np.float64)
    if wanted.shape != factor.shape or np.abs(wanted - factor).max() > _SLACK:
        return "not the colour of"
    if material.factor[3] < 1 and not material.blends:
        return "opaque, unlike"
    return ""


def _scalar(fields: Mapping[str, Any], name: str) -> float:
    values = np.ravel(fields.get(name, 0.0))
    return float(values[0]) if len(values) else 0.0


def _child(node: Node | Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """The fields of the node in a field; empty if there is none."""
    fields = node.fields if isinstance(node, Node) else node
    child = fields.get(name)
    return child.fields if isinstance(child, Node) else {}


def _corners(geometry: Mapping[str, Any], values: str, index: str) -> NDArray[np.float64] | None:
    """(m, 3, k) the points of a shape's triangles; None without, or if the indices are wrong,
    which the check of the VRML file tells."""
    points = _child(geometry, values).get("point")
    try:
        rows = np.asarray(geometry[index]).reshape(-1, 4)[:, :3]
        return None if points is None else np.asarray(points)[rows]
    except (KeyError, ValueError, IndexError):
        return None


def _difference(own: object, other: dict[str, Any]) -> str:
    """Where a document of JSON differs first from another, "" if it does not."""
    if not isinstance(own, dict):
        return "document"
    for name in sorted(own.keys() | other.keys()):
        one, two = own.get(name), other.get(name)
        if (name in own) != (name in other) or not _same(one, two):
            if isinstance(one, list) and isinstance(two, list):
                rows = (i for i, ab in enumerate(zip(one, two, strict=False)) if not _same(*ab))
                return f"{name}[{next(rows, min(len(one), len(two)))}]"
            return name
    return ""


def _same(one: object, other: object) -> bool:
    """Whether two values of JSON are the same; for Python, 1 is true."""
    return json.dumps(one, sort_keys=True) == json.dumps(other, sort_keys=True)


def _stems(files: Collection[str], folder: str, suffix: str) -> set[str]:
    """The names, without suffix, of the files of one kind in a folder."""
    kept = (f for f in files if posixpath.dirname(f) == folder and f.endswith(suffix))
    return {_stem(file) for file in kept}


def _stem(path: str) -> str:
    return posixpath.splitext(posixpath.basename(path))[0]
