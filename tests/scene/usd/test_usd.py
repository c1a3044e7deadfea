"""USD: each thing that is read or noted in a small file, and files that would do harm."""

from __future__ import annotations

import io
import math
import os
import sys
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.errors import InputError, LimitError, MissingComponentError, PtmError
from ptmtools.scene import IngestOptions, ingest
from ptmtools.scene.formats import read_other
from ptmtools.scene.messages import NamedImage
from ptmtools.scene.notes import Findings
from ptmtools.scene.source import MAX_VERTICES, FileRange, Source
from tests.scene.conftest import Put, noise, png

if TYPE_CHECKING:
    from tests.scene.usd import usd_models as made

if find_spec("pxr") is not None:
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdSkel

    from tests.scene.usd import usd_models as made


@pytest.fixture(autouse=True)
def usd_core(require: Callable[[str, str], None]) -> None:
    if find_spec("pxr") is None:
        require("usd-core", "pip install 'ptmtools[usd]'")


class Read:
    """What a stage becomes, made here and not in a process of its own."""

    def __init__(self, stage: Any, folder: Path, most: int = MAX_VERTICES) -> None:
        from ptmtools.scene.usd.source import make_source

        path = folder / f"{len(os.listdir(folder))}.usda"
        stage.GetRootLayer().Export(str(path))
        findings = Findings(path)
        self.source, self.images, self.files = make_source(path, findings, most)
        self.notes = findings.notes
        self.codes = {note.code for note in self.notes}

    @property
    def corners(self) -> np.ndarray:
        return self.source.points[self.source.triangles]

    @property
    def normals(self) -> np.ndarray:
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a)

    @property
    def image(self) -> NamedImage:
        (image,) = self.images.values()
        return image

    def says(self, code: str) -> str:
        return "; ".join(note.message for note in self.notes if note.code == code)

    def count(self, code: str) -> int:
        return sum(note.count for note in self.notes if note.code == code)

    def uv_at(self, x: float, y: float) -> list[float]:
        corners, uv = self.corners.reshape(-1, 3), self.source.uv.reshape(-1, 2)
        (actual,) = np.unique(uv[(corners[:, :2] == (x, y)).all(axis=1)].round(6), axis=0)
        return list(actual.tolist())


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., Read]:
    return lambda stage, most=MAX_VERTICES: Read(stage, tmp_path, most)


def equal(a: Source, b: Source) -> bool:
    """Whether two sources have the same surfaces, in the same order."""
    return (
        np.array_equal(a.points, b.points)
        and np.array_equal(a.triangles, b.triangles)
        and np.array_equal(a.uv, b.uv)
        and np.array_equal(a.triangle_material, b.triangle_material)
        and [m.name for m in a.materials] == [m.name for m in b.materials]
    )


def tri(source: Source) -> np.ndarray:
    """(T, 3, 3) corners in an order of their own."""
    corners = source.points[source.triangles].reshape(-1, 9).round(5)
    return corners[np.lexsort(corners.T)]


def two_rooms(path: Path) -> Any:
    """Two rooms of 6 x 3 x 5 m with an opening between them, textured."""
    on = made.stage(path)
    quad = [(0, 0, 0), (0, 0, 5), (6, 0, 5), (6, 0, 0)]
    up = [(x, 3, z) for x, _, z in quad]
    image = made.texture(on, "/World/paint/image", "./maps/brick.png")
    paint = made.material(on, "/World/paint", diffuseColor=made.rgb(image))
    for n in range(2):
        below = f"/World/room_{n}"
        at = UsdGeom.Xform.Define(on, below)
        at.AddTranslateOp().Set((6.0 * n, 0, 0))
        made.mesh(on, f"{below}/floor", quad, st=made.CORNERS)
        made.mesh(on, f"{below}/ceiling", up[::-1], st=made.CORNERS)
        for name, a, b in (("front", 0, 1), ("back", 2, 3), ("side", 1, 2), ("other", 3, 0)):
            if (n, name) in ((0, "back"), (1, "front")):
                continue
            made.mesh(on, f"{below}/{name}", [quad[a], up[a], up[b], quad[b]], st=made.CORNERS)
    # Between the two, with an opening in its middle.
    wall = [(6, 0, 0), (6, 3, 0), (6, 3, 2), (6, 0, 2)]
    half = [(6, 0, 3), (6, 3, 3), (6, 3, 5), (6, 0, 5)]
    for name, points in (("wall_a", wall), ("wall_b", half)):
        made.mesh(on, f"/World/{name}", points, st=made.CORNERS).CreateDoubleSidedAttr(True)
    made.bind(on.GetPrimAtPath("/World"), paint)
    on.GetRootLayer().Save()
    return on


# -- Formats --------------------------------------------------------------------------------------


def test_the_same_of_all_kinds_of_files(put: Put, tmp_path: Path) -> None:
    put("maps/brick.png", png(noise(1)))
    on = two_rooms(tmp_path / "a.usda")
    on.Export(str(tmp_path / "b.usdc"))
    on.Export(str(tmp_path / "c.usd"))
    made.package(tmp_path / "b.usdc", tmp_path / "d.usdz")
    sources, notes = [], []
    for name in ("a.usda", "b.usdc", "c.usd", "d.usdz"):
        findings = Findings(tmp_path / name)
        sources.append(read_other(tmp_path / name, findings))
        notes.append(findings.notes)
    assert len(sources[0].triangles) == 2 * (5 * 2 + 2 - 1) + 2
    assert all(equal(sources[0], other) for other in sources[1:])
    assert notes == [notes[0]] * 4
    assert {(s.metres, s.up, s.objects) for s in sources} == {(1.0, "y", sources[0].objects)}
    images = [s.materials[0].texture for s in sources]
    assert all(image is not None and image.read() == png(noise(1)) for image in images)
    assert [image.label.split("/")[-1] for image in images if image] == ["brick.png"] * 4


def test_a_quad(tmp_path: Path) -> None:
    on = made.stage(tmp_path / "a.usda")
    made.mesh(on, st=made.CORNERS)
    on.GetRootLayer().Save()
    scene = ingest(tmp_path / "a.usda")
    assert scene.objects == ("wall",)
    assert (scene.space.metres, scene.space.up) == (1.0, "y")
    assert (scene.space.unit_guessed, scene.space.up_guessed) == (False, False)
    assert scene.points.min(axis=0).tolist() == [-5, 0, 0]
    assert not scene.two_sided.any()
    assert scene.materials[0].color == (0.8, 0.8, 0.8)
    assert scene.colors is None


def test_the_same_each_time(put: Put, tmp_path: Path) -> None:
    put("maps/brick.png", png(noise(1)))
    two_rooms(tmp_path / "a.usda")
    first, second = (ingest(tmp_path / "a.usda").to_arrays() for _ in range(2))
    assert all(first[name].tobytes() == second[name].tobytes() for name in first)


# -- Space ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("metres", "up", "expected"),
    [(0.01, "Z", (0.01, "z")), (0.3048, "Y", (0.3048, "y")), (None, None, (None, None))],
)
def test_unit_and_axis_where_they_are_said(
    read: Any, metres: float | None, up: str | None, expected: Any
) -> None:
    on = Usd.Stage.CreateInMemory()
    if metres is not None:
        UsdGeom.SetStageMetersPerUnit(on, metres)
    if up is not None:
        UsdGeom.SetStageUpAxis(on, up)
    made.mesh(on, "/wall")
    source = read(on).source
    assert (source.metres, source.up) == expected


@pytest.mark.parametrize("metres", [0.0, -1.0, math.inf, math.nan])
def test_a_unit_that_cannot_be_is_guessed(read: Any, metres: float) -> None:
    on = made.stage()
    UsdGeom.SetStageMetersPerUnit(on, metres)
    made.mesh(on)
    assert read(on).source.metres is None


def test_centimetres_with_z_up(tmp_path: Path) -> None:
    on = made.stage(tmp_path / "a.usda")
    UsdGeom.SetStageMetersPerUnit(on, 0.01)
    UsdGeom.SetStageUpAxis(on, "Z")
    made.box(on, "/World/hall", (0, 0, 0), (1000, 800, 300), inwards=True)
    on.GetRootLayer().Save()
    scene = ingest(tmp_path / "a.usda")
    assert np.allclose(np.ptp(scene.points, axis=0), [10, 3, 8])
    assert not {note.code for note in scene.notes} & {"PTM-N201", "PTM-N202", "PTM-N227"}


def test_a_unit_without_a_name_is_believed(tmp_path: Path) -> None:
    on = made.stage(tmp_path / "a.usda")
    UsdGeom.SetStageMetersPerUnit(on, 0.1)
    made.box(on, "/World/hall", (0, 0, 0), (100, 30, 80), inwards=True)
    on.GetRootLayer().Save()
    scene = ingest(tmp_path / "a.usda")
    assert np.allclose(np.ptp(scene.points, axis=0), [10, 3, 8])
    assert "PTM-N227" not in {note.code for note in scene.notes}


# -- Meshes ---------------------------------------------------------------------------------------


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


# -- What is drawn --------------------------------------------------------------------------------


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


# -- Instances ------------------------------------------------------------------------------------


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


# -- Materials ------------------------------------------------------------------------------------


def test_colours_are_linear(read: Any) -> None:
    on = made.stage()
    made.bind(
        made.mesh(on), made.material(on, "/World/paint", diffuseColor=(0.5, 0, 2), opacity=0.25)
    )
    got = read(on)
    (material,) = got.source.materials
    assert material.name == "paint"
    assert material.color == pytest.approx((0.735357, 0, 1), abs=1e-6)
    assert (material.opacity, material.see_through) == (0.25, False)
    assert "colour factor converted" in got.says("PTM-N215")


def test_the_colour_of_nothing_said(read: Any) -> None:
    """UsdPreviewSurface: diffuseColor is 0.18, opacity 1."""
    on = made.stage()
    made.bind(made.mesh(on), made.material(on, "/World/paint"))
    (material,) = read(on).source.materials
    assert material.color == pytest.approx((0.461356,) * 3, abs=1e-6)
    assert material.opacity == 1


@pytest.mark.parametrize(("opacity", "threshold", "shown"), [(0.3, 0.5, 0), (0.7, 0.5, 1)])
def test_cut_out_is_all_or_nothing(read: Any, opacity: float, threshold: float, shown: int) -> None:
    on = made.stage()
    paint = made.material(on, "/World/paint", opacity=opacity, opacityThreshold=threshold)
    made.bind(made.mesh(on), paint)
    (material,) = read(on).source.materials
    assert (material.opacity, material.see_through) == (shown, False)


def test_values_through_the_interface_of_a_material(read: Any) -> None:
    on = made.stage()
    paint = made.material(on, "/World/paint")
    tint = paint.CreateInput("tint", Sdf.ValueTypeNames.Color3f)
    tint.Set((0, 1, 0))
    surface = UsdShade.Shader.Get(on, "/World/paint/surface")
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(tint)
    made.bind(made.mesh(on), paint)
    assert read(on).source.materials[0].color == (0, 1, 0)


def test_bindings_are_inherited_and_of_collections(read: Any) -> None:
    on = made.stage()
    names = ("of_all", "own", "of_some", "strong")
    of_all, own, of_some, strong = (made.material(on, f"/Looks/{name}") for name in names)
    world = on.GetPrimAtPath("/World")
    made.bind(world, of_all)
    made.mesh(on, "/World/a")
    made.bind(made.mesh(on, "/World/b"), own)
    made.mesh(on, "/World/c")
    some = Usd.CollectionAPI.Apply(world, "some")
    some.CreateIncludesRel().AddTarget("/World/c")
    UsdShade.MaterialBindingAPI(world).Bind(some, of_some, "some")
    group = UsdGeom.Xform.Define(on, "/World/group")
    made.bind(group, strong, bindingStrength=UsdShade.Tokens.strongerThanDescendants)
    made.bind(made.mesh(on, "/World/group/d"), own)
    source = read(on).source
    used = [source.materials[i].name for i in source.triangle_material[::2]]
    assert dict(zip(source.objects, used, strict=True)) == {
        "a": "of_all",
        "b": "own",
        "c": "of_some",
        "group/d": "strong",
    }


@pytest.mark.parametrize(
    ("purposes", "shown"),
    [(("", "full", "preview"), "preview"), (("", "full"), "all"), (("full",), "full")],
)
def test_of_bindings_that_for_previews_counts(read: Any, purposes: Any, shown: str) -> None:
    on = made.stage()
    wall = made.mesh(on)
    for purpose in purposes:
        paint = made.material(on, f"/World/{purpose or 'all'}")
        made.bind(wall, paint, materialPurpose=purpose or UsdShade.Tokens.allPurpose)
    assert [m.name for m in read(on).source.materials] == [shown]


def test_subsets_of_faces(read: Any) -> None:
    on = made.stage()
    hall = made.box(on, "/World/hall", (0, 0, 0), (1, 1, 1))
    whole, part = (made.material(on, f"/World/{name}") for name in ("whole", "part"))
    made.bind(hall, whole)
    subset = UsdShade.MaterialBindingAPI(hall).CreateMaterialBindSubset("floor", [1, 4, 99])
    made.bind(subset, part)
    other = UsdGeom.Subset.CreateGeomSubset(hall, "other", "face", [0], "selection")
    made.bind(other, made.material(on, "/World/never"))
    source = read(on).source
    used = [source.materials[i].name for i in source.triangle_material[::2]]
    assert used == ["whole", "part", "whole", "whole", "part", "whole"]
    assert source.objects == ("hall",)


def test_other_shaders_are_noted_and_the_displayed_colour_counts(read: Any) -> None:
    on = made.stage()
    paint = UsdShade.Material.Define(on, "/World/paint")
    other = made.shader(on, "/World/paint/s", "ND_standard_surface_surfaceshader")
    paint.CreateSurfaceOutput("mtlx").ConnectToSource(
        other.CreateOutput("out", Sdf.ValueTypeNames.Token)
    )
    wall = made.mesh(on)
    made.bind(wall, paint)
    made.colors(wall, [(1, 0, 0)], "constant")
    got = read(on)
    assert "paint" in got.says("PTM-N214")
    assert (got.source.materials[0].name, got.source.materials[0].color) == ("paint", (1, 0, 0))


# -- Textures -------------------------------------------------------------------------------------


def test_a_texture(read: Any, put: Put) -> None:
    put("brick.png", png(noise(1)))
    on = made.stage()
    made.textured(on)
    got = read(on)
    assert (got.image.name, got.image.offset) == ("brick.png", None)
    assert (got.image.wrap_s, got.image.wrap_t) == ("repeat", "repeat")
    assert got.source.materials[0].color == (1, 1, 1)
    assert [got.uv_at(x, y) for x, y, _ in made.QUAD] == [list(map(float, c)) for c in made.CORNERS]
    assert not got.codes


@pytest.mark.parametrize(
    ("mode", "wrap", "noted"),
    [
        ("repeat", "repeat", 0),
        ("clamp", "clamp", 0),
        ("mirror", "mirror", 0),
        ("black", "clamp", 1),
        ("useMetadata", "clamp", 1),
    ],
)
def test_wrapping(read: Any, mode: str, wrap: str, noted: int) -> None:
    on = made.stage()
    made.textured(on, wrapS=mode)
    got = read(on)
    assert (got.image.wrap_s, got.image.wrap_t) == (wrap, "repeat")
    assert got.count("PTM-N215") == noted


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("constant", [(0.5, 0.25)]),
        ("uniform", [(0.5, 0.25), (0.75, 1)]),
        ("vertex", [(i / 8, i / 4) for i in range(6)]),
        ("varying", [(i / 8, i / 4) for i in range(6)]),
        ("faceVarying", [(i / 8, i / 4) for i in range(8)]),
    ],
)
@pytest.mark.parametrize("indexed", [False, True])
def test_interpolation(read: Any, kind: str, values: Any, indexed: bool) -> None:
    """Two quads beside each other, with corners 0 1 2 3 and 1 4 5 2."""
    on = made.stage()
    points = [*made.QUAD, (20, 0, 0), (20, 4, 0)]
    index = [0, 1, 2, 3, 1, 4, 5, 2]
    wall = made.mesh(on, points=points, counts=(4, 4), indices=index)
    st = made.coords(wall, values[::-1] if indexed else values, kind)
    if indexed:
        st.SetIndices(list(range(len(values)))[::-1])
    image = made.texture(on, "/World/paint/image", "a.png")
    made.bind(wall, made.material(on, "/World/paint", diffuseColor=made.rgb(image)))
    source = read(on).source
    for face in range(2):
        for corner, point in enumerate(index[4 * face : 4 * face + 4]):
            expected = {
                "constant": values[0],
                "uniform": values[face % len(values)],
                "faceVarying": values[(4 * face + corner) % len(values)],
            }.get(kind, values[point % len(values)])
            here = source.triangles[2 * face : 2 * face + 2] == point
            assert (source.uv[2 * face : 2 * face + 2][here] == expected).all()


@pytest.mark.parametrize(
    ("kind", "values", "index"),
    [
        ("vertex", made.CORNERS[:3] if find_spec("pxr") else [], None),
        ("faceVarying", [(0, 0)], None),
        ("vertex", [(0, 0)], [0, 0, 0, 1]),
        ("vertex", [(0, 0)], [0, 0, 0, -1]),
    ],
)
def test_coordinates_that_do_not_fit(read: Any, kind: str, values: Any, index: Any) -> None:
    on = made.stage()
    wall = made.textured(on, st=values)
    st = UsdGeom.PrimvarsAPI(wall).GetPrimvar("st")
    st.SetInterpolation(kind)
    if index is not None:
        st.SetIndices(index)
    got = read(on)
    assert "st" in got.says("PTM-N214")
    assert not got.source.uv.any()


def test_coordinates_for_fewer_points_than_there_are(read: Any) -> None:
    on = made.stage()
    made.textured(on)
    wall = made.mesh(on, points=[*made.QUAD, *made.QUAD], indices=[4, 5, 6, 7])
    made.coords(wall, made.CORNERS)
    assert "st" in read(on).says("PTM-N214")


def test_other_names_of_coordinates(read: Any) -> None:
    on = made.stage()
    wall = made.mesh(on, st=[(0, 0)] * 4)
    made.coords(wall, made.CORNERS, name="UVMap")
    paint = made.material(on, "/World/paint")
    name = paint.CreateInput("frame:stPrimvarName", Sdf.ValueTypeNames.Token)
    name.Set("UVMap")
    st = made.shader(on, "/World/paint/st", "UsdPrimvarReader_float2")
    st.CreateInput("varname", Sdf.ValueTypeNames.Token).ConnectToSource(name)
    image = made.texture(
        on, "/World/paint/image", "a.png", st=st.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    )
    surface = UsdShade.Shader.Get(on, "/World/paint/surface")
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(made.rgb(image))
    made.bind(wall, paint)
    assert read(on).uv_at(10, 4) == [1, 1]


def test_no_coordinates(read: Any) -> None:
    on = made.stage()
    made.textured(on, st=None)
    got = read(on)
    assert got.count("PTM-N229") == 2
    assert not got.source.uv.any()


def test_a_transformation_of_coordinates_is_baked(read: Any) -> None:
    """in * scale, then rotated counter-clockwise, then + translation."""
    on = made.stage()
    st = made.reader(on, "/World/paint/st", "st")
    move = made.shader(
        on,
        "/World/paint/move",
        "UsdTransform2d",
        in_=st,
        scale=(2, 3),
        rotation=90.0,
        translation=(10, 20),
    )
    made.textured(on, st=made.CORNERS)
    image = UsdShade.Shader.Get(on, "/World/paint/image")
    image.GetInput("st").ConnectToSource(move.CreateOutput("result", Sdf.ValueTypeNames.Float2))
    got = read(on)
    assert got.uv_at(10, 4) == [10 - 3, 20 + 2]
    assert "UsdTransform2d baked" in got.says("PTM-N215")


def test_transformations_of_coordinates_follow_each_other(read: Any) -> None:
    on = made.stage()
    result = made.reader(on, "/World/paint/st", "st")
    for n, inputs in enumerate(({"translation": (1, 2)}, {"scale": (10, 100)})):
        move = made.shader(on, f"/World/paint/m{n}", "UsdTransform2d", in_=result, **inputs)
        result = move.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    made.textured(on)
    UsdShade.Shader.Get(on, "/World/paint/image").GetInput("st").ConnectToSource(result)
    assert read(on).uv_at(10, 4) == [20, 300]


@pytest.mark.parametrize("inputs", [{"scale": (0.5, 0.5, 0.5, 1)}, {"bias": (0.1, 0, 0, 0)}])
def test_scale_and_bias_are_noted(read: Any, inputs: dict[str, Any]) -> None:
    on = made.stage()
    made.textured(on, **inputs)
    assert "scale and bias" in read(on).says("PTM-N215")


def test_scale_and_bias_that_change_nothing(read: Any) -> None:
    on = made.stage()
    made.textured(on, scale=(1, 1, 1, 1), bias=(0, 0, 0, 0))
    assert not read(on).says("PTM-N215")


@pytest.mark.parametrize(("name", "kind"), [("diffuseColor", "String"), ("opacity", "Token")])
def test_values_of_another_type_say_nothing(read: Any, name: str, kind: str) -> None:
    on = made.stage()
    paint = made.material(on, "/World/paint")
    surface = UsdShade.Shader.Get(on, "/World/paint/surface")
    surface.CreateInput(name, getattr(Sdf.ValueTypeNames, kind)).Set("red")
    made.bind(made.mesh(on), paint)
    (material,) = read(on).source.materials
    assert material.color == pytest.approx((0.461356,) * 3, abs=1e-6)
    assert material.opacity == 1


def test_shaders_in_a_circle(read: Any) -> None:
    on = made.stage()
    move = made.shader(on, "/World/paint/move", "UsdTransform2d")
    moved = move.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    move.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(moved)
    made.textured(on, st=made.CORNERS)
    UsdShade.Shader.Get(on, "/World/paint/image").GetInput("st").ConnectToSource(moved)
    assert read(on).count("PTM-N229") == 2


@pytest.mark.parametrize("file", ["brick.<UDIM>.png", ""])
def test_what_is_no_image(read: Any, file: str) -> None:
    on = made.stage()
    made.textured(on, file)
    got = read(on)
    assert not got.images
    assert got.codes == {"PTM-N214" if file else "PTM-N204"}


@pytest.mark.parametrize(
    ("file", "output", "threshold", "see_through"),
    [
        ("brick.png", "a", 0.0, False),
        ("brick.png", "a", 0.5, True),
        ("brick.png", "r", 0.0, True),
        ("mask.png", "r", 0.0, True),
    ],
)
def test_opacity_by_an_image(
    read: Any, file: str, output: str, threshold: float, see_through: bool
) -> None:
    on = made.stage()
    made.textured(on)
    mask = made.texture(on, "/World/paint/mask", file)
    surface = UsdShade.Shader.Get(on, "/World/paint/surface")
    surface.CreateInput("opacity", Sdf.ValueTypeNames.Float).ConnectToSource(
        mask.CreateOutput(output, Sdf.ValueTypeNames.Float)
    )
    surface.CreateInput("opacityThreshold", Sdf.ValueTypeNames.Float).Set(threshold)
    got = read(on)
    assert got.source.materials[0].see_through is see_through
    transparent = "image of opacities" in got.says("PTM-N215")
    assert transparent is (see_through and not threshold)
    assert got.source.materials[0].opacity == 1
    tested = threshold if (file, output) == ("brick.png", "a") else 0
    assert got.source.materials[0].cutoff == (tested or None)


def test_holes_in_an_image(put: Put, tmp_path: Path) -> None:
    """They count where the opacity of the material is the image's alpha, and not otherwise."""
    texels = np.full((8, 8, 4), 255, np.uint8)
    texels[:4, :, 3] = 0  # the upper half
    put("brick.png", png(texels))
    for name, st, connected, transparent in (
        ("upper", made.CORNERS, True, True),
        ("lower", [(0, 0.2), (1, 0.2), (1, 0.3), (0, 0.3)], True, False),
        ("opaque", made.CORNERS, False, False),
    ):
        on = made.stage(tmp_path / f"{name}.usda")
        made.textured(on, st=st)
        if connected:
            alpha = UsdShade.Shader.Get(on, "/World/paint/image")
            UsdShade.Shader.Get(on, "/World/paint/surface").CreateInput(
                "opacity", Sdf.ValueTypeNames.Float
            ).ConnectToSource(alpha.CreateOutput("a", Sdf.ValueTypeNames.Float))
        on.GetRootLayer().Save()
        scene = ingest(tmp_path / f"{name}.usda")
        assert scene.materials[0].transparent is transparent
        with Image.open(io.BytesIO(scene.images[0].load())) as image:
            assert image.mode == ("RGBA" if connected else "RGB")


# -- Displayed colours ----------------------------------------------------------------------------


def test_one_displayed_colour(read: Any) -> None:
    on = made.stage()
    wall = made.mesh(on)
    made.colors(wall, [(0.5, 0, 1)], "constant")
    opacity = UsdGeom.PrimvarsAPI(wall).CreatePrimvar(
        "displayOpacity", Sdf.ValueTypeNames.FloatArray, "constant"
    )
    opacity.Set([0.5])
    source = read(on).source
    assert source.materials[0].color == pytest.approx((0.735357, 0, 1), abs=1e-6)
    assert source.materials[0].opacity == 0.5
    assert source.colors is None


def test_displayed_colours_of_corners(read: Any) -> None:
    on = made.stage()
    made.mesh(on, "/World/plain")
    made.colors(made.mesh(on), [(0.5, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], "vertex")
    bound = made.mesh(on, "/World/bound")
    made.colors(bound, [(1, 0, 0)], "constant")
    made.bind(bound, made.material(on, "/World/paint", diffuseColor=(0, 1, 0)))
    source = read(on).source
    assert source.colors is not None
    at = {
        tuple(p): tuple(c)
        for p, c in zip(
            source.points[source.triangles[2:4]].reshape(-1, 3).tolist(),
            source.colors[2:4].reshape(-1, 3).tolist(),
            strict=True,
        )
    }
    assert at == {
        (0, 0, 0): (188, 0, 0),
        (10, 0, 0): (0, 255, 0),
        (10, 4, 0): (0, 0, 255),
        (0, 4, 0): (255, 255, 255),
    }
    assert (source.colors[[0, 1, 4, 5]] == 255).all()
    colours = [source.materials[i].color for i in source.triangle_material[::2]]
    assert colours == [None, (1, 1, 1), (0, 1, 0)]


def test_displayed_colours_reach_the_scene(tmp_path: Path) -> None:
    on = made.stage(tmp_path / "a.usda")
    made.colors(made.mesh(on), [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], "vertex")
    on.GetRootLayer().Save()
    colors = ingest(tmp_path / "a.usda").colors
    assert colors is not None
    assert colors[0].tolist() == [[255, 0, 0], [0, 255, 0], [0, 0, 255]]


def test_no_displayed_colours(read: Any) -> None:
    on = made.stage()
    made.colors(made.mesh(on), [], "vertex")
    got = read(on)
    assert got.source.materials[0].color is None
    assert not got.codes


def test_inherited_colours(read: Any) -> None:
    on = made.stage()
    made.colors(on.GetPrimAtPath("/World"), [(0, 1, 0)], "constant")
    made.mesh(on)
    assert read(on).source.materials[0].color == (0, 1, 0)


def test_displayed_opacities_that_differ(read: Any) -> None:
    on = made.stage()
    wall = made.mesh(on)
    UsdGeom.PrimvarsAPI(wall).CreatePrimvar(
        "displayOpacity", Sdf.ValueTypeNames.FloatArray, "vertex"
    ).Set([1, 0, 1, 1])
    got = read(on)
    assert got.source.materials[0].see_through
    assert "displayOpacity" in got.says("PTM-N215")


def test_a_material_that_shows_the_colours_of_a_primvar(read: Any) -> None:
    on = made.stage()
    wall = made.mesh(on)
    made.colors(wall, [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)], "vertex", "paint")
    reads = made.shader(on, "/World/m/reads", "UsdPrimvarReader_float3", varname="paint")
    result = reads.CreateOutput("result", Sdf.ValueTypeNames.Float3)
    made.bind(wall, made.material(on, "/World/m", diffuseColor=result))
    colors = read(on).source.colors
    assert colors is not None
    assert colors[0].tolist() == [[255, 0, 0], [0, 255, 0], [0, 0, 255]]


# -- Cameras, names, time -------------------------------------------------------------------------


def test_cameras(read: Any) -> None:
    on = made.stage()
    made.mesh(on)
    eye = UsdGeom.Camera.Define(on, "/World/eyes/left")
    eye.AddTranslateOp().Set((1, 2, 3))
    eye.AddRotateYOp().Set(90)
    eye.CreateVerticalApertureAttr(24)
    eye.CreateFocalLengthAttr(12)
    flat = UsdGeom.Camera.Define(on, "/World/eyes/flat")
    flat.CreateProjectionAttr("orthographic")
    got = read(on)
    (camera,) = got.source.cameras
    assert (camera.name, camera.position) == ("eyes/left", (1, 2, 3))
    assert camera.direction == pytest.approx((-1, 0, 0))
    assert camera.field_of_view == pytest.approx(math.pi / 2)
    assert "flat" in got.says("PTM-N215")


@pytest.mark.parametrize(
    ("path", "default", "name"),
    [
        ("/World/Chair/legs", "/World", "Chair/legs"),
        ("/World/Chair", "/World", "Chair"),
        ("/Chair", "/World", "Chair"),
        ("/Worldly/Chair", "/World", "Worldly/Chair"),
        ("/Chair", "/Chair", "Chair"),
    ],
)
def test_names(read: Any, path: str, default: str, name: str) -> None:
    on = Usd.Stage.CreateInMemory()
    made.mesh(on, path)
    on.SetDefaultPrim(on.OverridePrim(default))
    assert read(on).source.objects == (name,)


def test_the_first_moment_is_shown(read: Any) -> None:
    on = made.stage()
    wall = made.mesh(on)
    move = wall.AddTranslateOp()
    move.Set((5, 0, 0), 10)
    move.Set((99, 0, 0), 20)
    points = wall.GetPointsAttr()
    points.Set([Gf.Vec3f(x, y, 1) for x, y, _ in made.QUAD], 10)
    points.Set([Gf.Vec3f(x, y, 2) for x, y, _ in made.QUAD], 20)
    got = read(on)
    assert got.source.points.min(axis=0).tolist() == [5, 0, 1]
    assert got.count("PTM-N215") == 2


def test_skins_are_shown_in_their_rest_pose(read: Any) -> None:
    on = made.stage()
    UsdSkel.Root.Define(on, "/World/body")
    wall = made.mesh(on, "/World/body/wall")
    binding = UsdSkel.BindingAPI.Apply(wall.GetPrim())
    binding.CreateJointIndicesPrimvar(False, 1).Set([0] * 4)
    binding.CreateBlendShapeTargetsRel()
    got = read(on)
    assert "rest pose" in got.says("PTM-N215")
    assert "blend shapes" in got.says("PTM-N215")


# -- Files ----------------------------------------------------------------------------------------


def chair(path: Path, image: str = "") -> None:
    """A layer with a chair, textured by a path relative to it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    on = made.stage(path, "/Chair")
    seat = made.mesh(on, "/Chair/seat", [(x, y, 9) for x, y, _ in made.QUAD], st=made.CORNERS)
    if image:
        shader = made.texture(on, "/Chair/paint/image", image)
        made.bind(seat, made.material(on, "/Chair/paint", diffuseColor=made.rgb(shader)))
    on.GetRootLayer().Save()


def refers(path: Path, *files: str, payload: bool = False) -> None:
    """A layer that refers to files, and has a wall of its own."""
    path.parent.mkdir(parents=True, exist_ok=True)
    on = made.stage(path)
    made.mesh(on)
    for n, file in enumerate(files):
        prim = UsdGeom.Xform.Define(on, f"/World/it_{n}").GetPrim()
        (prim.GetPayloads().AddPayload if payload else prim.GetReferences().AddReference)(file)
    on.GetRootLayer().Save()


@pytest.mark.parametrize("payload", [False, True])
def test_references_and_their_images(put: Put, tmp_path: Path, payload: bool) -> None:
    put("parts/maps/wood.png", png(noise(1)))
    chair(tmp_path / "parts/chair.usda", "./maps/wood.png")
    refers(tmp_path / "a.usda", "./parts/chair.usda", payload=payload)
    scene = ingest(tmp_path / "a.usda", IngestOptions(strict=True))
    assert scene.objects == ("wall", "it_0/seat")
    assert [image.load() for image in scene.images] == [png(noise(1))]
    assert scene.files == ("parts/chair.usda", "parts/maps/wood.png")


def test_sublayers_and_variants(tmp_path: Path) -> None:
    base = made.stage(tmp_path / "base.usda")
    made.mesh(base)
    base.GetRootLayer().Save()
    on = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    on.GetRootLayer().subLayerPaths.append("./base.usda")
    choice = on.OverridePrim("/World").GetVariantSets().AddVariantSet("chair")
    for name in ("with", "without"):
        choice.AddVariant(name)
        choice.SetVariantSelection(name)
        with choice.GetVariantEditContext():
            made.mesh(on, f"/World/{name}", [(x, y, 9) for x, y, _ in made.QUAD])
    choice.SetVariantSelection("with")
    on.SetDefaultPrim(on.GetPrimAtPath("/World"))
    on.GetRootLayer().Save()
    scene = ingest(tmp_path / "a.usda")
    assert set(scene.objects) == {"wall", "with"}
    assert scene.files == ("base.usda",)


def test_what_is_missing_is_noted(tmp_path: Path) -> None:
    refers(tmp_path / "a.usda", "./none.usda")
    scene = ingest(tmp_path / "a.usda")
    assert [(n.code, n.message, n.place) for n in scene.notes] == [
        ("PTM-N203", "./none.usda: not found", "a.usda")
    ]
    assert scene.files == ("none.usda",)
    with pytest.raises(InputError, match="PTM-I203"):
        ingest(tmp_path / "a.usda", IngestOptions(strict=True))


def test_prims_that_refer_to_themselves_are_noted_alike_each_time(tmp_path: Path) -> None:
    on = made.stage(tmp_path / "a.usda")
    made.mesh(on)
    on.DefinePrim("/World/it").GetReferences().AddInternalReference("/World")
    on.GetRootLayer().Save()
    first, second = (ingest(tmp_path / "a.usda").notes for _ in range(2))
    assert first == second
    assert [note.code for note in first] == ["PTM-N214"]
    assert "\n" not in first[0].message


def test_variants_that_are_not_chosen_may_lack_their_files(tmp_path: Path) -> None:
    on = made.stage(tmp_path / "a.usda")
    made.mesh(on)
    choice = on.GetPrimAtPath("/World").GetVariantSets().AddVariantSet("chair")
    choice.AddVariant("far")
    choice.SetVariantSelection("far")
    with choice.GetVariantEditContext():
        on.OverridePrim("/World/far").GetReferences().AddReference("./none.usda")
    choice.SetVariantSelection("")
    on.GetRootLayer().Save()
    assert ingest(tmp_path / "a.usda").notes == ()


def test_other_faults_of_the_composition_are_noted(tmp_path: Path) -> None:
    chair(tmp_path / "chair.usda")
    on = made.stage(tmp_path / "a.usda")
    made.mesh(on)
    on.DefinePrim("/World/it").GetReferences().AddReference("./chair.usda", "/NoSuch")
    on.GetRootLayer().Save()
    (note,) = ingest(tmp_path / "a.usda").notes
    assert note.code == "PTM-N214"
    assert "/NoSuch" in note.message
    assert str(tmp_path) not in note.message


@pytest.mark.parametrize(
    "how", ["../chair.usda", "absolute", "link.usda", "sublayer", "expression"]
)
def test_layers_outside_are_refused(tmp_path: Path, how: str) -> None:
    chair(tmp_path / "chair.usda")
    name = str(tmp_path / "chair.usda") if how == "absolute" else how
    model = tmp_path / "model/a.usda"
    model.parent.mkdir()
    if how == "link.usda":
        os.symlink(tmp_path / "chair.usda", model.parent / "link.usda")
    if how in ("sublayer", "expression"):
        on = made.stage(model)
        made.mesh(on)
        if how == "sublayer":
            on.GetRootLayer().subLayerPaths.append("../chair.usda")
        else:
            on.DefinePrim("/World/it").GetReferences().AddReference('`"../${NAME}.usda"`')
            on.GetRootLayer().expressionVariables = {"NAME": "chair"}
        on.GetRootLayer().Save()
    else:
        refers(model, name)
    with pytest.raises(
        InputError, match=r"lies outside the model's folder.*--allow-outside.*PTM-I205"
    ):
        ingest(model)
    assert len(ingest(model, IngestOptions(allow_outside=True)).triangles) in (2, 4)


def test_layers_outside_are_refused_before_they_are_opened(put: Put, tmp_path: Path) -> None:
    put("secret.usda", "nothing that the library could read")
    refers(tmp_path / "model/a.usda", "../secret.usda")
    with pytest.raises(InputError, match="PTM-I205"):
        ingest(tmp_path / "model/a.usda")


def test_images_outside_are_not_read(put: Put, tmp_path: Path) -> None:
    put("secret.png", png(noise(1)))
    model = tmp_path / "model/a.usda"
    model.parent.mkdir()
    on = made.stage(model)
    made.textured(on, "../secret.png")
    on.GetRootLayer().Save()
    scene = ingest(model)
    assert "PTM-N205" in {note.code for note in scene.notes}
    assert not scene.images
    assert len(ingest(model, IngestOptions(allow_outside=True)).images) == 1


@pytest.mark.parametrize("name", ["http://localhost:1/a.usda", "omniverse://host/a.usda"])
def test_nothing_is_read_over_a_network(tmp_path: Path, name: str) -> None:
    refers(tmp_path / "a.usda", name)
    assert [note.code for note in ingest(tmp_path / "a.usda").notes] == ["PTM-N203"]


def test_images_in_packages(put: Put, tmp_path: Path) -> None:
    """In the model's own, and in one that it refers to."""
    put("maps/wood.png", png(noise(1)))
    chair(tmp_path / "chair.usda", "./maps/wood.png")
    made.package(tmp_path / "chair.usda", tmp_path / "parts.usdz")
    (tmp_path / "maps/wood.png").unlink()
    (tmp_path / "chair.usda").unlink()
    refers(tmp_path / "a.usda", "./parts.usdz")
    for name in ("a.usda", "parts.usdz"):
        scene = ingest(tmp_path / name)
        assert [image.load() for image in scene.images] == [png(noise(1))]
        assert scene.images[0].name == "wood.png"
    assert ingest(tmp_path / "a.usda").files == ("parts.usdz",)
    texture = (
        read_other(tmp_path / "parts.usdz", Findings(tmp_path / "parts.usdz")).materials[0].texture
    )
    assert texture is not None
    assert isinstance(texture.read, FileRange)


# -- Faults ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.usda", b'#usda 1.0\ndef Xform "W" { nonsense }\n'),
        ("a.usda", b"nothing of the kind"),
        ("a.usdc", b"PXR-USDC" + bytes(200)),
        ("a.usdc", b"nothing of the kind"),
        ("a.usd", b"nothing of the kind"),
        ("a.usdz", b"PK\3\4" + bytes(200)),
        ("a.usdz", b"nothing of the kind"),
    ],
)
def test_files_that_are_none(put: Put, name: str, data: bytes) -> None:
    with pytest.raises(InputError, match=rf"{name}: .*PTM-I254") as caught:
        ingest(put(name, data))
    assert "\n" not in str(caught.value)
    assert "pxrInternal" not in str(caught.value)


def test_a_damaged_layer_is_named(put: Put, tmp_path: Path) -> None:
    put("parts/b.usda", "#usda 1.0\nnonsense")
    refers(tmp_path / "a.usda", "./parts/b.usda")
    with pytest.raises(InputError, match=r"b\.usda: .*PTM-I254"):
        ingest(tmp_path / "a.usda")


@pytest.mark.parametrize("suffix", ["usdc", "usdz"])
def test_damaged_files(put: Put, tmp_path: Path, suffix: str) -> None:
    """Cut short and with other bytes in between: a model, or an error of one line."""
    put("maps/brick.png", png(noise(1)))
    two_rooms(tmp_path / "a.usda").Export(str(tmp_path / "a.usdc"))
    made.package(tmp_path / "a.usdc", tmp_path / "a.usdz")
    whole = (tmp_path / f"a.{suffix}").read_bytes()
    random = np.random.default_rng(7)
    outcomes: list[bool] = []
    messages: list[str] = []
    for n in range(16):
        data = bytearray(whole)
        if n % 2:
            data = data[: int(random.integers(1, len(whole)))]
        else:
            for at in random.integers(0, len(whole), 1 + n):
                data[at] = random.integers(0, 256)
        path = put(f"damaged_{n}.{suffix}", bytes(data))
        try:
            outcomes.append(len(ingest(path).triangles) > 0)
        except PtmError as error:
            outcomes.append(False)
            messages.append(str(error))
    assert messages
    assert not any("\n" in message for message in messages)


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    on = made.stage(tmp_path / "a.usda")
    made.mesh(on)
    on.GetRootLayer().Save()
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingComponentError, match=r"pip install 'ptmtools\[usd\]'.*PTM-M100"):
        ingest(tmp_path / "a.usda")


def test_a_package_becomes_a_database(put: Put, tmp_path: Path) -> None:
    from ptmtools.cli.main import main

    put("maps/brick.png", png(noise(1, 64)))
    two_rooms(tmp_path / "a.usda")
    made.package(tmp_path / "a.usda", tmp_path / "rooms.usdz")
    (tmp_path / "maps/brick.png").unlink()
    db = tmp_path / "rooms.db"
    model = str(tmp_path / "rooms.usdz")
    assert main(["-q", "build-scene", model, "-o", str(db), "-j", "1", "--two-sided"]) == 0
    assert [file.name for file in (db / "www/textures").glob("*.ptm")] == ["brick.ptm"]
    assert main(["-q", "validate", str(db)]) == 0


@pytest.mark.parametrize("outside", [False, True])
def test_clips_are_files_of_the_model(tmp_path: Path, outside: bool) -> None:
    """They are opened when a value is asked for, after the layers have been gone through."""
    folder = tmp_path / "in"
    folder.mkdir()
    where = tmp_path if outside else folder
    points = "[(0, 0, 0), (10, 0, 0), (10, 4, 0), (0, 4, 0)]"
    (where / "clip.usda").write_text(
        f'#usda 1.0\ndef Mesh "wall" {{\n  point3f[] points.timeSamples = {{ 0: {points} }}\n}}\n'
    )
    (where / "manifest.usda").write_text('#usda 1.0\ndef Mesh "wall" {\n  point3f[] points\n}\n')
    up = "../" if outside else "./"
    root = folder / "a.usda"
    root.write_text(
        "#usda 1.0\n"
        'def Mesh "wall" (\n  clips = { dictionary default = {\n'
        f"    asset[] assetPaths = [@{up}clip.usda@]\n"
        f"    asset manifestAssetPath = @{up}manifest.usda@\n"
        '    string primPath = "/wall"\n    double2[] active = [(0, 0)]\n'
        "    double2[] times = [(0, 0)]\n  } }\n) {\n"
        "  int[] faceVertexCounts = [4]\n  int[] faceVertexIndices = [0, 1, 2, 3]\n}\n"
    )
    from ptmtools.scene.usd.source import make_source

    if outside:
        with pytest.raises(InputError, match="PTM-I205"):
            make_source(root, Findings(root), MAX_VERTICES)
        return
    source, _, files = make_source(root, Findings(root), MAX_VERTICES)
    assert len(source.triangles) == 2
    assert {"clip.usda", "manifest.usda"} <= set(files)
