"""USD: images, their coordinates and wrapping, opacity by an image."""

from __future__ import annotations

import io
import math
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools.scene import IngestOptions, ingest
from tests.scene.conftest import Put, noise, png

if find_spec("pxr") is not None:
    from pxr import Sdf, UsdGeom, UsdShade

    from tests.scene.usd import usd_models as made


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


HALF = np.repeat([[255] * 4 + [0] * 4], 8, axis=0).astype(np.uint8)[..., None].repeat(3, axis=2)


def screen(emitter: dict[str, Any], **surface: Any) -> Any:
    """A wall that emits glow.png; ``emitter``: inputs of the texture."""
    on = made.stage()
    wall = made.mesh(on, st=made.CORNERS)
    image = made.texture(on, "/World/paint/glow", emitter.pop("file", "glow.png"), **emitter)
    inputs = {"emissiveColor": made.rgb(image), **surface}
    made.bind(wall, made.material(on, "/World/paint", **inputs))
    return on


def test_a_dark_surface_shows_the_image_of_its_emission(put: Put) -> None:
    put("glow.png", png(HALF))
    on = screen({"wrapS": "clamp", "scale": (0.5, 2, 4, 1)}, diffuseColor=(0, 0, 0))
    scene = ingest(put("screen.usda", on.GetRootLayer().ExportToString().encode()))
    (material,) = scene.materials
    assert (material.image, material.wrap_s, material.wrap_t) == (0, "clamp", "repeat")
    assert material.color[0] == pytest.approx(0.735, abs=1e-3), "0.5 in sRGB"
    assert scene.images[0].load() == png(HALF)
    assert np.ptp(scene.uv, axis=(0, 1)) == pytest.approx(np.ptp(made.CORNERS, axis=0))
    assert scene.lights.unlit.all()
    assert scene.lights.glow == pytest.approx(np.array([[0.25, 1, 2]]))


def test_other_emissions_of_images_light_by_their_mean(put: Put) -> None:
    put("glow.png", png(HALF))
    put("brick.png", png(noise(1)))
    for number, (emitter, surface, glow) in enumerate(
        (
            ({}, {"diffuseColor": (0.2, 0, 0)}, 0.5),
            ({"file": "gone.png"}, {"diffuseColor": (0, 0, 0)}, 1),
            ({"file": "glow.<UDIM>.png"}, {}, 0),
            ({"scale": (math.inf, 1, 1, 1)}, {"diffuseColor": (1, 1, 1)}, 0.5),
            ({"bias": (0.1, 0, 0, 0)}, {}, 0.5),
        )
    ):
        on = screen(emitter, **surface)
        model = put(f"{number}.usda", on.GetRootLayer().ExportToString().encode())
        scene = ingest(model, IngestOptions(strict=True))
        assert scene.materials[0].image == -1, number
        assert scene.lights.glow == pytest.approx(np.full((1, 3), glow)), number
        assert not scene.lights.unlit.any(), number


def test_coordinates_of_an_emission_are_optional(put: Put) -> None:
    put("glow.png", png(HALF))
    on = screen({}, diffuseColor=(0, 0, 0))
    (wall,) = (prim for prim in on.Traverse() if prim.IsA(UsdGeom.Mesh))
    UsdGeom.PrimvarsAPI(wall).GetPrimvar("st").Set([(0.0, 0.0)])
    model = put("screen.usda", on.GetRootLayer().ExportToString().encode())
    scene = ingest(model, IngestOptions(strict=True))
    assert scene.lights.glow == pytest.approx(np.full((1, 3), 0.5))


def test_an_image_of_colours_and_one_of_emission(put: Put) -> None:
    put("glow.png", png(HALF))
    put("brick.png", png(noise(1)))
    on = made.stage()
    made.textured(on)
    glow = made.texture(on, "/World/paint/glow", "glow.png", st=(0.0, 0.0))
    surface = UsdShade.Shader.Get(on, "/World/paint/surface")
    surface.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(made.rgb(glow))
    scene = ingest(put("both.usda", on.GetRootLayer().ExportToString().encode()))
    assert scene.images[0].load() == png(noise(1))
    assert scene.lights.glow == pytest.approx(np.full((1, 3), 0.5))


def test_shaders_that_emit_no_image(read: Any) -> None:
    on = made.stage()
    source = made.shader(on, "/World/paint/noise", "Noise")
    output = source.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    made.bind(made.mesh(on), made.material(on, "/World/paint", emissiveColor=output))
    got = read(on)
    assert got.source.materials[0].glow == (0, 0, 0)
    assert "emission of Noise ignored" in got.says("PTM-N215")


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
