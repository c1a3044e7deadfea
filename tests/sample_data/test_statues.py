"""The statues: closed surfaces of even triangles, the same bytes every time."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ptmtools.cli.main import main
from ptmtools.scene import IngestOptions, ingest

NAMES = ("bust", "relief", "dragon", "column")
#: Enough to have every part of the code, few enough to be made in a second.
FEW = 6000


@pytest.fixture(scope="session")
def statues() -> ModuleType:
    from ptmtools_samples.statues import model

    return model


@pytest.fixture(scope="session")
def made(statues):
    options = statues.StatueOptions(FEW, colors=True)
    return {name: statues.make_statue(name, options) for name in NAMES}


def test_the_table_has_them(statues) -> None:
    assert tuple(statues.STATUES) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_closed_everywhere_a_surface_and_in_one_piece(made, name: str) -> None:
    statue = made[name]
    points, triangles = statue.points.astype(np.float64), statue.triangles
    sides = np.concatenate([triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    key = sides[:, 0] * len(points) + sides[:, 1]
    back = sides[:, 1] * len(points) + sides[:, 0]
    # Each edge has one triangle on each side, which both have the same outside.
    assert len(np.unique(key)) == len(key)
    assert np.array_equal(np.sort(key), np.sort(back))
    assert len(np.unique(triangles)) == len(points)
    # One piece: every point takes the least number that is joined to it.
    label = np.arange(len(points))
    for _ in range(len(points)):
        least = label[triangles].min(axis=1)
        before = label.copy()
        for k in range(3):
            np.minimum.at(label, triangles[:, k], least)
        if np.array_equal(before, label):
            break
    assert not label.any()
    a, b, c = points[triangles].transpose(1, 0, 2)
    volume = float((a * np.cross(b, c)).sum() / 6)
    assert 0.005 < volume < 0.3


@pytest.mark.parametrize("name", NAMES)
def test_triangles_are_even_and_about_as_many_as_asked_for(made, name: str) -> None:
    statue = made[name]
    assert 0.8 * FEW < len(statue.triangles) < 1.2 * FEW
    a, b, c = statue.points.astype(np.float64)[statue.triangles].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    assert np.percentile(area, 95) < 8 * np.percentile(area, 5)
    sides = sum(((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a)))
    assert np.percentile(4 * 3**0.5 * area / sides, 5) > 0.4


def test_points_lie_on_the_solid(statues, made) -> None:
    kind, low, high = statues.STATUES["bust"]
    solid = kind(np.random.Generator(np.random.PCG64([1, 0])))
    away = solid(made["bust"].points.astype(np.float64).T)
    assert np.median(np.abs(away)) < 0.002  # a quarter of a triangle's side
    assert (made["bust"].points > np.array(low) - 0.01).all()
    assert (made["bust"].points < np.array(high) + 0.01).all()


def test_the_seed_decides(statues) -> None:
    one, same, other = (
        statues.make_statue("column", statues.StatueOptions(2000, seed)) for seed in (1, 1, 2)
    )
    assert one.points.tobytes() == same.points.tobytes()
    assert one.triangles.tobytes() == same.triangles.tobytes()
    assert one.points.tobytes() != other.points.tobytes()


def test_parts_on_threads_change_nothing(statues, monkeypatch) -> None:
    from ptmtools_samples.statues import surface

    one = statues.make_statue("relief", statues.StatueOptions(2000))
    monkeypatch.setattr(surface, "BATCH", 999)
    other = statues.make_statue("relief", statues.StatueOptions(2000))
    assert one.points.tobytes() == other.points.tobytes()


@pytest.mark.parametrize("kind", ["ply", "obj", "glb"])
def test_files_are_read_again(statues, kind: str, tmp_path: Path) -> None:
    command = ["sample", "statues", "-o", str(tmp_path), "--triangles", "2000"]
    command += ["--only", "dragon", "--format", kind]
    assert main([*command, "--colors"]) == 0
    assert main(command) == 0  # over its own file
    scene = ingest(tmp_path / f"dragon.{kind}", IngestOptions(unit="m", up="y"))
    again = statues.make_statue("dragon", statues.StatueOptions(2000))
    assert len(scene.triangles) == len(again.triangles)
    extent = np.ptp(scene.points, axis=0)
    np.testing.assert_allclose(extent, np.ptp(again.points, axis=0), rtol=1e-5)


def test_files_of_other_origin_stay(tmp_path: Path, capsys) -> None:
    (tmp_path / "bust.ply").write_bytes(b"mine")
    command = ["sample", "statues", "-o", str(tmp_path), "--triangles", "1500", "--only", "bust"]
    assert main(command) == 4
    assert "use --force" in capsys.readouterr().err
    assert (tmp_path / "bust.ply").read_bytes() == b"mine"
    assert main([*command, "--force"]) == 0


def test_an_unknown_statue_is_refused(tmp_path: Path, capsys) -> None:
    assert main(["sample", "statues", "-o", str(tmp_path / "s"), "--only", "bull"]) == 3
    assert "choose bust, relief, dragon, column" in capsys.readouterr().err


def test_colours(made) -> None:
    dragon = made["dragon"].colors.astype(int)
    assert dragon.shape == made["dragon"].points.shape
    assert dragon[:, 1].mean() > dragon[:, 2].mean() + 20
    assert all(np.ptp(statue.colors, axis=0).min() > 20 for statue in made.values())
