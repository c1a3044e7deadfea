"""Where visits begin, in made buildings of several floors. Metres, Z up."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ptmtools.cells import SubdivideOptions, subdivide
from ptmtools.output import GivenViewpoint
from ptmtools.output.model import Viewpoint, WriterOptions
from ptmtools.output.viewpoints import place_viewpoints
from ptmtools.scene import IngestOptions, ingest
from ptmtools.scene.orientation.space import to_world
from tests.cells.buildings import AXES, carved, room, write
from tests.scene.buildings import box


def viewpoints(folder: Path, parts: dict[str, np.ndarray]) -> tuple[list[Viewpoint], list[float]]:
    """Those of a model of parts, and the height of the floor of each in the model."""
    scene = ingest(write(folder / "model.obj", parts.items()), IngestOptions(**AXES))
    options = WriterOptions()
    views, _ = place_viewpoints(scene, subdivide(scene, SubdivideOptions(gain=1.0)), options)
    bottom = min(part[..., 2].min() for part in parts.values())
    return [*views], [round(float(view.position[1]) - 1.6 + bottom, 3) for view in views]


def test_a_house_begins_at_the_ground(tmp_path: Path) -> None:
    """Above a larger basement, under an attic, both without windows: these come last."""
    plans = (0, 0, 4.9, 8), (5.1, 0, 10, 8)
    rooms = [room(0, 0, 10, 8, -2.6, -0.2), room(0, 0, 10, 8, 5.6, 8)]
    holes = []
    for low in (0.0, 2.8, 5.6):
        holes.append(((8, 6, low - 0.2), (9.5, 7.5, low)))  # of a staircase
    for low in (0.0, 2.8):
        rooms += [room(*plan, low, low + 2.6) for plan in plans]
        holes.append(((4.9, 3, low), (5.1, 4, low + 2)))
        holes += [((x, -0.2, low + 0.9), (x + 2, 0, low + 2.2)) for x in (1, 7)]
    lawn = [((-9, -9), (19, -0.2)), ((-9, 8.2), (19, 17)), ((-9, -0.2), (-0.2, 8.2))]
    around = [box((*low, -0.3), (*high, -0.1)) for low, high in lawn]
    parts = {"walls": carved(rooms, holes), "lawn": np.concatenate(around)}
    _, floors = viewpoints(tmp_path, parts)
    assert list(dict.fromkeys(round(floor) for floor in floors)) == [0, 3, 6, -3]


def test_a_loft_comes_after_the_nave(tmp_path: Path) -> None:
    """Though its ceiling is as low as a room's; and the nave before a chapel, since it has windows
    and is no sky over a house."""
    nave, loft = room(0, 0, 30, 10, 0, 14), room(0, 0, 30, 10, 14.2, 18)
    chapel = room(0, 10.2, 6, 16, 0, 4)
    holes = [((2, 2, 14), (3, 3, 14.2)), ((2, 10, 0), (4, 10.2, 3))]
    windows = [((x, -0.2, 6), (x + 2, 0, 12)) for x in (5, 15, 25)]
    rooms = [nave, loft, chapel]
    views, floors = viewpoints(tmp_path, {"walls": carved(rooms, [*holes, *windows])})
    assert len(views) == 3
    assert floors[0] == 0
    assert views[0].position[2] > -2, "in the nave"
    views, floors = viewpoints(tmp_path, {"walls": carved(rooms, holes)})
    assert floors[0] == 0
    assert views[0].position[2] < -2, "in the chapel"


def test_passengers_wait_on_the_platform(tmp_path: Path) -> None:
    """A screen along it leaves a part before the tracks that is narrower than these."""
    hall, tracks = room(0, 0, 40, 9.8, 0, 4.5), room(0, 0, 40, 4, -1.1, 0)
    screen = (8, 6.6, 0), (32, 6.7, 4.5)
    _, floors = viewpoints(tmp_path, {"walls": carved([hall, tracks], solids=[screen])})
    assert floors[0] == 0


def test_a_car_leaves_room_in_a_garage(tmp_path: Path) -> None:
    rooms = [room(0, 0, 5.8, 6.6, 0, 2.4), room(6, 0, 12, 6.6, 0, 2.4)]
    door = (5.8, 0.5, 0), (6, 1.4, 2.05)
    car = np.concatenate(
        [box((0.9, 2.4, 0.3), (4.9, 4.2, 0.9)), box((1.9, 2.5, 0.9), (3.9, 4.1, 1.5))]
    )
    views, floors = viewpoints(tmp_path, {"walls": carved(rooms, [door]), "Car": car})
    assert len(views) == 2
    assert floors == [0, 0]


def test_pavilions_far_apart_need_no_ground(tmp_path: Path) -> None:
    parts = {}
    for k, start in enumerate((0, 300)):
        space = room(start, start, start + 5, start + 4, 0, 2.6)
        door = (start + 1, start - 0.2, 0), (start + 2, start, 2.1)
        parts[f"house{k}"] = carved([space], [door])
    views, floors = viewpoints(tmp_path, parts)
    assert floors[:2] == [0, 0]
    assert abs(views[0].position[0] - views[1].position[0]) > 290


def test_rooms_without_a_viewpoint_are_counted(tmp_path: Path) -> None:
    """Those of the user take none from a room that they are not in."""
    rooms = [room(5.2 * k, 0, 5.2 * k + 5, 4, 0, 2.6) for k in range(4)]
    doors = [((5.2 * k + 5, 1, 0), (5.2 * k + 5.2, 2, 2.1)) for k in range(3)]
    doors.append(((1, -0.2, 0), (2, 0, 2.1)))
    parts = {"walls": carved(rooms, doors), "lawn": box((-9, -9, -0.3), (30, -0.2, -0.1))}
    scene = ingest(write(tmp_path / "model.obj", parts.items()), IngestOptions(**AXES))
    cells = subdivide(scene, SubdivideOptions(gain=1.0))
    lawn = tuple(to_world(np.array([[1.5, -4.0, 1.6]]), scene.space)[0].tolist())
    for count in (1, 3, 4):
        options = WriterOptions(viewpoint_count=count, viewpoints=(GivenViewpoint(lawn, 0.0),))
        views, notes = place_viewpoints(scene, cells, options)
        assert len(views) == count + 1
        expected = [f"rooms without a viewpoint: {4 - count};"] * (count < 4)
        assert [note.split(" --")[0] for note in notes if "without a" in note] == expected
