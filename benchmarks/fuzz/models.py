"""Hostile models: OBJ and MTL as words and lines, glTF as JSON and as chunks, meshes as bytes.

Beside the model lie images, libraries, links that lead out, named pipes, and, outside of its
folder, files that nothing may open. Each model is ingested as the command does it; what comes out
is stored and read back.
"""

from __future__ import annotations

import base64
import json
import os
import struct
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any, NoReturn

import numpy as np

from benchmarks.fuzz.mutation import NAMES, NUMBERS, Case, damaged, dumped, garbled, twisted
from ptmtools.errors import InputError
from ptmtools.scene import IngestOptions, Scene, ingest
from ptmtools.scene.polygon import triangulate
from ptmtools.store.archive import pack_arrays, unpack_arrays
from ptmtools.texture.images import png_bytes

#: Small limits, so that going beyond them shows.
OPTIONS = IngestOptions(limit=16, max_triangles=300_000)

MTL = """# materials
newmtl wall
Ka 1 1 1
Kd 0.8 0.7 0.6
d 1
map_Kd -s 2 2 1 -o 0.1 0.2 -clamp on wall.png
newmtl glass
Kd 1 1 1
Tr 0.4
map_d -imfchan m alpha.png
map_Kd maps\\alpha.png
newmtl plain
d -halo 0.5
illum 2
map_bump -bm 1 wall.png
newmtl wall
Kd spectral a.rfl
"""
OBJ = """# a house
mtllib a.mtl
mtllib b c.mtl a.mtl
o house
v 0 0 0
v 10 0 0
v 10 4 0
v 0 4 0
v 0 0 8 1 0.5 0
v 10 0 8
v 10 4 8
v 0 4 8
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
g wall one
usemtl wall
s 1
f 1/1/1 2/2/1 3/3/1 4/4/1
usemtl glass
f 5/1 8/2 7/3 6/4
g
usemtl plain
f 1 5 6 2
f -8 -4 -1 \\
-5
o floor of it
v 2 0 2
v 4 0 1
v 3 0 3
v 4 0 5
v 1 0 4
f 9 10 11 12 13
f 9//1 10//1 12//1
l 1 2 3
p 1
usemtl none such
f 4 3 7 8
"""
OBJ_WORDS = (
    *("v", "vt", "vn", "f", "o", "g", "s", "usemtl", "mtllib", "l", "p", "curv", "surf", "call"),
    *("a.mtl", "wall", "glass", "1/1", "2//1", "-1", "-1/-1/-1", "99", "1/99", "fifo.mtl"),
)
MTL_WORDS = (
    *("newmtl", "Kd", "Ka", "d", "Tr", "map_Kd", "map_d", "map_bump", "-s", "-o", "-t", "-mm"),
    *("-bm", "-clamp", "-imfchan", "-halo", "-cc", "on", "off", "wall.png", "alpha.png", "wall"),
    *("spectral", "xyz", "refl", "norm", "wall.eps", "fifo.png", "bomb.png", "round.png"),
)


def furnished(folder: Path, outside: Path) -> list[str]:
    """What lies in the folder and beside it; the names that lead elsewhere, filled in."""
    rng = np.random.default_rng(5)
    image = rng.integers(0, 255, (16, 16, 4), np.uint8)
    wall, alpha = png_bytes(image[:, :, :3]), png_bytes(image)
    files = {
        "wall.png": wall,
        "alpha.png": alpha,
        "maps/alpha.png": alpha,
        "bomb.png": wall[:16] + struct.pack(">II", 60_000, 60_000) + wall[24:],
        "wall.eps": b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 8 8\n%%EndComments\nshowpage\n",
        "a.mtl": MTL.encode(),
        "b c.mtl": b"newmtl other\nKd 1 0 0\n",
    }
    for name, data in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(data)
    (outside / "secret.png").write_bytes(wall)
    (outside / "secret.mtl").write_bytes(b"newmtl wall\n")
    for link, to in (("link.png", outside / "secret.png"), ("away", outside),
                     ("round.png", "round.png"), ("zero.png", "/dev/zero")):  # fmt: skip
        os.symlink(to, folder / link)
    for name in ("fifo", "fifo.png", "fifo.mtl", "fifo.bin"):
        os.mkfifo(folder / name)
    return [name.replace("{outside}", str(outside)) for name in NAMES]


def ingested(path: Path) -> str:
    """Reads a model, stores the scene and reads it back."""
    scene = ingest(path, OPTIONS)
    packed = pack_arrays(scene.to_arrays())
    again = Scene.from_arrays(unpack_arrays(packed, file="scene.npz"), scene.images)
    assert pack_arrays(again.to_arrays()) == packed
    for image in scene.images:
        image.load()
    assert all(".." not in file.split("/") for file in scene.files)
    json.dumps(scene.files, ensure_ascii=False).encode()
    return f"{len(scene.images)} images"


class Obj:
    """The reader of OBJ."""

    limit = 1 << 26

    def __init__(self, folder: Path, outside: Path) -> None:
        self._names = furnished(folder, outside)
        self._path = folder / "a.obj"

    def make(self, rng: Random) -> Case:
        """Lines and words; now and then bytes."""
        if rng.random() < 0.1:
            return Case(damaged(rng, OBJ.encode(), MTL.encode()))
        words = rng.choice((OBJ_WORDS, OBJ_WORDS, [f"mtllib {name}" for name in self._names]))
        return Case(garbled(rng, OBJ, words).encode("utf-8", "surrogatepass"))

    def read(self, case: Case) -> str:
        """Ingests it."""
        self._path.write_bytes(case.data)
        return ingested(self._path)


class Mtl:
    """The reader of MTL."""

    limit = 1 << 26

    def __init__(self, folder: Path, outside: Path) -> None:
        self._names = furnished(folder, outside)
        self._path = folder / "a.obj"
        self._path.write_text(OBJ)

    def make(self, rng: Random) -> Case:
        """Lines and words; now and then bytes."""
        if rng.random() < 0.1:
            return Case(damaged(rng, MTL.encode(), OBJ.encode()))
        statements = [f"{key} {name}" for name in self._names for key in ("map_Kd", "map_d")]
        words = rng.choice((MTL_WORDS, MTL_WORDS, statements))
        return Case(garbled(rng, MTL, words).encode("utf-8", "surrogatepass"))

    def read(self, case: Case) -> str:
        """Ingests a model that uses it."""
        self._path.with_name("a.mtl").write_bytes(case.data)
        return ingested(self._path)


#: The corners of a quad, 10 × 4, as 32-bit floats, by the encoder of meshoptimizer.
MESHOPT = bytes.fromhex(
    "a000000133000000403f013300000082810000010c000000ff010c000000800000000000000000000000"
    "00000000000000000000000000000000000000000000000000"
)


def document() -> tuple[dict[str, Any], bytes]:
    """A glTF document of two textured quads, a strip, a fan of colours, instances, a camera and an
    image in the buffer; with views that are compressed with meshopt, and a sparse accessor."""
    blob = b""
    views: list[dict[str, int]] = []
    accessors: list[dict[str, Any]] = []

    def view(data: bytes) -> int:
        nonlocal blob
        blob += bytes(-len(blob) % 4)
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": len(data)})
        blob += data
        return len(views) - 1

    def add(values: np.ndarray[Any, Any], kind: int) -> int:
        name = "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}"
        accessors.append(
            {"bufferView": view(values.tobytes()), "componentType": kind, "count": len(values),
             "type": name}
        )  # fmt: skip
        return len(accessors) - 1

    corners = np.array([[0, 0, 0], [10, 0, 0], [10, 4, 0], [0, 4, 0]], np.float32)
    coords = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    where = {"POSITION": add(corners, 5126), "TEXCOORD_0": add(coords, 5126)}
    indices = add(np.array([0, 1, 2, 0, 2, 3], np.uint16), 5123)
    bytes_ = add((coords * 255).astype(np.uint8).repeat(2, axis=1)[:, ::2].copy(), 5121)
    accessors[bytes_]["normalized"] = True
    noise = np.random.default_rng(5).integers(0, 255, (8, 8, 4), np.uint8)
    image = view(png_bytes(noise))
    packed = add(corners, 5126)
    part = {"buffer": 0, "byteOffset": len(blob), "byteLength": len(MESHOPT)}
    blob += MESHOPT
    extension = part | {"mode": "ATTRIBUTES", "count": 4, "byteStride": 12, "filter": "NONE"}
    views[accessors[packed]["bufferView"]] |= {"extensions": {"EXT_meshopt_compression": extension}}
    colored = add((corners / 10).astype(np.float32), 5126)
    accessors[colored]["sparse"] = {
        "count": 2,
        "indices": {"bufferView": view(bytes([1, 3])), "componentType": 5121},
        "values": {"bufferView": view(corners[:2].tobytes())},
    }
    moved = add(np.array([[0, 0, 9], [0, 0, 5]], np.float32), 5126)
    turned = add(np.array([[0, 0, 0, 1], [0, 1, 0, 0]], np.float32), 5126)
    where_from = {"TRANSLATION": moved, "ROTATION": turned, "SCALE": moved}
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 2, 3]}],
        "nodes": [
            {"mesh": 0, "name": "wall", "children": [1], "translation": [0, 0, 1]},
            {"mesh": 1, "rotation": [0, 1, 0, 0], "scale": [1, 2, 1]},
            {"camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 1, 5, 1]},
            {
                "mesh": 2,
                "extensions": {
                    "EXT_mesh_gpu_instancing": {"attributes": where_from},
                    "KHR_node_visibility": {"visible": True},
                },
            },
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "meshes": [
            {"primitives": [{"attributes": where, "indices": indices, "material": 0}]},
            {
                "name": "strip",
                "primitives": [
                    {"attributes": {**where, "TEXCOORD_1": bytes_}, "mode": 5, "material": 1}
                ],
            },
            {
                "primitives": [
                    {"attributes": {"POSITION": packed, "COLOR_0": colored}, "mode": 6},
                ],
            },
        ],
        "materials": [
            {
                "name": "paint",
                "doubleSided": True,
                "alphaMode": "MASK",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [1, 0.5, 0.25, 1],
                    "baseColorTexture": {
                        "index": 0,
                        "extensions": {"KHR_texture_transform": {"scale": [2, 2]}},
                    },
                },
            },
            {"pbrMetallicRoughness": {"baseColorTexture": {"index": 1, "texCoord": 1}}},
        ],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1}],
        "samplers": [{"wrapS": 33071, "wrapT": 33648}],
        "images": [
            {"bufferView": image, "mimeType": "image/png", "name": "own"},
            {"uri": "wall.png"},
        ],
        "extensionsUsed": ["KHR_texture_transform", "EXT_meshopt_compression"],
        "extensionsRequired": ["EXT_mesh_gpu_instancing"],
        "bufferViews": views,
        "accessors": accessors,
        "buffers": [{"byteLength": len(blob)}],
    }  # fmt: skip
    return tree, blob


class Gltf:
    """The reader of glTF: .gltf with buffers of all kinds, and .glb."""

    limit = 1 << 26

    def __init__(self, folder: Path, outside: Path) -> None:
        self._names = furnished(folder, outside)
        self._folder = folder
        self._tree, self._blob = document()
        (folder / "a.bin").write_bytes(self._blob)

    def make(self, rng: Random) -> Case:
        """The document with other values, or the file with other bytes."""
        tree = json.loads(json.dumps(self._tree))
        way = rng.randrange(3)
        if way == 0:
            tree["buffers"][0]["uri"] = "a.bin"
        elif way == 1:
            body = base64.b64encode(self._blob).decode()
            tree["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{body}"
        if way == 2 and rng.random() < 0.3:
            blob = damaged(rng, self._blob)
            return Case(_glb(rng, json.dumps(tree).encode(), blob, exact=True), "glb")
        if rng.random() < 0.1:
            text = damaged(rng, json.dumps(tree).encode(), self._blob)
        else:
            text = dumped(rng, twisted(rng, tree, self._names))
        return Case(_glb(rng, text, self._blob), "glb") if way == 2 else Case(text, "gltf")

    def read(self, case: Case) -> str:
        """Ingests it."""
        path = self._folder / f"a.{case.facts}"
        path.write_bytes(case.data)
        return ingested(path)


def _glb(rng: Random, text: bytes, blob: bytes, exact: bool = False) -> bytes:
    """A container; sometimes its lengths lie."""
    text += b" " * (-len(text) % 4)
    lengths = [28 + len(text) + len(blob), len(text), len(blob)]
    if not exact and rng.random() < 0.3:
        lengths[rng.randrange(3)] = rng.choice(NUMBERS) & 0xFFFFFFFF
    whole, first, second = lengths
    data = struct.pack("<4sII", b"glTF", 2, whole) + struct.pack("<I4s", first, b"JSON") + text
    data += struct.pack("<I4s", second, b"BIN\0") + blob
    return damaged(rng, data) if rng.random() < 0.1 else data


DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"><asset>
<unit meter=" 0.0254 "/> <up_axis> X_UP </up_axis> </asset>
<library_images> <image id="i"> <init_from> wall.png </init_from> </image> </library_images>
<library_effects> <effect id="e"> <profile_COMMON> <newparam sid="f"> <surface>
<init_from> i </init_from> </surface> </newparam> <newparam sid="t"> <sampler2D>
<source> f </source> <wrap_s> MIRROR </wrap_s> </sampler2D> </newparam> <technique> <phong>
<emission> <color> 0.1 0 0 1 </color> </emission> <shininess> <float> 20 </float> </shininess>
<diffuse> <texture texture="t" texcoord="UV"/> </diffuse> <transparent opaque="RGB_ZERO">
<color> 0.1 0.1 0.1 1 </color> </transparent> </phong> </technique> </profile_COMMON> </effect>
</library_effects> <library_materials> <material id="m"> <instance_effect url="#e"/> </material>
</library_materials> <library_geometries> <geometry id="g"> <mesh> <source id="p">
<float_array id="a"> 0 0 0 10 0 0 10 4 0 0 4 0 1 1 0 2 1 0 2 2 0 </float_array> <technique_common>
<accessor source="#a" count="7" stride="3"/> </technique_common> </source> <source id="c">
<float_array id="b"> 0 0 1 0 1 1 0 1 </float_array> <technique_common>
<accessor source="#b" count="4" stride="2"/> </technique_common> </source>
<vertices id="v"> <input semantic="POSITION" source="#p"/> </vertices> <triangles material="s">
<input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#c" offset="1"/> <p> 0 0 1 1 2 2 0 0 2 2 3 3 </p>
</triangles> <polylist> <input semantic="VERTEX" source="#v"/>
<vcount> 4 3 </vcount> <p> 0 1 2 3 0 1 2 </p> </polylist> <polygons>
<input semantic="VERTEX" source="#v"/> <ph> <p> 0 1 2 3 </p> <h> 4 5 6 </h> </ph> </polygons>
<tristrips> <input semantic="VERTEX" source="#v"/> <p> 0 1 3 2 </p> </tristrips> </mesh>
</geometry> </library_geometries> <library_visual_scenes> <visual_scene id="s"> <node id="n">
<rotate> 0 0 1 90 </rotate> <lookat> 1 2 3 4 5 6 0 1 0 </lookat> <scale> 1 2 1 </scale>
<instance_geometry url="#g"> <bind_material> <technique_common>
<instance_material symbol="s" target="#m"> <bind_vertex_input semantic="UV" input_set="0"/>
</instance_material> </technique_common> </bind_material> </instance_geometry> <node id="k">
<matrix> 1 0 0 0 0 1 0 0 0 0 1 7 0 0 0 1 </matrix> <instance_node url="#l"/> </node> </node>
<node id="l"> <instance_geometry url="#g"/> </node> </visual_scene> </library_visual_scenes>
<scene> <instance_visual_scene url="#s"/> </scene> </COLLADA>
"""


VRML = """#VRML V2.0 utf8
PROTO Wall [ field SFVec3f at 0 0 1 field MFNode parts [ ] ] { Transform { translation IS at
children [ Group { children IS parts } USE quad ] } }
DEF top Transform { center 1 0 0 rotation 0 0 1 1.5 scale 2 1 1 scaleOrientation 1 0 0 0.5
children [
DEF quad Shape { appearance Appearance { material Material { diffuseColor 1 0 0 transparency 0.5 }
texture ImageTexture { url [ "none.png" "wall.png" ] repeatS FALSE }
textureTransform TextureTransform { scale 2 2 rotation 0.5 center 1 1 } }
geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0, 10 0 0, 10 4 0, 0 4 0 ] }
coordIndex [ 0 1 2 3 -1 0 2 3 -1 ] color Color { color [ 1 0 0, 0 1 0 ] } colorPerVertex FALSE
texCoord TextureCoordinate { point [ 0 0, 1 1 ] } texCoordIndex [ 0 1 0 1 -1 0 1 0 -1 ] } } ] }
Wall { at 1 2 3 parts [ Wall { } Shape { geometry Box { size 1 2 3 } } ] }
LOD { level [ Shape { geometry Cone { bottom FALSE } } ] } Inline { url "a.wrl" }
Switch { whichChoice 0 choice [ Shape { geometry Sphere { radius 2 } } ] }
Shape { geometry ElevationGrid { xDimension 2 zDimension 2 height [ 0 1 2 3 ] } }
Shape { geometry Extrusion { spine [ 0 0 0, 0 1 0, 1 1 0 ] scale [ 1 1 ] endCap FALSE } }
Viewpoint { position 1 2 3 orientation 0 1 0 1 fieldOfView 0.8 description "eye" }
Script { eventIn SFTime t url "x" } ROUTE a.b TO c.d
"""
X3D = """<X3D> <Scene> <Transform DEF="a" translation=" 1 2 3 " scale=" 1 2 1 "> <Shape>
<Appearance> <Material diffuseColor=" 1 0 0 " transparency=" 0.5 "/>
<ImageTexture url=' "none.png" "wall.png" '/> </Appearance>
<IndexedFaceSet coordIndex=" 0 1 2 3 -1 " solid=" false ">
<Coordinate point=" 0 0 0 10 0 0 10 4 0 0 4 0 "/> </IndexedFaceSet> </Shape> </Transform>
<Transform USE="a"/> <Shape> <IndexedTriangleStripSet index=" 0 1 3 2 -1 ">
<Coordinate point=" 0 0 0 10 0 0 10 4 0 0 4 0 "/> </IndexedTriangleStripSet> </Shape>
<Shape> <TriangleFanSet fanCount=" 4 "> <Coordinate point=" 0 0 0 10 0 0 10 4 0 0 4 0 "/>
<ColorRGBA color=" 0 0 0 1 0 0 1 1 1 1 0 0 0 0 0 1 "/> </TriangleFanSet> </Shape>
<Shape> <QuadSet> <Coordinate point=" 0 0 0 10 0 0 10 4 0 0 4 0 "/> </QuadSet> </Shape>
</Scene> </X3D>
"""


class Mesh:
    """The readers of COLLADA, VRML, X3D, PLY, STL and OFF, without pymeshlab."""

    limit = 1 << 26

    def __init__(self, folder: Path, outside: Path) -> None:
        from ptmtools.scene import libraries

        libraries.convert = _no_meshlab
        # Compiles the cutting of concave polygons, or loads it from its cache, which is pickled.
        star = np.array([[2.0, 0, 2], [4, 0, 1], [3, 0, 3], [4, 0, 5], [1, 0, 4]])
        triangulate(star[[1, 2, 3, 4, 0]], np.array([0, 5]))
        furnished(folder, outside)
        self._folder = folder
        corners = "0 0 0\n10 0 0\n10 4 0\n0 4 0\n"
        head = ("ply\nformat {} 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                "property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
                "end_header\n")  # fmt: skip
        points = struct.pack("<12f", *map(float, corners.split()))
        faces = struct.pack("<B3iB3i", 3, 0, 1, 2, 3, 0, 2, 3)
        solid = "solid a\n" + "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n".format(
            "".join(f"vertex {line}\n" for line in corners.splitlines()[:3])
        )
        triangle = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 10, 0, 0, 10, 4, 0, 0)
        self._seeds: list[tuple[str, bytes, Callable[..., bytes]]] = [
            ("ply", (head.format("ascii") + corners + "3 0 1 2\n3 0 2 3\n").encode(), _words),
            ("ply", head.format("binary_little_endian").encode() + points + faces, damaged),
            ("stl", (solid + "endsolid a\n").encode(), _words),
            ("stl", bytes(80) + struct.pack("<I", 2) + triangle * 2, damaged),
            ("dae", DAE.encode(), _words),
            ("wrl", VRML.replace('Inline { url "a.wrl" }', "").encode(), _words),
            ("wrl", VRML.encode(), _words),
            ("x3d", X3D.encode(), _words),
            ("off", f"OFF\n4 2 0\n{corners}3 0 1 2\n3 0 2 3\n".encode(), _words),
        ]

    def make(self, rng: Random) -> Case:
        """Words of a text, or bytes."""
        suffix, data, change = rng.choice(self._seeds)
        return Case(change(rng, data), suffix)

    def read(self, case: Case) -> str:
        """Ingests it."""
        path = self._folder / f"a.{case.facts}"
        path.write_bytes(case.data)
        return ingested(path)


def _words(rng: Random, data: bytes) -> bytes:
    return garbled(rng, data.decode()).encode("utf-8", "surrogatepass")


def _no_meshlab(path: Path, scratch: Path) -> NoReturn:
    raise InputError("PTM-I254", "pymeshlab is left out", file=path)


class Meshopt:
    """The decoder of what is compressed with meshopt in glTF."""

    limit = 1 << 26

    def __init__(self, folder: Path, outside: Path) -> None:
        import meshopt

        rng = np.random.default_rng(5)
        walk = np.cumsum(rng.integers(-9, 9, (300, 4)), axis=0)
        rows = np.hstack([walk.astype(np.uint8), rng.random((300, 2), np.float32).view(np.uint8)])
        index = (np.arange(400)[:, None] + [0, 1, 2]).astype(np.uint32).ravel()
        encode = meshopt.encode_vertex_buffer_level
        self._streams = [
            (encode(np.ascontiguousarray(rows), 3, 0), "ATTRIBUTES", 300, 12),
            (encode(np.ascontiguousarray(rows), 3, 1), "ATTRIBUTES", 300, 12),
            (encode(np.ascontiguousarray(rows[:, :4]), 2, 1), "ATTRIBUTES", 300, 4),
            (meshopt.encode_index_buffer(index), "TRIANGLES", len(index), 4),
            (meshopt.encode_index_sequence(index), "INDICES", len(index), 2),
        ]
        self._filters = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR")

    def make(self, rng: Random) -> Case:
        """Other bytes, and sometimes another layout than they have."""
        data, mode, count, stride = rng.choice(self._streams)
        others = [stream for stream, *_ in self._streams]
        stream = {"mode": mode, "count": count, "byteStride": stride}
        if rng.random() < 0.3:
            stream["filter"] = rng.choice(self._filters)
        if rng.random() < 0.3:
            stream[rng.choice(("count", "byteStride"))] = rng.choice((0, 3, 4, 8, 256, *NUMBERS))
        return Case(damaged(rng, data, rng.choice(others)), stream)

    def read(self, case: Case) -> str:
        """Decodes it, as the reader of glTF does."""
        from ptmtools.meshopt.decoding import decode

        try:
            actual = decode(case.data, case.facts)
        except ValueError as error:
            raise InputError("PTM-I249", str(error)) from None
        assert len(actual) == case.facts["count"] * case.facts["byteStride"]
        return case.facts["mode"].lower()


class Messages:
    """Messages of sandboxed readers (IFC, USD)."""

    limit = 1 << 26

    def __init__(self, folder: Path, outside: Path) -> None:
        from ptmtools.scene import messages
        from ptmtools.scene.notes import IngestNotes
        from ptmtools.scene.source import ModelSource, SourceMaterial

        self._names = furnished(folder, outside)
        self._model, self._scratch = folder / "a.usda", folder / "scratch"
        self._model.write_bytes(b"#usda 1.0")
        self._scratch.mkdir(exist_ok=True)
        source = ModelSource(
            points=np.eye(3) * 10,
            triangles=np.array([[0, 1, 2], [2, 1, 0]]),
            uv=np.zeros((2, 3, 2)),
            triangle_object=np.array([0, 1]),
            triangle_material=np.array([0, 0]),
            objects=("a", "b"),
            materials=(SourceMaterial("paint", (1.0, 0.5, 0.0)),),
            metres=1.0,
            up="z",
            colors=np.zeros((2, 3, 3), np.uint8),
            kinds=("door", ""),
        )
        image = messages.NamedImage("wall.png", "/a")
        images = {"texture": {0: image}, "glow_map": {0: image}}
        findings = IngestNotes(self._model)
        findings.note("PTM-N215", "left out", "/b")
        self._answer = messages.pack_source(source, images, findings, str(self._scratch))
        self._arrays = (self._scratch / "source.npz").read_bytes()
        self._messages = messages

    def make(self, rng: Random) -> Case:
        """Another message, or other arrays."""
        if rng.random() < 0.3:
            return Case(damaged(rng, self._arrays), self._answer)
        answer = json.loads(json.dumps(self._answer))
        try:
            reply = json.loads(dumped(rng, twisted(rng, answer, self._names)))
        except (ValueError, RecursionError):
            reply = answer
        return Case(self._arrays, reply)

    def read(self, case: Case) -> str:
        """Reads the message."""
        from ptmtools.scene.notes import IngestNotes

        (self._scratch / "source.npz").write_bytes(case.data)
        self._messages.run_in_sandbox = lambda *given, **options: case.facts
        source = self._messages.read_in_sandbox(
            "", "the library", self._model, IngestNotes(self._model), str(self._scratch)
        )
        return f"{len(source.triangles)} triangles"
