"""USD: instances, point instancers, and limits of what they draw."""

from __future__ import annotations

import math
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from ptmtools.errors import InputError, LimitError
from ptmtools.scene import ingest

if find_spec("pxr") is not None:
    from pxr import Gf, Sdf, UsdGeom

    from tests.scene.usd import usd_models as made
from tests.scene.usd.reading import equal


def chairs(instanceable: bool) -> Any:
    on = made.stage()
    image = made.texture(on, "/World/wood/image", "a.png")
    wood = made.material(on, "/World/wood", diffuseColor=made.rgb(image))
    on.CreateClassPrim("/_chair")
    made.bind(made.box(on, "/_chair/seat", (0, 1, 0), (1, 1.1, 1)), wood)
    made.box(on, "/_chair/back", (0, 1, 0), (1, 2, 0.1)).AddScaleOp().Set((-1, 1, 1))
    for n in range(3):
        chair = UsdGeom.Xform.Define(on, f"/World/Chair_{n}")
        chair.AddTranslateOp().Set((3.0 * n, 0, 0))
        chair.AddRotateYOp().Set(30.0 * n)
        chair.GetPrim().GetInherits().AddInherit("/_chair")
        chair.GetPrim().SetInstanceable(instanceable)
    made.bind(on.GetPrimAtPath("/World/Chair_1"), made.material(on, "/World/red"))
    return on


def test_instances_are_like_copies(read: Any) -> None:
    instances, copies = read(chairs(True)), read(chairs(False))
    assert equal(instances.source, copies.source)
    assert instances.source.objects == copies.source.objects
    assert instances.source.objects[0] == "Chair_0/seat"
    assert len(set(instances.source.objects)) == 6
    assert [m.name for m in instances.source.materials] == ["wood", "default", "red"]


def instancer(on: Any, path: str = "/World/many", **more: Any) -> Any:
    made_one = UsdGeom.PointInstancer.Define(on, path)
    made_one.CreatePrototypesRel().SetTargets([f"{path}/table", f"{path}/lamp"])
    made.mesh(on, f"{path}/table")
    lamp = UsdGeom.Xform.Define(on, f"{path}/lamp")
    lamp.AddTranslateOp().Set((0, 100, 0))
    made.mesh(on, f"{path}/lamp/shade").AddScaleOp().Set((0.1, 0.25, 1))
    made_one.CreateProtoIndicesAttr([0, 1, 0, 1])
    made_one.CreatePositionsAttr([(0, 0, 0), (20, 0, 0), (40, 0, 0), (60, 0, 0)])
    return made_one


def test_point_instancers(read: Any) -> None:
    on = made.stage()
    many = instancer(on)
    many.AddTranslateOp().Set((0, 0, 5))
    many.CreateScalesAttr([(1, 1, 1), (2, 2, 2), (-1, 1, 1), (1, 1, 1)])
    half = math.sqrt(0.5)
    turned = Gf.Quath(half, Gf.Vec3h(0, half, 0))
    many.CreateOrientationsAttr([Gf.Quath(1)] * 3 + [turned])
    many.CreateInvisibleIdsAttr([0])
    got = read(on)
    assert sorted(got.source.objects) == ["many/lamp/shade"] * 2 + ["many/table"]
    boxes = {}
    for number in range(3):
        of = got.corners[got.source.triangle_object == number].reshape(-1, 3)
        boxes[round(of[:, 0].max())] = of.min(axis=0).tolist() + of.max(axis=0).tolist()
    assert boxes[40] == [30, 0, 5, 40, 4, 5]  # mirrored at its own origin
    assert boxes[22] == pytest.approx([20, 200, 5, 22, 202, 5])  # the prototype's own place, scaled
    assert boxes[60] == pytest.approx([60, 100, 4, 60, 101, 5], abs=2e-3)
    mirrored = got.corners[..., 0].max(axis=1) == 40
    assert (got.normals[mirrored][:, 2] > 0).all()
    assert got.count("PTM-N215") == 1


def test_nested_point_instancers(read: Any) -> None:
    on = made.stage()
    outer = UsdGeom.PointInstancer.Define(on, "/World/rows")
    outer.CreatePrototypesRel().SetTargets(["/World/rows/row"])
    UsdGeom.Xform.Define(on, "/World/rows/row")
    inner = UsdGeom.PointInstancer.Define(on, "/World/rows/row/seats")
    inner.CreatePrototypesRel().SetTargets(["/World/rows/row/seats/seat"])
    made.mesh(on, "/World/rows/row/seats/seat")
    inner.CreateProtoIndicesAttr([0, 0, 0])
    inner.CreatePositionsAttr([(0, 0, 0), (11, 0, 0), (22, 0, 0)])
    outer.CreateProtoIndicesAttr([0, 0])
    outer.CreatePositionsAttr([(0, 0, 0), (0, 0, 9)])
    got = read(on)
    assert got.source.objects == ("rows/row/seats/seat",) * 6
    low = {tuple(got.corners[got.source.triangle_object == i].min(axis=(0, 1))) for i in range(6)}
    assert low == {(x, 0, z) for x in (0, 11, 22) for z in (0, 9)}


def test_prototypes_elsewhere_may_be_undefined_or_abstract(read: Any) -> None:
    on = made.stage()
    made.mesh(on, "/Prototypes/chair")
    on.GetPrimAtPath("/Prototypes").SetSpecifier(Sdf.SpecifierOver)
    on.CreateClassPrim("/_lamp")
    made.mesh(on, "/_lamp/shade")
    many = UsdGeom.PointInstancer.Define(on, "/World/many")
    many.CreatePrototypesRel().SetTargets(["/Prototypes/chair", "/_lamp"])
    many.CreateProtoIndicesAttr([0, 1])
    many.CreatePositionsAttr([(0, 0, 0), (20, 0, 0)])
    assert read(on).source.objects == ("many/chair", "many/_lamp/shade")


def test_an_instancer_in_itself(read: Any) -> None:
    on = made.stage()
    made.mesh(on)
    many = UsdGeom.PointInstancer.Define(on, "/World/many")
    many.CreatePrototypesRel().SetTargets(["/World/many/a", "/World/none"])
    UsdGeom.Xform.Define(on, "/World/many/a")
    again = UsdGeom.PointInstancer.Define(on, "/World/many/a/b")
    again.CreatePrototypesRel().SetTargets(["/World/many/a"])
    again.CreateProtoIndicesAttr([0])
    again.CreatePositionsAttr([(0, 0, 0)])
    many.CreateProtoIndicesAttr([0, 1])
    many.CreatePositionsAttr([(0, 0, 0), (1, 0, 0)])
    got = read(on)
    assert got.source.objects == ("wall",)
    assert "/World/none" in got.says("PTM-N214")


@pytest.mark.parametrize("wrong", ["index", "positions"])
def test_instancers_that_do_not_fit(read: Any, wrong: str) -> None:
    on = made.stage()
    many = instancer(on)
    if wrong == "index":
        many.GetProtoIndicesAttr().Set([0, 1, 0, 2])
    else:
        many.GetPositionsAttr().Set([(0, 0, 0)])
    with pytest.raises(InputError, match=r"/World/many: .*PTM-I254"):
        read(on)


def test_triangles_are_counted_before_they_are_made(tmp_path: Path) -> None:
    """Ten thousand times ten thousand times ten thousand quads: no memory would do."""
    on = made.stage(tmp_path / "a.usda")
    parent = "/World"
    for level in range(3):
        path = f"{parent}/many_{level}"
        many = UsdGeom.PointInstancer.Define(on, path)
        many.CreatePrototypesRel().SetTargets([f"{path}/it"])
        many.CreateProtoIndicesAttr([0] * 10_000)
        many.CreatePositionsAttr([(0, 0, 0)] * 10_000)
        parent = f"{path}/it"
        UsdGeom.Xform.Define(on, parent)
    made.mesh(on, f"{parent}/wall")
    on.GetRootLayer().Save()
    with pytest.raises(LimitError, match=r"a\.usda: has more than 20,000,000 triangles.*PTM-L203"):
        ingest(tmp_path / "a.usda")


def test_instances_of_an_instancer_count_as_often_as_they_are_shown(read: Any) -> None:
    on = made.stage()
    many = UsdGeom.PointInstancer.Define(on, "/World/many")
    many.CreatePrototypesRel().SetTargets(["/World/many/box"])
    made.box(on, "/World/many/box", (0, 0, 0), (1, 1, 1))
    many.CreateProtoIndicesAttr([0] * 4)
    many.CreatePositionsAttr([(2 * x, 0, 0) for x in range(4)])
    many.CreateInvisibleIdsAttr([3])
    assert len(read(on, 36).source.triangles) == 36
    with pytest.raises(LimitError, match="PTM-L203"):
        read(on, 35)


def test_points_that_no_face_uses_are_not_multiplied(read: Any) -> None:
    on = made.stage()
    many = UsdGeom.PointInstancer.Define(on, "/World/many")
    many.CreatePrototypesRel().SetTargets(["/World/many/it"])
    many.CreateProtoIndicesAttr([0] * 1000)
    many.CreatePositionsAttr([(x, 0, 0) for x in range(1000)])
    points = [(9, 9, 9)] * 10_000 + made.QUAD
    it = made.mesh(on, "/World/many/it", points, indices=range(10_000, 10_004))
    made.colors(it, [(0, 0, 0)] * 10_000 + [(1, 0, 0)] * 4, "vertex")
    source = read(on).source
    assert len(source.points) == 4000
    assert (source.colors == [255, 0, 0]).all()


@pytest.mark.parametrize("instanceable", [True, False])
def test_instances_count_as_often_as_they_are_shown(read: Any, instanceable: bool) -> None:
    assert len(read(chairs(instanceable), 72).source.triangles) == 3 * 2 * 12
    with pytest.raises(LimitError, match="PTM-L203"):
        read(chairs(instanceable), 71)
