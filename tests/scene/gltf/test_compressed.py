"""A building as plain glTF and compressed: the same cells, and the same textures."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest

from ptmtools.cells import Cells, subdivide
from ptmtools.errors import LimitError
from ptmtools.scene import Scene, ingest
from tests.scene.buildings import HIGH, WIDE, house
from tests.scene.conftest import GltfModel, Put, noise, png
from tests.scene.features.gltf import compressed

#: Bits of the grid that encoders take where nobody says otherwise.
BITS = 14


@pytest.fixture(autouse=True)
def _components(require: Callable[[str, str], None]) -> None:
    for module in ("meshopt", "DracoPy"):
        if find_spec(module) is None:
            require(module, f"pip install {module}")


def building() -> tuple[GltfModel, list[np.ndarray]]:
    """Each wall, floor and roof a primitive of its own, (n, 3, 3) triangles, Y up."""
    corners = house()[..., [0, 2, 1]] * [1, 1, -1]
    parts = np.array_split(corners, max(1, len(corners) // 12))
    doc = GltfModel()
    doc.tree["images"] = [
        {"bufferView": doc.view(png(noise(seed))), "mimeType": "image/png"} for seed in (1, 2)
    ]
    doc.tree["textures"] = [{"source": 0}, {"source": 1}]
    doc.tree["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": index}}, "doubleSided": True}
        for index in (0, 1)
    ]
    return doc, parts


def floats() -> GltfModel:
    """All as it is."""
    doc, parts = building()
    for n, part in enumerate(parts):
        points = part.reshape(-1, 3).astype(np.float32)
        where = {"POSITION": doc.add(points), "TEXCOORD_0": doc.add(points[:, :2].copy())}
        doc.place({"attributes": where, "material": n % 2}, name=f"part {n}")
    return doc


def plain(put: Put) -> Scene:
    return ingest(put("plain.glb", floats().glb()))


def by_meshopt(put: Put) -> Scene:
    return ingest(put("meshopt.glb", compressed(floats(), "KHR_meshopt_compression", 1).glb()))


def by_draco(put: Put) -> Scene:
    """Each primitive on a grid of its own, as Draco has it."""
    import DracoPy

    doc, parts = building()
    doc.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    for n, part in enumerate(parts):
        points = part.reshape(-1, 3)
        faces = np.arange(len(points), dtype=np.uint32).reshape(-1, 3)
        data = DracoPy.encode(points, faces, quantization_bits=BITS, tex_coord=points[:, :2].copy())
        decoded = DracoPy.decode(data)
        ids = {row["attribute_type"]: row["unique_id"] for row in decoded.attributes}
        count = len(decoded.points)
        form = {"componentType": 5126, "count": count}
        doc.tree["accessors"] += [
            form | {"type": "VEC3"},
            form | {"type": "VEC2"},
            {"componentType": 5125, "count": faces.size, "type": "SCALAR"},
        ]
        first = len(doc.tree["accessors"]) - 3
        reported: dict[str, Any] = {"bufferView": doc.view(data)}
        reported["attributes"] = {"POSITION": ids[0], "TEXCOORD_0": ids[3]}
        primitive = {
            "attributes": {"POSITION": first, "TEXCOORD_0": first + 1},
            "indices": first + 2,
            "material": n % 2,
            "extensions": {"KHR_draco_mesh_compression": reported},
        }
        doc.place(primitive, name=f"part {n}")
    return ingest(put("draco.glb", doc.glb()))


def by_integers(put: Put) -> Scene:
    """All on one grid of 16 bits (KHR_mesh_quantization)."""
    doc, parts = building()
    doc.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    step = np.abs(np.concatenate(parts)).max() / 32767
    for n, part in enumerate(parts):
        points = np.rint(part.reshape(-1, 3) / step).astype(np.int16)
        coords = (points[:, :2] * step).astype(np.float32)
        where = {"POSITION": doc.add(points), "TEXCOORD_0": doc.add(coords)}
        doc.place({"attributes": where, "material": n % 2}, name=f"part {n}", scale=[step] * 3)
    return ingest(put("integers.glb", doc.glb()))


def counts(cells: Cells) -> tuple[int, int, bool]:
    return cells.cell_count, cells.portal_count, cells.closed


def test_without_loss_everything_is_the_same(put: Put) -> None:
    one, other = plain(put), by_meshopt(put)
    first, second = one.to_arrays(), other.to_arrays()
    assert all(np.array_equal(first[name], second[name]) for name in first)
    assert [i.sha256 for i in one.images] == [i.sha256 for i in other.images]


@pytest.mark.parametrize(
    ("make", "step"), [(by_draco, 19 / (2**BITS - 1)), (by_integers, 19 / 32767)]
)
def test_on_a_coarser_grid_the_cells_are_the_same(
    put: Put, make: Callable[[Put], Scene], step: float
) -> None:
    """Points that were in one plane lie up to a step apart, and no wall leaks for it."""
    one, other = plain(put), make(put)
    assert one.tolerance.step == 0
    assert other.tolerance.step == pytest.approx(step, rel=0.1)
    assert other.tolerance.plane > 1.1 * other.tolerance.step
    assert [i.sha256 for i in one.images] == [i.sha256 for i in other.images]
    assert counts(subdivide(other)) == counts(subdivide(one))
    again = Scene.from_arrays(other.to_arrays(), other.images)
    assert again.tolerance == other.tolerance
    assert other.with_points(2 * other.points).tolerance.step == other.tolerance.step


def test_a_door_stays_open_on_a_coarse_grid(put: Put) -> None:
    """The openings of the house are wider than any tolerance."""
    assert by_draco(put).tolerance.hairline < min(WIDE, HIGH) / 50


def test_what_unpacks_to_more_than_can_be_meant(put: Put, monkeypatch: pytest.MonkeyPatch) -> None:
    """Equal bytes take a thousandth of what they unpack to."""
    from ptmtools.scene.gltf import document as module

    doc = GltfModel.wall()
    for count, refused in ((4, False), (400_000, True)):
        block = min(count, 256)
        control = bytes([0xAA]) * (3 * -(-count // block))
        data = bytes([0xA1]) + control + bytes(9) + bytes(15)
        reported = {"buffer": 0, "byteOffset": 0, "byteLength": len(data), "count": count}
        reported |= {"byteStride": 12, "mode": "ATTRIBUTES"}
        extension = {"KHR_meshopt_compression": reported}
        view = {"buffer": 0, "byteLength": 12 * count, "extensions": extension}
        tree = doc.tree | {"bufferViews": [view]}
        made = module.GltfDocument(put("a.glb", b""), tree, [module.Buffer(data, None)])
        monkeypatch.setattr(module, "_DECODED", 1 << 20)
        made = module.GltfDocument(made.path, tree, [module.Buffer(data, None)])
        if refused:
            with pytest.raises(LimitError, match=r"4 MiB.*PTM-L204"):
                made.view(0)
        else:
            buffer, start, length = made.view(0)
            assert (buffer.data, start, length) == (bytes(48), 0, 48)
