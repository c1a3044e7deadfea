"""Labels of a first tour, and the places of labels in the scene."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ptmtools_samples.files import write
from ptmtools_samples.museum import make_museum
from ptmtools_samples.options import MuseumOptions

from ptmtools.cells import subdivide
from ptmtools.cells.model import Cells
from ptmtools.embree import ray_tree
from ptmtools.errors import InputError
from ptmtools.scene import ingest
from ptmtools.scene.model import RoomVolume, Scene
from ptmtools.tour.model import Label, Tour
from ptmtools.tour.placing import Placing
from ptmtools.tour.starting import first_tour
from tests.tour.hall import write_hall


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, Cells]:
    """A museum of one room."""
    folder = tmp_path_factory.mktemp("museum")
    write(folder, list(make_museum(MuseumOptions(rooms=1, textures=9, size=16))), force=True)
    scene = ingest(folder / "museum.obj")
    return scene, subdivide(scene)


def tour(*labels: Label) -> Tour:
    return Tour(("en",), labels)


def test_every_painting_has_a_label_and_a_view_that_nothing_hides(
    built: tuple[Scene, Cells],
) -> None:
    scene, cells = built
    text, pictures, rooms = first_tour(scene, cells, "museum.obj")
    document = json.loads(text)
    paintings = {name for name in scene.objects if name.startswith("painting_")}
    assert {label["object"] for label in document["labels"]} == paintings
    assert (pictures, rooms) == (len(paintings), 0)
    assert [stop["label"] for stop in document["stops"]] == [
        label["id"] for label in document["labels"]
    ], "each can be seen"
    tree = ray_tree(scene.corners)
    for label, stop in zip(document["labels"], document["stops"], strict=True):
        eye, ray = (np.array([stop["view"][k]], np.float32) for k in ("position", "direction"))
        hit = int(tree.run(eye, ray, query="INTERSECT")[0])
        assert scene.objects[scene.triangle_object[hit]] == label["object"]
        assert cells.locate(eye.astype(float))[0] >= 0
        assert cells.eyes.contains(eye.astype(float))[0], "a visitor can stand there"


def test_markers_of_pictures_are_in_front_of_their_lower_edge(built: tuple[Scene, Cells]) -> None:
    scene, cells = built
    names = [name for name in scene.objects if name.startswith("painting_")]
    places = Placing(scene).anchors(tour(*(Label(name, object=name) for name in names)))
    for name, place in zip(names, places, strict=True):
        picture = place.picture
        assert picture is not None
        own = np.array([other == name for other in scene.objects])[scene.triangle_object]
        points = scene.corners[own].reshape(-1, 3)
        assert np.allclose(place.low, points.min(axis=0))
        assert np.allclose(place.high, points.max(axis=0))
        out = (place.marker - points) @ picture.normal
        assert 0.02 < out.min() < 0.04, "before the frame, too"
        assert abs(place.marker[1] - place.low[1]) < 0.2
        assert cells.locate(place.marker[None])[0] >= 0


def test_markers_of_statues_rooms_and_places(built: tuple[Scene, Cells]) -> None:
    scene, _ = built
    box = np.array([[0, 0, 0], [4, 3, 2]], np.float64)
    hall = RoomVolume("Hall", box, np.zeros((0, 3), np.int32))
    scene = replace(scene, rooms=(hall,))
    other = next(name for name in scene.objects if name.startswith(("statue", "bench")))
    labels = Label("a", object=other), Label("b", room="Hall"), Label("c", at=(1.0, 2.0, 3.0))
    statue, room, place = Placing(scene).anchors(tour(*labels))
    assert statue.picture is None
    assert statue.marker[1] > statue.high[1]
    assert room.marker.tolist() == [2, 1.5, 1]
    assert place.marker.tolist() == [1, 2, 3]


def test_unknown_names_are_errors_with_the_nearest_name(built: tuple[Scene, Cells]) -> None:
    scene, _ = built
    with pytest.raises(InputError, match="PTM-I302") as caught:
        Placing(scene).anchors(tour(Label("a", object="paintng_01")))
    assert caught.value.place == "labels[0].object"
    assert "painting_01" in str(caught.value.remedy)
    with pytest.raises(InputError, match="no room is called Hall"):
        Placing(scene).anchors(tour(Label("a", room="Hall")))


def test_a_wall_is_no_picture() -> None:
    scene = ingest(Path(__file__).resolve().parents[2] / "sample_data/two_rooms/two_rooms.obj")
    text, pictures, rooms = first_tour(scene, subdivide(scene), "two_rooms.obj", ["Room 1"])
    assert (pictures, rooms) == (0, 0)
    assert json.loads(text)["places"] == {"Room 1": {"en": "Room 1"}}


def test_pictures_as_programs_write_them(tmp_path: Path) -> None:
    """A slab, a canvas that is wound the other way, one on a board with a texture, and one with the
    image of the walls: each has a stop in the hall, and its marker before it."""
    scene = ingest(write_hall(tmp_path))
    cells = subdivide(scene)
    text, pictures, _ = first_tour(scene, cells, "hall.obj")
    document = json.loads(text)
    names = ["slab", "turned", "board", "wallpaper"]
    assert [label["object"] for label in document["labels"]] == names
    assert pictures == len(document["stops"]) == 4
    for place in Placing(scene).anchors(tour(*(Label(name, object=name) for name in names))):
        assert place.picture is not None
        assert place.picture.normal[2] > 0.99, "all hang on the wall at the back"
        assert place.picture.width == pytest.approx(0.8)
        assert cells.locate(place.marker[None])[0] >= 0
