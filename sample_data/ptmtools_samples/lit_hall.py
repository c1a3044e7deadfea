"""Three lit rooms in a row: daylight, a skylight, and panels; polish, metal and glass.

A test of light: the sun through two windows on parquet, a red wall beside white ones, a room of
6 m under a skylight with a brass figure and a showcase, a room without windows under four panels,
and a spot for each painting. One GLB with metallic and roughness factors, KHR_lights_punctual and
KHR_materials_emissive_strength. Metres, Y up; lux, candela and nits of a hall under a veiled sun.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools_samples.files import HEAD, File, Note, ignore
from ptmtools_samples.furnishing import (
    FurnitureSpot,
    amphora,
    bench,
    figure,
    hang_picture,
    lathe,
    plinth,
)
from ptmtools_samples.gltf import GlbBuffer
from ptmtools_samples.mesh import Point, Thing, block
from ptmtools_samples.noise import generator
from ptmtools_samples.options import LitHallOptions, WebGalleryOptions
from ptmtools_samples.paintings import PAINTINGS
from ptmtools_samples.plan import OUTER_WALL, SLAB, Mm, Plan, PlanBox
from ptmtools_samples.shell import Panel, make_shell
from ptmtools_samples.web_gallery import painting, surface

LAMPS, STRONG = "KHR_lights_punctual", "KHR_materials_emissive_strength"
Color = tuple[float, float, float]


@dataclass(frozen=True)
class LitMaterial:
    """A material of glTF: linear colour or the texture of a surface, and its polish."""

    color: Color = (1.0, 1.0, 1.0)
    texture: str = ""
    metallic: float = 0.0
    roughness: float = 1.0
    nits: float = 0.0
    alpha: float = 1.0


MATERIALS: dict[str, LitMaterial] = {
    "plaster_cream": LitMaterial((0.72, 0.71, 0.68)),
    "red": LitMaterial((0.50, 0.10, 0.07)),
    "green": LitMaterial((0.15, 0.32, 0.14)),
    "blue": LitMaterial((0.10, 0.19, 0.42)),
    "ceiling": LitMaterial((0.80, 0.80, 0.78)),
    "parquet": LitMaterial(texture="parquet", roughness=0.22),
    "stone": LitMaterial((0.30, 0.29, 0.28), "marble", roughness=0.08),
    "wood": LitMaterial(texture="wood", roughness=0.45),
    "marble": LitMaterial((0.62, 0.62, 0.60)),
    "terracotta": LitMaterial((0.12, 0.28, 0.50), roughness=0.12),
    "brass": LitMaterial((0.80, 0.58, 0.26), metallic=1.0, roughness=0.22),
    "steel": LitMaterial((0.60, 0.60, 0.60), metallic=1.0, roughness=0.35),
    "frame_gilt": LitMaterial((0.75, 0.52, 0.20), metallic=1.0, roughness=0.40),
    "frame_dark": LitMaterial((0.06, 0.03, 0.02), roughness=0.45),
    "frame_black": LitMaterial((0.03, 0.03, 0.03), roughness=0.35),
    "facade": LitMaterial((0.42, 0.37, 0.27)),
    "roof": LitMaterial((0.10, 0.10, 0.11)),
    "glass": LitMaterial(alpha=0.1, roughness=0.0),
    "panel": LitMaterial((0.80, 0.71, 0.58), nits=2700.0),
}
_PAINTING = LitMaterial(roughness=0.6)
#: Wall, millimetres, between rooms; depth of all rooms.
_WALL, _DEPTH = 200, 8000
#: Name, low and high x, height, floor.
_ROOMS = (
    ("daylight", 0, 8000, 4000, "parquet"),
    ("skylight", 8200, 18200, 6000, "stone"),
    ("panels", 18400, 26400, 4000, "parquet"),
)
#: Walls that are not white, by the names of their things.
_COLORED = {
    "daylight_wall_west": "red",
    "panels_wall_east": "blue",
    "panels_wall_south": "green",
}
#: Windows of the room of daylight, low and high x; the skylight, low and high (x, z).
_WINDOWS, _SILL, _LINTEL = ((1200, 3000), (5000, 6800)), 900, 3100
_SKYLIGHT = ((11200, 2500), (15200, 5500))
#: Of each painting: room, axis, side, position and place along the wall; height, width, tallness.
_HUNG = (
    ("daylight", 0, 1, 0, 2.4, 1.7, 1.6, 1.1),
    ("daylight", 0, 1, 0, 5.6, 1.7, 1.2, 1.4),
    ("daylight", 2, -1, _DEPTH, 4.0, 1.75, 2.2, 1.5),
    ("skylight", 2, -1, _DEPTH, 13.2, 2.0, 2.6, 1.8),
    ("panels", 0, -1, 26400, 4.0, 1.7, 2.4, 1.5),
    ("panels", 2, 1, 0, 22.4, 1.7, 1.8, 1.3),
)
#: Candela of a spot, its distance from the wall and its height above the middle of a painting, m.
_CANDELA, _BEFORE, _OVER = 2600.0, 1.8, 2.0
_WARM, _SUN = (1.0, 0.85, 0.62), (1.0, 0.9, 0.74)
#: Lux of the sun, which shines along this.
_LUX, _SUNBEAM = 5000.0, (0.35, -0.62, 0.70)
#: Corners of faces with angles up to this between them have one normal.
_CREASE = math.cos(math.radians(40))


def make_plan() -> Plan:
    """The boxes of air: three rooms, two doorways, two windows, a skylight."""
    roof = max(height for *_, height, _ in _ROOMS) + SLAB
    plan = Plan(low=(-OUTER_WALL, -SLAB, -OUTER_WALL))
    plan.high = (_ROOMS[-1][2] + OUTER_WALL, roof, _DEPTH + OUTER_WALL)

    def add(kind: str, name: str, low: Mm, high: Mm, wall: str, floor: str = "stone") -> None:
        plan.boxes.append(PlanBox(name, kind, 0, low, high, wall, floor, "ceiling"))

    for name, x, X, height, floor in _ROOMS:
        add("room", name, (x, 0, 0), (X, height, _DEPTH), "plaster_cream", floor)
    for _, _, X, _, _ in _ROOMS[:-1]:
        add("door", f"doorway_{X}", (X, 0, 3000), (X + _WALL, 2700, 5000), "wood")
    for k, (x, X) in enumerate(_WINDOWS):
        low, high = (x, _SILL, -OUTER_WALL), (X, _LINTEL, 0)
        add("window", f"window_{k + 1}", low, high, "plaster_cream")
    (x, z), (X, Z) = _SKYLIGHT
    add("window", "skylight_shaft", (x, 6000, z), (X, roof, Z), "ceiling")
    return plan


def paint_walls(shell: Sequence[Thing]) -> list[Thing]:
    """The shell with coloured walls. The skylight is open."""
    open_above = ("skylight_shaft_glass", "skylight_shaft_bars")
    return [
        Thing(thing.name, [replace(face, material=color) for face in thing.faces])
        if (color := _COLORED.get(thing.name))
        else thing
        for thing in shell
        if thing.name not in open_above
    ]


def hang_paintings(seed: int) -> list[Thing]:
    """A painting for each row of `_HUNG`."""
    things = []
    for k, (room, axis, side, wall, along, height, width, tall) in enumerate(_HUNG):
        panel = Panel(room, axis, side, wall, 0, _DEPTH, 0, 4000)
        spot = FurnitureSpot(panel, along, height, width, tall)
        aspect = PAINTINGS[k][2]
        things.append(
            hang_picture(f"painting_{k + 1:02d}", k, aspect, spot, generator(seed, 30, k))
        )
    return things


def furnish_hall(plan: Plan) -> list[Thing]:
    """Benches, a steel turning, a brass figure, a vase in a showcase, a sphere, and panels."""
    stand = plinth(10.45, 0.0, 2.65, 0.6, 0.32)
    robed = figure(10.45, 0.0, 2.65)[len(stand) :]
    turning = [(0.0, 0.16), (0.1, 0.2), (0.3, 0.12), (0.42, 0.06), (0.6, 0.13), (0.74, 0.02)]
    angles = [math.pi * (k / 24 - 0.5) for k in range(1, 24)]
    sphere = [(0.3 + 0.3 * math.sin(a), 0.3 * math.cos(a)) for a in angles]
    showcase = block("glass", (14.9, 0.9, 1.8), (15.9, 2.2, 2.8), 1.0, without=frozenset({"-y"}))
    daylight, _, lamplight = plan.of_kind("room")
    return [
        bench(1, daylight, 0.5, 0),
        bench(2, lamplight, 0.5, 0),
        Thing("turning_plinth", plinth(1.0, 0.0, 7.1, 0.9)),
        Thing("turning", lathe(1.0, 0.9, 7.1, [(h, r, r) for h, r in turning], "steel", 48)),
        Thing("figure_plinth", stand),
        Thing("figure", [replace(face, material="brass") for face in robed]),
        Thing("vase", amphora(15.4, 0.0, 2.3)),
        Thing("showcase", showcase),
        Thing("sphere_plinth", plinth(25.1, 0.0, 1.3, 0.9)),
        Thing("sphere", lathe(25.1, 0.9, 1.3, [(h, r, r) for h, r in sphere], "plaster_cream", 48)),
        *(
            Thing(f"panel_{k}", block("panel", (x, 3.93, z), (x + 1.2, 3.98, z + 1.2), 1.0))
            for k, (x, z) in enumerate(((20.4, 2.0), (20.4, 4.8), (23.2, 2.0), (23.2, 4.8)))
        ),
    ]


def corner_normals(corner: NDArray[np.float64]) -> NDArray[np.float32]:
    """(n, 3, 3) unit normals of the corners of (n, 3, 3) triangles: at each point the sum of those
    of the faces around it, by area, that are within the crease of the face."""
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    flat = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-20)
    point = np.unique(np.round(corner.reshape(-1, 3), 4), axis=0, return_inverse=True)[1].ravel()
    face = np.repeat(np.arange(len(corner)), 3)
    order = np.argsort(point, kind="stable")
    result = np.empty((len(point), 3))
    for corners in np.split(order, np.flatnonzero(np.diff(point[order])) + 1):
        around = face[corners]
        near = flat[around] @ flat[around].T > _CREASE
        result[corners] = near @ across[around]
    length = np.maximum(np.linalg.norm(result, axis=1, keepdims=True), 1e-20)
    return np.asarray((result / length).reshape(-1, 3, 3), np.float32)


def _spots() -> Iterator[tuple[Point, Point]]:
    """The place of the spot of each painting, and the unit vector along which it shines."""
    for _, axis, side, wall, along, height, _, _ in _HUNG:
        middle = np.full(3, along)
        middle[[axis, 1]] = wall / 1000, height
        place = middle + [0, _OVER, 0]
        place[axis] += side * _BEFORE
        way = (middle - place) / np.linalg.norm(middle - place)
        yield tuple(place.tolist()), tuple(way.tolist())


def _rotation(way: Point) -> list[float]:
    """The quaternion that turns -z, along which lamps of glTF shine, to a unit vector."""
    x, y, z = way
    length = math.hypot(y, x, 1 - z)
    return [y / length, -x / length, 0.0, (1 - z) / length]  # -z × way, 1 + (-z) · way


def lamp_nodes() -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """The nodes of the lamps, and the lamps: the sun, and the spots."""
    cone = {"innerConeAngle": 0.25, "outerConeAngle": 0.5}
    lamps: list[dict[str, Any]] = [
        {"type": "directional", "color": _SUN, "intensity": _LUX},
        {"type": "spot", "color": _WARM, "intensity": _CANDELA, "spot": cone},
    ]
    x, y, z = _SUNBEAM
    length = math.hypot(x, y, z)
    beam = (x / length, y / length, z / length)
    nodes = [{"name": "sun", "rotation": _rotation(beam), "extensions": {LAMPS: {"light": 0}}}]
    nodes += [
        {
            "name": f"spot_{k + 1}",
            "translation": place,
            "rotation": _rotation(way),
            "extensions": {LAMPS: {"light": 1}},
        }
        for k, (place, way) in enumerate(_spots())
    ]
    return nodes, lamps


def _material(name: str, textures: dict[str, int]) -> dict[str, Any]:
    material = MATERIALS.get(name) or replace(_PAINTING, texture=name)
    look: dict[str, Any] = {
        "baseColorFactor": [*material.color, material.alpha],
        "metallicFactor": material.metallic,
        "roughnessFactor": material.roughness,
    }
    entry: dict[str, Any] = {"name": name, "pbrMetallicRoughness": look}
    if material.texture:
        look["baseColorTexture"] = {"index": textures[material.texture]}
    if material.nits:
        entry["emissiveFactor"] = material.color
        entry["extensions"] = {STRONG: {"emissiveStrength": material.nits}}
    if material.alpha < 1:
        entry |= {"alphaMode": "BLEND", "doubleSided": True}
    return entry


def lit_glb(things: Sequence[Thing], images: dict[str, bytes]) -> bytes:
    """A GLB with a node for each thing and material; ``images``: JPEGs by name."""
    buffer, textures = GlbBuffer(), {name: k for k, name in enumerate(images)}
    materials: dict[str, int] = {}
    meshes = []
    for thing in things:
        rows: dict[str, list[list[tuple[float, ...]]]] = defaultdict(list)
        for face in thing.faces:
            corners = [(*p, u, 1 - v) for p, (u, v) in zip(face.points, face.uv, strict=True)]
            rows[face.material] += [[corners[0], *pair] for pair in pairwise(corners[1:])]
        for name, triangles in rows.items():
            corner = np.array(triangles, np.float64)
            normal = corner_normals(corner[..., :3])
            attributes = {
                "POSITION": buffer.add_array(corner[..., :3].reshape(-1, 3).astype(np.float32)),
                "NORMAL": buffer.add_array(normal.reshape(-1, 3)),
                "TEXCOORD_0": buffer.add_array(corner[..., 3:].reshape(-1, 2).astype(np.float32)),
            }
            material = materials.setdefault(name, len(materials))
            primitive = {"attributes": attributes, "material": material}
            meshes.append({"name": thing.name, "primitives": [primitive]})
    nodes, lamps = lamp_nodes()
    document = {
        "asset": {"version": "2.0", "generator": f"{HEAD} lit hall"},
        "extensionsUsed": [LAMPS, STRONG],
        "extensions": {LAMPS: {"lights": lamps}},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(meshes) + len(nodes)))}],
        "nodes": [{"name": mesh["name"], "mesh": k} for k, mesh in enumerate(meshes)] + nodes,
        "meshes": meshes,
        "materials": [_material(name, textures) for name in materials],
        "textures": [
            {"source": k, "sampler": int(name.startswith("painting"))}
            for k, name in enumerate(images)
        ],
        "images": [
            {"name": name, "bufferView": buffer.add(data), "mimeType": "image/jpeg"}
            for name, data in images.items()
        ],
    }
    return buffer.encode(document)


def make_lit_hall(options: LitHallOptions, note: Note = ignore) -> Iterator[File]:
    """Returns the file of the hall: its name and a function that returns the bytes."""
    plan = make_plan()
    things = [*paint_walls(make_shell(plan)[0]), *hang_paintings(options.seed), *furnish_hall(plan)]

    def load() -> bytes:
        look = WebGalleryOptions(scale=options.scale, seed=options.seed)
        surfaces = {material.texture for material in MATERIALS.values() if material.texture}
        images = {name: surface(name, look) for name in sorted(surfaces)}
        images |= {f"painting_{k + 1:02d}": painting(k, look) for k in range(len(_HUNG))}
        return lit_glb(things, images)

    yield "lit_hall.glb", load
