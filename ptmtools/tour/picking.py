"""What a visitor points at: objects of the scene along a ray."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, normals
from ptmtools.scene.model import Scene
from ptmtools.tour.pictures import Pictures

#: Distance of a marker before the surface, metres; and from a surface behind which the ray goes on.
_BEFORE, _NEXT = 0.03, 1e-4
#: The most objects, and the most surfaces that a ray meets.
_MOST, _SURFACES = 8, 64


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


def picked(scene: Scene, pictures: Pictures, eye: Floats, direction: Floats) -> list[Pick]:
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
        if face < 0 or len(picks) == _MOST:
            break
        away += step
        across = normals(scene.corners[face][None])[0]
        if scene.two_sided[face] or across @ along < 0:
            name = scene.objects[scene.triangle_object[face]]
            if not any(name == pick.object for pick in picks):
                at = eye + max(away - _BEFORE, 0) * along
                x, y, z = (round(float(value), 3) for value in at)
                picks.append(Pick(name, (x, y, z)))
            if not scene.materials[scene.triangle_material[face]].transparent:
                break
        away += _NEXT
    return picks
