"""The table of forms in which a database is served: the names and files of each.

A form is one frozen value. `emission.WRITERS` has the function that writes it, and
`validation.database.CHECKERS` those that read and check its files; nothing else branches on a name.
The tables are apart because the options and all writers need the names, and writers and checks need
the options.
"""

from __future__ import annotations

from dataclasses import dataclass

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

#: Suffix of a gzip copy.
GZIP = ".gz"


@dataclass(frozen=True)
class Emitter:
    """A form of the cells or of their textures.

    Attributes
    ----------
    name: the name in `--format` and in the index of the hints.
    about: a short description for help.
    owns: files and folders in the served folder that belong to the form; a folder ends in a slash.
        The files must exist once the form has been written.
    entry: the file that leads to the others and that a browser opens, written last; "" for a form
        that only clients of the hints read.
    cell_files: template of the paths of the cells' geometry (`names.path_of`), if it has geometry.
    texture_files: template of the folders of the textures' files, if it has a texture form of its
        own (`names.texture_name`).
    """

    name: str
    about: str
    owns: tuple[str, ...]
    entry: str = ""
    cell_files: str = ""
    texture_files: str = ""

    def is_owner(self, path: str) -> bool:
        """Whether a path in the served folder, or that of a gzip copy, belongs to the form."""
        plain = path.removesuffix(GZIP)
        return any(path.startswith(own) if own.endswith("/") else plain == own for own in self.owns)


GLTF = Emitter(
    name="gltf",
    about="a GLB of each cell, in gltf/",
    owns=(f"{GLTF_FOLDER}/",),
    cell_files=GLTF_FILES,
)
INTERLACE = Emitter(
    name="interlace",
    about="an interlaced image of each texture, in interlace/",
    owns=(f"{INTERLACE_FOLDER}/",),
    texture_files=INTERLACE_FILES,
)
VRML = Emitter(
    name="vrml",
    about="VRML97 files",
    owns=(ROOT, f"{CELL_FOLDER}/"),
    entry=ROOT,
    cell_files=VRML_FILES,
)
_HINTS = Emitter(
    name="hints",
    about="hints.json, and a record and a first-look bundle of each cell",
    owns=(HINTS, f"{HINTS_FOLDER}/"),
    entry=HINTS,
)

#: The names of `--format`, in the order of writing.
EMITTERS: dict[str, Emitter] = {emitter.name: emitter for emitter in (VRML, GLTF, INTERLACE)}
#: Written after the chosen ones, with every choice.
_ALWAYS = (_HINTS,)


def all_emitters() -> tuple[Emitter, ...]:
    """The emitters of the table and those that are always written."""
    return (*EMITTERS.values(), *_ALWAYS)


def chosen_emitters(format: str) -> tuple[Emitter, ...]:
    """The emitters of a `--format`, names separated by commas, in the order of the table, and
    those that are always written.

    Raises ValueError, with the reason, for an unknown name or none.
    """
    names = set(format.split(","))
    if unknown := sorted(names - set(EMITTERS)):
        raise ValueError(f"{unknown[0]!r} is not one of {', '.join(EMITTERS)}")
    return (*(emitter for name, emitter in EMITTERS.items() if name in names), *_ALWAYS)


def owner_of(path: str) -> Emitter | None:
    """The emitter that a path in the served folder belongs to, or None."""
    return next((emitter for emitter in all_emitters() if emitter.is_owner(path)), None)
