"""Features of glTF and its extensions."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from typing import Any

import numpy as np
from PIL import Image

from ptmtools.scene import Scene
from tests.scene.conftest import GltfModel, Put, png
from tests.scene.features.registry import (
    ALPHA,
    BLUE,
    FOUR,
    GREEN,
    RED,
    WHITE,
    clamped,
    cut_out,
    feature,
    four,
    glossy,
    glowing,
    half,
    mirrored,
    seen,
    shown,
    the_quad,
    three_quads,
    twice,
    vertex_colors,
)


def glb(put: Put, doc: GltfModel, name: str = "a.glb") -> str:
    put(name, doc.glb())
    return name


def with_texture(
    doc: GltfModel, data: bytes, use: dict[str, Any] | None = None, **material: Any
) -> dict[str, Any]:
    """Gives the document an image and a material that shows it."""
    doc.tree["images"] = [{"bufferView": doc.view(data), "mimeType": "image/png"}]
    doc.tree["textures"] = [{"source": 0}]
    base = {"baseColorTexture": {"index": 0, **(use or {})}}
    doc.tree["materials"] = [{"pbrMetallicRoughness": base, **material}]
    return {"material": 0}


@feature("glTF", "textures", "carried over", four)
def _(put: Put) -> str:
    doc = GltfModel()
    doc.place(doc.quad(**with_texture(doc, png(FOUR))))
    return glb(put, doc)


@feature("glTF", "images of emission", "carried over", glowing, "PTM-N215")
def _(put: Put) -> str:
    doc = GltfModel()
    shown = {"emissiveTexture": {"index": 0}, "emissiveFactor": [1, 1, 1]}
    black = {"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]}}
    doc.place(doc.quad(**with_texture(doc, png(FOUR), **shown, **black)))
    return glb(put, doc)


def orange(scene: Scene) -> None:
    assert np.allclose(scene.materials[0].color, (1.0, 0.735357, 0.0), atol=1e-6)


@feature("glTF", "material colours", "carried over", orange, "PTM-N215")
def _(put: Put) -> str:
    """Linear light of a half is 0.735 in sRGB (IEC 61966-2-1)."""
    doc = GltfModel()
    doc.tree["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0, 1]}}]
    doc.place(doc.quad(material=0))
    return glb(put, doc)


CORNERS = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]], np.float32)


@feature("glTF", "vertex colours", "carried over", vertex_colors)
def _(put: Put) -> str:
    doc = GltfModel()
    quad = doc.quad()
    quad["attributes"]["COLOR_0"] = doc.add(CORNERS)
    doc.place(quad)
    return glb(put, doc)


@feature("glTF", "vertex colours", "carried over", vertex_colors)
def _colours_of_bytes(put: Put) -> str:
    """Normalised, with an alpha that an opaque material does not heed."""
    doc = GltfModel()
    quad = doc.quad()
    rows = np.hstack([255 * CORNERS, [[9]] * 4]).astype(np.uint8)
    quad["attributes"]["COLOR_0"] = doc.add(rows, normalized=True)
    doc.place(quad)
    return glb(put, doc)


def multiplied(scene: Scene) -> None:
    """A quarter of the light: 0.537 in sRGB, 137 of 255."""
    assert scene.colors is not None
    assert set(scene.colors.ravel().tolist()) == {137}
    assert scene.materials[0].color == (1, 1, 1)


@feature("glTF", "vertex colours", "carried over", multiplied, "PTM-N215")
def _colours_times_a_factor(put: Put) -> str:
    doc = GltfModel()
    doc.tree["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}}]
    quad = doc.quad(material=0)
    quad["attributes"]["COLOR_0"] = doc.add(np.full((4, 3), 0.5, np.float32))
    doc.place(quad)
    return glb(put, doc)


@feature("glTF", "opacity", "carried over", half)
def _(put: Put) -> str:
    doc = GltfModel()
    base = {"baseColorFactor": [1, 1, 1, 0.5]}
    doc.tree["materials"] = [{"pbrMetallicRoughness": base, "alphaMode": "BLEND"}]
    doc.place(doc.quad(material=0))
    return glb(put, doc)


@feature("glTF", "texture alpha", "carried over", cut_out)
def _(put: Put) -> str:
    doc = GltfModel()
    image = png(np.dstack([FOUR, ALPHA]))
    doc.place(doc.quad(**with_texture(doc, image, alphaMode="BLEND")))
    return glb(put, doc)


def tested(cutoff: float) -> Callable[[Scene], None]:
    def check(scene: Scene) -> None:
        cut_out(scene)
        assert scene.materials[0].cutoff == cutoff
        assert scene.materials[0].opacity == 1

    return check


@feature("glTF", "alpha cutoff", "carried over", tested(0.25))
def _(put: Put) -> str:
    doc = GltfModel()
    image = png(np.dstack([FOUR, ALPHA]))
    doc.place(doc.quad(**with_texture(doc, image, alphaMode="MASK", alphaCutoff=0.25)))
    return glb(put, doc)


@feature("glTF", "alpha cutoff", "carried over", tested(0.5))
def _default_cutoff(put: Put) -> str:
    doc = GltfModel()
    image = png(np.dstack([FOUR, ALPHA]))
    doc.place(doc.quad(**with_texture(doc, image, alphaMode="MASK")))
    return glb(put, doc)


def invisible(scene: Scene) -> None:
    assert scene.materials[0].opacity == 0
    assert not scene.opaque.any()


@feature("glTF", "alpha cutoff", "carried over", invisible, "PTM-N211")
def _below_the_cutoff(put: Put) -> str:
    """The factor's alpha alone is less than the cutoff."""
    doc = GltfModel()
    material = with_texture(doc, png(FOUR), alphaMode="MASK")
    doc.tree["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, 0.3]
    doc.place(doc.quad(**material))
    return glb(put, doc)


@feature("glTF", "texture transforms", "baked", twice, "PTM-N215")
def _(put: Put) -> str:
    doc = GltfModel()
    use = {"extensions": {"KHR_texture_transform": {"scale": [2, 1]}}}
    doc.place(doc.quad(**with_texture(doc, png(FOUR), use)))
    return glb(put, doc)


def turned(scene: Scene) -> None:
    """By a quarter, clockwise."""
    quarters = [shown(scene, u, v)[:3] for u, v in ((0.2, 0.8), (0.8, 0.8), (0.2, 0.2), (0.8, 0.2))]
    assert quarters == [BLUE, RED, WHITE, GREEN]


@feature("glTF", "texture transforms", "baked", turned, "PTM-N215")
def _turned_texture(put: Put) -> str:
    """u' = cos·u + sin·v + offset, v' = −sin·u + cos·v + offset (KHR_texture_transform)."""
    doc = GltfModel()
    moved = {"rotation": float(np.pi / 2), "offset": [0, 1]}
    use = {"extensions": {"KHR_texture_transform": moved}}
    doc.place(doc.quad(**with_texture(doc, png(FOUR), use)))
    return glb(put, doc)


@feature("glTF", "clamped textures", "carried over", clamped, "PTM-N215")
def _(put: Put) -> str:
    doc = GltfModel()
    use = {"extensions": {"KHR_texture_transform": {"scale": [2, 1]}}}
    material = with_texture(doc, png(FOUR), use)
    doc.tree["samplers"] = [{"wrapS": 33071}]
    doc.tree["textures"][0]["sampler"] = 0
    doc.place(doc.quad(**material))
    return glb(put, doc)


def repeating(doc: GltfModel, scale: list[float]) -> dict[str, Any]:
    material = with_texture(
        doc, png(FOUR), {"extensions": {"KHR_texture_transform": {"scale": scale}}}
    )
    doc.tree["samplers"] = [{"wrapS": 33648, "wrapT": 33648}]
    doc.tree["textures"][0]["sampler"] = 0
    return material


@feature("glTF", "mirrored textures", "baked", mirrored, "PTM-N215", "PTM-N215")
def _(put: Put) -> str:
    """Three repetitions across and two down: the image beside its mirror images."""
    doc = GltfModel()
    doc.place(doc.quad(**repeating(doc, [2.5, 2])))
    return glb(put, doc)


def folded(scene: Scene) -> None:
    assert len(scene.images) == 1
    with Image.open(io.BytesIO(scene.images[0].load())) as image:
        assert image.size == (2, 2)
    quarters = [shown(scene, u, v)[:3] for u, v in ((0.2, 0.8), (0.8, 0.8), (0.2, 0.2), (0.8, 0.2))]
    assert quarters == [GREEN, RED, WHITE, BLUE]


@feature("glTF", "mirrored textures", "baked", folded, "PTM-N215", "PTM-N215")
def _mirrored_within_a_repetition(put: Put) -> str:
    """The second one: the coordinates are mirrored, and the image stays."""
    doc = GltfModel()
    material = repeating(doc, [1, 1])
    use = doc.tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    use["extensions"]["KHR_texture_transform"] = {"offset": [1, 0]}
    doc.place(doc.quad(**material))
    return glb(put, doc)


@feature("glTF", "WebP", "carried over", four)
def _(put: Put) -> str:
    stream = io.BytesIO()
    Image.fromarray(FOUR.repeat(8, 0).repeat(8, 1)).save(stream, "webp", lossless=True)
    doc = GltfModel()
    material = with_texture(doc, stream.getvalue())
    doc.tree["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 0}}}]
    doc.tree["extensionsRequired"] = ["EXT_texture_webp"]
    doc.place(doc.quad(**material))
    return glb(put, doc)


def first_image(scene: Scene) -> None:
    assert len(scene.images) == 1
    four(scene)


@feature("glTF", "WebP", "carried over", first_image)
def _webp_beside_png(put: Put) -> str:
    """The image for those without the extension has lost less."""
    doc = GltfModel()
    material = with_texture(doc, png(FOUR))
    doc.tree["images"].append({"bufferView": doc.view(b"RIFF"), "mimeType": "image/webp"})
    doc.tree["textures"] = [{"source": 0, "extensions": {"EXT_texture_webp": {"source": 1}}}]
    doc.place(doc.quad(**material))
    return glb(put, doc)


#: The four colours on 8 × 8 texels, as UASTC.
KTX2 = base64.b64decode(
    "q0tUWCAyMLsNChoKAAAAAAEAAAAIAAAACAAAAAAAAAAAAAAAAQAAAAQAAAACAAAAsAAAACwAAADcAAAAJAAA"
    "AAAAAAAAAAAAAAAAAAAAAABLAQAAAAAAAC8AAAAAAAAAQAAAAAAAAAAyAQAAAAAAABkAAAAAAAAAEAAAAAAA"
    "AAAZAQAAAAAAABkAAAAAAAAAEAAAAAAAAAAAAQAAAAAAABkAAAAAAAAAEAAAAAAAAAAsAAAAAAAAAAIAKACm"
    "AQIAAwMAABAAAAAAAAAAAAB/AAAAAAAAAAAA/////x8AAABLVFh3cml0ZXIAQmFzaXMgVW5pdmVyc2FsIDIu"
    "NTAAACi1L/0gEIEAABcQEPAfQAgBAAAAAAAAAAAotS/9IBCBAABTfCsAAAAASZAAQID//38AKLUv/SAQgQAA"
    "U/IOAAAAIAAQJEEAgP9/ACi1L/0gQDUBAOD3HwDgH3oAF+Af4B8CDwDg/x8C4AH3////H3zvBEAHoAAycxcg"
)


@feature("glTF", "KTX2", "carried over", four)
def _(put: Put) -> str:
    doc = GltfModel()
    material = with_texture(doc, KTX2)
    doc.tree["images"][0]["mimeType"] = "image/ktx2"
    doc.tree["textures"] = [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]
    doc.tree["extensionsRequired"] = ["KHR_texture_basisu"]
    doc.place(doc.quad(**material))
    return glb(put, doc)


@feature("glTF", "instances", "carried over", three_quads)
def _(put: Put) -> str:
    doc = GltfModel()
    moved = np.array([[0, 0, 0], [0, 0, 5], [0, 0, -5]], np.float32)
    turns = np.array([[0, 0, 0, 32767], [0, 0, 32767, 0], [0, 0, 0, 32767]], np.int16)
    scales = np.array([[1, 1, 1], [1, 1, 1], [2, 1, 1]], np.float32)
    attributes = {
        "TRANSLATION": doc.add(moved),
        "ROTATION": doc.add(turns, normalized=True),
        "SCALE": doc.add(scales),
    }
    doc.place(doc.quad(), extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    doc.tree["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    return glb(put, doc)


@feature("glTF", "sparse accessors", "carried over", the_quad)
def _(put: Put) -> str:
    """Two of four corners are written over what the buffer has."""
    doc = GltfModel()
    quad = doc.quad()
    wrong = np.array([[0, 0, 0], [9, 9, 9], [10, 4, 0], [9, 9, 9]], np.float32)
    right = np.array([[10, 0, 0], [0, 4, 0]], np.float32)
    sparse = {
        "count": 2,
        "indices": {
            "bufferView": doc.view(np.array([1, 3], np.uint16).tobytes()),
            "componentType": 5123,
        },
        "values": {"bufferView": doc.view(right.tobytes())},
    }
    quad["attributes"]["POSITION"] = doc.add(wrong, sparse=sparse)
    doc.place(quad)
    return glb(put, doc)


@feature("glTF", "sparse accessors", "carried over", the_quad)
def _sparse_over_nothing(put: Put) -> str:
    """What is not written is 0."""
    doc = GltfModel()
    quad = doc.quad()
    right = np.array([[10, 0, 0], [10, 4, 0], [0, 4, 0]], np.float32)
    index = doc.view(np.array([1, 2, 3], np.uint8).tobytes())
    doc.tree["accessors"].append(
        {
            "componentType": 5126,
            "count": 4,
            "type": "VEC3",
            "sparse": {
                "count": 3,
                "indices": {"bufferView": index, "componentType": 5121},
                "values": {"bufferView": doc.view(right.tobytes())},
            },
        }
    )
    quad["attributes"]["POSITION"] = len(doc.tree["accessors"]) - 1
    doc.place(quad)
    return glb(put, doc)


@feature("glTF", "quantised meshes", "carried over", four)
def _(put: Put) -> str:
    """Positions of 16 bits, as they are and normalised coordinates (KHR_mesh_quantization)."""
    doc = GltfModel()
    quad = doc.quad(**with_texture(doc, png(FOUR)))
    corners = np.array([[0, 0, 0], [1000, 0, 0], [1000, 400, 0], [0, 400, 0]], np.int16)
    coords = np.array([[0, 65535], [65535, 65535], [65535, 0], [0, 0]], np.uint16)
    quad["attributes"]["POSITION"] = doc.add(corners)
    quad["attributes"]["TEXCOORD_0"] = doc.add(coords, normalized=True)
    doc.place(quad, scale=[0.01, 0.01, 0.01])
    doc.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    return glb(put, doc)


def compressed(
    doc: GltfModel, extension: str = "EXT_meshopt_compression", version: int = 0
) -> GltfModel:
    """With all its buffer views of vertices and indices compressed, and nothing in their place."""
    import meshopt

    accessors = {a["bufferView"]: a for a in doc.tree["accessors"]}
    blob = b""
    for number, view in enumerate(doc.tree["bufferViews"]):
        data = doc.blob[view["byteOffset"] :][: view["byteLength"]]
        start = len(blob)
        if number not in accessors:  # an image
            blob += data + b"\0" * (-len(data) % 4)
            view["byteOffset"] = start
            continue
        count = accessors[number]["count"]
        stride = len(data) // count
        if stride == 2:
            index, mode = np.frombuffer(data, np.uint16).astype(np.uint32), "TRIANGLES"
            stream = meshopt.encode_index_buffer(index)
        else:
            rows, mode = np.frombuffer(data, np.uint8).reshape(count, stride), "ATTRIBUTES"
            stream = meshopt.encode_vertex_buffer_level(rows, 2, version)
        reported = {"buffer": 0, "byteOffset": start, "byteLength": len(stream), "count": count}
        view |= {
            "buffer": 1,
            "extensions": {extension: reported | {"byteStride": stride, "mode": mode}},
        }
        if mode == "ATTRIBUTES":
            view["byteStride"] = stride
        blob += stream + b"\0" * (-len(stream) % 4)
    size, doc.blob = len(doc.blob), blob
    doc.tree |= {"extensionsUsed": [extension], "extensionsRequired": [extension]}
    doc.spare = [{"byteLength": size, "extensions": {extension: {"fallback": True}}}]
    return doc


@feature("glTF", "meshopt compression", "carried over", four)
def _(put: Put) -> str:
    doc = GltfModel()
    doc.place(doc.quad(**with_texture(doc, png(FOUR))))
    return glb(put, compressed(doc))


@feature("glTF", "meshopt compression", "carried over", four)
def _meshopt_of_khronos(put: Put) -> str:
    doc = GltfModel()
    doc.place(doc.quad(**with_texture(doc, png(FOUR))))
    return glb(put, compressed(doc, "KHR_meshopt_compression", 1))


def draco(doc: GltfModel, quad: dict[str, Any]) -> dict[str, Any]:
    """A primitive like that, compressed with Draco, and nothing in its place."""
    import DracoPy

    corners = np.array([[0, 0, 0], [10, 0, 0], [10, 4, 0], [0, 4, 0]], np.float64)
    coords = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float64)
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    data = DracoPy.encode(corners, faces, quantization_bits=20, tex_coord=coords)
    ids = {row["attribute_type"]: row["unique_id"] for row in DracoPy.decode(data).attributes}
    reported = {
        "bufferView": doc.view(data),
        "attributes": {"POSITION": ids[0], "TEXCOORD_0": ids[3]},
    }
    for accessor in (*quad["attributes"].values(), quad["indices"]):
        del doc.tree["accessors"][accessor]["bufferView"]
    doc.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return quad | {"extensions": {"KHR_draco_mesh_compression": reported}}


@feature("glTF", "Draco compression", "carried over", four)
def _(put: Put) -> str:
    doc = GltfModel()
    doc.place(draco(doc, doc.quad(**with_texture(doc, png(FOUR)))))
    return glb(put, doc)


@feature("glTF", "Draco compression", "carried over", the_quad)
def _draco_beside_plain_data(put: Put) -> str:
    """What is compressed need not be read, and here cannot be."""
    doc = GltfModel()
    quad = doc.quad()
    reported = {"bufferView": doc.view(b"DRACO"), "attributes": {"POSITION": 0}}
    doc.place(quad | {"extensions": {"KHR_draco_mesh_compression": reported}})
    return glb(put, doc)


@feature("glTF", "unlit materials", "carried over", four)
def _(put: Put) -> str:
    doc = GltfModel()
    material = with_texture(doc, png(FOUR), extensions={"KHR_materials_unlit": {}})
    doc.tree["extensionsRequired"] = ["KHR_materials_unlit"]
    doc.place(doc.quad(**material))
    return glb(put, doc)


@feature("glTF", "specular-glossiness materials", "carried over", four)
def _(put: Put) -> str:
    doc = GltfModel()
    with_texture(doc, png(FOUR))
    glossy = {"diffuseTexture": {"index": 0}}
    doc.tree["materials"] = [{"extensions": {"KHR_materials_pbrSpecularGlossiness": glossy}}]
    doc.tree["extensionsRequired"] = ["KHR_materials_pbrSpecularGlossiness"]
    doc.place(doc.quad(material=0))
    return glb(put, doc)


def through(scene: Scene) -> None:
    assert not scene.opaque.any()


@feature("glTF", "transmission", "noted", through, "PTM-N215")
def _(put: Put) -> str:
    doc = GltfModel()
    glass = {"KHR_materials_transmission": {"transmissionFactor": 0.9}}
    doc.tree["materials"] = [{"extensions": glass}]
    doc.place(doc.quad(material=0))
    return glb(put, doc)


@feature("glTF", "triangle strips and fans", "carried over", the_quad)
def _(put: Put) -> str:
    doc = GltfModel()
    doc.place(doc.quad() | {"mode": 6, "indices": doc.add(np.array([0, 1, 2, 3], np.uint16))})
    return glb(put, doc)


@feature("glTF", "triangle strips and fans", "carried over", the_quad)
def _strip(put: Put) -> str:
    doc = GltfModel()
    doc.place(doc.quad() | {"mode": 5, "indices": doc.add(np.array([0, 1, 3, 2], np.uint16))})
    return glb(put, doc)


@feature("glTF", "points and lines", "noted", the_quad, "PTM-N215")
def _(put: Put) -> str:
    doc = GltfModel()
    doc.place(doc.quad(), doc.quad() | {"mode": 1})
    return glb(put, doc)


@feature("glTF", "hidden nodes", "noted", the_quad, "PTM-N215")
def _(put: Put) -> str:
    doc = GltfModel.wall()
    hidden = {"extensions": {"KHR_node_visibility": {"visible": False}}, "children": [2]}
    doc.tree["nodes"] += [{"mesh": 0, "translation": [99, 0, 0], **hidden}, {"mesh": 0}]
    doc.tree["scenes"] = [{"nodes": [0, 1]}]
    return glb(put, doc)


@feature("glTF", "skins and morph targets", "noted", the_quad, "PTM-N215")
def _(put: Put) -> str:
    doc = GltfModel()
    target = doc.add(np.zeros((4, 3), np.float32))
    doc.place(doc.quad(targets=[{"POSITION": target}]))
    return glb(put, doc)


@feature("glTF", "cameras", "carried over", seen)
def _(put: Put) -> str:
    doc = GltfModel.wall()
    doc.tree["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}]
    doc.tree["nodes"].append({"camera": 0, "translation": [5, 2, 5]})
    doc.tree["scenes"] = [{"nodes": [0, 1]}]
    return glb(put, doc)


def asked(text: str) -> None:
    assert "requires the unsupported glTF extension EXT_texture_avif; run `npx" in text


@feature("glTF", "unknown required extension", "refused", asked, "PTM-I243")
def _(put: Put) -> str:
    doc = GltfModel.wall()
    doc.tree["extensionsRequired"] = ["EXT_texture_avif"]
    return glb(put, doc)


@feature("glTF", "unknown optional extension", "noted", the_quad, "PTM-N215")
def _(put: Put) -> str:
    doc = GltfModel.wall()
    doc.tree["extensionsUsed"] = ["MSFT_lod"]
    return glb(put, doc)


@feature("glTF", "metallic and roughness", "carried over", glossy)
def _(put: Put) -> str:
    doc = GltfModel()
    doc.tree["materials"] = [{"pbrMetallicRoughness": {"roughnessFactor": 0.25}}]
    doc.place(doc.quad(material=0))
    return glb(put, doc)
