"""What a database can be written as: a table of emitters, a file each.

An emitter is one frozen value that says what it is called, what it writes and where, and how that
is checked. `emit`, `validate_database` and the command line loop over the table, and nothing else
branches on a name: a new one is a file here with its declaration, and a line in the table.
"""

from __future__ import annotations

from ptmtools.database.emitters.emitter import GZIP, Emitter
from ptmtools.database.emitters.gltf import GLTF
from ptmtools.database.emitters.vrml import VRML

__all__ = ["EMITTERS", "GZIP", "Emitter", "chosen_emitters", "owner_of"]

#: By name, in the order of writing.
EMITTERS: dict[str, Emitter] = {emitter.name: emitter for emitter in (VRML, GLTF)}


def chosen_emitters(format: str) -> tuple[Emitter, ...]:
    """The emitters of a `--format`, names with commas in between, in the order of the table.

    Raises ValueError, with what is wrong, for an unknown name or none.
    """
    alone = EMITTERS[format].before if format in EMITTERS else ""
    names = set((alone or format).split(","))
    if unknown := sorted(names - set(EMITTERS)):
        raise ValueError(f"{unknown[0]!r} is not one of {', '.join(EMITTERS)}")
    return tuple(emitter for name, emitter in EMITTERS.items() if name in names)


def owner_of(path: str) -> Emitter | None:
    """Whose a path in the served folder is, if any emitter's."""
    return next((emitter for emitter in EMITTERS.values() if emitter.is_owner(path)), None)
