"""The probes of a database: which cells and surfaces have one, whatever options of textures say."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from ptmtools.coverage.options import AchOptions
from ptmtools.light.options import LightOptions
from ptmtools.output.gltf_reader import read_glb
from ptmtools.output.options import EmitOptions
from ptmtools.output.served import Served, read_served
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.encoding import TextureOptions
from ptmtools.pipeline.stages import LIGHT
from ptmtools.pipeline.status import database_status
from ptmtools.pipeline.validation import validate
from ptmtools.pipeline.warm_up import write_building
from ptmtools.rendering.drawing import ViewOptions, draw_view

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")

QUICK = AchOptions(samples=1, face=16, backend="embree")
BAKE = LightOptions("bake", light_samples=4, light_density=2.0)
#: The walls of the building, which reflect, and a pane in it.
PANE = "newmtl pane\nd 0.3\nKd 0.8 0.9 1\n"
STANDING = "o pane\nusemtl pane\nv 2.2 1 1.5\nv 2.8 1 1.5\nv 2.8 2 1.5\nf -3 -2 -1\n"


def model_of(folder: Path) -> Path:
    folder.mkdir()
    model = write_building(folder)
    with (folder / "building.mtl").open("a") as materials:
        materials.write(PANE)
    with model.open("a") as faces:
        faces.write(STANDING)
    return model


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return model_of(tmp_path_factory.mktemp("probes") / "model")


def build(model: Path, db: Path, *options: Any, workers: int = 1) -> Served:
    build_scene(model, db, QUICK, BAKE, EmitOptions(format="gltf"), *options, workers=workers)
    assert not validate(db).errors
    return read_served(db)


def probe_rows(served: Served) -> dict[int, dict[str, Any]]:
    rows = enumerate(served.index["textures"])
    return {number: dict(row["probe"]) for number, row in rows if "probe" in row}


@pytest.fixture(scope="module")
def served(model: Path, tmp_path_factory: pytest.TempPathFactory) -> Served:
    return build(model, tmp_path_factory.mktemp("built") / "a.db")


def test_cells_whose_surfaces_reflect_have_a_probe(served: Served) -> None:
    rows = probe_rows(served)
    seen = set()
    for cell, name in enumerate(row["name"] for row in served.index["cells"]):
        read = read_glb((served.folder / f"gltf/{name}.glb").read_bytes())
        for primitive in read.primitives:
            probe = primitive.material.probe
            assert probe is not None
            assert rows[probe]["cell"] == cell
            pane = primitive.material.white is None
            assert primitive.material.roughness == (0 if pane else 0.3)
            seen.add(pane)
    assert seen == {False, True}
    (counts,) = (
        k.counts for k in database_status(served.folder.parent).stages if k.stage == "light"
    )
    assert counts["probes"] == len(rows)
    assert "probes" in LIGHT.summarize(counts)


def test_need_lists_probes_after_lightmaps(served: Served) -> None:
    rows = probe_rows(served)
    for record in served.records:
        need = {place: share for place, _, share, *_ in record["need"] if place in rows}
        assert need
        lights = [
            share
            for place, _, share, *_ in record["need"]
            if "light" in served.index["textures"][place]
        ]
        assert max(need.values()) < max(lights)


@pytest.mark.parametrize("levels", [{"max_side": 64}, {"min_side": 128}])
def test_levels_of_textures_do_not_concern_probes(
    model: Path, served: Served, tmp_path: Path, levels: dict[str, int]
) -> None:
    """Not even where images have no level as small as a probe looks up."""
    other = build(model, tmp_path / "a.db", TextureOptions(**levels))
    assert probe_rows(other).keys()
    assert len(probe_rows(other)) == len(probe_rows(served))
    assert draw_view(other, ViewOptions(width=16, height=9)).any()


def test_any_number_of_workers_gives_the_same_probes(
    model: Path, served: Served, tmp_path: Path
) -> None:
    other = build(model, tmp_path / "a.db", workers=2)
    for file in (served.folder / "textures").glob("probe~*"):
        assert (other.folder / "textures" / file.name).read_bytes() == file.read_bytes()
    assert json.dumps(probe_rows(other)) == json.dumps(probe_rows(served))


def test_reflections_show(served: Served) -> None:
    view = ViewOptions(width=64, height=36)
    matt = replace(served, surfaces=replace(served.surfaces, gloss=None))
    apart = draw_view(served, view).astype(float) - draw_view(matt, view)
    assert abs(apart).mean() > 1
