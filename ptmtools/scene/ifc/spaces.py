"""The rooms of an IFC file: which spaces are rooms, and their names.

A space (IfcSpace) is never drawn. Spaces that contain other spaces, gross floor areas and spaces
without a volume are no rooms; `ptmtools.cells.room_volumes` tests the meshes of the others.

A room has the long name of its space ("Kitchen"); if other rooms have the same one, or if there is
none, the name, which most programs fill with a number, is added ("Office 1.07").
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.ifc.entities import FAULTS, has_body, name_of, one_line
from ptmtools.scene.model import RoomVolume
from ptmtools.scene.notes import IngestNotes

_SPACE = "IfcSpace"
#: A space of this composition contains others, one of the next is a part of another.
_WHOLE, _PART = "COMPLEX", "PARTIAL"
#: Types of spaces that are no rooms: gross floor areas.
_AREAS = ("GFA",)
_NO_MESH: tuple[Floats, Ints] = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
#: Triangles of a space; a room with a curved wall has hundreds.
_MOST_TRIANGLES = 20_000


def rooms_of(file: Any, notes: IngestNotes) -> list[Any]:
    """The spaces that may be rooms, in the order of their numbers; notes the others."""
    result, left = [], Counter[str]()
    for space in sorted(file.by_type(_SPACE), key=lambda space: int(space.id())):
        try:
            fault = _fault(space)
        except FAULTS:
            fault = "an attribute has a wrong type"
        if not fault:
            result.append(space)
        left[fault] += 1
    for fault, count in left.items():
        if fault:
            notes.note("PTM-N215", f"{_SPACE}: no room ({fault})", "", count)
    return result


def _fault(space: Any) -> str:
    """The reason why a space is no room, "" if it may be one."""
    if space.Representation is None or not has_body(space):
        return "without a volume"
    if space.CompositionType == _WHOLE or any(
        part.is_a(_SPACE) and part.CompositionType != _PART for part in _parts(space)
    ):
        return "contains other spaces"
    if space.CompositionType == _PART and any(
        whole.is_a(_SPACE) and whole.Representation and whole.CompositionType != _WHOLE
        for relation in space.Decomposes
        for whole in [relation.RelatingObject]
    ):
        return "part of another space"
    if getattr(space, "PredefinedType", None) in _AREAS:
        return "gross floor area"
    return ""


def _parts(space: Any) -> list[Any]:
    return [part for relation in space.IsDecomposedBy for part in relation.RelatedObjects]


def named_rooms(
    spaces: Sequence[Any], meshes: Mapping[int, tuple[Floats, Ints]], notes: IngestNotes
) -> tuple[RoomVolume, ...]:
    """The rooms of spaces; ``meshes`` are their points and triangles by number. Notes the spaces
    without a mesh."""
    long_names = Counter(_long_name(space) for space in spaces)
    rooms = []
    for space in spaces:
        points, triangles = meshes.get(space.id(), _NO_MESH)
        name, number = _long_name(space), name_of(space)
        if not len(triangles) or not np.isfinite(points).all():
            notes.note("PTM-N215", f"{_SPACE}: no room (its volume cannot be computed)")
        elif len(triangles) > _MOST_TRIANGLES:
            notes.note("PTM-N215", f"{_SPACE}: no room (more than {_MOST_TRIANGLES} triangles)")
        else:
            if (long_names[name] > 1 and number not in name) or not name:
                name = one_line(f"{name} {number}")
            rooms.append(RoomVolume(name, points, triangles.astype(np.int32)))
    return tuple(rooms)


def _long_name(space: Any) -> str:
    return one_line(space.LongName or "")
