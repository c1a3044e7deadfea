"""The table of emitters, the forms in which a database is served.

Options, writing, validation and the command line go by the table, and nothing else branches on a
name: a new form is a file with its functions and a declaration here, or an entry point of the group
``ptmtools.emitters`` in another package.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ptmtools import plugins
from ptmtools.lazy import Lazy
from ptmtools.output import names
from ptmtools.output.emitter import Emitter, SiteTextures
from ptmtools.output.names import (
    CELL_FOLDER,
    GLTF_FILES,
    GLTF_FOLDER,
    HINTS,
    HINTS_FOLDER,
    ROOT,
    VRML_FILES,
)

GLTF = Emitter(
    name=names.GLTF,
    about="a GLB of each cell, and finer meshes of its objects, in gltf/",
    owns=(f"{GLTF_FOLDER}/",),
    writer=Lazy("ptmtools.output.gltf:gltf_files"),
    reader=Lazy("ptmtools.output.validation.gltf:read_file"),
    check=Lazy("ptmtools.output.validation.gltf:check_files"),
    cell_files=GLTF_FILES,
    has_meshes=True,
)
VRML = Emitter(
    name=names.VRML,
    about="VRML97 files",
    owns=(ROOT, f"{CELL_FOLDER}/"),
    writer=Lazy("ptmtools.output.vrml:vrml_files"),
    reader=Lazy("ptmtools.output.validation.vrml:read_file"),
    check=Lazy("ptmtools.output.validation.vrml:check_files"),
    entry=ROOT,
    cell_files=VRML_FILES,
)
_HINTS = Emitter(
    name="hints",
    about="hints.json, and a record of each cell",
    owns=(HINTS, f"{HINTS_FOLDER}/"),
    writer=Lazy("ptmtools.output.hints:hints_files"),
    reader=Lazy("ptmtools.output.validation.hints:read_file"),
    check=Lazy("ptmtools.output.validation.hints:check_files"),
    entry=HINTS,
)

#: The names of `--format`, in the order of writing.
EMITTERS: dict[str, Emitter] = {
    emitter.name: emitter
    for emitter in (VRML, GLTF, *plugins.declarations("emitters", Emitter).values())
}
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
    chosen = set(format.split(","))
    if unknown := sorted(chosen - set(EMITTERS)):
        raise ValueError(f"{unknown[0]!r} is not one of {', '.join(EMITTERS)}")
    return (*(emitter for name, emitter in EMITTERS.items() if name in chosen), *_ALWAYS)


def owner_of(path: str) -> Emitter | None:
    """The emitter that a path in the served folder belongs to, or None."""
    return next((emitter for emitter in all_emitters() if emitter.is_owner(path)), None)


def texture_forms(index: Mapping[str, Any]) -> Iterator[SiteTextures]:
    """The forms of textures that an index of the hints names, and a site has."""
    for emitter in EMITTERS.values():
        if emitter.site and emitter.name in index.get("textureSets", {}):
            yield emitter.site


def is_other_form(name: str) -> bool:
    """Whether a file of a site is a texture in one of these forms, which few visits need."""
    forms = (emitter.site for emitter in EMITTERS.values() if emitter.site)
    return any(name.startswith(f"{form.folder}/") for form in forms)
