"""Compares the files of one emitted database with each other: VRML, GLB, hints and textures.

`ptm validate` checks what a client would stumble over; what only the emitters can make wrong, their
tests check here: the form of VRML files, cells in space, and two files that differ. Files that
`ptm validate` cannot read are left out.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools import schemas
from ptmtools.output.gltf import WRAPS, linear
from ptmtools.output.gltf_reader import ReadGlb, ReadMaterial, ReadPrimitive, read_glb
from ptmtools.output.gltf_shapes import flip_v
from ptmtools.output.grid import COARSEST, MOST
from ptmtools.output.model import FileError
from ptmtools.scene.colors import to_srgb
from ptmtools.texture import read_header
from ptmtools.tolerance import PARALLEL_COSINE
from tests.output.relations import relations, root_file
from tests.output.texture_agreement import materials, octrees, textures
from tests.output.vrml_checks import vrml_faults
from tests.output.vrml_reader import VrmlDocument, VrmlNode, parse

#: Slack of a colour that went through the decimals of VRML.
COLOR_SLACK = 1e-5
#: Half a level of 255, and the loss in 16 bits of linear light.
LEVEL_SLACK = 0.6 / 255
#: Largest errors of positions and texture coordinates on the grids: that of a texture of one texel.
SLACK = (2.0**COARSEST / 2, 0.1)


def disagreements(www: Path) -> list[str]:
    """The differences, each as "KIND: where and what". KIND is "cell" (record and VRML file),
    "viewpoint" (index and root), "triangles" or "material" (GLB and VRML file); "root" (root and
    VRML files); "relation", "openings", "overlap", "shares" or "statistics" (records); "texture",
    "set" or "bundle" (texture and other files); "octree" (octree texture and GLBs); "box",
    "leaves", "portals" or "viewpoint_place" (cells in space); others are faults of a VRML file."""
    index = _json(www / "hints.json", schemas.HINTS)
    paths = sorted(www.glob("cells/*.wrl"))
    lines: list[str] = []
    documents: dict[str, VrmlDocument] = {}
    for path in (*paths, *www.glob("root.wrl")):
        try:
            documents[path.stem] = parse(path.read_bytes())
        except FileError as fault:
            kind = "not_finite" if "not finite" in fault.message else "vrml"
            lines.append(f"{kind}: {path.stem}: {fault}")
    lines += vrml_faults(documents, _extent(www))
    cells = {name: document for name, document in documents.items() if name != "root"}
    root = documents.get("root")
    glbs = {p.stem: glb for p in sorted(www.glob("gltf/*.glb")) if (glb := _glb(p))}
    if root is not None:
        lines += root_file(root, [path.stem for path in paths], cells)
    statistics = _json(www / "hints/statistics.json", schemas.STATISTICS)
    with suppress(KeyError, TypeError):
        records = {
            cell["name"]: record
            for cell in (index["cells"] if index else ())
            if (record := _json(www / f"hints/{cell['name']}.json", schemas.CELL)) is not None
        }
        lines += _cells(records, index, cells)
        lines += relations(index, records, statistics, _extent(www))
        lines += textures(www, index, statistics)
        lines += octrees(www, index, glbs)
        for name, glb in glbs.items():
            lines += materials(name, glb, index)
        if root is not None:
            lines += _viewpoints(index, root)
    for name in sorted(cells.keys() & glbs.keys()):
        lines += _shapes(name, glbs[name], cells[name].of_type("Shape"))
    return lines


def wrong_counts(db: Path) -> set[str]:
    """The counts in the manifest, as "STAGE.NAME", that are not those of the served files."""
    stages = json.loads((db / "manifest.json").read_bytes())["stages"]
    sizes = {stage: _sizes(db, record["outputs"]) for stage, record in stages.items()}
    baked = {file for kind in ("light", "probe") for file in db.glob(f"www/textures/{kind}~*")}
    files = sorted(set(db.glob("www/textures/*.ptm")) - baked)
    headers = [read_header(path.read_bytes()) for path in files]
    finest = [(header.levels[-1], header.texel_bytes) for header in headers]
    counts: dict[str, dict[str, int]] = {
        "textures": {
            "textures": len(headers),
            "ptm_bytes": sum(n for f, n in sizes["textures"].items() if f.endswith(".ptm")),
            "raw_bytes": sum(level.width * level.height * texel for level, texel in finest),
        },
        "emit": {},
    }
    documents = [parse(path.read_bytes()) for path in sorted(db.glob("www/**/*.wrl"))]
    if documents:
        nodes = [node for document in documents for node in document.nodes]
        index = [n.at("geometry")["coordIndex"] for n in nodes if n.type == "Shape"]
        counts["emit"] = {
            "shapes": len(index),
            "triangles": sum(len(corners) // 4 for corners in index),
            "viewpoints": sum(node.type == "Viewpoint" for node in nodes),
        }
    wrong = set()
    for stage, own in counts.items():
        own |= {"files": len(sizes[stage]), "bytes": sum(sizes[stage].values())}
        listed = stages[stage]["counts"]
        wrong |= {f"{stage}.{name}" for name in own if listed.get(name, own[name]) != own[name]}
    return wrong


def _sizes(db: Path, names: Iterable[str]) -> dict[str, int]:
    return {name: (db / name).stat().st_size for name in names}


def kinds(www: Path) -> set[str]:
    """The kinds of the differences."""
    return {line.partition(":")[0] for line in disagreements(www)}


def _json(path: Path, schema: str) -> Any:
    try:
        return schemas.read(path.read_bytes(), schema)
    except (OSError, schemas.ShapeError):
        return None


def _extent(www: Path) -> float:
    """The largest side of the model, metres; 0 if the manifest does not record it."""
    try:
        manifest = json.loads((www.parent / "manifest.json").read_bytes())
        return float(max(manifest["stages"]["scene"]["counts"]["size"]))
    except (OSError, KeyError):
        return 0.0


def _glb(path: Path) -> ReadGlb | None:
    try:
        return read_glb(path.read_bytes())
    except (OSError, FileError):
        return None


# Hints and VRML files


def _cells(
    records: Mapping[str, Any], index: Any, documents: Mapping[str, VrmlDocument]
) -> Iterator[str]:
    with suppress(KeyError, TypeError):
        known = [cell["name"] for cell in index["cells"]]
        # VRML shows neither light nor reflections nor relief.
        images = [
            set()
            if row.keys() & {"light", "probe", "relief"}
            else {row["file"], row["fallback"]} - {None}
            for row in index["textures"]
        ]
        for name in known:
            record, document = records.get(name), documents.get(name)
            nodes = document.of_type("PTMCell") if document else []
            if record is None or document is None or len(nodes) != 1 or nodes[0].lacks:
                continue
            with suppress(KeyError, TypeError, IndexError, ValueError):
                for field in _differences(record, nodes[0].fields, document, known, images):
                    yield f"cell: {name}: {field}"


def _differences(
    record: Any, cell: Any, document: VrmlDocument, known: Sequence[str], images: Sequence[set[str]]
) -> list[str]:
    """The fields in which a record differs from the cell's VRML file."""
    textures = [shape.at("appearance", "texture") for shape in document.of_type("Shape")]
    shown = {frozenset(u.removeprefix("../") for u in t["url"]) for t in textures if "url" in t}
    leaves = []
    if "leafPoint" in cell:
        leaves = np.split(cell["leafPoint"], cell["leafStart"][1:])
    equal = {
        "name": record["name"] == cell["cellName"],
        "adjacent": [f"{known[c]}.wrl" for c in record["adjacent"]] == list(cell["adjacentUrl"]),
        "visible": [f"{known[c]}.wrl" for c in record["visible"]] == list(cell["visibleUrl"]),
        "ach": _equal_single(record["ach"], cell["ach"]),
        "leaves": _same_leaves(record["leaves"], leaves, cell["hullPoint"]),
        "textures": {frozenset(images[t]) for t in record["textures"][0] if images[t]} == shown,
    }
    return [field for field, same in equal.items() if not same]


def _equal_single(full: Sequence[Any], written: Any) -> bool:
    return np.array_equal(np.array(full, np.float32), np.asarray(written).astype(np.float32))


def _same_leaves(leaves: Sequence[Any], written: Sequence[Any], hull: Any) -> bool:
    """Whether the leaves are those of the file, if it has several, and as large as its hull."""
    if len(leaves) != max(len(written), 1) or not len(hull):
        return False
    points = [point for leaf in leaves for point in leaf["points"]]
    pairs = zip(leaves, written, strict=False)
    return all(_equal_single(leaf["points"], rows) for leaf, rows in pairs) and all(
        _equal_single(end(points, axis=0), end(hull, axis=0)) for end in (np.min, np.max)
    )


def _viewpoints(index: Any, root: VrmlDocument) -> Iterator[str]:
    views, cells = index["viewpoints"], index["cells"]
    cell_of = {
        node.fields.get("viewpoint"): node.fields.get("cellUrl")
        for node in root.of_type("PTMViewpointCell")
    }
    with suppress(KeyError, TypeError, IndexError):
        expected = {view["name"]: (f"cells/{cells[view['cell']]['name']}.wrl",) for view in views}
        if expected != cell_of or len(expected) < len(views):
            yield "viewpoint: other names or cells"
        poses = {node.name: node.fields for node in root.of_type("Viewpoint")}
        for view in views:
            for name, written in poses.get(view["name"], {}).items():
                if name == "orientation":
                    same = _turns(written, view["direction"])
                elif isinstance(written, str):
                    same = written == " ".join(view[name].split())
                else:
                    same = _equal_single(np.ravel(view[name]), np.ravel(written))
                if not same:
                    yield f"viewpoint: {view['name']}: {name}"


def _turns(orientation: Sequence[float], direction: Sequence[float]) -> bool:
    """Whether a rotation, axis and angle, brings -Z to a direction."""
    axis, angle = np.array(orientation[:3], np.float64), orientation[3]
    ahead = np.array([0.0, 0.0, -1.0])
    turned = (
        ahead * np.cos(angle)
        + np.cross(axis, ahead) * np.sin(angle)
        + axis * (axis @ ahead) * (1 - np.cos(angle))
    )
    unit = abs(axis @ axis - 1) <= 1 - PARALLEL_COSINE
    return bool(unit and turned @ direction >= PARALLEL_COSINE)


# GLBs and VRML files


def _shapes(name: str, glb: ReadGlb, shapes: Sequence[VrmlNode]) -> Iterator[str]:
    if len(shapes) != len(glb.primitives):
        yield f"triangles: {name}: {len(glb.primitives)} primitives for {len(shapes)} shapes"
        return
    for primitive, shape in zip(glb.primitives, shapes, strict=True):
        corners = _corners(shape, "coord", "coordIndex")
        if corners is None:
            continue
        mapped = _corners(shape, "texCoord", "texCoordIndex")
        unmapped = "texCoord" not in shape.at("geometry")
        uv = primitive.uv
        if mapped is not None and uv is not None:
            mapped = flip_v(mapped.astype(np.float32))
        elif (mapped is not None or unmapped) and (uv is not None or not unmapped):
            yield f"triangles: {name}: {primitive.place}, texture coordinates"
            continue
        else:
            mapped = uv = None
        pairs = [(corners.astype(np.float32), primitive.point)]
        kept, triangle = corresponding(primitive.triangle, pairs)
        if uv is not None and triangle is not None:
            kept, triangle = corresponding(primitive.triangle, [*pairs, (mapped, uv)])
            if triangle is None:
                yield f"triangles: {name}: {primitive.place}, texture coordinates"
                continue
        if triangle is None:
            yield f"triangles: {name}: {primitive.place}, positions"
            continue
        fault = _other_colors(primitive, shape, kept, triangle)
        if fault := fault or _other_material(primitive.material, shape):
            yield f"material: {name}: {primitive.place}, {fault}"


def corresponding(
    triangle: np.ndarray, pairs: Sequence[tuple[np.ndarray, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray | None]:
    """Finds the triangles of a shape in a GLB, whose vertices may lie on grids of powers of two,
    and whose triangles may have another order and begin with another corner.

    ``pairs``: (m, 3, k) the values at the shape's corners, and (n, k) those of the GLB's vertices.
    Returns which of the shape's triangles have three corners on the grid of the first pair, and
    (m', 3) the GLB's vertices at their corners; None if they are others.
    """
    kept = np.ones(len(pairs[0][0]), np.bool_)
    columns, own = [], []
    for k, (exact, given) in enumerate(pairs):
        step = 2.0 ** np.array([_exponent(column) for column in given.T])
        steps = np.rint(exact / step)
        # 24 bits hold all of a building, which may be eight times as large as a shape.
        slack = max(SLACK[k], 8 * np.abs(exact).max(initial=0.0) / MOST)
        if np.abs(steps * step - exact).max(initial=0.0) > slack:
            return kept, None
        if k == 0:
            kept = ~(steps == np.roll(steps, 1, axis=1)).all(axis=2).any(axis=1)
        columns.append(steps.reshape(-1, exact.shape[2]))
        own.append(given / step)
    both = np.vstack([np.hstack(columns), np.hstack(own)[triangle.ravel()]])
    number = np.unique(both, axis=0, return_inverse=True)[1].reshape(-1, 3)
    wanted, given = number[: len(kept)][kept], number[len(kept) :]
    turns = [corner.argmin(axis=1)[:, None] for corner in (wanted, given)]
    turned = [
        np.take_along_axis(corner, (turn + np.arange(3)) % 3, axis=1)
        for corner, turn in zip((wanted, given), turns, strict=True)
    ]
    orders = [np.lexsort(corner.T) for corner in turned]
    if not np.array_equal(*(corner[order] for corner, order in zip(turned, orders, strict=True))):
        return kept, None
    vertex = np.take_along_axis(triangle, (turns[1] + np.arange(3)) % 3, axis=1)
    result = np.empty_like(vertex)
    result[orders[0]] = vertex[orders[1]]
    return kept, np.take_along_axis(result, (np.arange(3) - turns[0]) % 3, axis=1)


def _exponent(values: np.ndarray) -> int:
    """The largest k for which float32 values are multiples of 2^k; 0 of zeros."""
    mantissa, exponent = np.frexp(values[np.isfinite(values) & (values != 0)].astype(np.float64))
    whole = (mantissa * 2.0**53).astype(np.int64)
    zeros = np.frexp((whole & -whole).astype(np.float64))[1] - 1
    return int((exponent - 53 + zeros).min()) if len(whole) else 0


def _other_material(material: ReadMaterial, shape: VrmlNode) -> str:
    """The property in which a material differs from a VRML shape; "" if in none."""
    geometry = shape.at("geometry")
    texture, surface = shape.at("appearance", "texture"), shape.at("appearance", "material")
    if material.two_sided == geometry.get("solid", True):
        return "sides"
    urls = sorted(url for url in (material.image, material.ptm) if url is not None)
    if sorted(texture.get("url", ())) != urls:
        return "images"
    wrap = tuple(
        WRAPS["repeat" if texture.get(name, True) else "clamp"] for name in ("repeatS", "repeatT")
    )
    if material.wrap != wrap:
        return "wrap"
    faces = shape.at("geometry", "color").get("color", np.ones((1, 3)))
    if geometry.get("colorPerVertex", True):  # colours of corners are no tint
        faces = np.ones((1, 3))
    color = surface.get("diffuseColor", faces)
    alpha = 1 - surface.get("transparency", np.zeros(1))
    expected = np.array([*(linear(float(c)) for c in np.ravel(color)[:3]), *alpha])
    if len(expected) != 4 or np.abs(expected - material.factor).max() > COLOR_SLACK:
        return "colour"
    return "opaque" if material.factor[3] < 1 and not material.blends else ""


def _other_colors(
    primitive: ReadPrimitive, shape: VrmlNode, kept: np.ndarray, triangle: np.ndarray
) -> str:
    geometry = shape.at("geometry")
    painted = "colorIndex" in geometry and geometry.get("colorPerVertex", True)
    if painted != (primitive.color is not None):
        return "colours of corners"
    colors = _corners(shape, "color", "colorIndex", "color") if painted else None
    if colors is None or primitive.color is None:
        return ""
    given, colors = to_srgb(primitive.color)[triangle], colors[kept]
    same = given.shape == colors.shape and np.abs(given - colors).max(initial=0.0) <= LEVEL_SLACK
    return "" if same else "colours of corners"


def _corners(shape: VrmlNode, values: str, index: str, field: str = "point") -> Any:
    """(m, 3, k) the values at the corners of a shape's triangles; None without."""
    try:
        rows = shape.at("geometry")[index].reshape(-1, 4)[:, :3]
        return shape.at("geometry", values)[field][rows]
    except (KeyError, ValueError, IndexError):
        return None
