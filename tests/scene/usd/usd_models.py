"""Small USD models, written with the library."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("pxr")

from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdUtils, Vt

#: A quad of 10 x 4, facing +z, its corners counter-clockwise.
QUAD = [(0, 0, 0), (10, 0, 0), (10, 4, 0), (0, 4, 0)]
CORNERS = [(0, 0), (1, 0), (1, 1), (0, 1)]


def stage(path: Path | str = "", default: str = "/World") -> Usd.Stage:
    """A stage in metres, Y up."""
    made = Usd.Stage.CreateNew(str(path)) if path else Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(made, 1.0)
    UsdGeom.SetStageUpAxis(made, "Y")
    made.SetDefaultPrim(UsdGeom.Xform.Define(made, default).GetPrim())
    return made


def mesh(
    on: Usd.Stage,
    path: str = "/World/wall",
    points: Any = QUAD,
    counts: Any = (4,),
    indices: Any = None,
    st: Any = None,
    interpolation: str = "vertex",
    st_name: str = "st",
) -> UsdGeom.Mesh:
    """A mesh, by default a quad, its scheme none."""
    made = UsdGeom.Mesh.Define(on, path)
    made.CreatePointsAttr([Gf.Vec3f(*p) for p in points])
    made.CreateFaceVertexCountsAttr(list(counts))
    made.CreateFaceVertexIndicesAttr(list(range(len(points)) if indices is None else indices))
    made.CreateSubdivisionSchemeAttr("none")
    if st is not None:
        coords(made, st, interpolation, st_name)
    return made


def coords(of: Any, st: Any, interpolation: str = "vertex", name: str = "st") -> Any:
    primvar = UsdGeom.PrimvarsAPI(of).CreatePrimvar(
        name, Sdf.ValueTypeNames.TexCoord2fArray, interpolation
    )
    primvar.Set(Vt.Vec2fArray([Gf.Vec2f(*each) for each in st]))
    return primvar


def colors(of: Any, values: Any, interpolation: str, name: str = "displayColor") -> Any:
    primvar = UsdGeom.PrimvarsAPI(of).CreatePrimvar(
        name, Sdf.ValueTypeNames.Color3fArray, interpolation
    )
    primvar.Set(Vt.Vec3fArray([Gf.Vec3f(*each) for each in values]))
    return primvar


def box(on: Usd.Stage, path: str, low: Any, high: Any, inwards: bool = False) -> UsdGeom.Mesh:
    """A box of six quads."""
    ends = (low, high)
    points = [(ends[i][0], ends[j][1], ends[k][2]) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    order = [corner for quad in quads for corner in (quad[::-1] if inwards else quad)]
    made = mesh(on, path, points, [4] * 6, order)
    coords(made, CORNERS * 6, "faceVarying")
    return made


def shader(on: Usd.Stage, path: str, kind: str, **inputs: Any) -> UsdShade.Shader:
    """A shader; an input is a value, or a shader's output to connect to."""
    made = UsdShade.Shader.Define(on, path)
    made.CreateIdAttr(kind)
    types = {
        "diffuseColor": "Color3f",
        "emissiveColor": "Color3f",
        "metallic": "Float",
        "roughness": "Float",
        "useSpecularWorkflow": "Int",
        "opacity": "Float",
        "opacityThreshold": "Float",
        "file": "Asset",
        "wrapS": "Token",
        "wrapT": "Token",
        "st": "Float2",
        "in": "Float2",
        "varname": "String",
        "rotation": "Float",
        "translation": "Float2",
        "scale": "Float2" if kind == "UsdTransform2d" else "Float4",
        "bias": "Float4",
    }
    for name, value in inputs.items():
        made_input = made.CreateInput(
            name.removesuffix("_"), getattr(Sdf.ValueTypeNames, types[name.removesuffix("_")])
        )
        if isinstance(value, UsdShade.Output | UsdShade.Input):
            made_input.ConnectToSource(value)
        else:
            made_input.Set(value)
    return made


def material(on: Usd.Stage, path: str, **inputs: Any) -> UsdShade.Material:
    """A material of UsdPreviewSurface with these inputs."""
    made = UsdShade.Material.Define(on, path)
    surface = shader(on, f"{path}/surface", "UsdPreviewSurface", **inputs)
    output = surface.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    made.CreateSurfaceOutput().ConnectToSource(output)
    return made


def texture(on: Usd.Stage, path: str, file: str, **inputs: Any) -> UsdShade.Shader:
    """A UsdUVTexture that repeats, with the primvar st, unless said otherwise."""
    given: dict[str, Any] = {"wrapS": "repeat", "wrapT": "repeat", **inputs}
    if "st" not in given:
        given["st"] = reader(on, f"{path}_st", "st")
    return shader(on, path, "UsdUVTexture", file=Sdf.AssetPath(file), **given)


def reader(on: Usd.Stage, path: str, name: Any) -> UsdShade.Output:
    made = shader(on, path, "UsdPrimvarReader_float2", varname=name)
    return made.CreateOutput("result", Sdf.ValueTypeNames.Float2)


def rgb(of: UsdShade.Shader) -> UsdShade.Output:
    return of.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)


def bind(prim: Any, to: UsdShade.Material, **more: Any) -> None:
    prim = prim.GetPrim()
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(to, **more)


def textured(
    on: Usd.Stage, file: str = "brick.png", st: Any = CORNERS, **inputs: Any
) -> UsdGeom.Mesh:
    """A quad with an image."""
    quad = mesh(on, st=st)
    image = texture(on, "/World/paint/image", file, **inputs)
    bind(quad, material(on, "/World/paint", diffuseColor=rgb(image)))
    return quad


def package(root: Path, to: Path) -> Path:
    """A .usdz of a layer and all that it names."""
    assert UsdUtils.CreateNewUsdzPackage(str(root), str(to))
    return to


def two_rooms(path: Path) -> Any:
    """Two rooms of 6 x 3 x 5 m with an opening between them, textured."""
    on = stage(path)
    quad = [(0, 0, 0), (0, 0, 5), (6, 0, 5), (6, 0, 0)]
    up = [(x, 3, z) for x, _, z in quad]
    image = texture(on, "/World/paint/image", "./maps/brick.png")
    paint = material(on, "/World/paint", diffuseColor=rgb(image))
    for n in range(2):
        below = f"/World/room_{n}"
        at = UsdGeom.Xform.Define(on, below)
        at.AddTranslateOp().Set((6.0 * n, 0, 0))
        mesh(on, f"{below}/floor", quad, st=CORNERS)
        mesh(on, f"{below}/ceiling", up[::-1], st=CORNERS)
        for name, a, b in (("front", 0, 1), ("back", 2, 3), ("side", 1, 2), ("other", 3, 0)):
            if (n, name) in ((0, "back"), (1, "front")):
                continue
            mesh(on, f"{below}/{name}", [quad[a], up[a], up[b], quad[b]], st=CORNERS)
    # Between the two, with an opening in its middle.
    wall = [(6, 0, 0), (6, 3, 0), (6, 3, 2), (6, 0, 2)]
    half = [(6, 0, 3), (6, 3, 3), (6, 3, 5), (6, 0, 5)]
    for name, points in (("wall_a", wall), ("wall_b", half)):
        mesh(on, f"/World/{name}", points, st=CORNERS).CreateDoubleSidedAttr(True)
    bind(on.GetPrimAtPath("/World"), paint)
    on.GetRootLayer().Save()
    return on
