"""`--format`: the Khronos validator finds no fault; the files go when not asked for."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchmarks.npm import GLTF_VALIDATOR
from ptmtools.cli.main import main
from ptmtools.output.gltf import unpack
from ptmtools.site.conversion import lean_glb
from tests.light.glowing import write_lit_room
from tests.output.agreement import disagreements

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "e2e")]
from browsers import gltf_validator  # noqa: E402

#: What the validator remarks of every image that is referred to, and of compressed views, which it
#: does not read.
REMARKS = {"URI_GLB"}
COMPRESSED = {"UNSUPPORTED_EXTENSION", "UNUSED_OBJECT", "BUFFER_VIEW_TARGET_MISSING"}


@pytest.fixture(scope="module")
def khronos(require: Callable[[str, str], None]) -> Any:
    if remedy := GLTF_VALIDATOR.remedy():
        require("the glTF validator", remedy)
    return gltf_validator


def clean(khronos: Any, database: Path, remarks: set[str]) -> int:
    """The triangles of all GLBs, once they are known to be without errors and warnings."""
    www = database / "www"
    actual = khronos.validate(www / "gltf")
    hints = json.loads((www / "hints.json").read_text())
    cells, textures = hints["cells"], hints["textures"]
    assert sorted(actual) == sorted(f"{cell['name']}.glb" for cell in cells)
    for name, file in actual.items():
        # The validator knows no AVIF, of which lightmaps are.
        images = unpack((www / "gltf" / name).read_bytes())[0].get("images", ())
        lossy = [n for n, image in enumerate(images) if image["uri"].endswith(".avif")]
        unknown = tuple(f"IMAGE_UNRECOGNIZED_FORMAT /images/{n}:" for n in lossy)
        assert [k for k in file.complaints if not k.startswith(unknown)] == []
    assert set().union(*(file.remarks for file in actual.values())) <= remarks
    for cell in cells:  # every image was fetched; probes are none of the GLBs'
        record = json.loads((www / f"hints/{cell['name']}.json").read_text())
        file = actual[f"{cell['name']}.glb"]
        images = [place for place in record["textures"][0] if "probe" not in textures[place]]
        assert file.images + len(file.complaints) >= len(images)
    return sum(file.triangles for file in actual.values())


def counts(database: Path) -> dict[str, int]:
    """The figures of the last stage."""
    manifest = json.loads((database / "manifest.json").read_text())
    return dict(manifest["stages"]["emit"]["counts"])


def test_two_rooms(khronos: Any, database: Path, ptm: Any) -> None:
    www = database / "www"
    before = {p: p.read_bytes() for p in www.rglob("*") if p.is_file()}
    both = REMARKS | COMPRESSED
    assert clean(khronos, database, both) == counts(database)["triangles"] > 0
    assert ptm("validate", database).status == 0
    assert disagreements(www) == []
    for format, folder, others in (("vrml", "gltf", "cells"), ("gltf", "cells", "gltf")):
        assert ptm("emit", database, "--format", format).status == 0
        assert not (www / folder).exists()
        for path in (www / others).iterdir():
            assert path.read_bytes() == before[path], "the same as with both"
        assert ptm("validate", database).status == 0
    assert not (www / "root.wrl").exists()
    assert ptm("emit", database).status == 0
    assert {p: p.read_bytes() for p in www.rglob("*") if p.is_file()} == before


def test_lit_rooms(khronos: Any, ptm: Any, tmp_path: Path) -> None:
    """glTF has no second coordinates without first ones: those of a surface with a lightmap alone
    are unused, and cost an entry of the JSON, but no bytes of the buffer."""
    pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")
    model, db = ROOT / "sample_data/two_rooms/two_rooms.obj", tmp_path / "db"
    light = ["--light", "bake", "--light-samples", "4", "--light-density", "4"]
    assert ptm("build-scene", model, "-o", db, "--plain-gltf", *light).status == 0
    remarks = REMARKS | {"UNUSED_OBJECT", "IMAGE_NPOT_DIMENSIONS", "UNSUPPORTED_EXTENSION"}
    assert clean(khronos, db, remarks) == counts(db)["triangles"] > 0
    shared = 0
    for file in (db / "www/gltf").iterdir():
        document = unpack(file.read_bytes())[0]
        for mesh in document["meshes"]:
            for shape in mesh["primitives"]:
                material, place = document["materials"][shape["material"]], shape["attributes"]
                assert "occlusionTexture" in material
                alike = place["TEXCOORD_0"] == place["TEXCOORD_1"]
                assert alike is ("baseColorTexture" not in material["pbrMetallicRoughness"])
                shared += alike
    assert shared > 0


@pytest.mark.parametrize("form", ["--plain-gltf", "--gltf-step=0.001"])
def test_curved_surfaces_that_reflect(khronos: Any, ptm: Any, tmp_path: Path, form: str) -> None:
    """Normals are bytes; the validator knows the extension that these need."""
    pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")
    brass = {"roughnessFactor": 0.3, "metallicFactor": 1}
    model = write_lit_room(tmp_path, ball=2, occlusionTexture=None, pbrMetallicRoughness=brass)
    quick = ["--light-samples=4", "--light-density=4", "--samples=2", "--face=16"]
    assert ptm("build-scene", model, "-o", tmp_path / "db", form, *quick).status == 0
    remarks = REMARKS | COMPRESSED | {"IMAGE_NPOT_DIMENSIONS"}
    assert clean(khronos, tmp_path / "db", remarks) > 0
    (file,) = (tmp_path / "db/www/gltf").iterdir()
    document = unpack(file.read_bytes())[0]
    shapes = [shape for mesh in document["meshes"] for shape in mesh["primitives"]]
    (place,) = {
        shape["attributes"]["NORMAL"] for shape in shapes if "NORMAL" in shape["attributes"]
    }
    accessor = document["accessors"][place]
    assert (accessor["componentType"], accessor["normalized"]) == (5120, True)


def test_museum(khronos: Any, gltf_museum: Path) -> None:
    both = REMARKS | COMPRESSED
    assert clean(khronos, gltf_museum, both) == counts(gltf_museum)["triangles"]


def test_published_cells(khronos: Any, gltf_museum: Path, tmp_path: Path) -> None:
    """Without names and images they are still glTF, for other clients of a site."""
    for file in (gltf_museum / "www/gltf").iterdir():
        (tmp_path / file.name).write_bytes(lean_glb(file.read_bytes()))
    actual = khronos.validate(tmp_path)
    assert {name: file.complaints for name, file in actual.items() if file.complaints} == {}
    assert set().union(*(file.remarks for file in actual.values())) <= COMPRESSED
    assert sum(file.triangles for file in actual.values()) == counts(gltf_museum)["triangles"]


def test_hospital(khronos: Any, shared: Path, tmp_path: Path) -> None:
    model, db = shared / "scenes/hospital/hospital.obj", tmp_path / "db"
    quick = ["--cells", "leaf", "--samples", "2", "--face", "16", "--plain-gltf"]
    # The sides of lightmaps are no powers of two.
    quick += ["--light", "none"]
    assert main(["-q", "build-scene", str(model), "-o", str(db), *quick]) == 0
    assert clean(khronos, db, REMARKS) == counts(db)["triangles"] > 10_000


def test_the_validator_complains(khronos: Any, database: Path, ptm: Any, tmp_path: Path) -> None:
    """Of a texture that is not there, of a number changed, of half a file."""
    assert ptm("emit", database, "--plain-gltf").status == 0
    www = Path(shutil.copytree(database / "www", tmp_path / "www"))
    good = khronos.validate(www / "gltf")
    textured = next(name for name, file in good.items() if file.images)
    data = (www / "gltf" / textured).read_bytes()
    for texture in (www / "textures").glob("*.png"):
        texture.unlink()
    assert "IO_ERROR" in khronos.validate(www / "gltf")[textured].complaints[0]
    (www / "gltf" / textured).write_bytes(data.replace(b'"max":[', b'"max":[1', 1))
    assert khronos.validate(www / "gltf")[textured].complaints
    (www / "gltf" / textured).write_bytes(data[: len(data) // 2])
    assert khronos.validate(www / "gltf")[textured].complaints
