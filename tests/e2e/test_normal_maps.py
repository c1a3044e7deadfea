"""Normal maps of materials in three.js: the package shows them as `ptm render`, and the GLBs are
valid for other viewers."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "e2e"), str(ROOT / "benchmarks")]
from browsers import gltf_validator  # noqa: E402

from benchmarks.npm import GLTF_VALIDATOR  # noqa: E402
from ptmtools.cli.main import main  # noqa: E402
from ptmtools.output.served import read_served  # noqa: E402
from ptmtools.rendering.drawing import ViewOptions, draw_view  # noqa: E402
from tests.scene.bumpy import write_bumpy  # noqa: E402

WIDTH, HEIGHT = 320, 240
#: In the first room, at a wall, and its yaw.
EYE = (-2.1, 1.6, 0.9, 20.0)


@pytest.fixture(scope="module", params=["unlit", "lit"])
def database(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bumpy")
    options = ["--samples", "4", "--format", "gltf", "-j", "1", "--plain-gltf"]
    if request.param == "unlit":
        options += ["--light", "none"]
    else:
        pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")
        options += ["--light", "bake", "--light-density", "4", "--light-samples", "8"]
    options += ["--viewpoint", ",".join(map(str, EYE))]
    model = write_bumpy(folder / "model")
    assert main(["-q", "build-scene", str(model), "-o", str(folder / "db"), *options]) == 0
    return folder / "db"


def test_the_package_shows_them(three: Any, database: Path) -> None:
    served = read_served(database)
    walked = three.walk(database / "www", width=WIDTH, height=HEIGHT)
    assert walked.messages == ()
    with Image.open(io.BytesIO(walked.png)) as image:
        shown = np.asarray(image.convert("RGB")).astype(float)
    expected = draw_view(served, ViewOptions(viewpoint=0, width=WIDTH, height=HEIGHT))
    # Below the ceiling, which has no headlight there, and without the edges of the letter, between
    # the texels of which three.js mixes linear light.
    error = ((shown - expected) ** 2).mean(axis=2)[HEIGHT // 3 :]
    error = error[error <= np.quantile(error, 0.9)]
    assert 10 * np.log10(255**2 / error.mean()) >= 38


def test_the_cells_are_valid(database: Path, require: Any) -> None:
    if remedy := GLTF_VALIDATOR.remedy():
        require("the glTF validator", remedy)
    for name, said in gltf_validator.validate(database / "www" / "gltf").items():
        # Tangents would be further bytes; clients derive them.
        others = [each for each in said.complaints if "GENERATED_TANGENT_SPACE" not in each]
        assert others == [], name
