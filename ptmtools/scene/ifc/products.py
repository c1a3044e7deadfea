"""Makes one object of triangles of each product of an IFC file, through IfcOpenShell.

The geometry kernel computes each product in its own coordinates, in metres for any unit of the
file. Placement is in float64, so that buildings in the coordinates of a land register, thousands of
kilometres from their origin, keep their millimetres. The kernel returns shapes in any order; they
are sorted by the number of their product. Of several representations of a product one is drawn.

Open CASCADE handles all products, but only some 5,000 triangles a second: each becomes a face with
edges, is sewn to its neighbours, and separated again. So products of triangles only use the kernel
`passthrough` of IfcOpenShell 0.9: an office of 2,450 products and 1.4 million triangles, most of
them of chairs, is read in 18 s instead of 319. Products with other polygons do not use it, because
it cuts concave ones as fans. (Rejected: two threads, which took more time than one.)

``python -P -m ptmtools.scene.ifc.products MEMORY FOLDER MODEL FILE TRIANGLES`` reads FILE, the
model or its unpacked content, and replies with the message of `messages.pack_source`.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.arrays import Floats, Ints, areas
from ptmtools.errors import InputError
from ptmtools.scene.ifc.entities import (
    FAULTS,
    UNSTYLED,
    has_body,
    is_drawn,
    is_provision,
    items,
    kind_of,
    length_unit,
    luminous_flux,
    make_rooms,
    material_of,
    note_dropped,
    one_line,
    rooms_of,
    shines,
    storeys,
    title_of,
)
from ptmtools.scene.messages import pack_source
from ptmtools.scene.model import RoomVolume
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import too_many_triangles
from ptmtools.scene.sandbox import reply_so_far, serve, unreadable
from ptmtools.scene.source import MeshArrays, ModelSource, SourceMaterial

_PLAIN, _DIRECT = "opencascade", "passthrough"
_THREADS = 1
#: Square metres that a lamp has at least.
_SMALLEST_LAMP = 1e-4
_TRIANGLE = 3
#: Excluding subclasses, which have holes.
_FACE, _BREP = "IfcIndexedPolygonalFace", "IfcFacetedBrep"


def compute_elements(file: Any, products: list[Any]) -> Iterator[Any]:
    """The shapes of products from the kernels: none, one or several of each, in any order."""
    from ifcopenshell import geom

    direct = []
    if hasattr(geom, "has_geometry_library") and geom.has_geometry_library(_DIRECT):
        direct = [product for product in products if _has_triangles_only(product)]
    numbers = {product.id() for product in direct}
    rest = [product for product in products if product.id() not in numbers]
    settings = geom.settings()
    settings.set("apply-default-materials", False)
    # The hybrid falls back to Open CASCADE, for instance for triangles with openings.
    for chosen, kernel in ((direct, f"hybrid-{_DIRECT}-{_PLAIN}"), (rest, _PLAIN)):
        if chosen:
            yield from geom.iterator(
                settings, file, _THREADS, include=chosen, geometry_library=kernel
            )


def _has_triangles_only(product: Any) -> bool:
    """Whether a product consists of triangles only."""
    try:
        shapes = product.Representation.Representations or ()
        return all(_is_triangles(item) for shape in shapes for item in items(shape))
    except FAULTS:
        return False


def _is_triangles(item: Any) -> bool:
    if item.is_a("IfcTriangulatedFaceSet"):
        return True
    if item.is_a("IfcPolygonalFaceSet"):
        return all(len(f.CoordIndex) == _TRIANGLE and f.is_a() == _FACE for f in item.Faces)
    if item.is_a() == _BREP:
        bounds = (face.Bounds for face in item.Outer.CfsFaces)
        return all(len(b) == 1 and len(b[0].Bound.Polygon) == _TRIANGLE for b in bounds)
    return False


#: The preferred representation of a product.
_BODY = "Body"
#: A line of the library's log: severity, code, time, GlobalId and message.
_LOGGED = re.compile(
    r"\[(?P<level>\w+)\]\s*(\[[A-Z]+\d+\]\s*)?\[[^]]*\]\s*(\{(?P<guid>[^}]*)\}\s*)?(?P<text>.*)"
)


@dataclass(frozen=True)
class ProductShape:
    """The triangles of a product."""

    product: Any
    points: Floats  # (V, 3) metres
    triangles: Ints  # (T, 3)
    materials: tuple[SourceMaterial, ...]
    material: Ints  # (T,) indices into them


def read_products(
    file: Any,
    notes: IngestNotes,
    max_triangles: int,
    before_rooms: Callable[[ModelSource, int], None] = lambda source, spaces: None,
) -> ModelSource:
    """The source of an IfcOpenShell file. ``before_rooms`` is called with the source without rooms
    and the number of spaces, if there are any, before the kernel computes their volumes.

    Raises InputError PTM-I247 without geometry, LimitError PTM-L203.
    """
    unit, metres = length_unit(file)
    if metres is None:
        notes.note("PTM-N201", "the file defines no unit of length")
    elif metres != 1:
        notes.note("PTM-N201", f"lengths in {unit} ({metres:g} m) converted to metres")
    products = _drawn_products(file, notes)
    shapes = _shapes(file, products, max_triangles, notes.model) if products else []
    _note_products(products, shapes, notes)
    note_dropped(file, notes)
    if not shapes:
        raise InputError(
            "PTM-I247",
            "no faces" if products else "no drawable product",
            remedy="export it with the geometry of its building elements",
        )
    numbers: dict[SourceMaterial, int] = {}
    arrays = MeshArrays()
    for shape in shapes:
        material = np.array([numbers.setdefault(m, len(numbers)) for m in shape.materials])
        number = arrays.add_objects(title_of(shape.product))
        arrays.add(number, shape.points, shape.triangles, material=material[shape.material])
    source = arrays.source(
        materials=tuple(numbers),
        metres=None if metres is None else 1.0,
        up="z",
        kinds=tuple(kind_of(shape.product) for shape in shapes),
        storeys=storeys(file, metres or 1.0),
    )
    if spaces := rooms_of(file, notes):
        before_rooms(source, len(spaces))
        source = replace(source, rooms=_rooms(file, spaces, notes))
    return source


def _rooms(file: Any, spaces: list[Any], notes: IngestNotes) -> tuple[RoomVolume, ...]:
    """The rooms of spaces; the kernel may fail without harm to the model."""
    meshes: dict[int, tuple[Floats, Ints]] = {}
    ranks: dict[int, tuple[bool, str]] = {}
    with suppress(*FAULTS):
        for element in compute_elements(file, spaces):
            rank = _rank(element)
            if element.id not in ranks or rank < ranks[element.id]:
                shape = _shape(file, element)
                ranks[element.id] = rank
                meshes[element.id] = shape.points, shape.triangles
    for _ in _errors():  # of spaces, which `make_rooms` notes
        pass
    return make_rooms(spaces, meshes, notes)


def _drawn_products(file: Any, notes: IngestNotes) -> list[Any]:
    """The products to draw; notes the others with geometry."""
    result, hidden = [], Counter[str]()
    for product in sorted(file.by_type("IfcProduct"), key=lambda product: int(product.id())):
        if product.Representation is None:
            continue
        if not is_drawn(product):
            hidden[product.is_a()] += 1
        elif is_provision(product):
            hidden["IfcBuildingElementProxy, a provision for void"] += 1
        elif not has_body(product):
            notes.note("PTM-N215", f"{product.is_a()}: lines without a surface")
        else:
            result.append(product)
    for name, count in hidden.items():
        notes.note("PTM-N215", f"{name}: not drawn", "", count)
    return result


def _shapes(file: Any, products: list[Any], limit: int, model: Path) -> list[ProductShape]:
    """The preferred shape of each product that has any, in the order of their numbers."""
    best: dict[int, tuple[tuple[bool, str], ProductShape]] = {}
    count = 0
    for element in compute_elements(file, products):
        shape = _shape(file, element)
        size = len(shape.triangles)
        if not size:
            continue
        rank = _rank(element)
        if element.id in best:
            best_rank, replaced = best[element.id]
            if best_rank <= rank:
                continue
            count -= len(replaced.triangles)
        count += size
        if count > limit:
            raise too_many_triangles(limit, model)
        best[element.id] = rank, shape
    return [shape for _, (_, shape) in sorted(best.items())]


def _rank(element: Any) -> tuple[bool, str]:
    """Of several shapes of a product the one of the least rank counts."""
    return element.context != _BODY, _sorting_name(element.geometry.id)


def _sorting_name(name: str) -> str:
    """A name that begins with a number, padded so that names sort by number."""
    number, *rest = name.split("-")
    return f"{number:>12}-{rest}"


def _shape(file: Any, element: Any) -> ProductShape:
    """A copy of a shape of the kernel, which overwrites it with the next one."""
    geometry = element.geometry
    placed = np.array(element.transformation.matrix, dtype=np.float64).reshape(4, 4).T
    local = np.frombuffer(geometry.verts_buffer, dtype=np.float64).reshape(-1, 3)
    triangles = np.frombuffer(geometry.faces_buffer, dtype=np.int32).reshape(-1, 3)
    number = np.frombuffer(geometry.material_ids_buffer, dtype=np.int32)  # -1 for none
    product = file.by_id(element.id)
    materials = UNSTYLED, *(material_of(file, style) for style in geometry.materials)
    points = local @ placed[:3, :3].T + placed[:3, 3]
    if shines(product):
        # A diffuse surface of luminance L sends π L lumens a square metre.
        area = max(float(areas(points[triangles]).sum()), _SMALLEST_LAMP)
        glow = (luminous_flux(file, product) / (math.pi * area),) * 3
        materials = tuple(replace(material, glow=glow) for material in materials)
    return ProductShape(
        product,
        points,
        triangles.astype(np.int64),
        materials,
        number.astype(np.int64) + 1,
    )


def _note_products(products: list[Any], shapes: list[ProductShape], notes: IngestNotes) -> None:
    """Misses products without a shape, or with an incomplete one."""
    shaped = {shape.product.id() for shape in shapes}
    errors: dict[str, str] = {}
    for guid, text in _errors():
        errors.setdefault(guid, text)
    for product in products:
        guid = one_line(product.GlobalId)
        reason = f" ({errors[guid]})" if guid in errors else ""
        if product.id() not in shaped:
            message = f"{title_of(product)}: geometry cannot be computed{reason}"
            notes.miss("PTM-N253", message, f"GlobalId {guid}")
        elif reason:
            message = f"{title_of(product)}: a part of the geometry cannot be computed{reason}"
            notes.miss("PTM-N253", message, f"GlobalId {guid}")


def _errors() -> Iterator[tuple[str, str]]:
    """GlobalId and text of the errors in the library's log since the last call."""
    import ifcopenshell

    for line in ifcopenshell.get_log().splitlines():
        logged = _LOGGED.match(line)
        if logged and logged["level"].lower() == "error":
            yield logged["guid"] or "", one_line(logged["text"])


def _open_file(path: str, notes: IngestNotes) -> Any:
    """Raises InputError PTM-I243 for an unknown schema, PTM-I254 for other errors."""
    import ifcopenshell as library

    try:
        file = library.open(path)
    except library.SchemaError as error:
        raise InputError(
            "PTM-I243", one_line(error), remedy="export it as IFC2X3, IFC4 or IFC4X3_ADD2"
        ) from None
    except library.Error as error:
        errors = [text for _, text in _errors()]
        raise unreadable("ifcopenshell", notes.model, one_line([*errors, error][0])) from None
    if errors := [text for _, text in _errors()]:
        message = f"invalid statements skipped, the first: {errors[0]}"
        notes.miss("PTM-N244", message, "", len(errors))
    return file


def _read_in_child(scratch: str, model: str, path: str, triangles: str) -> dict[str, Any]:
    notes = IngestNotes(Path(model))

    def reply_without_rooms(source: ModelSource, spaces: int) -> None:
        without = IngestNotes(Path(model))
        without.add_records(notes.records())
        without.note("PTM-N215", "IfcSpace: no room (IfcOpenShell fails on them)", "", spaces)
        reply_so_far(pack_source(source, {}, without, scratch))

    source = read_products(_open_file(path, notes), notes, int(triangles), reply_without_rooms)
    return pack_source(source, {}, notes, scratch)


if __name__ == "__main__":
    serve(_read_in_child)
