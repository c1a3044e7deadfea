"""Normals of what is curved and reflects: smooth, the same for all pieces, and kept by a site."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.arrays import Floats, normals
from ptmtools.cells.model import Cells
from ptmtools.light.model import Light
from ptmtools.output import EmitOptions, emit
from ptmtools.output.content import EmitExtras
from ptmtools.output.geometry import Geometry, bends, normal_steps, smooth_normals
from ptmtools.output.gltf import pack, unpack
from ptmtools.output.gltf_reader import ReadPrimitive, read_glb
from ptmtools.output.mesh_levels import mesh_levels
from ptmtools.output.model import FileError
from ptmtools.scene.model import Material, Scene
from ptmtools.site.conversion import lean_glb
from tests.systems.apo.meshes import sphere

CENTRE = np.array([3.9, 1.5, 0.0])
BRASS = Material("brass", metallic=1.0, roughness=0.3)


def column(sides: int) -> Floats:
    """The side and the lids of a column, wound outwards."""
    angle = 2 * np.pi * np.arange(sides) / sides
    low = np.stack([np.sin(angle), np.zeros(sides), np.cos(angle)], axis=1)
    high = low + [0, 2, 0]
    after = np.roll(np.arange(sides), -1)
    side = np.stack([low, low[after], high[after], low, high[after], high], axis=1)
    tip, foot = np.zeros((sides, 3)), np.zeros((sides, 3))
    tip[:, 1] = 2
    lids = [np.stack([high, high[after], tip], axis=1), np.stack([low[after], low, foot], axis=1)]
    return np.concatenate([side.reshape(-1, 3, 3), *lids])


def test_a_sphere_is_smooth() -> None:
    points, triangles = sphere(2, 0.0)
    corner = points[triangles]
    normal = smooth_normals(corner, np.zeros(len(corner), np.int64))
    exact = corner / np.linalg.norm(corner, axis=2, keepdims=True)
    assert np.degrees(np.arccos((normal * exact).sum(axis=2).min())) < 1.5
    assert bends(corner, normal).all()
    # One normal for each place, whatever the order of its faces.
    assert len(np.unique(normal_steps(normal).reshape(-1, 3), axis=0)) <= len(points)


@pytest.mark.parametrize(("sides", "curved"), [(8, 0), (10, 20), (64, 128), (400, 800)])
def test_edges_stay_edges(sides: int, curved: int) -> None:
    """Faces 45° apart meet at an edge, and so do a column and its lid."""
    corner = column(sides)
    normal = smooth_normals(corner, np.zeros(len(corner), np.int64))
    assert bends(corner, normal).sum() == curved
    assert not bends(corner, normal)[2 * sides :].any()


def test_objects_have_edges_between_them() -> None:
    corner = column(64)
    normal = smooth_normals(corner, np.arange(len(corner)))
    assert not bends(corner, normal).any()


def test_what_has_no_area_has_no_normal() -> None:
    corner = np.concatenate([column(10), np.zeros((1, 3, 3))])
    normal = smooth_normals(corner, np.zeros(len(corner), np.int64))
    assert not normal[-1].any()
    assert np.isfinite(normal).all()


def with_ball(scene: Scene, cells: Cells, times: int = 2) -> tuple[Scene, Cells]:
    """With a ball of the last material between the first two rooms, each face of which cells hold
    in four pieces; each belongs to the cell of its middle."""
    points, triangles = sphere(times, 0.0)
    corner = CENTRE + 0.5 * points[triangles]
    middle = (corner + np.roll(corner, -1, axis=1)) / 2
    a, b, c = middle.swapaxes(0, 1)
    p, q, r = corner.swapaxes(0, 1)
    pieces = np.stack([[p, a, c], [a, q, b], [c, b, r], [a, b, c]]).transpose(2, 0, 1, 3)
    pieces = pieces.reshape(-1, 3, 3)
    count, first = len(corner), len(scene.triangles)
    room = (pieces.mean(axis=1)[:, 0] > 4).astype(np.int32)

    def longer(rows: Any, more: Any) -> Any:
        return np.concatenate([rows, np.asarray(more, rows.dtype)])

    scene = replace(
        scene,
        points=longer(scene.points, corner.reshape(-1, 3)),
        triangles=longer(scene.triangles, len(scene.points) + np.arange(3 * count).reshape(-1, 3)),
        uv=longer(scene.uv, np.zeros((count, 3, 2))),
        triangle_object=longer(scene.triangle_object, np.full(count, len(scene.objects))),
        triangle_material=longer(scene.triangle_material, np.full(count, len(scene.materials) - 1)),
        two_sided=longer(scene.two_sided, np.zeros(count)),
        objects=(*scene.objects, "ball"),
    )
    start = len(cells.vertex) + np.arange(3 * len(pieces)).reshape(-1, 3)
    cells = replace(
        cells,
        vertex=longer(cells.vertex, pieces.reshape(-1, 3)),
        vertex_uv=longer(cells.vertex_uv, np.zeros((3 * len(pieces), 2))),
        triangle=longer(cells.triangle, start),
        triangle_source=longer(cells.triangle_source, first + np.repeat(np.arange(count), 4)),
        triangle_cell=longer(cells.triangle_cell, np.stack([room, room], axis=1)),
    )
    return scene, cells


def light_of(geometry: Geometry, scene: Scene, *, reflects: bool = True) -> Light:
    """White light at the vertices of all shapes; the last material may reflect."""
    shapes, faces, rooms = (
        len(geometry.object),
        len(geometry.triangle),
        len(geometry.cell_start) - 1,
    )
    last = geometry.material == len(scene.materials) - 1
    return Light(
        np.zeros(rooms, np.int32),
        np.ones(rooms),
        np.ones((rooms, 3)),
        np.ones(shapes, np.bool_),
        np.zeros(shapes, np.bool_),
        np.zeros((faces, 3, 2), np.float32),
        np.full((faces, 3, 3), 255, np.uint8),
        np.zeros((2, 3)),
        np.zeros((len(scene.materials), 3)),
        last & reflects,
        np.full((rooms, 11), 0.5),
    )


@pytest.fixture
def written(artifacts: Any, put_textures: Any, tmp_path: Path) -> Any:
    """``written(…)``: the served folder, the primitives of a brass ball in the first two cells, and
    the others there."""

    def write(*, reflects: bool = True, **options: Any) -> Any:
        a, www = artifacts, tmp_path / "rooms" / "www"
        scene, cells = with_ball(replace(a.scene, materials=(*a.scene.materials, BRASS)), a.cells)
        records = put_textures(www)
        probes = tuple(replace(records[0], image=-1, probe=cell) for cell in range(2))
        light = light_of(Geometry(scene, cells), scene, reflects=reflects)
        given = EmitOptions(format="gltf", **options)
        every = (*records, *probes) if reflects else records
        emit(scene, cells, a.pvs, a.ach, every, www, given, EmitExtras(light=light))
        glbs = [read_glb((www / f"gltf/c{c:04d}.glb").read_bytes()) for c in range(2)]
        primitives = [p for glb in glbs for p in glb.primitives]
        balls = [p for p in primitives if p.object == "ball"]
        return www, balls, [p for p in primitives if p.object != "ball"]

    return write


def exact(ball: ReadPrimitive) -> Floats:
    away = ball.point - CENTRE
    return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))


@pytest.mark.parametrize("plain", [False, True])
def test_pieces_of_what_reflects_have_smooth_normals(written: Any, plain: bool) -> None:
    www, balls, others = written(plain_gltf=plain)
    assert len(balls) == 2
    assert all(p.normals is None for p in others), "they are flat, or do not reflect"
    known: dict[bytes, bytes] = {}
    for ball in balls:
        assert np.abs(ball.normals - exact(ball)).max() < 0.03
        for point, normal in zip(ball.point, ball.normals, strict=True):
            assert known.setdefault(point.tobytes(), normal.tobytes()) == normal.tobytes()
    assert len(known) < sum(len(ball.point) for ball in balls), "some are in both cells"
    data = (www / "gltf/c0000.glb").read_bytes()
    tree, binary = unpack(data)
    assert "KHR_mesh_quantization" in tree["extensionsRequired"]
    lean, _ = unpack(lean_glb(data))
    assert lean["extensionsRequired"] == tree["extensionsRequired"]
    (place,) = (p["attributes"].get("NORMAL") for p in lean["meshes"][0]["primitives"]
                if "NORMAL" in p["attributes"])  # fmt: skip
    assert lean["accessors"][place]["componentType"] == 5120
    tree["extensionsRequired"].remove("KHR_mesh_quantization")
    with pytest.raises(FileError, match="extensions"):
        read_glb(pack(tree, binary))


def test_other_surfaces_have_none(written: Any) -> None:
    www, balls, others = written(reflects=False)
    assert all(p.normals is None for p in balls + others)
    tree, _ = unpack((www / "gltf/c0000.glb").read_bytes())
    assert tree["extensionsRequired"] == ["EXT_meshopt_compression"]


def test_coarser_meshes_have_normals(room_row: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, cells = room_row(2)
    scene, cells = with_ball(replace(scene, materials=(*scene.materials, BRASS)), cells, 4)
    geometry = Geometry(scene, cells)
    lit = geometry.with_light(light_of(geometry, scene)).with_normals(scene, cells)
    monkeypatch.setattr("ptmtools.output.mesh_levels.MANY", 2048)
    meshes = mesh_levels(lit)
    assert meshes
    for level in (level for mesh in meshes for level in mesh.levels):
        (shape,) = level.shapes
        assert shape.normals is not None
        corner = level.point[shape.point[shape.triangle]].astype(np.float64)
        away = corner - CENTRE
        away /= np.linalg.norm(away, axis=2, keepdims=True)
        # At its rim the ball goes on in the other cell, of which a mesh knows nothing.
        inner = np.abs(corner[:, :, 0] - 4) > 0.1
        assert np.abs(shape.normals / 127 - away)[inner].max() < 0.15
        assert normals(corner).any(axis=1).all()


def test_sites_keep_the_gloss_of_what_has_a_probe(written: Any) -> None:
    www, _, _ = written()
    data = (www / "gltf/c0000.glb").read_bytes()
    (brass,) = (m for m in unpack(data)[0]["materials"] if m["name"] == "brass")
    lean = unpack(lean_glb(data))[0]["materials"]
    kept = [m for m in lean if "metallicFactor" in m.get("pbrMetallicRoughness", {})]
    assert kept == [{name: brass[name] for name in ("pbrMetallicRoughness", "extras")}]
    assert brass["extras"]["probe"] == 2
    assert brass["pbrMetallicRoughness"]["roughnessFactor"] == 0.3
