"""Other representations of objects than their meshes, such as octree textures.

A `Representation` declares a kind, by an entry point of the group ``ptmtools.representations``. A
stage that makes it for some objects of a database has `Stage.representation`, which returns a
`Represented`. The served files carry it in one way for all kinds: a list in the index of the hints
has a row for each object, and nodes of the GLBs name their row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ptmtools import plugins
from ptmtools.lazy import Lazy

if TYPE_CHECKING:
    from ptmtools.output.model import TextureRecord
    from ptmtools.output.object_maps import ObjectMaps

#: A row of a list in the index of the hints.
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Representation:
    """A kind of representation.

    Attributes
    ----------
    name: of its list in the index of the hints, such as "octrees".
    noun: of one of them in messages, such as "octree texture".
    member: of the "extras" of an object's node in GLBs, with the number of its row.
    folder: of its files in the served folder.
    script: the file of the script that draws it in a walk, ``statues.js``.
    check: function that checks the rows in ``hints`` and their files in a served database.
    painter: opens the painter of a `Served` database that has such a list, an `ObjectPainter` of
        `ptmtools.rendering.painting`.
    published: from a `Served` database and the file and SHA-256 of a URL to the rows of a site's
        index, each with its file.
    warm_up: calls the compiled kernels that making and drawing it need.
    """

    name: str
    noun: str
    member: str
    folder: str
    script: Path
    check: Lazy[Callable[[Any, Any], None]]
    painter: Lazy[Callable[[Any], Any]]
    published: Lazy[
        Callable[[Any, Callable[[str], tuple[Path, str]]], Iterable[tuple[Row, Path, str]]]
    ]
    warm_up: Lazy[Callable[[], None]]


@dataclass(frozen=True)
class Represented:
    """The objects of a database that have a representation.

    Attributes
    ----------
    objects: their numbers in the scene, ascending.
    kind: None of objects that only have normal maps of their own.
    rows: of the list in the index of the hints, one for each object.
    maps, textures: the places of objects in their normal maps, and the map of each.
    """

    objects: tuple[int, ...]
    kind: Representation | None = None
    rows: Sequence[Row] = ()
    maps: ObjectMaps | None = None
    textures: tuple[TextureRecord, ...] = ()


def representations() -> tuple[Representation, ...]:
    """All kinds, in the order of their names; raises as `plugins.declarations`."""
    return tuple(plugins.declarations("representations", Representation).values())


def representations_in(index: Mapping[str, Any]) -> Iterator[Representation]:
    """The kinds that an index of the hints, or of a site, has a list of."""
    return (kind for kind in representations() if index.get(kind.name))


def replaced_objects(represented: Iterable[Represented]) -> frozenset[int]:
    """The objects of the scene with another representation."""
    return frozenset(number for kind in represented for number in kind.objects)


def object_maps(represented: Iterable[Represented]) -> ObjectMaps | None:
    """The places of objects in their normal maps, if there are any."""
    return next((kind.maps for kind in represented if kind.maps), None)


def node_extras(represented: Iterable[Represented]) -> dict[int, dict[str, int]]:
    """Object of the scene → the members of its nodes' "extras": of each kind of representation the
    number of its row."""
    extras: dict[int, dict[str, int]] = {}
    for objects in represented:
        if objects.kind:
            for row, number in enumerate(objects.objects):
                extras.setdefault(number, {})[objects.kind.member] = row
    return extras
