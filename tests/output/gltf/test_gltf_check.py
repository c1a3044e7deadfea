"""Every fault planted in the glTF files is found with its code."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.diagnostics import CODES
from ptmtools.output import validate_database
from ptmtools.output.gltf import pack, unpack
from tests.output.agreement import disagreements, kinds
from tests.output.damage import (
    KINDS,
    Damage,
    copied,
    hinted,
    is_planted,
    put,
    removed,
    rewritten,
)

GLB = "gltf/c0001.glb"


def treed(change: Callable[[dict[str, Any]], object]) -> Damage:
    """Changes the JSON of a GLB."""

    def changed(data: bytes) -> bytes:
        tree, binary = unpack(data)
        change(tree)
        return pack(tree, binary)

    return rewritten(GLB, changed)


def poked(kind: str, element: int, value: float) -> Damage:
    """Writes a number into the first accessor of a kind: POSITION, TEXCOORD_0 or indices."""

    def changed(data: bytes) -> bytes:
        tree, binary = unpack(data)
        primitives = [p for mesh in tree["meshes"] for p in mesh["primitives"]]
        places = [p["attributes"].get(kind, p.get(kind)) for p in primitives]
        accessor = tree["accessors"][next(place for place in places if place is not None)]
        view = tree["bufferViews"][accessor["bufferView"]]
        one = np.array([value], "<u2" if kind == "indices" else "<f4").tobytes()
        begin = view.get("byteOffset", 0) + accessor.get("byteOffset", 0) + element * len(one)
        return pack(tree, binary[:begin] + one + binary[begin + len(one) :])

    return rewritten(GLB, changed)


def edited(change: Callable[[bytearray], object]) -> Damage:
    """Changes the bytes of a GLB."""

    def changed(data: bytes) -> bytes:
        held = bytearray(data)
        change(held)
        return bytes(held)

    return rewritten(GLB, changed)


def textured(tree: dict[str, Any]) -> dict[str, Any]:
    """A material with a texture."""
    return next(m for m in tree["materials"] if "baseColorTexture" in m["pbrMetallicRoughness"])


def plain(tree: dict[str, Any]) -> dict[str, Any]:
    """A material without, that does not blend."""
    return next(m for m in tree["materials"] if "extras" not in m and "alphaMode" not in m)


def swap_first_corners(tree: dict[str, Any]) -> None:
    """Gives two primitives each other's triangles."""
    one, two = (mesh["primitives"][0] for mesh in tree["meshes"][:2])
    one["attributes"], two["attributes"] = two["attributes"], one["attributes"]


def drop_coordinates(tree: dict[str, Any]) -> None:
    for mesh in tree["meshes"]:
        for primitive in mesh["primitives"]:
            primitive["attributes"].pop("TEXCOORD_0", None)


def drop_mesh(tree: dict[str, Any]) -> None:
    for name in ("nodes", "meshes"):
        tree[name].pop()
    tree["scenes"][0]["nodes"].pop()


def misplace(tree: dict[str, Any]) -> None:
    """Positions begin two bytes late."""
    accessor = tree["accessors"][tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    accessor["byteOffset"] = accessor.get("byteOffset", 0) + 2


def lengthen(tree: dict[str, Any]) -> None:
    tree["bufferViews"][0]["byteLength"] += 10**6
    tree["accessors"][0]["count"] += 10**4


def repeat(tree: dict[str, Any]) -> None:
    """As if the model did not clamp."""
    for sampler in tree["samplers"]:
        sampler.clear()
    for material in tree["materials"]:
        material.get("extras", {}).pop("wrapS", None)


def of_accessor(member: str, value: object) -> Damage:
    """Changes a member of the first accessor of positions."""

    def change(tree: dict[str, Any]) -> None:
        place = tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
        tree["accessors"][place][member] = value

    return treed(change)


#: The code that the check reports, or the kind of difference from the VRML file
#: (`tests.output.agreement`). The manifest is written afterwards: no hash reveals the fault.
FAULTS: list[tuple[str, str, Damage]] = [
    ("PTM-D699", "no GLB", removed(GLB)),
    ("PTM-D699", "not named", hinted(lambda d: d["geometry"].pop("gltf"))),
    (
        "PTM-D699",
        "named otherwise",
        hinted(lambda d: d["geometry"].update(gltf="gltf/x{name}.glb")),
    ),
    ("PTM-D699", "a GLB too many", copied(GLB, "gltf/c0003.glb")),
    ("PTM-D731", "empty", put(GLB, b"")),
    ("PTM-D731", "magic", edited(lambda d: d.__setitem__(0, 0))),
    ("PTM-D731", "version", edited(lambda d: d.__setitem__(4, 1))),
    ("PTM-D731", "length", edited(lambda d: d.__setitem__(8, d[8] ^ 4))),
    ("PTM-D731", "cut short", edited(lambda d: d.__delitem__(slice(-4, None)))),
    ("PTM-D731", "appended", edited(lambda d: d.extend(b"\0\0\0\0"))),
    ("PTM-D731", "length of JSON", edited(lambda d: d.__setitem__(12, d[12] ^ 4))),
    ("PTM-D731", "kind of chunk", edited(lambda d: d.__setitem__(16, 66))),
    ("PTM-D731", "JSON", edited(lambda d: d.__setitem__(20, 91))),
    ("PTM-D731", "UTF-8", edited(lambda d: d.__setitem__(30, 255))),
    ("PTM-D731", "NaN", edited(lambda d: d.__setitem__(slice(0, None), with_constant(bytes(d))))),
    ("PTM-D731", "no scene", treed(lambda t: t.pop("scene"))),
    ("PTM-D731", "version of glTF", treed(lambda t: t["asset"].update(version="1.0"))),
    ("PTM-D731", "an extension", treed(lambda t: t.update(extensionsUsed=["EXT_texture_webp"]))),
    ("PTM-D731", "a number for true", treed(lambda t: t["materials"][0].update(doubleSided=1))),
    ("PTM-D731", "true for a number", treed(lambda t: t.update(scene=False))),
    ("PTM-D731", "no such mesh", treed(lambda t: t["nodes"][0].update(mesh=99))),
    ("PTM-D731", "no such material", treed(lambda t: t["materials"].clear())),
    ("PTM-D731", "no such image", treed(lambda t: t["textures"][0].update(source=-1))),
    ("PTM-D731", "a node is left out", treed(lambda t: t["scenes"][0]["nodes"].pop())),
    ("PTM-D731", "a matrix", treed(lambda t: t["nodes"][0].update(matrix=[1] * 16))),
    ("PTM-D731", "another cell", copied("gltf/c0000.glb", GLB)),
    ("PTM-D731", "another number", treed(lambda t: t["scenes"][0]["extras"].update(cell=2))),
    ("PTM-D731", "type", of_accessor("type", "VEC4")),
    ("PTM-D731", "component type", of_accessor("componentType", 5122)),
    ("PTM-D731", "no bounds", of_accessor("min", [])),
    ("PTM-D731", "no max", treed(lambda t: [a.pop("max", 0) for a in t["accessors"]])),
    ("PTM-D731", "a dither", treed(lambda t: t["materials"][0].update(alphaMode="DITHER"))),
    ("PTM-D731", "stride", treed(lambda t: t["bufferViews"][0].update(byteStride=16))),
    ("PTM-D731", "an embedded buffer", treed(lambda t: t["buffers"][0].update(uri="data:,"))),
    (
        "PTM-D731",
        "a colour above 1",
        treed(lambda t: plain(t)["pbrMetallicRoughness"].update(baseColorFactor=[2, 1, 1, 1])),
    ),
    ("glb_accessor", "a count", of_accessor("count", 10**9)),
    ("glb_accessor", "no count", of_accessor("count", 0)),
    ("glb_accessor", "a view beyond the bytes", treed(lengthen)),
    ("glb_accessor", "misaligned", treed(misplace)),
    ("glb_accessor", "before the bytes", of_accessor("byteOffset", -12)),
    ("glb_accessor", "a longer buffer", treed(lambda t: t["buffers"][0].update(byteLength=10**12))),
    ("glb_indices", "beyond the vertices", poked("indices", 0, 60000)),
    ("glb_numbers", "not finite", poked("POSITION", 0, float("nan"))),
    ("glb_numbers", "infinite", poked("TEXCOORD_0", 0, float("inf"))),
    ("glb_numbers", "bounds", of_accessor("max", [1e3, 1e3, 1e3])),
    ("glb_numbers", "huge bounds", of_accessor("max", [10**400, 0, 0])),
    ("glb_texture", "no such texture", treed(lambda t: textured(t)["extras"].update(texture=7))),
    ("glb_texture", "before the first", treed(lambda t: textured(t)["extras"].update(texture=-1))),
    (
        "texture",
        "another texture",
        treed(lambda t: textured(t)["extras"].update(texture=1 - textured(t)["extras"]["texture"])),
    ),
    ("triangles", "swapped", treed(swap_first_corners)),
    ("triangles", "fewer shapes", treed(drop_mesh)),
    ("triangles", "no texture coordinates", treed(drop_coordinates)),
    ("triangles", "texture coordinates", poked("TEXCOORD_0", 1, 0.123)),
    ("material", "sides", treed(lambda t: t["materials"][0].update(doubleSided=sides(t)))),
    (
        "material",
        "colour",
        treed(lambda t: plain(t)["pbrMetallicRoughness"].pop("baseColorFactor")),
    ),
    ("material", "opaque glass", treed(lambda t: [m.pop("alphaMode", 0) for m in t["materials"]])),
    ("PTM-D731", "sampler", treed(lambda t: [r.clear() for r in t["samplers"]])),
    ("material", "wrap", treed(repeat)),
    (
        "material",
        "no image",
        treed(lambda t: textured(t)["pbrMetallicRoughness"].pop("baseColorTexture")),
    ),
    ("texture", "blends for nothing", treed(lambda t: see_through(t, "../textures/a.png"))),
    ("leads_out", "outside", treed(lambda t: t["images"][0].update(uri="../../a.png"))),
    ("no_file", "no such file", treed(lambda t: textured(t)["extras"].update(ptm="a.ptm"))),
]


def sides(tree: dict[str, Any]) -> bool:
    return not tree["materials"][0].get("doubleSided", False)


def see_through(tree: dict[str, Any], uri: str) -> None:
    """Lets the materials of an image blend."""
    image = tree["images"].index({"uri": uri})
    for material in tree["materials"]:
        use = material["pbrMetallicRoughness"].get("baseColorTexture")
        if use is not None and tree["textures"][use["index"]]["source"] == image:
            material["alphaMode"] = "BLEND"


def with_constant(data: bytes) -> bytes:
    """The GLB with NaN in its JSON, which `pack` does not write."""
    tree, binary = unpack(data)
    tree["scene"] = 123
    return pack(tree, binary).replace(b'"scene":123', b'"scene":NaN')


@pytest.mark.parametrize(
    ("kind", "what", "damage"), FAULTS, ids=[f"{kind}-{what}" for kind, what, _ in FAULTS]
)
def test_each_planted_fault_is_found(
    gltf_database: Path, seal: Damage, kind: str, what: str, damage: Damage
) -> None:
    damage(gltf_database)
    seal(gltf_database)
    if kind not in KINDS and not kind.startswith("PTM"):
        assert kind in kinds(gltf_database / "www")
        return
    report = validate_database(gltf_database)
    files = [i.file for i in report.issues if is_planted(i, kind.removeprefix("PTM-"))]
    assert files, [str(issue) for issue in report.issues]
    assert all(file.startswith("www/gltf/") for file in files)
    assert not report.ok


def test_each_code_is_planted() -> None:
    codes = {code for code in CODES if code.startswith("PTM-D73")}
    planted = {f"PTM-{KINDS[kind][0]}" if kind in KINDS else kind for kind, _, _ in FAULTS}
    others = {"PTM-D671", "PTM-D699", "PTM-D704", "triangles", "material", "texture"}
    assert codes == planted - others


def test_the_forms_agree(gltf_finished: Path) -> None:
    assert disagreements(gltf_finished) == []


def test_a_damaged_vrml_file_is_told_once(gltf_database: Path, seal: Damage) -> None:
    """What is wrong with the VRML file is not reported of the GLB as well."""
    path = gltf_database / "www/cells/c0001.wrl"
    path.write_text(path.read_text().replace(" coordIndex [ 0", " coordIndex { 0", 1))
    seal(gltf_database)
    report = validate_database(gltf_database)
    assert {issue.code for issue in report.issues} == {"PTM-D661"}


def test_damaged_hints_leave_the_rest_to_be_checked(gltf_database: Path, seal: Damage) -> None:
    (gltf_database / "www/hints.json").write_text("{")
    poked("indices", 0, 60000)(gltf_database)
    seal(gltf_database)
    codes = {issue.code for issue in validate_database(gltf_database).issues}
    assert codes == {"PTM-D700", "PTM-D731"}
