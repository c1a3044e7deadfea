"""A first tour of a database: labels for its pictures and its rooms, with a view of each.

A picture is an object with an upright, flat, textured part of a plausible size that hangs above the
floor and shows an image once. The texture of a wall repeats, and a wall reaches the floor.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.cells.model import Cells
from ptmtools.embree import ray_tree
from ptmtools.scene.model import Scene
from ptmtools.tour.model import FORMAT, SCHEMA
from ptmtools.tour.pictures import (
    PictureFinder,
    PictureRectangle,
    first_face,
    images_once,
    shows_an_image,
)
from ptmtools.tour.placing import faces_of_objects
from ptmtools.tour.writing import format_json

#: Height of a standing visitor's eye, and of the eye region that the floor is searched in, metres.
_EYE = 1.6
#: Vertical field of view of a stop, width by height of a narrow window, and the share of the window
#: that a picture fills.
_ANGLE, _ASPECT, _FILLED = np.pi / 3, 1.2, 0.7
#: Nearest view, metres, and distances that are tried, in units of the best one.
_NEAREST = 0.8
_STEPS = (1.0, 0.85, 1.2, 0.7, 1.5, 0.55, 2.0)
#: Tilt to the side of views that are tried, radians.
_TURNS = (0.0, 0.35, -0.35, 0.7, -0.7)
#: Height above the lowest floor of the views that are tried, metres: a bench is higher.
_STEP = 0.25
_DOWN = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True)
class Proposal:
    """A label and the view of its stop, as JSON, before it has an id."""

    name: str
    label: dict[str, Any]
    view: dict[str, Any] | None


def first_tour(
    scene: Scene, cells: Cells, model: str, places: Sequence[str] = ()
) -> tuple[str, int, int]:
    """The text of a tour, and its numbers of pictures and rooms; ``places``: the names that the
    menu of places has."""
    pictures, rooms = list(_pictures(scene, cells)), list(_rooms(scene, cells))
    ids: set[str] = set()
    labels, stops = [], []
    for proposal in (*rooms, *pictures):
        label_id = _id(proposal.name, ids)
        labels.append({"id": label_id, **proposal.label, "title": {"en": _title(proposal.name)}})
        if proposal.view:
            stops.append({"label": label_id, "view": proposal.view})
    document = {
        "format": FORMAT,
        "schema": SCHEMA,
        "model": model,
        "languages": ["en"],
        **({"places": {name: {"en": name} for name in places}} if places else {}),
        "labels": labels,
        "stops": stops,
    }
    return format_json(document) + "\n", len(pictures), len(rooms)


def _pictures(scene: Scene, cells: Cells) -> Iterator[Proposal]:
    """The pictures of a scene, in the order of its objects."""
    shown, all_pictures = _objects_of_images(scene), PictureFinder(scene)
    eyes = _EyeFinder(scene, cells, all_pictures)
    counts = Counter(scene.objects)
    for name, faces in faces_of_objects(scene).items():
        if not name or counts[name] > 1 or not shows_an_image(scene, faces, shown):
            continue
        picture = all_pictures.picture_of(faces)
        if picture and all_pictures.hangs(picture):
            view = eyes.view_of(picture, faces)
            yield Proposal(name, {"object": name}, view and _row(*view))


def _rooms(scene: Scene, cells: Cells) -> Iterator[Proposal]:
    """The named rooms of a model, each with a view along its longer side."""
    names = [room.name for room in scene.rooms]
    for room in scene.rooms:
        if not room.name or names.count(room.name) > 1 or not len(room.points):
            continue
        low, high = room.points.min(axis=0), room.points.max(axis=0)
        eye = (low + high) / 2
        eye[1] = min(low[1] + _EYE, high[1])
        along = np.zeros(3)
        along[0 if high[0] - low[0] >= high[2] - low[2] else 2] = 1.0
        standing = cells.locate(eye[None])[0] >= 0
        yield Proposal(room.name, {"room": room.name}, _row(eye, along) if standing else None)


def _objects_of_images(scene: Scene) -> Counter[int]:
    """Image → number of objects that show it once. Those that repeat it, such as walls, do not
    count: a hall may have pictures of the same image as its walls."""
    shown: Counter[int] = Counter()
    for faces in faces_of_objects(scene).values():
        shown.update(images_once(scene, faces))
    return shown


class _EyeFinder:
    """Places to look at pictures from."""

    def __init__(self, scene: Scene, cells: Cells, pictures: PictureFinder) -> None:
        self._cells, self._pictures = cells, pictures
        low, high = scene.points.min(axis=0), scene.points.max(axis=0)
        self._middle = (low + high) / 2
        floor = cells.eye_floor
        self._floor = ray_tree((floor if len(floor) else scene.corners) - self._middle)

    def view_of(self, picture: PictureRectangle, faces: Ints) -> tuple[Floats, Floats] | None:
        """Eye and direction from which nothing hides the centre of a picture; None if no visitor
        can stand there."""
        tall = np.tan(_ANGLE / 2)
        best = max(
            picture.height / (2 * tall * _FILLED),
            picture.width / (2 * tall * _ASPECT * _FILLED),
            _NEAREST,
        )
        ways = [np.cos(turn) * picture.normal + np.sin(turn) * picture.right for turn in _TURNS]
        tried = [self._eye(picture.centre + way * best * step) for way in ways for step in _STEPS]
        eyes = [eye for eye in tried if eye is not None]
        lowest = min((eye[1] for eye in eyes), default=0.0)
        for eye in sorted(eyes, key=lambda eye: eye[1] > lowest + _STEP):
            if self._sees(eye, picture, faces):
                return eye, picture.centre - eye
        return None

    def _eye(self, point: Floats) -> Floats | None:
        """The eye of a visitor below or above a point, where one can stand."""
        down = first_face(self._floor, point - self._middle, _DOWN)[1]
        if not np.isfinite(down):
            return None
        eye = point + [0.0, _EYE - down, 0.0]
        inside = self._cells.locate(eye[None])[0] >= 0 and self._cells.eyes.contains(eye[None])[0]
        return eye if inside else None

    def _sees(self, eye: Floats, picture: PictureRectangle, faces: Ints) -> bool:
        """Whether the first surface towards the centre of a picture is its object."""
        hit, _ = self._pictures.first(eye, picture.centre - eye)
        return hit >= 0 and bool((faces == hit).any())


def _row(eye: Floats, direction: Floats) -> dict[str, Any]:
    length = float(np.linalg.norm(direction))
    return {
        "position": [round(float(value), 3) for value in eye],
        "direction": [round(float(value) / length, 4) for value in direction],
    }


def _id(name: str, taken: set[str]) -> str:
    """An id from a name, unlike the others."""
    stem = re.sub(r"[^a-z0-9_-]+", "-", name.lower()).strip("-_")[:56] or "label"
    number, unused = 1, stem
    while unused in taken:
        number += 1
        unused = f"{stem}-{number}"
    taken.add(unused)
    return unused


def _title(name: str) -> str:
    words = re.sub(r"[\s_]+", " ", name).strip()
    return words[:1].upper() + words[1:]
