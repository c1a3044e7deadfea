"""Passes the result of a reader from its sandbox (`sandbox`) to this process.

A file carries the arrays, and a JSON message (schema ``messages``) everything else. The message
names images instead of containing them: `reference` decides in this process which files may be
read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from ptmtools import schemas
from ptmtools.errors import DatabaseError
from ptmtools.scene.model import (
    FACE_ARRAYS,
    Camera,
    Storey,
    fields_of,
    room_arrays,
    rooms_of,
)
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.sandbox import run_in_sandbox, unreadable
from ptmtools.scene.source import FileRange, ModelSource, SourceMaterial, SourceTexture, SourceWrap
from ptmtools.store.archive import Stored, pack_arrays, unpack_arrays

_ARRAYS = "source.npz"
_FAULTS = (ArithmeticError, LookupError, OSError, TypeError, ValueError, DatabaseError)


@dataclass(frozen=True)
class NamedImage:
    """A reference of a model to an image.

    Attributes
    ----------
    name: file name as written in the model.
    place: location in the model, for notes.
    wrap_s, wrap_t: wrap modes beyond [0, 1].
    offset, length: byte range of the image in the model file (USDZ); None for a separate file.
    package: the separate file that the byte range refers to, "" for the model file.
    """

    name: str
    place: str
    wrap_s: SourceWrap = "repeat"
    wrap_t: SourceWrap = "repeat"
    offset: int | None = None
    length: int | None = None
    package: str = ""


#: The fields of a `SourceMaterial` that a message names images of, and these images by field and
#: number of the material.
ROLES = ("texture", "glow_map")
Images: TypeAlias = Mapping[str, Mapping[int, NamedImage]]


def pack_source(
    source: ModelSource,
    images: Images,
    notes: IngestNotes,
    scratch: str,
    files: Iterable[str] = (),
) -> dict[str, Any]:
    """The message to `read_in_sandbox`; writes the arrays into the folder ``scratch``.

    The materials of ``source`` have neither images nor normal maps. ``files`` names the other files
    that the model consists of, missing ones included.
    """
    arrays = {name: getattr(source, name) for name in FACE_ARRAYS}
    if source.colors is not None:
        arrays["colors"] = source.colors
    Path(scratch, _ARRAYS).write_bytes(pack_arrays(arrays | room_arrays(source.rooms)))
    return {
        "objects": source.objects,
        "materials": [
            {name: value for name, value in vars(material).items() if name != "normal"}
            for material in source.materials
        ],
        "images": {
            name: {str(number): vars(image) for number, image in numbered.items()}
            for name, numbered in images.items()
        },
        "cameras": [vars(camera) for camera in source.cameras],
        "kinds": source.kinds,
        "storeys": [vars(storey) for storey in source.storeys],
        "rooms": [room.name for room in source.rooms],
        "metres": source.metres,
        "up": source.up,
        "findings": notes.records(),
        "files": list(files),
    }


def read_in_sandbox(
    module: str,
    library: str,
    model: Path,
    notes: IngestNotes,
    scratch: str,
    *arguments: str,
    other_bytes: int = 0,
) -> ModelSource:
    """The source that the reader of a module packs; its arguments are the folder ``scratch``, the
    model and ``arguments``. ``other_bytes`` as in `run_in_sandbox`.

    Raises the `PtmError` of the reader, and InputError PTM-I254 if the library cannot read the
    model.
    """
    message = run_in_sandbox(
        module, library, model, scratch, model.absolute(), *arguments, other_bytes=other_bytes
    )
    try:
        schemas.check(message, schemas.MESSAGES)
        file = Path(scratch, _ARRAYS)
        arrays = unpack_arrays(file.read_bytes(), file=file)
        stored = Stored(arrays)
        points = stored.array("points", np.float64, None, 3)
        triangles = stored.indices("triangles", np.int64, None, 3, high=len(points))
        n = len(triangles)
        notes.add_records(message["findings"])
        for name in message["files"]:
            notes.folder.find(name)
        materials = [SourceMaterial(**fields_of(row)) for row in message["materials"]]
        for name, images in message["images"].items():
            with nullcontext() if name == "texture" else notes.optional():
                for number, row in images.items():
                    use: dict[str, Any] = {name: _texture(NamedImage(**row), model, notes)}
                    materials[int(number)] = replace(materials[int(number)], **use)
        objects = tuple(message["objects"])
        return ModelSource(
            points=points,
            triangles=triangles,
            uv=stored.array("uv", np.float64, n, 3, 2),
            triangle_object=stored.indices("triangle_object", np.int64, n, high=len(objects)),
            triangle_material=stored.indices("triangle_material", np.int64, n, high=len(materials)),
            objects=objects,
            materials=tuple(materials),
            cameras=tuple(Camera(**fields_of(row)) for row in message["cameras"]),
            metres=message["metres"],
            up=message["up"],
            colors=stored.array("colors", np.uint8, n, 3, 3) if "colors" in arrays else None,
            kinds=tuple(message["kinds"]),
            storeys=tuple(Storey(**row) for row in message["storeys"]),
            rooms=rooms_of(stored, message["rooms"]),
        )
    except _FAULTS as error:  # the library has corrupted its own process
        raise unreadable(library, model, str(error)) from None


def _texture(image: NamedImage, model: Path, notes: IngestNotes) -> SourceTexture | None:
    name = image.package or image.name
    embedded = image.offset is not None and not image.package
    file = model if embedded else notes.locate(name, name, image.place)
    if file is None:
        return None
    return SourceTexture(
        read=FileRange(file, image.offset or 0, image.length),
        label=file.name if image.offset is None else image.name,
        what=image.name,
        place=image.place,
        wrap_s=image.wrap_s,
        wrap_t=image.wrap_t,
    )
