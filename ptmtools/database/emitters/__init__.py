"""What a database can be written as: a table of emitters, a file each.

An emitter is one frozen value that says what it is called, what it writes and where, and how that
is checked. `emit`, `validate_database` and the command line loop over the table, and nothing else
branches on a name: a new one is a file here with its declaration, and a line in the table.
"""

from __future__ import annotations

from ptmtools.database.emitters.emitter import GZIP, Emitter
from ptmtools.database.emitters.gltf import GLTF
from ptmtools.database.emitters.hints import HINTS_EMITTER
from ptmtools.database.emitters.interlace import INTERLACE
from ptmtools.database.emitters.vrml import VRML

__all__ = ["EMITTERS", "GZIP", "Emitter", "all_emitters", "chosen_emitters", "owner_of"]

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
