"""Places the labels of a tour in the scene: markers, and the boxes that a click hits.

A label describes the objects of its name. If nearly all of their textured area lies in one upright
plane and faces one way, as that of a picture does, the marker is in front of the lower edge of that
part; elsewhere it is above the objects.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from ptmtools.arrays import Floats, Ints, areas, normals
from ptmtools.errors import InputError
from ptmtools.scene.model import Scene
from ptmtools.tour.model import Label, Tour

#: Cosine within which faces lie in one plane, and of the plane's angle to the vertical.
_ALIKE, _UPRIGHT = 0.99, 0.2
#: Share of the textured area that lies in that plane.
_MOST = 0.9
#: Distance of a marker from its picture, and its height above other objects, metres.
_BEFORE, _ABOVE = 0.03, 0.12
#: Height of the marker of a room above its floor, metres.
_ROOM_HEIGHT = 1.5


@dataclass(frozen=True)
class Picture:
    """An upright rectangle around a flat part of an object, metres.

    Attributes
    ----------
    centre, normal, right: (3,) its centre, unit normal of its front, and unit vector to the right.
    width, height: along `right`, and along the third axis, which points up.
    """

    centre: Floats
    normal: Floats
    right: Floats
    width: float
    height: float

    @property
    def up(self) -> Floats:
        """(3,) unit vector to its upper edge."""
        up: Floats = np.cross(self.normal, self.right)
        return up


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
    picture: Picture | None = None


def anchors(tour: Tour, scene: Scene) -> list[Anchor]:
    """The anchor of each label.

    Raises InputError: PTM-I302 the scene has no object or no room of that name.
    """
    faces = faces_of_objects(scene)
    return [_anchor(label, number, scene, faces) for number, label in enumerate(tour.labels)]


def faces_of_objects(scene: Scene) -> dict[str, Ints]:
    """Name → the faces, ascending, of all objects of that name."""
    order = np.argsort(scene.triangle_object, kind="stable")
    starts = np.searchsorted(scene.triangle_object[order], np.arange(1, len(scene.objects)))
    faces: dict[str, Ints] = {}
    for name, own in zip(scene.objects, np.split(order, starts), strict=True):
        faces[name] = np.sort(np.concatenate([faces[name], own])) if name in faces else own
    return faces


def _anchor(label: Label, number: int, scene: Scene, faces: Mapping[str, Ints]) -> Anchor:
    if label.object:
        own = faces.get(label.object, np.zeros(0, np.int64))
        if not len(own):
            raise _unknown("object", label.object, scene.objects, number)
        return of_faces(scene, own)
    if label.room:
        rooms = [room for room in scene.rooms if room.name == label.room and len(room.points)]
        if not rooms:
            raise _unknown("room", label.room, [room.name for room in scene.rooms], number)
        low, high = rooms[0].points.min(axis=0), rooms[0].points.max(axis=0)
        marker = (low + high) / 2
        marker[1] = min(low[1] + _ROOM_HEIGHT, high[1])
        return Anchor(marker, marker, marker)
    at = np.array(label.at, dtype=np.float64)
    return Anchor(at, at, at)


def of_faces(scene: Scene, own: Ints) -> Anchor:
    """The anchor of an object with the faces (n,)."""
    corners = scene.corners[own].reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    picture = picture_of(scene, own)
    if picture is None:
        marker = np.array([(low[0] + high[0]) / 2, high[1] + _ABOVE, (low[2] + high[2]) / 2])
    else:
        lower = picture.centre - picture.up * picture.height / 2
        # A frame may stand out before the picture.
        out = float(((corners - picture.centre) @ picture.normal).max(initial=0))
        marker = lower + picture.normal * (max(out, 0) + _BEFORE)
    return Anchor(marker, low, high, picture)


def picture_of(scene: Scene, own: Ints) -> Picture | None:
    """The rectangle around the textured part of an object with the faces (n,), where that is
    upright and flat."""
    textured = np.array([material.image >= 0 for material in scene.materials], np.bool_)
    faces = own[textured[scene.triangle_material[own]]]
    if not len(faces):
        return None
    corners = scene.corners[faces]
    size, across = areas(corners), normals(corners)
    length = np.linalg.norm(across, axis=1)
    across = across / np.maximum(length, np.finfo(np.float64).tiny)[:, None]
    main = across[int(size.argmax())]
    alike = across @ main > _ALIKE
    # A frame may have a texture, too; the picture is the largest part of one material.
    flat = faces[alike]
    if not len(flat):
        return None
    material = scene.triangle_material[flat]
    weights = np.bincount(material, weights=size[alike])
    largest = int(weights.argmax())
    of_material = scene.triangle_material[faces] == largest
    if abs(main[1]) > _UPRIGHT or weights[largest] < _MOST * size[of_material].sum():
        return None
    right = np.cross([0.0, 1.0, 0.0], main)
    right /= np.linalg.norm(right)
    up = np.cross(main, right)
    points = scene.corners[flat[material == largest]].reshape(-1, 3)
    sides = points @ np.stack([right, up, main], axis=1)
    low, high = sides.min(axis=0), sides.max(axis=0)
    middle = (low + high) / 2
    centre = middle[0] * right + middle[1] * up + high[2] * main
    return Picture(centre, main, right, float(high[0] - low[0]), float(high[1] - low[1]))


def _unknown(kind: str, name: str, names: Sequence[str], number: int) -> InputError:
    near = get_close_matches(name, {n for n in names if n}, 1)
    remedy = (
        f"there is one called {near[0]}"
        if near
        else f"name {'an' if kind[0] == 'o' else 'a'} {kind} of the model"
    )
    return InputError(
        "PTM-I302", f"no {kind} is called {name}", place=f"labels[{number}].{kind}", remedy=remedy
    )
