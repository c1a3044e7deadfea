"""Division of a model into the objects of a campus: those that it names, and small ones joined.

Each object has meshes, a lightmap and a place in the client's order, so thousands of lamps and
chairs would each take three lightmaps and a request. Objects smaller than a few metres are joined
with the small ones of the same square of a grid on the ground; larger ones stay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import LimitError
from ptmtools.scene.model import Scene

#: Side of the grid's squares, in sizes of the largest small object.
SQUARE = 4
#: Most objects of a campus.
MAX_OBJECTS = 20_000
#: An object with more than this share of all faces gets a note.
MOST_FACES = 0.8


@dataclass(frozen=True)
class ObjectPart:
    """An object of the campus.

    Attributes
    ----------
    label: for visitors.
    parts: names of the model's objects in it.
    triangles: (n,) int64 of the scene, ascending.
    """

    label: str
    parts: tuple[str, ...]
    triangles: Ints


def parts_of(scene: Scene, small: float) -> tuple[ObjectPart, ...]:
    """The objects of a scene, in the order of the model; ``small`` as in `CampusOptions`.

    Raises LimitError: PTM-L400 there are more than `MAX_OBJECTS`.
    """
    count = len(scene.objects)
    box = _boxes(scene.corners, scene.triangle_object, count)
    group = np.arange(count)
    diagonal = np.linalg.norm(box[:, 3:] - box[:, :3], axis=1)
    tiny = np.flatnonzero(diagonal < small)
    if len(tiny):
        middle = (box[tiny, :3] + box[tiny, 3:]) / 2
        square = np.floor(middle[:, [0, 2]] / (SQUARE * small))
        _, first, place = np.unique(square, axis=0, return_index=True, return_inverse=True)
        group[tiny] = tiny[first][place.ravel()]
    kept, of_object = np.unique(group, return_inverse=True)
    if len(kept) > MAX_OBJECTS:
        raise LimitError(
            "PTM-L400",
            f"{len(kept):,} objects, more than {MAX_OBJECTS:,}",
            remedy="join more of them with --small, or divide the model",
        )
    order = np.argsort(of_object[scene.triangle_object], kind="stable")
    sizes = np.bincount(of_object[scene.triangle_object], minlength=len(kept))
    members = np.argsort(of_object, kind="stable")
    named = np.split(members, np.cumsum(np.bincount(of_object))[:-1])
    parts = []
    for triangles, these in zip(np.split(order, np.cumsum(sizes)[:-1]), named, strict=True):
        names = tuple(scene.objects[i] for i in these.tolist())
        parts.append(ObjectPart(_label(names), names, triangles))
    return tuple(parts)


def notes_on(parts: Sequence[ObjectPart]) -> tuple[str, ...]:
    """Notes on the division into objects."""
    joined = [part for part in parts if len(part.parts) > 1]
    notes = []
    if joined:
        count = sum(len(part.parts) for part in joined)
        notes.append(
            f"{count:,} small objects of the model are {len(joined):,} of the campus (--small)"
        )
    faces = [len(part.triangles) for part in parts]
    if max(faces) > MOST_FACES * sum(faces):
        share = max(faces) / sum(faces)
        label = parts[faces.index(max(faces))].label
        notes.append(
            f"{label} has {share:.0%} of all faces, and a client loads objects as a whole; "
            "divide it in the model if it is more than a building"
        )
    return tuple(notes)


def _boxes(corners: Floats, owner: np.ndarray, count: int) -> Floats:
    """(count, 6) bounding boxes of objects; ``owner``: (T,) the object of each face."""
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, owner, corners.min(axis=1))
    np.maximum.at(high, owner, corners.max(axis=1))
    return np.concatenate([low, high], axis=1)


def _label(names: tuple[str, ...]) -> str:
    others = len(names) - 1
    return names[0] if not others else f"{names[0]} and {others:,} more"
