"""The real models: their units, axes and flaws, as the folder's README tells them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.scene import IngestOptions, Scene, ingest


def counts(scene: Scene) -> dict[str, int]:
    return {note.code: note.count for note in scene.notes}


def load(shared: Path, name: str, options: IngestOptions | None = None) -> Scene:
    scene = ingest(shared / "scenes" / name / f"{name}.obj", options or IngestOptions())
    assert scene.triangles.max() == len(scene.points) - 1
    assert len(np.unique(scene.points, axis=0)) == len(scene.points)
    assert scene.points.min(axis=0)[1] == 0
    assert np.abs(scene.points.min(axis=0) + scene.points.max(axis=0))[[0, 2]].max() < 1e-9
    for image in scene.images:
        assert image.load()[:4] == b"\x89PNG"
    return scene


def test_hospital(shared: Path) -> None:
    scene = load(shared, "hospital")
    assert (scene.space.metres, scene.space.up) == (0.01, "z")
    assert np.ptp(scene.points, axis=0) == pytest.approx([25.12, 6.0, 56.12], abs=0.01)
    assert counts(scene)["PTM-N211"] == 52
    assert len(scene.triangles) == 5103 - 52
    assert (len(scene.materials), len(scene.images), len(scene.objects)) == (10, 9, 10)
    assert scene.two_sided.all()


def test_willowgarage(shared: Path) -> None:
    scene = load(shared, "willowgarage")
    assert (scene.space.metres, scene.space.up) == (0.0254, "z")
    assert np.ptp(scene.points, axis=0) == pytest.approx([58.63, 2.84, 48.62], abs=0.01)
    found = counts(scene)
    # The README counts 248 and 6,729: two faces are collinear to the last digit, one of a pair.
    assert found["PTM-N209"] == pytest.approx(248, abs=2)
    assert found["PTM-N213"] == pytest.approx(6729, abs=1)
    assert "PTM-N211" not in found
    assert (~scene.two_sided).sum() == 2 * found["PTM-N213"]
    assert (len(scene.materials), len(scene.images)) == (19, 6)


def test_gallery(shared: Path) -> None:
    scene = load(shared, "gallery")
    assert (scene.space.metres, scene.space.up) == (1.0, "y")
    assert len(scene.triangles) == 1930
    assert scene.materials[0].color == (0.8, 0.8, 0.8)


def test_office(shared: Path) -> None:
    """Its texture has an alpha channel of 255s: it occludes."""
    scene = load(shared, "office")
    assert (scene.space.metres, scene.space.up) == (1.0, "y")
    assert np.ptp(scene.points, axis=0) == pytest.approx([49.5, 5.15, 34.94], abs=0.02)
    assert [m.transparent for m in scene.materials] == [False]


@pytest.mark.parametrize("unit", ["cm", "0.01"])
def test_given_is_as_guessed(shared: Path, unit: str) -> None:
    guessed = load(shared, "hospital")
    given = load(shared, "hospital", IngestOptions(unit=unit, up="z"))
    assert np.array_equal(given.points, guessed.points)
    assert not given.space.unit_guessed
