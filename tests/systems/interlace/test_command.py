"""`ptm interlace` and `ptm deinterlace` as a user runs them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools import schemas
from ptmtools.cli.main import main
from ptmtools.texture import Description, load_image, write_image
from ptmtools_systems.schemas import INTERLACE
from tests.conftest import files_below
from tests.systems.interlace.folders import image


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    write_image("wall.png", image(64, 128))
    return tmp_path


def test_there_and_back(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["interlace", "wall.png", "-o", "wall", "--min", "16"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("wall: 128 x 64, 5 files, ")
    assert "of wall.png" in out
    assert "first file 32 x 16, " in out
    assert len(out.splitlines()) == 1
    assert sorted(files_below(here / "wall")) == [*(f"{n}.png" for n in range(1, 6))] + [
        "interlace.json"
    ]
    assert main(["deinterlace", "wall", "-o", "back.png"]) == 0
    assert capsys.readouterr().out == "back.png: 128 x 64, 3 components, 5 of 5 files\n"
    np.testing.assert_array_equal(load_image("back.png").array(), image(64, 128))
    assert main(["deinterlace", "wall", "--step", "2", "-o", "step.npy"]) == 0
    np.testing.assert_array_equal(np.load("step.npy"), image(64, 128)[::4, ::2])
    assert main(["validate", "--strict", "wall"]) == 0


def test_beside_the_folder(here: Path) -> None:
    write_image("deep.png", image(32, 32, 4, "uint16"))
    assert main(["-q", "interlace", "deep.png", "-o", "sub.d"]) == 0
    assert main(["-q", "deinterlace", "sub.d/"]) == 0
    np.testing.assert_array_equal(load_image("sub.d.png").array(), image(32, 32, 4, "uint16"))


def test_scaled(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_image("odd.png", image(50, 100), Description(gamma=100_000, orientation=3))
    assert main(["interlace", "odd.png", "-o", "odd", "--min", "16"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line[:9] for line in lines[1:]] == ["  turned ", "  the fil", "  scaled "]
    assert "scaled from 100 x 50 to 128 x 64" in lines[3]
    assert main(["deinterlace", "odd", "-o", "x.png"]) == 0
    assert "had 100 x 50 texels" in capsys.readouterr().out.splitlines()[1]


def test_json(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["interlace", "wall.png", "-o", "wall", "--format", "webp", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    schemas.check(report["manifest"], INTERLACE)
    assert report["manifest"] == json.loads(Path("wall/interlace.json").read_text())
    assert report["image_bytes"] == Path("wall.png").stat().st_size
    assert report["notes"] == []
    assert main(["info", "wall", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == report["manifest"]


def test_info(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["-q", "interlace", "wall.png", "-o", "wall", "--min", "16"]) == 0
    assert main(["info", "wall"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "wall: interlaced image"
    assert lines[1].startswith("128 x 64, 3 components of uint8, lossless, 5 files, ")
    assert [line.split()[0] for line in lines[3:]] == [f"{n}.png" for n in range(1, 6)]
    assert [line.split()[4] for line in lines[4:]] == ["columns", "rows", "columns", "rows"]


@pytest.mark.parametrize("size", [(16, 32), (20, 32)])
@pytest.mark.parametrize("suffix", ["npy", "flat.npy", "ppm", "gif", "tif", "jpg"])
def test_every_way_that_images_come(here: Path, size: tuple[int, int], suffix: str) -> None:
    name, (height, width) = f"x.{suffix}", size
    deep, shallow = image(*size, 3, "uint16"), image(*size)
    if suffix == "flat.npy":
        np.save(name, shallow[:, :, 0])
    elif suffix == "ppm":  # mapped, in the other byte order
        head = f"P6 {width} {height} 65535\n".encode()
        Path(name).write_bytes(head + deep.astype(">u2").tobytes())
    elif suffix in ("npy", "tif"):
        write_image(name, shallow)
    else:
        Image.fromarray(shallow).save(name)
    assert main(["-q", "interlace", name, "-o", "made", "--min", "4"]) == 0
    assert main(["-q", "deinterlace", "made", "-o", "back.png"]) == 0
    assert main(["-q", "validate", "--strict", "made"]) == 0
    back, was = load_image("back.png").array(), load_image(name).array()
    assert back.shape == (16, *was.shape[1:])
    if height == 16:
        np.testing.assert_array_equal(back, was)


@pytest.mark.parametrize(
    ("words", "status", "code"),
    [
        ("interlace absent.png -o x", 3, "PTM-I120"),
        ("interlace notes.txt -o x", 3, "PTM-I125"),
        ("interlace wall.png -o x --min 0", 3, "PTM-I111"),
        ("interlace wall.png -o x --format jpg --quality 101", 3, "PTM-I111"),
        ("interlace wall.png -o x --format gif", 2, "PTM-U001"),
        ("interlace wall.png", 2, "PTM-U001"),
        ("interlace deep.png -o x --format jpg", 3, "PTM-I126"),
        ("interlace deep.png -o x --format webp", 3, "PTM-I126"),
        ("interlace float.npy -o x", 3, "PTM-I126"),
        ("interlace long.npy -o x --format webp", 7, "PTM-L400"),
        ("interlace long.npy -o x --format jpg", 7, "PTM-L400"),
        ("interlace wide.npy -o x --limit 1", 7, "PTM-L104"),
        ("interlace wall.png -o notes.txt", 4, "PTM-O010"),
        ("interlace wall.png -o full --force", 4, "PTM-O010"),
        ("interlace wall.png -o absent/x", 4, "PTM-O002"),
        ("interlace wall.png -o made", 4, "PTM-O001"),
        ("interlace wall.png -o more --force", 4, "PTM-O010"),
        ("deinterlace made -o wall.png", 4, "PTM-O001"),
        ("deinterlace made -o x.jpg", 4, "PTM-O101"),
        ("deinterlace made -o x.exr", 4, "PTM-O101"),
        ("deinterlace made -o absent/x.png", 4, "PTM-O002"),
        ("deinterlace full", 3, "PTM-I120"),
        ("deinterlace made --step x", 2, "PTM-U001"),
    ],
)
def test_one_line_for_what_cannot_be(
    here: Path, words: str, status: int, code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("notes.txt").write_text("no image")
    write_image("deep.png", image(8, 8, 3, "uint16"))
    np.save("float.npy", np.zeros((8, 8, 3), np.float32))
    np.save("long.npy", np.zeros((1, 65536), np.uint8))
    np.save("wide.npy", np.zeros((750, 1100, 2), np.uint8))  # 1024 × 1024 when scaled
    for name in ("made", "more"):
        assert main(["-q", "interlace", "wall.png", "-o", name]) == 0
    for name in ("full", "more"):
        Path(name).mkdir(exist_ok=True)
        Path(name, "mine.txt").write_text("mine")
    before = files_below(here)
    capsys.readouterr()
    assert main(words.split()) == status
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("ptm: ")
    assert err.endswith(f"[{code}]\n")
    assert err.count("\n") == 1
    assert files_below(here) == before
