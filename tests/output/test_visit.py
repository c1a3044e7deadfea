"""Figures of a visit of a database, against the served files that a client reads."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.output import EmitOptions, TextureRecord, emit
from ptmtools.output.model import VisitCost
from ptmtools.visibility.model import Pvs, over_places

#: The second room is twice as large as it looks, the third half as large.
VOLUME = np.array([64.0, 128.0, 32.0])


@pytest.fixture
def seen(artifacts: Any, made_up_hints: Callable[[Pvs, np.ndarray], Any]) -> Any:
    """The three rooms in a row; the first and the last do not see each other."""
    matrix = np.array([[1, 1, 0], [1, 1, 1], [0, 1, 1]], np.bool_)
    pvs = Pvs.from_matrix(matrix, volume=VOLUME)
    value = np.concatenate([np.full(n, 1 / n) for n in np.diff(pvs.start)])
    painted = np.where(artifacts.scene.triangle_material == 3, 4, artifacts.scene.triangle_material)
    first = (artifacts.cells.triangle_cell == 0).any(axis=-1)
    painted[artifacts.cells.triangle_source[first]] = 0
    scene = replace(artifacts.scene, triangle_material=painted)
    return replace(artifacts, scene=scene, pvs=pvs, ach=made_up_hints(pvs, value))


def written(
    a: Any, www: Path, records: tuple[TextureRecord, ...], options: EmitOptions
) -> tuple[VisitCost, set[str]]:
    report = emit(a.scene, a.cells, a.pvs, a.ach, records, www, options)
    return report.visit, set(report.files)


class Client:
    """Reads the hints as docs/formats/hints.md has them."""

    def __init__(self, www: Path) -> None:
        self.www = www
        self.index = json.loads((www / "hints.json").read_text())
        names = [cell["name"] for cell in self.index["cells"]]
        self.paths = [self.index["record"].replace("{name}", name) for name in names]
        self.records = [json.loads((www / path).read_text()) for path in self.paths]
        forms = self.index["geometry"]
        template = forms.get("gltf") or forms["vrml"]
        self.geometry = [template.replace("{name}", name) for name in names]

    def size(self, path: str) -> int:
        return (self.www / path).stat().st_size

    def textures(self, cell: int) -> set[int]:
        return {t for used in self.records[cell]["textures"] for t in used}

    def at_hand(self, cell: int) -> int:
        files = [self.geometry[other] for other in self.records[cell]["visible"]]
        files += [self.index["textures"][t]["file"] for t in self.textures(cell)]
        return sum(map(self.size, files))

    def until(self, cell: int, share: float) -> int:
        """Bytes of the cell itself, and of others by coverage, up to a share of the view."""
        record, covered, files = self.records[cell], 0.0, set()
        rows = list(zip(record["visible"], record["ach"], record["textures"], strict=True))
        for other, part, textures in [rows[0], *sorted(rows[1:], key=lambda row: -row[1])]:
            if covered < share:
                files.add(self.geometry[other])
                files |= {self.index["textures"][t]["file"] for t in textures}
                covered += part
        return sum(map(self.size, files))

    def first_room(self) -> int:
        cell = self.index["viewpoints"][0]["cell"]
        own = set(self.records[cell]["textures"][0])
        files = ["hints.json", self.paths[cell]]
        files += [self.geometry[other] for other in self.records[cell]["visible"]]
        files += [self.index["textures"][t]["file"] for t in own]
        coarse = (self.index["textures"][t]["ends"][0] for t in self.textures(cell) - own)
        return sum(map(self.size, files)) + sum(coarse)

    def texels(self, textures: set[int]) -> int:
        rows = [self.index["textures"][t] for t in textures]
        return sum(row["width"] * row["height"] for row in rows)


@pytest.mark.parametrize("format", ["vrml,gltf", "vrml", "gltf"])
def test_figures_are_those_of_the_files(
    seen: Any,
    tmp_path: Path,
    put_textures: Callable[[Path], tuple[TextureRecord, ...]],
    format: str,
) -> None:
    records = tuple(
        replace(r, fallback_bytes=(tmp_path / (r.fallback or "")).stat().st_size)
        for r in put_textures(tmp_path)
    )
    visit, files = written(seen, tmp_path, records, EmitOptions(format=format))
    client = Client(tmp_path)
    assert visit.first_room == client.first_room()
    at_hand = [client.at_hand(cell) for cell in range(3)]
    assert visit.mean_at_hand == round(float(np.average(at_hand, weights=VOLUME)))
    assert visit.most_at_hand == max(at_hand)
    for share, actual in ((0.9, visit.mean_90), (0.99, visit.mean_99)):
        until = [client.until(cell, share) for cell in range(3)]
        assert actual == round(float(np.average(until, weights=VOLUME)))
    every = {client.index["textures"][t]["file"] for c in range(3) for t in client.textures(c)}
    assert visit.everything == sum(map(client.size, [*client.geometry, *every]))
    assert visit.mean_volume == pytest.approx((64 * 192 + 128 * 224 + 32 * 160) / 224**2)
    assert visit.most_volume == 1
    all_texels = client.texels({t for cell in range(3) for t in client.textures(cell)})
    texels = [client.texels(client.textures(cell)) / all_texels for cell in range(3)]
    assert visit.mean_texels == pytest.approx(float(np.average(texels, weights=VOLUME)))
    assert visit.most_texels == pytest.approx(max(texels))
    if "vrml" in format:
        text = "".join(path.read_text() for path in tmp_path.rglob("*.wrl"))
        images = [f"textures/{name}.png" for name in "ab" if f"textures/{name}.png" in text]
        wrl = [name for name in files if name.endswith(".wrl")]
        assert visit.browser == sum(map(client.size, wrl + images))
    else:
        assert visit.browser is None


def test_without_textures_and_fallback(seen: Any, tmp_path: Path, put_textures: Any) -> None:
    plain = replace(seen.scene, triangle_material=np.zeros_like(seen.scene.triangle_material))
    records = tuple(replace(r, fallback_bytes=10**6) for r in put_textures(tmp_path))
    visit, _ = written(replace(seen, scene=plain), tmp_path, records, EmitOptions())
    assert (visit.mean_texels, visit.most_texels) == (None, None)
    assert visit.browser is not None
    assert visit.browser < 10**6, "no surface uses them"
    options = EmitOptions(fallback=False)
    visit, _ = written(seen, tmp_path / "ptm", records, options)
    assert visit.browser is not None
    assert visit.browser < 10**6, "no file names them"


def test_a_cell_counts_by_its_volume() -> None:
    """A closet that sees the hall does not make the hall small."""
    hall_and_closets = np.eye(10, dtype=np.bool_)
    hall_and_closets[0] = hall_and_closets[:, 0] = True
    volume = np.array([91.0] + [1.0] * 9)
    pvs = Pvs.from_matrix(hall_and_closets, volume=volume)
    assert pvs.average_share == pytest.approx(0.28)
    mean, most = pvs.volume_at_hand
    assert (mean, most) == (pytest.approx(0.91 + 0.09 * 0.92), 1)
    unknown = replace(pvs, volume=np.zeros(0))
    assert unknown.volume_at_hand == (pytest.approx(0.28), 1), "of the cells"
    assert over_places(np.zeros(0), np.zeros(0)) == (0, 0)
    nothing = Pvs(np.zeros(1, np.int64), np.zeros(0, np.int32))
    assert nothing.volume_at_hand == (0, 0)
