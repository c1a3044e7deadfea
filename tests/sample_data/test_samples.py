"""The table of samples: `ptm sample` offers each, and each writes files, a model last."""

from __future__ import annotations

import inspect
import json
from pathlib import Path

import pytest
from ptmtools_samples.files import MODELS
from ptmtools_samples.samples import SAMPLES

from ptmtools.cli.main import main

#: Options of samples whose geometry is made before the first file.
FEW = {
    "campus": {"buildings": 1, "length": 50, "texture": 8},
    "museum": {"rooms": 1, "textures": 3},
}


@pytest.mark.parametrize("name", SAMPLES)
def test_each_sample_makes_files_with_a_model_last(name: str) -> None:
    options = SAMPLES[name].options(**FEW.get(name, {}))
    files = list(SAMPLES[name].make.load()(options, lambda text: None))
    assert files[-1][0].endswith(MODELS)
    assert len({file for file, _ in files}) == len(files)
    assert all(not inspect.signature(load).parameters for _, load in files)


def test_help_names_each_sample(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sample", "--help"]) == 0
    shown = capsys.readouterr().out
    assert all(name in shown and entry.about in shown for name, entry in SAMPLES.items())


def test_the_folder_is_named_after_the_sample(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["sample", "two-rooms", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["model"] == str(Path("two_rooms/two_rooms.obj"))
    assert report["files"] == len(list((tmp_path / "two_rooms").iterdir()))


def test_one_sample_has_no_options_of_another(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sample", "two-rooms", "-o", str(tmp_path), "--rooms", "3"]) == 2
    assert "--rooms" in capsys.readouterr().err


def test_a_web_gallery_is_written_over_itself(tmp_path: Path) -> None:
    (tmp_path / "web_gallery.glb").write_bytes(b"glTF ptmtools sample gallery")
    words = ["--rooms", "1", "--paintings", "1", "--scale", "0.02", "--statue-triangles", "400"]
    assert main(["sample", "web-gallery", "-o", str(tmp_path), *words]) == 0
