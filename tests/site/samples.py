"""Sites that several tests look at: each is made once in a run."""

from __future__ import annotations

import json
import re
import wave
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from ptmtools_samples.campus.model import make_campus as make_street
from ptmtools_samples.files import write
from ptmtools_samples.options import StreetOptions

from ptmtools.cli.main import main
from ptmtools.scene.options import IngestOptions
from ptmtools_systems.campus import CampusOptions, make_campus
from tests.builds import once
from tests.systems.apo.meshes import ply, sphere

ROOT = Path(__file__).resolve().parents[2]
PIXEL = "data:image/gif;base64,R0lGODlhAQABAIAAAP8AAP///yH5BAAAAAAALAAAAAABAAEAAAICRAEAOw=="
#: A record that tries to run scripts, to send requests and to leave.
HOSTILE = f"""</iframe></header><script>top.broken = 1; parent.broken = 1</script>
<!doctype html><html onclick="top.broken = 1"><head>
<meta http-equiv="refresh" content="0; url=/refreshed"></head><body onload="top.broken = 1">
<h1>Medicine</h1><p id="kept" style="color: red">12 laboratories</p><img id="inline" src="{PIXEL}">
<img src="x" onerror="parent.broken = 1"><img src="/image.png">
<link rel="stylesheet" href="/style.css">
<svg onload="parent.broken = 1"><script>parent.broken = 1</script></svg>
<iframe src="/frame" srcdoc="<script>top.broken = 1</script>"></iframe>
<object data="/object"></object><embed src="/embed"><video src="/video.mp4" autoplay></video>
<form action="/form" target="_top"><button id="send">Send</button></form>
<a id="script" href="javascript:top.broken=1" target="_top">run</a>
<a id="leave" href="/left" target="_top">leave</a>
<a id="open" href="/popped" target="_blank">open</a>
"""
#: Of the OBJ of a street: further trees and furniture, and mouldings and window frames,
#: which are eight of nine faces of buildings.
SURPLUS = re.compile(
    r"^o (?:hedge|bench|tree_00[4-8]).*\n(?:(?!o ).*\n)*"
    r"|^usemtl (?:stone_trim|paint_white)\n(?:(?![ou]).*\n)*",
    re.MULTILINE,
)


@pytest.fixture(scope="session")
def statue(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ball with relief, of nine levels."""

    def make(folder: Path) -> None:
        mesh = ply(folder / "ball.ply", *sphere(6, 0.1))
        options = ["--faces", "800", "--depth", "9", "--error", "0.01"]
        assert main(["-q", "apo", str(mesh), "-o", str(folder / "ball.apo"), *options]) == 0

    return once(tmp_path_factory, "statue", make) / "ball.apo"


@pytest.fixture(scope="session")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Interlaced images of every container and kind, by their names."""
    folder = tmp_path_factory.mktemp("sets")
    random = np.random.default_rng(7)
    waves = np.sin(np.arange(256) / 9)
    smooth = (waves[:, None, None] * waves[None, :, None] * [90, 70, 50] + 120).astype(np.uint8)
    images = {
        "grey": random.integers(0, 256, (128, 256), np.uint8),
        "rgb": smooth,
        "rgba": random.integers(0, 256, (256, 128, 4), np.uint8),
        "deep": random.integers(0, 65536, (64, 64), np.uint16),
    }
    sets = {}
    for name, texels in images.items():
        Image.fromarray(texels).save(folder / f"{name}.png")
        for container in ("png", "webp") if name != "deep" else ("png",):
            sets[f"{name}-{container}"] = target = folder / f"{name}-{container}"
            command = ["interlace", str(folder / f"{name}.png"), "-o", str(target), "--min", "32"]
            assert main(["-q", *command, "--format", container]) == 0
    return sets


def write_tour(folder: Path) -> str:
    """A tour of two languages for the two rooms, with a sound and its captions; its file."""
    with wave.open(str(folder / "night.wav"), "wb") as sound:
        sound.setparams((1, 1, 8000, 0, "NONE", ""))
        sound.writeframes(bytes([128]) * 8000)
    (folder / "night.vtt").write_text("WEBVTT\n\n00:00.000 --> 00:01.000\nSilence.\n")
    label = {
        "id": "night",
        "at": [1, 1.5, 1],
        "title": {"en": "Night", "de": "Nacht"},
        "sound": "night.wav",
        "captions": "night.vtt",
    }
    document = {"format": "ptmtools tour", "schema": 1, "model": "two_rooms.obj"}
    text = json.dumps(document | {"languages": ["en", "de"], "labels": [label], "stops": []})
    (folder / "tour.json").write_text(text)
    return str(folder / "tour.json")


@pytest.fixture(scope="session")
def campus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short street with two buildings, trees and lamps; the buildings have records. Each object
    has lightmaps of up to 2048 × 2048 texels: there are few."""
    return once(tmp_path_factory, "campus", _make_campus) / "campus"


def _make_campus(folder: Path) -> None:
    write(folder / "model", list(make_street(StreetOptions(2, 60, texture=32))), force=False)
    model = folder / "model/campus.obj"
    without = re.compile("^f .*\n", re.MULTILINE)
    model.write_text(SURPLUS.sub(lambda part: without.sub("", part[0]), model.read_text()))
    (folder / "records").mkdir()
    (folder / "records/building_01_rectorate.html").write_text("<p>Built in 1903</p>")
    (folder / "records/building_02_medicine.html").write_text(HOSTILE)
    # Without a far reach most texels have the light of their neighbours, and need no rays.
    options = CampusOptions(samples=4, reach=0.1, faces=50)
    reading, records = IngestOptions(unit="m"), folder / "records"
    make_campus(model, folder / "campus", options, reading, records=records)
