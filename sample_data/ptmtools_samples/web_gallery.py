"""A gallery as people put them on the web: one GLB, compressed geometry, JPEG paintings.

Rooms of the sample museum, without windows, whose 40 paintings and surfaces are JPEGs of many
sizes, none a power of two on the walls, and whose geometry is compressed with Draco
(KHR_draco_mesh_compression). A model that is small already: a tool that makes it larger has no
excuse. Metres, Y up; closed; unlit. The same options give the same bytes on every machine (for the
same numpy, Pillow and DracoPy).

Positions of all meshes are rounded on one grid of half a millimetre, as `gltf-transform draco
--quantization-volume scene` does: rounded by the bounds of each mesh, walls would part from floors.
"""

from __future__ import annotations

import io
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ptmtools_samples.files import HEAD, File, Note, ignore
from ptmtools_samples.furnishing import furnish, hang
from ptmtools_samples.gltf import GlbBuffer
from ptmtools_samples.mesh import Face, Thing
from ptmtools_samples.museum import MATERIALS, surface_names
from ptmtools_samples.noise import bytes_of, generator
from ptmtools_samples.options import StatueOptions, WebGalleryOptions
from ptmtools_samples.paintings import PAINTINGS
from ptmtools_samples.plan import make_plan
from ptmtools_samples.shell import make_shell
from ptmtools_samples.statues.model import STATUES, make_statue
from ptmtools_samples.surfaces import SURFACES

DRACO, UNLIT = "KHR_draco_mesh_compression", "KHR_materials_unlit"
#: Texels of the longer side of paintings, in turn; of surfaces.
SIDES, SURFACE_SIDE = (1400, 900, 1200, 1600, 1000), 1024
QUALITY = 85
#: Draco: bits of positions on one grid for all meshes, and of texture coordinates.
POSITION_BITS, UV_BITS, SPEED = 16, 14, 3


@dataclass(frozen=True)
class WebMesh:
    """Triangles in one material: (P, 3) points, (P, 2) texture coordinates, v down, (T, 3)."""

    material: str
    points: NDArray[np.float32]
    uv: NDArray[np.float32]
    triangles: NDArray[np.uint32]


def meshes_of(faces: Sequence[Face]) -> list[WebMesh]:
    """A mesh for each material, with shared vertices."""
    corners: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    for face in faces:
        rows = [(*p, u, 1 - v) for p, (u, v) in zip(face.points, face.uv, strict=True)]
        for k in range(1, len(rows) - 1):
            corners[face.material] += [rows[0], rows[k], rows[k + 1]]
    meshes = []
    for material, vertex_rows in corners.items():
        vertices, index = np.unique(np.array(vertex_rows, np.float32), axis=0, return_inverse=True)
        triangles = index.reshape(-1, 3).astype(np.uint32)
        meshes.append(WebMesh(material, vertices[:, :3], vertices[:, 3:], triangles))
    return meshes


def statues_of(things: Sequence[Thing], options: WebGalleryOptions) -> list[WebMesh]:
    """Scanned-looking statues in the places of simple ones, in the same bounds; marble, whose image
    repeats every 0.8 m along x and y."""
    meshes = []
    for k, thing in enumerate(things):
        name = list(STATUES)[k % len(STATUES)]
        made = make_statue(name, StatueOptions(options.statue_triangles, options.seed + k))
        corners = np.array([p for face in thing.faces for p in face.points])
        low, high = corners.min(axis=0), corners.max(axis=0)
        least, greatest = made.points.min(axis=0), made.points.max(axis=0)
        scale = ((high - low) / (greatest - least)).min()
        foot = (low + high) / 2 * [1, 0, 1] + low * [0, 1, 0]
        statue_foot = (least + greatest) / 2 * [1, 0, 1] + least * [0, 1, 0]
        points = ((made.points - statue_foot) * scale + foot).astype(np.float32)
        uv = np.round(points[:, :2] / np.float32(0.8), 4)
        meshes.append(WebMesh("marble", points, uv, made.triangles.astype(np.uint32)))
    return meshes


def jpeg(image: Image.Image) -> bytes:
    out = io.BytesIO()
    image.convert("RGB").save(out, "JPEG", quality=QUALITY, optimize=True)
    return out.getvalue()


def painting(k: int, options: WebGalleryOptions) -> bytes:
    """Painted square, then resized to the proportions of its canvas."""
    _, paint, aspect = PAINTINGS[k % len(PAINTINGS)]
    side = max(round(SIDES[k % len(SIDES)] * options.scale), 4)
    square = paint(generator(options.seed, 20, k), side)
    size = (side, round(side / aspect)) if aspect > 1 else (round(side * aspect), side)
    return jpeg(square.resize(size, Image.Resampling.LANCZOS))


def surface(name: str, options: WebGalleryOptions) -> bytes:
    stream = list(SURFACES).index(name)
    side = max(round(SURFACE_SIDE * options.scale), 4)
    field = SURFACES[name](generator(options.seed, 21, stream), side)
    return jpeg(Image.fromarray(bytes_of(field)))


def _primitive(
    mesh: WebMesh, low: NDArray[np.float64], extent: float, buffer: GlbBuffer
) -> dict[str, Any]:
    import DracoPy

    data = DracoPy.encode(
        mesh.points,
        mesh.triangles,
        quantization_bits=POSITION_BITS,
        compression_level=10 - SPEED,
        quantization_range=extent,
        quantization_origin=low,
        tex_coord=mesh.uv.astype(np.float64),
        tex_coord_quantization_bits=UV_BITS,
    )
    decoded = DracoPy.decode(data)
    ids = {"POSITION": 0, "TEXCOORD_0": 3}
    names = {row["attribute_type"]: row["unique_id"] for row in decoded.attributes}
    extension = {
        "bufferView": buffer.add(data),
        "attributes": {name: names[kind] for name, kind in ids.items()},
    }
    points = np.asarray(decoded.points)
    count = len(points)
    first = len(buffer.accessors)
    buffer.accessors += [
        {
            "componentType": 5126,
            "count": count,
            "type": "VEC3",
            "min": points.min(axis=0).tolist(),
            "max": points.max(axis=0).tolist(),
        },
        {"componentType": 5126, "count": count, "type": "VEC2"},
        {"componentType": 5125, "count": 3 * len(decoded.faces), "type": "SCALAR"},
    ]
    return {
        "attributes": {"POSITION": first, "TEXCOORD_0": first + 1},
        "indices": first + 2,
        "extensions": {DRACO: extension},
    }


def _material(name: str, source: dict[str, int]) -> dict[str, Any]:
    """A material without light; ``source``: numbers of textures by their names."""
    texture, tint, plain = MATERIALS.get(name, (name, (1, 1, 1), (1, 1, 1)))
    shown = texture in source
    color = [c**2.2 for c in (tint if shown else plain)]
    surface: dict[str, Any] = {"baseColorFactor": [*color, 1]}
    if shown:
        surface["baseColorTexture"] = {"index": source[texture]}
    return {"name": name, "pbrMetallicRoughness": surface, "extensions": {UNLIT: {}}}


def glb_of(meshes: Sequence[WebMesh], images: dict[str, bytes], about: str) -> bytes:
    """A GLB with a node for each mesh; ``images`` by the name of the material, or of the texture
    that it uses (`ptmtools_samples.museum.MATERIALS`)."""
    buffer = GlbBuffer()
    every = np.concatenate([mesh.points for mesh in meshes]).astype(np.float64)
    low = every.min(axis=0)
    extent = float((every.max(axis=0) - low).max())
    source = {name: k for k, name in enumerate(images)}
    materials: list[dict[str, Any]] = []
    primitives = []
    for mesh in meshes:
        primitive = _primitive(mesh, low, extent, buffer)
        primitives.append({**primitive, "material": len(materials)})
        materials.append(_material(mesh.material, source))
    pictures = [
        {"name": name, "bufferView": buffer.add(data), "mimeType": "image/jpeg"}
        for name, data in images.items()
    ]
    document = {
        "asset": {"version": "2.0", "generator": about},
        "extensionsUsed": [DRACO, UNLIT],
        "extensionsRequired": [DRACO],
        "scene": 0,
        "scenes": [{"nodes": list(range(len(meshes)))}],
        "nodes": [{"name": mesh.material, "mesh": k} for k, mesh in enumerate(meshes)],
        "meshes": [{"primitives": [primitive]} for primitive in primitives],
        "materials": materials,
        "textures": [
            {"source": k, "sampler": int(name.startswith("painting"))}
            for k, name in enumerate(images)
        ],
        "images": pictures,
    }
    return buffer.encode(document)


def make_web_gallery(options: WebGalleryOptions, note: Note = ignore) -> Iterator[File]:
    """Returns the file of the gallery: its name and a function that returns the bytes."""
    plan = make_plan(options.rooms, generator(options.seed, 0), windows=False)
    shell, panels = make_shell(plan)
    furniture = furnish(plan, generator(options.seed, 4))
    simple = [thing for thing in furniture if thing.name.startswith("statue")]
    aspects = [PAINTINGS[k % len(PAINTINGS)][2] for k in range(options.paintings)]
    hung = hang(panels, aspects, options.rooms, generator(options.seed, 3))
    things = [thing for thing in (*shell, *hung, *furniture) if thing not in simple]

    def load() -> bytes:
        names = surface_names([*shell, *furniture], len(SURFACES) * 3)
        images = {name: surface(name, options) for name in names}
        for k in range(options.paintings):
            images[f"painting_{k + 1:02d}"] = painting(k, options)
        about = f"# {HEAD} gallery: {options.paintings} paintings, seed {options.seed}"
        meshes = meshes_of([face for thing in things for face in thing.faces])
        return glb_of([*meshes, *statues_of(simple, options)], images, about)

    yield "web_gallery.glb", load
