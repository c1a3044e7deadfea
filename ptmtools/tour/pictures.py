"""Pictures: upright rectangles that show an image, and the side from which visitors see them.

The canvas of a picture is the part of one material. It is flat, or a slab whose front, back and
edges have that material, as many programs write them. A frame may have a texture, too: a flat part
comes first, then the larger one.

Where faces have two sides, or a slab has two faces, the winding does not say which side is the
front. Then rays decide: a picture hangs on a wall, and looks into a room.

A work is a picture beyond doubt: it shows one whole image, which the parts of a wall do not, and
hangs before a wall, which panels of a wall and windows do not.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints, areas, normals
from ptmtools.cells.search import connect
from ptmtools.embree import ray_tree
from ptmtools.scene.model import Scene

#: Cosine within which faces lie in one plane, and of the plane's angle to the vertical.
_ALIKE, _UPRIGHT = 0.99, 0.2
#: Share of the textured area that lies in the plane of a flat part; share of its rectangle that the
#: front of a slab fills; thickness of a slab, in units of its smaller side.
_MOST, _THIN = 0.9, 0.25
#: Share of the width and height of its object that a picture has: the rest is its frame.
_SHARE = 0.5
#: Greatest distance of a picture from its wall; distance from a face behind which a ray starts; in
#: metres. The most faces of the own object that a ray passes.
_ON_WALL, _NEXT, _PASSED = 0.3, 1e-4, 16
#: Sides of a picture, metres.
_LEAST, _GREATEST = 0.1, 5.0
#: Height of its lower edge above the floor, metres; span of its texture coordinates; and number of
#: objects that may show the same image.
_HANGS, _SPAN, _COPIES = 0.3, 1.05, 16
#: Distance of a point before a picture, metres.
_BEFORE = 0.1
_DOWN = np.array([0.0, -1.0, 0.0])
#: Least span of the texture coordinates of a work; metres that it is before its wall at least; the
#: start of the rays that look for the wall before the plane of a work, and their distances from its
#: edges, one of which may be that of a frame; and the edges that have a wall beside them.
_WHOLE, _PROUD, _AHEAD, _BESIDE, _EDGES = 0.8, 1e-3, 0.15, (0.08, 0.25), 3
#: Distance of a marker before a surface that one points at, metres; the most objects that a ray
#: picks, and the most surfaces that it meets.
_MARKER_BEFORE, _PICKS, _SURFACES = 0.03, 8, 64


@dataclass(frozen=True)
class PictureRectangle:
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
    def upward(self) -> Floats:
        """(3,) unit vector to its upper edge."""
        upward: Floats = np.cross(self.normal, self.right)
        return upward


@dataclass(frozen=True)
class _FlatPart:
    """A picture of one material; whether it is flat; and its thickness if it could be seen from
    behind, else None."""

    picture: PictureRectangle
    flat: bool
    thickness: float | None


class PictureFinder:
    """Finds the pictures of a scene."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._textured = np.array([m.image >= 0 for m in scene.materials], np.bool_)

    @cached_property
    def _middle(self) -> Floats:
        points = self._scene.points
        middle: Floats = (points.min(axis=0) + points.max(axis=0)) / 2
        return middle

    @cached_property
    def _tree(self) -> Any:
        return ray_tree(self._scene.corners - self._middle)

    def _corners(self, faces: Ints) -> Floats:
        # Not all of the scene's, for each object.
        return self._scene.points[self._scene.triangles[faces]]

    def first(self, start: Floats, along: Floats) -> tuple[int, float]:
        """The first face of the scene along a ray, -1 for none, and its distance in units of the
        ray."""
        return first_face(self._tree, start - self._middle, along)

    def picture_of(self, faces: Ints) -> PictureRectangle | None:
        """The picture that an object with the faces (n,) is; None if it is none."""
        textured = faces[self._textured[self._scene.triangle_material[faces]]]
        if not len(textured):
            return None
        points = self._corners(faces).reshape(-1, 3)
        parts = [part for part in self._parts(textured) if _fills(part.picture, points)]
        if not parts:
            return None
        best = max(parts, key=lambda part: (part.flat, part.picture.width * part.picture.height))
        return self._facing_the_room(best, faces)

    def work_of(self, canvas: Ints, faces: Ints) -> PictureRectangle | None:
        """The picture that the ``canvas`` of an object with ``faces`` is, faces of one material, if
        it hangs before a wall."""
        part = self._part(canvas)
        picture = None if part is None else self._facing_the_room(part, faces)
        if picture and self.hangs(picture) and self._hangs_before_a_wall(picture, faces):
            return picture
        return None

    def hangs(self, picture: PictureRectangle) -> bool:
        """Whether a picture has a plausible size and is not a wall."""
        if not all(_LEAST <= side <= _GREATEST for side in (picture.width, picture.height)):
            return False
        before = picture.centre + _BEFORE * picture.normal
        return self.first(before, _DOWN)[1] > picture.height / 2 + _HANGS

    def _facing_the_room(self, part: _FlatPart, faces: Ints) -> PictureRectangle:
        if part.thickness is None or not self._looks_at_a_wall(part, faces):
            return part.picture
        return _other_side(part.picture, part.thickness)

    def _hangs_before_a_wall(self, picture: PictureRectangle, faces: Ints) -> bool:
        """Whether there is a wall behind a picture, an object with ``faces``, that goes on beside
        it."""
        if not 0 < self._gap(picture.centre, 0.0, picture, faces) <= _ON_WALL:
            return False
        edges = 0
        for way, size in ((picture.right, picture.width), (picture.upward, picture.height)):
            for sign in (-1.0, 1.0):
                points = (picture.centre + sign * (size / 2 + away) * way for away in _BESIDE)
                gaps = (self._gap(point, _AHEAD, picture, faces) for point in points)
                edges += any(_PROUD < gap <= _ON_WALL for gap in gaps)
        return edges >= _EDGES

    def _gap(self, point: Floats, ahead: float, picture: PictureRectangle, faces: Ints) -> float:
        """Metres from the plane of a picture to the first face behind a point of it, but for
        ``faces``, from ``ahead`` of the plane on; infinite if one sees through that."""
        start = point + ahead * picture.normal
        hit, away = self._first_other(start, -picture.normal, faces)
        transparent = (
            hit < 0 or self._scene.materials[self._scene.triangle_material[hit]].transparent
        )
        return np.inf if transparent else away - ahead

    def _parts(self, faces: Ints) -> Iterator[_FlatPart]:
        """Those of each material of the faces."""
        material = self._scene.triangle_material[faces]
        for number in np.unique(material).tolist():
            part = self._part(faces[material == number])
            if part:
                yield part

    def _part(self, faces: Ints) -> _FlatPart | None:
        """The rectangle in the plane of the largest of the faces, if that is upright and nearly all
        that one sees of them."""
        corners = self._corners(faces)
        size, across = areas(corners), normals(corners)
        length = np.linalg.norm(across, axis=1)
        across = across / np.maximum(length, np.finfo(np.float64).tiny)[:, None]
        main = across[int(size.argmax())]
        front, behind = across @ main > _ALIKE, across @ main < -_ALIKE
        if abs(main[1]) > _UPRIGHT or not front.any():
            return None
        right = np.cross([0.0, 1.0, 0.0], main)
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(main, right), main], axis=1)
        low, high = _span(corners[front] @ axes)
        width, height = float(high[0] - low[0]), float(high[1] - low[1])
        middle = (low + high) / 2
        centre = axes @ [middle[0], middle[1], high[2]]
        first, last = _span(corners @ axes)
        thickness = float(last[2] - first[2])
        shown, whole = float(size[front].sum()), float(size.sum())
        flat = shown >= _MOST * whole
        slab = thickness <= _THIN * min(width, height) and shown >= _MOST * width * height
        if not flat and not slab:
            return None
        two = bool(self._scene.two_sided[faces[front]].any())
        back = two or float(size[behind].sum()) >= _MOST * shown
        picture = PictureRectangle(centre, main, right, width, height)
        return _FlatPart(picture, flat, thickness if back else None)

    def _looks_at_a_wall(self, part: _FlatPart, faces: Ints) -> bool:
        """Whether visitors see a part from behind: something is just before it, and nothing behind
        it; or out of the building before it."""
        picture = part.picture
        back = picture.centre - picture.normal * (part.thickness or 0)
        _, before = self._first_other(picture.centre, picture.normal, faces)
        _, behind = self._first_other(back, -picture.normal, faces)
        if (before < _ON_WALL) != (behind < _ON_WALL):
            return before < _ON_WALL
        return bool(np.isinf(before) and np.isfinite(behind))

    def _first_other(self, start: Floats, along: Floats, faces: Ints) -> tuple[int, float]:
        """The first face along a unit vector that is not one of ``faces``, -1 for none, and its
        distance."""
        away = _NEXT
        for _ in range(_PASSED):
            hit, step = self.first(start + away * along, along)
            if hit < 0:
                return -1, np.inf
            away += step
            if not (faces == hit).any():
                return hit, away
            away += _NEXT
        return hit, away


def works_of(scene: Scene) -> Bools:
    """(T,) the faces of works, without their frames if these have another material. An object may
    be several, such as all canvases of one image."""
    textured = np.array([m.image >= 0 and not m.transparent for m in scene.materials], np.bool_)
    candidates = np.zeros(len(scene.objects), np.bool_)
    candidates[scene.triangle_object[textured[scene.triangle_material]]] = True
    order = np.argsort(scene.triangle_object, kind="stable")
    start = np.searchsorted(scene.triangle_object[order], np.arange(len(candidates) + 1))
    objects = [order[start[n] : start[n + 1]] for n in np.flatnonzero(candidates).tolist()]
    shown = Counter(image for faces in objects for image in images_once(scene, faces))
    finder = PictureFinder(scene)
    result = np.zeros(len(order), np.bool_)
    for faces in objects:
        material = scene.triangle_material[faces]
        for number in np.unique(material[textured[material]]).tolist():
            canvas = faces[material == number]
            if shown[scene.materials[number].image] <= _COPIES and all(
                images_once(scene, part, _WHOLE) and finder.work_of(part, faces)
                for part in _components(scene, canvas)
            ):
                result[canvas] = True
    return result


def _components(scene: Scene, faces: Ints) -> Iterator[Ints]:
    """The parts of (n,) faces that share no places."""
    corner = scene.points[scene.triangles[faces]].reshape(-1, 3)
    _, place = np.unique(corner, axis=0, return_inverse=True)
    place = place.reshape(-1, 3)
    group = connect(int(place.max()) + 1, place)[place[:, 0]]
    for number in np.unique(group).tolist():
        yield faces[group == number]


def images_once(scene: Scene, faces: Ints, least: float = 0.0) -> set[int]:
    """The images that the faces of an object show once, and at least this share of their sides."""
    images = set()
    for material in np.unique(scene.triangle_material[faces]).tolist():
        image = scene.materials[material].image
        if image >= 0:
            uv = scene.uv[faces[scene.triangle_material[faces] == material]].reshape(-1, 2)
            span = np.ptp(uv, axis=0)
            if (span <= _SPAN).all() and (span >= least).all():
                images.add(image)
    return images


def shows_an_image(scene: Scene, faces: Ints, shown: Counter[int]) -> bool:
    """Whether an object shows an image once that few objects show."""
    return any(shown[image] <= _COPIES for image in images_once(scene, faces))


@dataclass(frozen=True)
class Pick:
    """An object on a ray.

    Attributes
    ----------
    object: its name, "" if it has none.
    at: place of a marker just before it, world metres.
    """

    object: str
    at: tuple[float, float, float]


def pick_objects(
    scene: Scene, pictures: PictureFinder, eye: Floats, direction: Floats
) -> list[Pick]:
    """The objects that a ray meets up to the first opaque one: glass, and the work behind it. Faces
    with one side are met from their front only, as the page draws them.

    Parameters
    ----------
    eye: (3,) world metres. direction: (3,) of any length but 0.
    """
    along = direction / np.linalg.norm(direction)
    away, picks = 0.0, list[Pick]()
    for _ in range(_SURFACES):
        face, step = pictures.first(eye + away * along, along)
        if face < 0 or len(picks) == _PICKS:
            break
        away += step
        across = normals(scene.corners[face][None])[0]
        if scene.two_sided[face] or across @ along < 0:
            name = scene.objects[scene.triangle_object[face]]
            if not any(name == pick.object for pick in picks):
                at = eye + max(away - _MARKER_BEFORE, 0) * along
                x, y, z = (round(float(value), 3) for value in at)
                picks.append(Pick(name, (x, y, z)))
            if not scene.materials[scene.triangle_material[face]].transparent:
                break
        away += _NEXT
    return picks


def first_face(tree: Any, start: Floats, along: Floats) -> tuple[int, float]:
    """The first face of a tree along a ray, -1 for none, and its distance in units of the ray."""
    answer = tree.run(start[None].astype(np.float32), along[None].astype(np.float32), output=1)
    hit = int(answer["primID"][0])
    return hit, float(answer["tfar"][0]) if hit >= 0 else np.inf


def _span(points: Floats) -> tuple[Floats, Floats]:
    flat = points.reshape(-1, 3)
    return flat.min(axis=0), flat.max(axis=0)


def _fills(picture: PictureRectangle, points: Floats) -> bool:
    """Whether a picture is a large part of its object, whose points are (n, 3)."""
    low, high = _span(points @ np.stack([picture.right, picture.upward, picture.normal], axis=1))
    width, height, _ = high - low
    return bool(picture.width >= _SHARE * width and picture.height >= _SHARE * height)


def _other_side(picture: PictureRectangle, thickness: float) -> PictureRectangle:
    """The other side of a picture."""
    return replace(
        picture,
        centre=picture.centre - picture.normal * thickness,
        normal=-picture.normal,
        right=-picture.right,
    )
