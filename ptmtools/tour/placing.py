"""Places the labels of a tour in the scene: markers, and the boxes that a click hits.

A label describes the objects of its name. The marker of a picture is in front of its lower edge,
those of other objects are above them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError
from ptmtools.scene.model import Scene
from ptmtools.tour.model import Label, Tour
from ptmtools.tour.pictures import PictureFinder, PictureRectangle

#: Distance of a marker from its picture, and its height above other objects, metres.
_BEFORE, _ABOVE = 0.03, 0.12
#: Height of the marker of a room above its floor, metres.
_ROOM_HEIGHT = 1.5


@dataclass(frozen=True)
class Anchor:
    """The place of a label in the scene, world metres.

    Attributes
    ----------
    marker: (3,) of its marker.
    low, high: (3,) corners of the box around what it describes; both `marker` for a place.
    picture: of a flat object, else None.
    """

    marker: Floats
    low: Floats
    high: Floats
    picture: PictureRectangle | None = None


class Placing:
    """Places labels in a scene."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._faces = faces_of_objects(scene)
        self.pictures = PictureFinder(scene)
        #: Anchors by the name of the object: an editor places a tour again and again.
        self._known: dict[str, Anchor] = {}

    def anchors(self, tour: Tour) -> list[Anchor]:
        """The anchor of each label.

        Raises InputError: PTM-I302 the scene has no object or no room of that name.
        """
        return [self._anchor(label, number) for number, label in enumerate(tour.labels)]

    def _anchor(self, label: Label, number: int) -> Anchor:
        scene = self._scene
        if label.object:
            faces = self._faces.get(label.object, np.zeros(0, np.int64))
            if not len(faces):
                raise unknown_name_error(
                    "object", label.object, scene.objects, f"labels[{number}].object"
                )
            if label.object not in self._known:
                self._known[label.object] = self._of_faces(faces)
            return self._known[label.object]
        if label.room:
            rooms = [room for room in scene.rooms if room.name == label.room and len(room.points)]
            if not rooms:
                names = [room.name for room in scene.rooms]
                raise unknown_name_error("room", label.room, names, f"labels[{number}].room")
            low, high = rooms[0].points.min(axis=0), rooms[0].points.max(axis=0)
            marker = (low + high) / 2
            marker[1] = min(low[1] + _ROOM_HEIGHT, high[1])
            return Anchor(marker, marker, marker)
        at = np.array(label.at, dtype=np.float64)
        return Anchor(at, at, at)

    def _of_faces(self, faces: Ints) -> Anchor:
        """The anchor of an object with the faces (n,)."""
        corners = self._scene.corners[faces].reshape(-1, 3)
        low, high = corners.min(axis=0), corners.max(axis=0)
        picture = self.pictures.picture_of(faces)
        if picture is None:
            marker = np.array([(low[0] + high[0]) / 2, high[1] + _ABOVE, (low[2] + high[2]) / 2])
        else:
            lower = picture.centre - picture.upward * picture.height / 2
            # A frame may stand out before the picture.
            out = float(((corners - picture.centre) @ picture.normal).max(initial=0))
            marker = lower + picture.normal * (max(out, 0) + _BEFORE)
        return Anchor(marker, low, high, picture)


def faces_of_objects(scene: Scene) -> dict[str, Ints]:
    """Name → the faces, ascending, of all objects of that name."""
    order = np.argsort(scene.triangle_object, kind="stable")
    starts = np.searchsorted(scene.triangle_object[order], np.arange(1, len(scene.objects)))
    named: dict[str, Ints] = {}
    for name, faces in zip(scene.objects, np.split(order, starts), strict=True):
        named[name] = np.sort(np.concatenate([named[name], faces])) if name in named else faces
    return named


def unknown_name_error(kind: str, name: str, names: Sequence[str], place: str) -> InputError:
    """An error: no object, room or place of the model has this name."""
    near = get_close_matches(name, {n for n in names if n}, 1)
    remedy = (
        f"there is one called {near[0]}"
        if near
        else f"name {'an' if kind[0] == 'o' else 'a'} {kind} of the model"
    )
    return InputError("PTM-I302", f"no {kind} is called {name}", place=place, remedy=remedy)
