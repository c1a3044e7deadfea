"""Surfaces without walls: scans and terrain, whose facets divide nothing."""

from __future__ import annotations

from pathlib import Path

from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.scene import IngestOptions, Scene, ingest
from tests.cells.buildings import write
from tests.cells.strangers import Parts, office, tile
from tests.scene.buildings import box


def scene_of_parts(parts: Parts, folder: Path) -> Scene:
    return ingest(write(folder / "model.obj", parts.items()), IngestOptions(unit="m", up="z"))


def test_a_town_from_the_air_is_one_cell(tmp_path: Path) -> None:
    """Of 4,608 facets of 60 m² and more, each in a plane of its own."""
    cells = subdivide(scene_of_parts(tile(side=48), tmp_path))
    assert cells.cell_count == 1
    assert cells.leaf_count < 50
    assert any("like a scan" in note for note in cells.notes)
    assert cells.visible == 4608


def test_a_house_on_terrain_keeps_its_rooms(tmp_path: Path) -> None:
    """Its walls are upright, whatever the ground."""
    rooms = {name: part + [250, 250, 60] for name, part in office(4).items()}
    scene = scene_of_parts(tile(side=48, blocks=0) | rooms, tmp_path)
    cells = subdivide(scene)
    assert any("like a scan" in note for note in cells.notes)
    assert cells.cell_count >= 5


def test_many_upright_walls_are_no_scan(tmp_path: Path) -> None:
    parts = {f"wall {k}": box((2 * k, 0, 0), (2 * k + 0.2, 5, 3)) for k in range(600)}
    cells = subdivide(scene_of_parts(parts, tmp_path), SubdivideOptions(max_leaves=50))
    assert not any("like a scan" in note for note in cells.notes)
    assert len(cells.node_plane) > 40
