"""The table of input formats.

A format is one declared `ModelFormat`: its suffixes, its reader, and what the format prescribes.
Nothing else branches on a format or a suffix. Packages add formats through entry points of the
group ``ptmtools.formats`` (`ptmtools.plugins`). Readers and their libraries are imported when a
file of the format is read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Literal

from ptmtools import plugins
from ptmtools.errors import InputError, LimitError, MissingComponentError
from ptmtools.lazy import Lazy
from ptmtools.scene.options import MAX_VERTICES, IngestOptions, damage, too_many_triangles

if TYPE_CHECKING:
    from ptmtools.progress import Progress
    from ptmtools.scene.notes import IngestNotes
    from ptmtools.scene.source import FileFacts, ModelSource, Purpose, SecondReading


@dataclass(frozen=True)
class ModelFormat:
    """An input format.

    Attributes
    ----------
    name: the key in the table.
    about: its usual name, for people.
    suffixes: of its files, in lower case, with the dot.
    reader: reads a file into triangles in its units and axes. An OSError becomes PTM-I122, and a
        ValueError PTM-I254, a damaged file. The notes resolve the names of other files, and record
        what is missing or dropped.
    metres, up: the unit and the up axis that it prescribes for all files; None if each file records
        its own (`ModelSource`), or none does.
    usual_up: the up axis by convention, where neither the format nor the file defines one.
    module, install: a library that the reader imports, and how to install it.
    facts: reads the head of a file, for ``ptm info``.
    second: reads a file again with other textures than the colours; None if it names none.
    """

    name: str
    about: str
    suffixes: tuple[str, ...]
    reader: Lazy[Callable[[Path, IngestNotes, IngestOptions, Progress], ModelSource]]
    metres: float | None = None
    up: Literal["y", "z"] | None = None
    usual_up: Literal["y", "z"] | None = None
    module: str = ""
    install: str = ""
    facts: Lazy[Callable[[Path], FileFacts]] | None = None
    second: Lazy[Callable[[Path, IngestOptions, Purpose], SecondReading | None]] | None = None

    def read(
        self, model: Path, notes: IngestNotes, options: IngestOptions, progress: Progress
    ) -> ModelSource:
        """The triangles of a file.

        Raises the errors of the reader; MissingComponentError PTM-M100 without its library; and
        LimitError PTM-L203 for more triangles than ``options`` allow, or more vertices than int32
        can number.
        """
        if self.module and find_spec(self.module) is None:
            message = f"{self.about} requires the module {self.module}"
            raise MissingComponentError("PTM-M100", message, file=model, remedy=self.install)
        try:
            source = self.reader.load()(model, notes, options, progress)
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError("PTM-I122", reason, file=error.filename or model) from None
        except ValueError as error:
            raise damage(model, str(error)) from None
        if len(source.triangles) > options.max_triangles:
            raise too_many_triangles(options.max_triangles, model)
        if len(source.points) > MAX_VERTICES or len(source.triangles) > MAX_VERTICES:
            message = f"more than {MAX_VERTICES} vertices or faces"
            raise LimitError("PTM-L203", message, file=model, remedy="split the model")
        return source


OBJ = ModelFormat(
    "obj", "Wavefront OBJ", (".obj",), Lazy("ptmtools.scene.obj:read_obj"), usual_up="y"
)
GLTF = ModelFormat(
    name="gltf",
    about="glTF",
    suffixes=(".gltf",),
    reader=Lazy("ptmtools.scene.gltf.reader:read_gltf"),
    metres=1.0,
    up="y",
    facts=Lazy("ptmtools.scene.gltf.document:facts_of"),
    second=Lazy("ptmtools.scene.gltf.reader:read_again"),
)
GLB = replace(GLTF, name="glb", about="glTF binary", suffixes=(".glb",))
COLLADA = ModelFormat(
    name="dae",
    about="COLLADA",
    suffixes=(".dae",),
    reader=Lazy("ptmtools.scene.collada.reader:read_collada"),
    usual_up="y",
)
VRML = ModelFormat(
    name="wrl",
    about="VRML",
    suffixes=(".wrl", ".wrz", ".vrml"),
    reader=Lazy("ptmtools.scene.x3d.reader:read_x3d"),
    metres=1.0,
    up="y",
)
X3D = replace(VRML, name="x3d", about="X3D", suffixes=(".x3d", ".x3dv"))
IFC = ModelFormat(
    name="ifc",
    about="IFC",
    suffixes=(".ifc",),
    reader=Lazy("ptmtools.scene.ifc.reader:read_ifc"),
    up="z",
    module="ifcopenshell",
    install="pip install 'ptmtools[ifc]'",
)
IFCZIP = replace(
    IFC, name="ifczip", suffixes=(".ifczip",), reader=Lazy("ptmtools.scene.ifc.reader:read_ifczip")
)
USD = ModelFormat(
    name="usd",
    about="USD",
    suffixes=(".usd", ".usda", ".usdc"),
    reader=Lazy("ptmtools.scene.usd.reader:read_usd"),
    module="pxr",
    install="pip install 'ptmtools[usd]'",
)
USDZ = replace(USD, name="usdz", about="USDZ", suffixes=(".usdz",))


def _mesh_format(name: str, about: str = "", reader: str = "read_by_pymeshlab") -> ModelFormat:
    place = f"ptmtools.scene.libraries:{reader}"
    return ModelFormat(name, about or name.upper(), (f".{name}",), Lazy(place))


#: The formats of this package by name.
FORMATS = {
    row.name: row
    for row in (
        *(OBJ, GLB, GLTF),
        _mesh_format("ply", reader="read_ply"),
        _mesh_format("stl", reader="read_stl"),
        _mesh_format("off", reader="read_off"),
        _mesh_format("3ds", "3D Studio"),
        _mesh_format("3mf"),
        _mesh_format("ctm", "OpenCTM"),
        *(COLLADA, VRML, X3D, IFC, IFCZIP, USD, USDZ),
    )
}


def formats() -> Iterator[ModelFormat]:
    """All formats, those of this package first; raises as `plugins.declarations`."""
    yield from FORMATS.values()
    yield from plugins.declarations("formats", ModelFormat).values()


def find_format(name: str | PurePath) -> ModelFormat | None:
    """The format of a file by its suffix, the first that has it; None if none has."""
    suffix = PurePath(name).suffix.lower()
    return next((row for row in formats() if suffix in row.suffixes), None)


def format_of(model: PurePath) -> ModelFormat:
    """The format of a model file. Raises InputError PTM-I243 if no format has its suffix."""
    if (row := find_format(model)) is None:
        raise InputError(
            "PTM-I243",
            f"unsupported format {model.suffix.lower() or '(no suffix)'}",
            file=model,
            remedy=f"use one of {' '.join(suffix for row in formats() for suffix in row.suffixes)}",
        )
    return row


def format_list() -> str:
    """The formats with their suffixes, for help texts."""
    suffixes: dict[str, list[str]] = {}
    for row in formats():
        suffixes.setdefault(row.about, []).extend(row.suffixes)
    return ", ".join(f"{about} ({' '.join(ends)})" for about, ends in suffixes.items())
