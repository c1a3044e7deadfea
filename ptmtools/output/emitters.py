"""What a database can be written as: a table of emitters, a file each.

An emitter is one frozen value that says what it is called, what it writes and where, and how that
is checked. `emit`, `validate_database` and the command line loop over the table, and nothing else
branches on a name: a new one is a file here with its declaration, and a line in the table.

What an emitter is: one frozen value that says what it is called, what it writes, and where.

glTF 2.0: a GLB for every cell.

The hints, which go with every form of the cells: an index, a record of each, statistics.

Interlaced images: the files of each texture for clients that join them on the GPU.

Writing and checking them needs the room of interlaced images, which is beside this one; so that is
done in a module above both, which is named here and imported when it is used.

VRML97: a root, and a file for every cell."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ptmtools.lazy import Lazy
from ptmtools.output.names import (
    CELL_FOLDER,
    GLTF_FILES,
    GLTF_FOLDER,
    HINTS,
    HINTS_FOLDER,
    INTERLACE_FILES,
    INTERLACE_FOLDER,
    ROOT,
    VRML_FILES,
)

if TYPE_CHECKING:
    from ptmtools.output.content import Content
    from ptmtools.output.validation.files import ServedDatabase

__all__ = ["EMITTERS", "GZIP", "Emitter", "all_emitters", "chosen_emitters", "owner_of"]


#: Suffix of a gzip copy.
GZIP = ".gz"


@dataclass(frozen=True)
class Emitter:
    """A form in which cells, or their textures, are served.

    Attributes
    ----------
    name: as `--format` and the index of the hints have it.
    about: what it is, in a few words, for help.
    owns: files and folders in the served folder that are its own; a folder ends in a slash. The
        files must be there once it has been written.
    entry: the one of its files that leads to the others, if any, and that a browser opens; written
        when those are on the disk. A form without one is for clients of the hints.
    cell_files: template of the paths of the cells' geometry (`names.path_of`), if it writes that.
    texture_files: template of the folders of the textures' files, if it writes textures in a form
        of its own (`names.texture_name`).
    writer: function from a `Content` to the files, as (path in the served folder, str or bytes);
        what it can refuse, it refuses before it gives the first.
    reader: function from (path in the served folder, bytes) of one of its files to what the check
        needs of it, None if that cannot be had; called from several threads. Raises FileError, see
        `ptmtools.output.model`. Without one nothing is read.
    check: function from a `ServedDatabase` to the counts of the manifest that it can tell, by name.
        Without one there is nothing to check.
    """

    name: str
    about: str
    owns: tuple[str, ...]
    writer: Lazy[Callable[[Content], Iterator[tuple[str, str | bytes]]]]
    reader: Lazy[Callable[[str, bytes], object | None]] | None = None
    check: Lazy[Callable[[ServedDatabase], Mapping[str, int]]] | None = None
    entry: str = ""
    cell_files: str = ""
    texture_files: str = ""

    def is_owner(self, path: str) -> bool:
        """Whether a path in the served folder is that of one of its files, or of a gzip copy."""
        plain = path.removesuffix(GZIP)
        return any(path.startswith(own) if own.endswith("/") else plain == own for own in self.owns)

    def files(self, content: Content) -> Iterator[tuple[str, str | bytes]]:
        """Path in the served folder and contents of each of its files, in the order of writing."""
        return self.writer.load()(content)

    def read(self, path: str, data: bytes) -> object | None:
        """What the check needs of a file."""
        return self.reader.load()(path, data) if self.reader else data

    def validate(self, database: ServedDatabase) -> Mapping[str, int]:
        """Holds its files against each other and against those of others; returns counts."""
        return self.check.load()(database) if self.check else {}


GLTF = Emitter(
    name="gltf",
    about="a GLB of each cell, in gltf/",
    owns=(f"{GLTF_FOLDER}/",),
    writer=Lazy("ptmtools.output.gltf:gltf_files"),
    reader=Lazy("ptmtools.output.validation.gltf:read_file"),
    check=Lazy("ptmtools.output.validation.gltf:check_files"),
    cell_files=GLTF_FILES,
)


HINTS_EMITTER = Emitter(
    name="hints",
    about="hints.json, and a record and a first-look bundle of each cell",
    owns=(HINTS, f"{HINTS_FOLDER}/"),
    writer=Lazy("ptmtools.output.hints:hints_files"),
    reader=Lazy("ptmtools.output.validation.hints:read_file"),
    check=Lazy("ptmtools.output.validation.hints:check_files"),
    entry=HINTS,
)


INTERLACE = Emitter(
    name="interlace",
    about="an interlaced image of each texture, in interlace/",
    owns=(f"{INTERLACE_FOLDER}/",),
    writer=Lazy("ptmtools.pipeline.interlacing:interlaced_files"),
    reader=Lazy("ptmtools.pipeline.interlacing:read_file"),
    check=Lazy("ptmtools.pipeline.interlacing:check_sets"),
    texture_files=INTERLACE_FILES,
)


VRML = Emitter(
    name="vrml",
    about="VRML97 files",
    owns=(ROOT, f"{CELL_FOLDER}/"),
    writer=Lazy("ptmtools.output.vrml:vrml_files"),
    reader=Lazy("ptmtools.output.validation.vrml:read_file"),
    check=Lazy("ptmtools.output.validation.vrml:check_files"),
    entry=ROOT,
    cell_files=VRML_FILES,
)


#: What `--format` names, in the order of writing.
EMITTERS: dict[str, Emitter] = {emitter.name: emitter for emitter in (VRML, GLTF, INTERLACE)}
#: What is written behind whichever of them are chosen.
_ALWAYS = (HINTS_EMITTER,)


def all_emitters() -> tuple[Emitter, ...]:
    """Those of the table, and those that are always written."""
    return (*EMITTERS.values(), *_ALWAYS)


def chosen_emitters(format: str) -> tuple[Emitter, ...]:
    """The emitters of a `--format`, names with commas in between, in the order of the table, and
    those that are always written.

    Raises ValueError, with what is wrong, for an unknown name or none.
    """
    names = set(format.split(","))
    if unknown := sorted(names - set(EMITTERS)):
        raise ValueError(f"{unknown[0]!r} is not one of {', '.join(EMITTERS)}")
    return (*(emitter for name, emitter in EMITTERS.items() if name in names), *_ALWAYS)


def owner_of(path: str) -> Emitter | None:
    """Whose a path in the served folder is, if any emitter's."""
    return next((emitter for emitter in all_emitters() if emitter.is_owner(path)), None)
