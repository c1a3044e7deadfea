"""USD: files that a stage refers to, and those that it must not."""

from __future__ import annotations

import os
from importlib.util import find_spec
from pathlib import Path

import pytest

from ptmtools.errors import InputError
from ptmtools.scene import IngestOptions, ingest
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.options import MAX_VERTICES
from ptmtools.scene.source import FileRange
from tests.scene.conftest import Put, noise, png, read_source

if find_spec("pxr") is not None:
    from pxr import Usd, UsdGeom

    from tests.scene.usd import usd_models as made


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
    texture = read_source(tmp_path / "parts.usdz").materials[0].texture
    assert texture is not None
    assert isinstance(texture.read, FileRange)


def test_a_damaged_layer_is_named(put: Put, tmp_path: Path) -> None:
    put("parts/b.usda", "#usda 1.0\nnonsense")
    refers(tmp_path / "a.usda", "./parts/b.usda")
    with pytest.raises(InputError, match=r"b\.usda: .*PTM-I254"):
        ingest(tmp_path / "a.usda")


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
            make_source(root, IngestNotes(root), MAX_VERTICES)
        return
    source, _, files = make_source(root, IngestNotes(root), MAX_VERTICES)
    assert len(source.triangles) == 2
    assert {"clip.usda", "manifest.usda"} <= set(files)
