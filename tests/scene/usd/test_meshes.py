"""USD: meshes, their faces and sides, and what is drawn."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.errors import InputError
from ptmtools.scene import ingest

if find_spec("pxr") is not None:
    from pxr import Gf, UsdGeom

    from tests.scene.usd import usd_models as made


def test_faces_of_any_size(read: Any) -> None:
    on = made.stage()
    # An L of six corners, concave at (2, 2), and a triangle.
    points = [(0, 0, 0), (6, 0, 0), (6, 2, 0), (2, 2, 0), (2, 5, 0), (0, 5, 0), (9, 0, 0)]
    made.mesh(on, points=points, counts=(6, 3), indices=[0, 1, 2, 3, 4, 5, 1, 6, 2])
    got = read(on)
    assert len(got.source.triangles) == 4 + 1
    assert (got.normals[:, 2] > 0).all()
    assert got.normals[:, 2].sum() / 2 == pytest.approx(12 + 6 + 3)


def test_holes_and_short_faces(read: Any) -> None:
    on = made.stage()
    points = [*made.QUAD, (20, 0, 0), (20, 4, 0)]
    wall = made.mesh(on, points=points, counts=(4, 2, 4), indices=[0, 1, 2, 3, 0, 1, 1, 4, 5, 2])
    wall.CreateHoleIndicesAttr([0, 77])
    got = read(on)
    assert got.corners[..., 0].min() == 10
    assert got.count("PTM-N214") == 1


@pytest.mark.parametrize("kind", ["uniform", "faceVarying"])
def test_what_belongs_to_faces_keeps_to_them(read: Any, kind: str) -> None:
    """The second face is a hole, the fourth has the colour."""
    on = made.stage()
    points = [(x, y, 0) for x in range(5) for y in range(2)]
    faces = [[2 * x, 2 * x + 2, 2 * x + 3, 2 * x + 1] for x in range(4)]
    wall = made.mesh(on, points=points, counts=(4,) * 4, indices=np.ravel(faces).tolist())
    wall.CreateHoleIndicesAttr([1])
    times = 4 if kind == "faceVarying" else 1
    made.colors(wall, [(0, 0, 0)] * 3 * times + [(1, 0, 0)] * times, kind)
    got = read(on)
    right = got.corners[..., 0].min(axis=1) == 3
    assert right.sum() == 2
    assert len(right) == 6
    assert (got.source.colors[right] == [255, 0, 0]).all()
    assert (got.source.colors[~right] == 0).all()


@pytest.mark.parametrize(
    ("left", "mirror"), [(False, False), (True, False), (False, True), (True, True)]
)
def test_sides(read: Any, left: bool, mirror: bool) -> None:
    on = made.stage()
    wall = made.mesh(on, st=made.CORNERS)
    if left:
        wall.CreateOrientationAttr("leftHanded")
    if mirror:
        wall.AddScaleOp().Set((-1, 1, 1))
    made.bind(
        wall,
        made.material(
            on, "/World/paint", diffuseColor=made.rgb(made.texture(on, "/World/i", "a.png"))
        ),
    )
    got = read(on)
    # A mirror keeps what is in front there: the quad faces +z, however it is wound.
    assert ((got.normals[:, 2] > 0) == (not left)).all()
    assert got.uv_at(-10 if mirror else 10, 4) == [1, 1]


@pytest.mark.parametrize("both", [True, False])
def test_double_sided(read: Any, both: bool) -> None:
    on = made.stage()
    made.mesh(on).CreateDoubleSidedAttr(both)
    (material,) = read(on).source.materials
    assert material.two_sided is both


def test_one_material_on_meshes_of_one_and_two_sides(read: Any) -> None:
    on = made.stage()
    paint = made.material(on, "/World/paint")
    for n in range(3):
        wall = made.mesh(on, f"/World/wall_{n}")
        wall.CreateDoubleSidedAttr(n == 1)
        made.bind(wall, paint)
    got = read(on)
    assert [(m.name, m.two_sided) for m in got.source.materials] == [
        ("paint", False),
        ("paint", True),
    ]
    assert got.source.triangle_material.tolist() == [0, 0, 1, 1, 0, 0]


@pytest.mark.parametrize(("scheme", "noted"), [("none", 0), ("catmullClark", 1), (None, 1)])
def test_subdivision_surfaces_are_drawn_as_their_cages(
    read: Any, scheme: str | None, noted: int
) -> None:
    on = made.stage()
    wall = made.mesh(on)
    wall.GetPrim().RemoveProperty("subdivisionScheme")
    if scheme:
        wall.CreateSubdivisionSchemeAttr(scheme)
    got = read(on)
    assert len(got.source.triangles) == 2
    assert got.says("PTM-N215").count("subdivision surfaces") == noted


def test_transformations(read: Any) -> None:
    on = made.stage()
    UsdGeom.Xform(on.GetPrimAtPath("/World")).AddTranslateOp().Set((100, 0, 0))
    wall = made.mesh(on)
    wall.AddTranslateOp().Set((0, 0, 7))
    wall.AddRotateYOp().Set(90)
    wall.AddScaleOp().Set((2, 2, 2))
    free = made.mesh(on, "/World/free")
    free.SetResetXformStack(True)
    got = read(on)
    # x becomes -z by a quarter turn about y.
    assert np.allclose(got.corners[:2].reshape(-1, 3).min(axis=0), [100, 0, 7 - 20])
    assert np.allclose(got.corners[:2].reshape(-1, 3).max(axis=0), [100, 8, 7])
    assert got.corners[2:].reshape(-1, 3).min(axis=0).tolist() == [0, 0, 0]


def test_far_from_the_origin_in_double_precision(read: Any) -> None:
    on = made.stage()
    made.mesh(on).AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(5e8 + 0.125, 0, 0))
    assert read(on).source.points[:, 0].min() == 5e8 + 0.125


@pytest.mark.parametrize("wrong", ["too few corners", "too many corners", "below zero", "point"])
def test_meshes_that_do_not_fit(read: Any, wrong: str) -> None:
    on = made.stage()
    wall = made.mesh(on)
    if wrong == "point":
        wall.GetFaceVertexIndicesAttr().Set([0, 1, 2, 4])
    else:
        counts = {"too few corners": [3], "too many corners": [5], "below zero": [5, -1]}
        wall.GetFaceVertexCountsAttr().Set(counts[wrong])
    code = "PTM-I245" if wrong == "point" else "PTM-I254"
    with pytest.raises(InputError, match=f"/World/wall: .*{code}"):
        read(on)


def test_invisible_is_not_drawn(read: Any) -> None:
    on = made.stage()
    made.mesh(on)
    hidden = UsdGeom.Xform.Define(on, "/World/hidden")
    hidden.MakeInvisible()
    made.mesh(on, "/World/hidden/a")
    made.mesh(on, "/World/hidden/b/c")
    got = read(on)
    assert got.source.objects == ("wall",)
    assert got.count("PTM-N215") == 2


@pytest.mark.parametrize(
    ("purpose", "drawn"), [("default", 1), ("render", 1), ("guide", 0), ("proxy", 0)]
)
def test_purpose(read: Any, purpose: str, drawn: int) -> None:
    on = made.stage()
    made.mesh(on)
    UsdGeom.Xform.Define(on, "/World/part").CreatePurposeAttr(purpose)
    made.mesh(on, "/World/part/a")
    got = read(on)
    assert len(got.source.objects) == 1 + drawn
    assert got.count("PTM-N215") == 1 - drawn


def test_inactive_and_abstract_prims_are_not_there(read: Any) -> None:
    on = made.stage()
    made.mesh(on)
    made.mesh(on, "/World/off").GetPrim().SetActive(False)
    on.CreateClassPrim("/_class")
    made.mesh(on, "/_class/a")
    on.OverridePrim("/World/over")
    assert read(on).source.objects == ("wall",)


@pytest.mark.parametrize(
    "kind", ["Sphere", "Cylinder", "Cone", "Capsule", "BasisCurves", "Points", "NurbsPatch"]
)
def test_what_is_no_mesh_is_noted(read: Any, kind: str) -> None:
    on = made.stage()
    made.mesh(on)
    on.DefinePrim("/World/it", kind)
    got = read(on)
    assert got.source.objects == ("wall",)
    surface = kind not in ("BasisCurves", "Points")
    assert kind in got.says("PTM-N214" if surface else "PTM-N215")


def test_cubes_and_planes_are_drawn_as_they_are(read: Any) -> None:
    """They have flat faces and no other form: a cube of edge `size` about its origin, a plane of
    `width` and `length`: x and y for the axis Z, x and z for Y, z and y for X."""
    on = made.stage()
    UsdGeom.Cube.Define(on, "/World/cube").CreateSizeAttr(4)
    made.colors(on.GetPrimAtPath("/World/cube"), [(1, 0, 0)], "constant")
    for axis in "XYZ":
        plane = UsdGeom.Plane.Define(on, f"/World/plane_{axis}")
        plane.CreateAxisAttr(axis)
        plane.CreateWidthAttr(6)
        plane.CreateLengthAttr(8)
    got = read(on)
    assert got.source.objects == ("cube", "plane_X", "plane_Y", "plane_Z")
    parts = [got.source.triangle_object == number for number in range(4)]
    sizes = [np.ptp(got.corners[part].reshape(-1, 3), axis=0).tolist() for part in parts]
    assert sizes == [[4, 4, 4], [0, 8, 6], [6, 0, 8], [6, 8, 0]]
    assert [int(part.sum()) for part in parts] == [12, 2, 2, 2]
    outwards = np.einsum("ij,ij->i", got.normals[parts[0]], got.corners[parts[0]].mean(axis=1))
    assert (outwards > 0).all()
    for axis in range(3):
        assert (got.normals[parts[1 + axis]][:, axis] > 0).all()
    sides = {m.two_sided: m.color for m in got.source.materials}
    assert sides == {False: (1, 0, 0), True: None}  # a plane has two by its schema


def test_no_geometry(tmp_path: Path) -> None:
    on = made.stage(tmp_path / "a.usda")
    UsdGeom.Sphere.Define(on, "/World/ball")
    on.GetRootLayer().Save()
    with pytest.raises(InputError, match=r"a\.usda: no faces.*PTM-I247"):
        ingest(tmp_path / "a.usda")
