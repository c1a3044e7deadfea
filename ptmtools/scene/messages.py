"""Hands what a reader has made of a model from a process apart (`apart`) to this one.

Arrays go through a file, all else through the answer. Images are handed over by name: which files
may be read, and where they are, is judged here (`reference`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools import schemas
from ptmtools.errors import DatabaseError
from ptmtools.scene.model import Camera, Storey, fields_of
from ptmtools.scene.sandbox import run_apart, unreadable
from ptmtools.scene.source import (
    FileRange,
    Findings,
    Source,
    SourceMaterial,
    SourceWrap,
    Texture,
)
from ptmtools.store.archive import pack_arrays, unpack_arrays
from ptmtools.store.checked import Stored

_ARRAYS = "source.npz"
_NAMES = ("points", "triangles", "uv", "triangle_object", "triangle_material")
_FAULTS = (ArithmeticError, LookupError, OSError, TypeError, ValueError, DatabaseError)


@dataclass(frozen=True)
class NamedImage:
    """An image as a model names it.

    Attributes
    ----------
    name: of its file, as it stands in the model.
    place: where in the model, for notes.
    wrap_s, wrap_t: beyond [0, 1].
    offset, length: bytes of the model's own file that hold it (USDZ); None for a file beside it.
    package: the file beside the model that these are bytes of, if it is not the model's own.
    """

    name: str
    place: str
    wrap_s: SourceWrap = "repeat"
    wrap_t: SourceWrap = "repeat"
    offset: int | None = None
    length: int | None = None
    package: str = ""


def hand_over(
    source: Source,
    images: dict[int, NamedImage],
    findings: Findings,
    scratch: str,
    files: Iterable[str] = (),
) -> dict[str, Any]:
    """The answer for `take_over`.

    ``source`` has materials without textures; ``images`` are those of its materials, by number;
    ``files`` are named that it was read from, or should have been, beside the model.
    """
    arrays = {name: getattr(source, name) for name in _NAMES}
    if source.colors is not None:
        arrays["colors"] = source.colors
    Path(scratch, _ARRAYS).write_bytes(pack_arrays(arrays))
    return {
        "objects": source.objects,
        "materials": [vars(material) for material in source.materials],
        "images": {str(number): vars(image) for number, image in images.items()},
        "cameras": [vars(camera) for camera in source.cameras],
        "kinds": source.kinds,
        "storeys": [vars(storey) for storey in source.storeys],
        "metres": source.metres,
        "up": source.up,
        "findings": findings.told(),
        "files": list(files),
    }


def take_over(
    module: str,
    library: str,
    model: Path,
    findings: Findings,
    scratch: str,
    *arguments: str,
    beside: int = 0,
) -> Source:
    """What a module's reader, called with the folder ``scratch``, the model and ``arguments``, has
    handed over; ``beside`` as of `run_apart`.

    Raises the reader's own `PtmError`, and InputError PTM-I254 for what the library cannot read.
    """
    answer = run_apart(module, library, model, scratch, model.absolute(), *arguments, beside=beside)
    try:
        schemas.check(answer, schemas.HANDED)
        file = Path(scratch, _ARRAYS)
        arrays = unpack_arrays(file.read_bytes(), file=file)
        stored = Stored(arrays)
        points = stored.array("points", np.float64, None, 3)
        triangles = stored.indices("triangles", np.int64, None, 3, high=len(points))
        n = len(triangles)
        findings.take(answer["findings"])
        for name in answer["files"]:
            findings.folder.find(name)
        materials = [SourceMaterial(**fields_of(row)) for row in answer["materials"]]
        for number, row in answer["images"].items():
            texture = _texture(NamedImage(**row), model, findings)
            materials[int(number)] = replace(materials[int(number)], texture=texture)
        objects = tuple(answer["objects"])
        return Source(
            points=points,
            triangles=triangles,
            uv=stored.array("uv", np.float64, n, 3, 2),
            triangle_object=stored.indices("triangle_object", np.int64, n, high=len(objects)),
            triangle_material=stored.indices("triangle_material", np.int64, n, high=len(materials)),
            objects=objects,
            materials=tuple(materials),
            cameras=tuple(Camera(**fields_of(row)) for row in answer["cameras"]),
            metres=answer["metres"],
            up=answer["up"],
            colors=stored.array("colors", np.uint8, n, 3, 3) if "colors" in arrays else None,
            kinds=tuple(answer["kinds"]),
            storeys=tuple(Storey(**row) for row in answer["storeys"]),
        )
    except _FAULTS as error:  # the library has spoilt its own process
        raise unreadable(library, model, str(error)) from None


def _texture(image: NamedImage, model: Path, findings: Findings) -> Texture | None:
    if image.offset is None:
        file = findings.locate(image.name, image.name, image.place)
        if file is None:
            return None
        read, label = FileRange(file), file.name
    else:
        package: Path | None = model
        if image.package:
            package = findings.locate(image.package, image.package, image.place)
        if package is None:
            return None
        read, label = FileRange(package, image.offset, image.length), image.name
    return Texture(
        read=read,
        label=label,
        what=image.name,
        place=image.place,
        wrap_s=image.wrap_s,
        wrap_t=image.wrap_t,
    )
