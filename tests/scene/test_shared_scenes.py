"""The real models: their units, axes and flaws, as the folder's README tells them."""

from __future__ import annotations

import json
import re
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
    actual = counts(scene)
    # The README counts 248 and 6,729: two faces are collinear to the last digit, one of a pair.
    assert actual["PTM-N214"] == pytest.approx(248, abs=2)
    (pairs,) = (note for note in scene.notes if note.code == "PTM-N211")
    assert pairs.message.startswith("pairs of coincident faces")
    assert pairs.count == pytest.approx(6729, abs=1)
    assert (~scene.two_sided).sum() == 2 * pairs.count
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


@pytest.mark.parametrize("name", ["hospital", "willowgarage", "gallery", "office"])
def test_lying_on_its_side_it_is_set_up_again(shared: Path, tmp_path: Path, name: str) -> None:
    """Written out with the other axis up, each model is read as before."""
    before = load(shared, name)
    text = (shared / "scenes" / name / f"{name}.obj").read_text()
    swapped = re.sub(r"(?m)^v +(\S+) +(\S+) +(\S+)", r"v \1 \3 \2", text)
    (tmp_path / "turned.obj").write_text(re.sub(r"(?m)^mtllib.*$", "", swapped))
    after = ingest(tmp_path / "turned.obj")
    assert after.space.up != before.space.up
    assert after.space.metres == before.space.metres
    assert np.ptp(after.points, axis=0) == pytest.approx(np.ptp(before.points, axis=0))
    assert not {"PTM-N232", "PTM-N233"} & (counts(before).keys() | counts(after).keys())


def test_gallery_as_glb(shared: Path, tmp_path: Path) -> None:
    """As it is, nothing is to say; with its content lying, it is believed and doubted."""
    path = shared / "scenes" / "gallery" / "gallery.glb"
    assert counts(ingest(path)) == {}
    data = path.read_bytes()
    end = 20 + int.from_bytes(data[12:16], "little")
    tree = json.loads(data[20:end])
    (scene,) = tree["scenes"]
    tree["nodes"].append({"children": scene["nodes"], "rotation": [0.5**0.5, 0, 0, 0.5**0.5]})
    scene["nodes"] = [len(tree["nodes"]) - 1]
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    length = len(data) - end + 20 + len(text)
    head = data[:8] + length.to_bytes(4, "little") + len(text).to_bytes(4, "little") + data[16:20]
    (tmp_path / "lying.glb").write_bytes(head + text + data[end:])
    lying = ingest(tmp_path / "lying.glb")
    assert counts(lying) == {"PTM-N234": 1}
    turned = ingest(tmp_path / "lying.glb", IngestOptions(up="z"))
    assert counts(turned) == {}
    assert np.ptp(turned.points, axis=0) == pytest.approx(np.ptp(ingest(path).points, axis=0))


@pytest.mark.parametrize("unit", ["cm", "0.01"])
def test_given_is_as_guessed(shared: Path, unit: str) -> None:
    guessed = load(shared, "hospital")
    given = load(shared, "hospital", IngestOptions(unit=unit, up="z"))
    assert np.array_equal(given.points, guessed.points)
    assert not given.space.unit_guessed
