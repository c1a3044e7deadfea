"""Files that the museum script writes, and files that it refuses to overwrite."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image

#: All surfaces and styles, in the least time.
SMALL = ["--rooms", "4", "--textures", "33", "--size", "24"]


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "ptmtools", "sample", "museum", *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("small") / "museum"
    done = run("-o", str(folder), *SMALL)
    assert done.returncode == 0, done.stderr
    return files(folder)


def test_same_seed_same_bytes_with_other_hashes_and_vector_instructions(
    small: dict[str, bytes], tmp_path: Path
) -> None:
    features = "AVX2 FMA3 AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL"
    done = run(
        "-o",
        str(tmp_path / "again"),
        *SMALL,
        PYTHONHASHSEED="12345",
        NPY_DISABLE_CPU_FEATURES=features,
        PYTHONWARNINGS="ignore",
    )
    assert done.returncode == 0, done.stderr
    assert files(tmp_path / "again") == small


def test_other_seed_other_bytes(museum: ModuleType, small: dict[str, bytes]) -> None:
    options = museum.MuseumOptions(rooms=4, textures=33, size=24, seed=2)
    other = dict(museum.make_museum(options))
    assert other.keys() == small.keys()
    for name in ("museum.obj", "textures/parquet.png", "textures/painting_01.png"):
        assert other[name]() != small[name]


def test_default_is_31_textures_of_1024_squared(museum: ModuleType) -> None:
    options = museum.MuseumOptions()
    names = [name for name, _ in museum.make_museum(options) if name.endswith(".png")]
    assert len(names) == 31
    assert len(names) * options.size**2 * 3 == 97_517_568
    assert options.size == 1024


def test_every_texture_is_used_and_none_is_flat(small: dict[str, bytes], tmp_path: Path) -> None:
    model = small["museum.obj"].decode()
    used = {line.split()[1] for line in model.splitlines() if line.startswith("usemtl ")}
    mapped: dict[str, set[str]] = {}
    for block in small["museum.mtl"].decode().split("newmtl ")[1:]:
        name, *rest = block.splitlines()
        assert name in used
        for line in rest:
            if line.startswith("map_Kd "):
                mapped.setdefault(line.split()[-1], set()).add(name)
    images = {name for name in small if name.endswith(".png")}
    assert set(mapped) == images
    assert len(images) == 33
    for name in images:
        (tmp_path / "image.png").write_bytes(small[name])
        with Image.open(tmp_path / "image.png") as image:
            assert image.mode == "RGB"
            assert image.size == (24, 24)
            assert np.unique(np.asarray(image).reshape(-1, 3), axis=0).shape[0] > 100, name


def test_users_images_keep_their_proportions(museum: ModuleType, read: Any, tmp_path: Path) -> None:
    pictures = tmp_path / "my pictures"
    pictures.mkdir()
    Image.new("RGB", (60, 30), (200, 30, 30)).save(pictures / "Große Wand (1).png")
    Image.new("RGB", (30, 45), (30, 30, 200)).save(pictures / "b.JPG", "JPEG")
    Image.new("P", (40, 40)).save(pictures / "c.gif")
    turned = Image.new("RGB", (50, 20), (9, 99, 9))
    exif = Image.Exif()
    exif[0x0112] = 6
    turned.save(pictures / "d.jpeg", exif=exif)
    (pictures / "notes.txt").write_text("not a picture")
    done = run("-o", str(tmp_path / "m"), *SMALL, "--images", str(pictures))
    assert done.returncode == 0, done.stderr
    assert "notes.txt" in done.stderr
    made = files(tmp_path / "m")
    model = read(made["museum.obj"].decode().splitlines())
    order = sorted(p.name for p in pictures.iterdir() if p.suffix != ".txt")
    aspects = {"Große Wand (1).png": 2.0, "b.JPG": 2 / 3, "c.gif": 1.0, "d.jpeg": 0.4}
    for k, name in enumerate(order):
        canvas = model.where(model.materials == f"painting_{k + 1:02d}")
        assert len(canvas.corners) >= 2
        size = np.ptp(canvas.corners[0], axis=0)
        assert max(size[0], size[2]) / size[1] == pytest.approx(aspects[name], abs=0.01)
        kept = [n for n in made if f"painting_{k + 1:02d}." in n]
        if name in ("b.JPG", "Große Wand (1).png"):
            assert made[kept[0]] == (pictures / name).read_bytes()
        assert kept[0].endswith(".jpg" if name == "b.JPG" else ".png")


def test_refuses_what_it_did_not_write(small: dict[str, bytes], tmp_path: Path) -> None:
    tiny = ["--rooms", "1", "--textures", "3", "--size", "8"]
    (tmp_path / "diary.txt").write_text("mine")
    refused = run("-o", str(tmp_path), *tiny)
    assert refused.returncode == 4
    assert "--force" in refused.stderr
    assert files(tmp_path) == {"diary.txt": b"mine"}
    assert run("-o", str(tmp_path), *tiny, "--force").returncode == 0
    assert (tmp_path / "diary.txt").read_text() == "mine"
    first = files(tmp_path)
    assert (
        run("-o", str(tmp_path), "--rooms", "1", "--textures", "1", "--size", "8").returncode == 0
    )
    second = files(tmp_path)
    assert second.keys() < first.keys()
    assert "diary.txt" in second


@pytest.mark.parametrize(
    "arguments",
    [
        ["--rooms", "0"],
        ["--textures", "0"],
        ["--size", "big"],
        ["--images", "/nowhere/at/all"],
        ["--rooms", "1", "--textures", "5000", "--size", "4"],
    ],
)
def test_bad_arguments_are_one_line_and_leave_nothing(arguments: list[str], tmp_path: Path) -> None:
    done = run("-o", str(tmp_path / "m"), *arguments)
    assert done.returncode in (2, 3)
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("ptm: ")
    assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "m").exists()


def test_output_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "m").write_text("x")
    done = run("-o", str(tmp_path / "m"), "--rooms", "1", "--textures", "1", "--size", "8")
    assert done.returncode == 4
    assert "not a folder" in done.stderr
    assert (tmp_path / "m").read_text() == "x"
