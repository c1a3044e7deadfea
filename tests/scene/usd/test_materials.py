"""USD: materials, their bindings, and displayed colours."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from ptmtools.scene import ingest

if find_spec("pxr") is not None:
    from pxr import Sdf, Usd, UsdGeom, UsdShade

    from tests.scene.usd import usd_models as made


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


def test_emission_has_a_colour(read: Any) -> None:
    on = made.stage()
    glow = (0.5, 0.25, -1)
    made.bind(made.mesh(on), made.material(on, "/World/paint", emissiveColor=glow))
    (material,) = read(on).source.materials
    assert material.glow == (0.5, 0.25, 0)


@pytest.mark.parametrize(
    ("inputs", "matter"),
    [
        ({}, (0, 0.5)),
        ({"metallic": 1.0, "roughness": 0.25}, (1, 0.25)),
        ({"metallic": 1.0, "useSpecularWorkflow": 1}, (0, 0.5)),
        ({"metallic": float("nan"), "roughness": 7.0}, (0, 7)),  # clipped later
    ],
)
def test_metallic_and_roughness(
    read: Any, inputs: dict[str, float], matter: tuple[float, float]
) -> None:
    on = made.stage()
    made.bind(made.mesh(on), made.material(on, "/World/paint", **inputs))
    (material,) = read(on).source.materials
    assert (material.metallic, material.roughness) == matter


def test_an_image_of_roughness_is_noted(read: Any) -> None:
    on = made.stage()
    image = made.shader(on, "/World/paint/rough", "UsdUVTexture", file="rough.png")
    output = image.CreateOutput("r", Sdf.ValueTypeNames.Float)
    made.bind(made.mesh(on), made.material(on, "/World/paint", roughness=output))
    result = read(on)
    assert result.source.materials[0].roughness == 0.5
    assert "image of roughness ignored" in result.says("PTM-N215")


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
