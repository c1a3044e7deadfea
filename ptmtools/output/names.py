"""The names of files and nodes: deterministic, unique, and legal in every reader.

A DEF name is the object's name in ASCII, without '.', which several browsers take for a route's
separator, led by the cell so that it stays unique when a reader merges the files.
"""

from __future__ import annotations

import re
import unicodedata
from pathlib import PurePosixPath

#: Forms of the served files, in `--format` and in the index of the hints.
VRML, GLTF = "vrml", "gltf"
#: In the served folder.
ROOT = "root.wrl"
HINTS = "hints.json"
HINTS_FOLDER = "hints"
STATISTICS = f"{HINTS_FOLDER}/statistics.json"
CELL_FOLDER = "cells"
TEXTURE_FOLDER = "textures"
GLTF_FOLDER = "gltf"
#: From one of these folders back to the served one.
UP = "../"
#: The files of a cell, as the index names them: URI templates (RFC 6570, level 1).
RECORD_FILES = f"{HINTS_FOLDER}/{{name}}.json"
VRML_FILES = f"{CELL_FOLDER}/{{name}}.wrl"
GLTF_FILES = f"{GLTF_FOLDER}/{{name}}.glb"

_ILLEGAL = re.compile(r"[^A-Za-z0-9_]+")
#: Longer object names are cut: they come from generators and carry no more information.
_LONGEST = 48


def plain_name(name: str, default: str) -> str:
    """The name of an object in ASCII letters, digits and _; ``default`` where nothing is left."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return _ILLEGAL.sub("_", plain).strip("_")[:_LONGEST] or default


def cell_name(cell: int) -> str:
    """ "c0000"; more digits where they are needed."""
    return f"c{cell:04d}"


def mesh_name(number: int) -> str:
    """ "m0000": of a file with a finer mesh of an object."""
    return f"m{number:04d}"


def mesh_path(number: int) -> str:
    """The path of such a file relative to the served folder."""
    return GLTF_FILES.replace("{name}", mesh_name(number))


def cell_file(cell: int) -> str:
    """The name of a cell's VRML file, as other cell files refer to it."""
    return f"{cell_name(cell)}.wrl"


def path_of(cell: int, files: str) -> str:
    """A cell's file relative to the served folder, by the template of such files."""
    return files.replace("{name}", cell_name(cell))


def texture_name(file: str) -> str:
    """The name of a texture, by the path or the URL of its `.ptm`."""
    return PurePosixPath(file).stem


class DefNames:
    """Hands out the DEF names of one file."""

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._taken: dict[str, int] = {}

    def take(self, name: str) -> str:
        """A name for the object ``name``, used nowhere else in the file."""
        preferred = f"{self._prefix}_{plain_name(name, 'shape')}"
        unique, count = preferred, self._taken.get(preferred, 1)
        while unique in self._taken:
            count += 1
            unique = f"{preferred}_{count}"
        self._taken[preferred] = count
        self._taken.setdefault(unique, 1)
        return unique
