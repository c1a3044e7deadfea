"""The arrays of the stages: whether each can be read, is as its stage writes it, and belongs to the
others; and whether the counts in the manifest are theirs.

A file whose hash is wrong is left to the check of the hashes. Here are those that are damaged
although the hash is right: a manifest repaired by hand, a stage replaced by that of another build.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.database.findings import Findings
from ptmtools.database.model import Issue
from ptmtools.errors import DatabaseError
from ptmtools.files import open_regular
from ptmtools.pipeline.archive import unpack_arrays
from ptmtools.pipeline.folder import MANIFEST, sha256
from ptmtools.pipeline.manifest import Manifest
from ptmtools.pipeline.stages import IMAGE_LIST, IMAGES, arrays_of, image_rows

Arrays = Mapping[str, NDArray[Any]]

#: Stage → array → kind of its numbers and shape. A letter is one number all over the database, and
#: L + 1 one more: C cells, L leaves, K portals, T triangles of the scene, M pieces, V entries of
#: the PVS. A small letter is one within the stage; * is any.
_ARRAYS: dict[str, dict[str, str]] = {
    "scene": {
        "points": "f v 3",
        "triangles": "i T 3",
        "uv": "f T 3 2",
        "triangle_object": "i T",
        "triangle_material": "i T",
        "two_sided": "b T",
        "about": "u *",
    },
    "cells": {
        "node_plane": "f n 4",
        "node_child": "i n 2",
        "root_box": "f 2 3",
        "leaf_cell": "i L",
        "leaf_point": "f p 3",
        "leaf_point_start": "i L+1",
        "face_index": "i x",
        "face_start": "i f+1",
        "leaf_face_start": "i L+1",
        "portal_leaf": "i K 2",
        "portal_plane": "f K 4",
        "portal_point": "f q 3",
        "portal_start": "i K+1",
        "portal_area": "f K",
        "vertex": "f w 3",
        "vertex_uv": "f w 2",
        "triangle": "i M 3",
        "triangle_source": "i M",
        "triangle_cell": "i M 2",
        "about": "u *",
    },
    "pvs": {
        "start": "i C+1",
        "cell": "i V",
        "work": "i *",
        "cut": "b *",
        "ties": "i *",
        "decided": "i *",
        "opened": "i *",
        "leak": "i * 4",
        "conservative": "b 1",
    },
    "ach": {
        "start": "i C+1",
        "value": "f V",
        "pixels": "f V",
        "error": "f V",
        "p95": "f V",
        "seen": "f V",
        "views": "f V 6",
        "missed": "f C",
        "samples": "i C",
        "rejected": "i C",
        "uncertain": "f C",
        "unseen_below": "f C",
        "floor": "f C",
        "texture_start": "i *",
        "texture": "i t",
        "texture_value": "f t",
        "about": "u *",
    },
}
#: Stage → where rows of a list begin → the length of the list.
_STARTS = {
    "cells": {
        "leaf_point_start": "p",
        "face_start": "x",
        "leaf_face_start": "f",
        "portal_start": "q",
    },
    "pvs": {"start": "V"},
    "ach": {"start": "V", "texture_start": "t"},
}
#: Stage → indices → the least, and of how many.
_INDICES = {
    "scene": {"triangles": (0, "v")},
    "cells": {
        "leaf_cell": (0, "C"),
        "face_index": (0, "p"),
        "portal_leaf": (0, "L"),
        "triangle": (0, "w"),
        "triangle_source": (0, "T"),
        "triangle_cell": (-1, "C"),
    },
    "pvs": {"cell": (0, "C")},
}
#: Arrays that may hold NaN, for what was not met.
_UNKNOWN = ("error", "uncertain")


class _DamageError(Exception):
    """What is wrong with an array: its name, what, and the code."""

    def __init__(self, array: str, message: str, code: str = "PTM-D720") -> None:
        self.array, self.message, self.code = array, message, code
        super().__init__(message)


def check_stages(
    folder: Path, manifest: Manifest, astray: Collection[str] = ()
) -> tuple[Issue, ...]:
    """What is wrong with the stages that have run, as far as their hashes are right; ``astray``
    are files of which that is known not to be so."""
    found = Findings()
    sizes: dict[str, int] = {}
    true: dict[str, dict[str, Any]] = {}
    for stage in (s for s in _ARRAYS if s in manifest.stages):
        name = arrays_of(stage)
        if name not in manifest.stages[stage].outputs:
            found.add("PTM-D720", MANIFEST, f"stages.{stage}", f"lists no {name}")
        elif (data := _content(folder, manifest, stage, name)) is not None:
            try:
                arrays = unpack_arrays(data, file=name)
                _check_arrays(stage, arrays, sizes)
                true[stage] = _figures(stage, arrays, sizes)
            except DatabaseError as fault:
                found.add("PTM-D720", name, "", fault.message)
            except _DamageError as fault:
                found.add(fault.code, name, fault.array, fault.message)
    if "scene" in manifest.stages:
        true.setdefault("scene", {})["images"] = _check_images(folder, manifest, found)
    for stage in ("textures", "emit"):
        if stage in manifest.stages and not manifest.stages[stage].outputs.keys() & set(astray):
            true[stage] = _sizes_on_disk(folder, manifest, stage)
    for stage, figures in true.items():
        counts = manifest.stages[stage].counts
        for name, value in figures.items():
            if value is not None and name in counts and counts[name] != value:
                told = f"is {counts[name]!r}, but the files hold {value!r}"
                found.add("PTM-D659", MANIFEST, f"stages.{stage}.counts.{name}", told)
    return found.issues()


def _content(folder: Path, manifest: Manifest, stage: str, name: str) -> bytes | None:
    """The bytes of an output if they are those that were recorded."""
    try:
        with open_regular(folder / name) as file:
            data = file.read()
    except OSError:
        return None
    return data if sha256(data) == manifest.stages[stage].outputs.get(name) else None


def _check_arrays(stage: str, arrays: Arrays, sizes: dict[str, int]) -> None:
    """Holds arrays against the tables above; ``sizes`` is what the capital letters stand for so
    far. Raises _DamageError at the first that does not fit."""
    wanted = _ARRAYS[stage]
    for name in sorted(wanted.keys() ^ arrays.keys()):
        raise _DamageError(name, "is missing" if name in wanted else "is no array of this stage")
    own: dict[str, int] = {}
    for name, told in wanted.items():
        kind, *shape = told.split()
        values = arrays[name]
        if values.dtype.kind != kind or values.ndim != len(shape):
            raise _DamageError(name, f"is {values.dtype} of shape {values.shape}")
        for side, length in zip(shape, values.shape, strict=True):
            _check_side(name, side, length, sizes if side[0].isupper() else own)
        if kind == "f" and name not in _UNKNOWN and not np.isfinite(values).all():
            raise _DamageError(name, "has a number that is not finite")
    if stage == "cells":
        sizes["C"] = int(arrays["leaf_cell"].max(initial=-1)) + 1
    own |= sizes
    for name, letter in _STARTS.get(stage, {}).items():
        begins = arrays[name]
        if not len(begins) and name == "texture_start":  # shares of textures were not measured
            continue
        if begins[0] != 0 or begins[-1] != own[letter] or (np.diff(begins) < 0).any():
            raise _DamageError(name, "does not cut its list into rows")
    for name, (least, letter) in _INDICES.get(stage, {}).items():
        values = arrays[name]
        if (values < least).any() or (letter in own and (values >= own[letter]).any()):
            raise _DamageError(name, "an index is out of range")


def _check_side(name: str, side: str, length: int, known: dict[str, int]) -> None:
    letter, _, more = side.partition("+")
    if letter == "*":
        return
    rest = length - int(more or 0)
    expected = int(letter) if letter.isdigit() else known.setdefault(letter, rest)
    if rest != expected:
        told = f"is {length} long where {expected + int(more or 0)} belong"
        raise _DamageError(name, told, "PTM-D721" if letter.isupper() else "PTM-D720")


def _figures(stage: str, arrays: Arrays, sizes: Mapping[str, int]) -> dict[str, Any]:
    """The counts of a stage, as its arrays have them."""
    match stage:
        case "scene":
            return {"triangles": sizes["T"]}
        case "cells":
            names = {"cells": "C", "leaves": "L", "portals": "K", "pieces": "M"}
            return {name: sizes[letter] for name, letter in names.items()}
        case "ach":
            return {name: int(arrays[name].sum()) for name in ("samples", "rejected")}
        case _:
            return {}


def _check_images(folder: Path, manifest: Manifest, found: Findings) -> int | None:
    """How many images the scene lists, each of which is there; None if the list is unreadable."""
    outputs = manifest.stages["scene"].outputs
    data = _content(folder, manifest, "scene", IMAGE_LIST)
    if data is None:
        return None
    try:
        rows = image_rows(data)
    except (ValueError, KeyError, TypeError, RecursionError) as fault:
        found.add("PTM-D720", IMAGE_LIST, "", f"is no list of images ({fault})")
        return None
    for row in rows:
        if outputs.get(f"{IMAGES}/{row['sha256']}") != row["sha256"]:
            found.add("PTM-D721", IMAGE_LIST, row["name"], "this image is not in the database")
    return len(rows)


def _sizes_on_disk(folder: Path, manifest: Manifest, stage: str) -> dict[str, Any]:
    """The counts of a stage of files, as they lie there; None for what cannot be told."""
    names = manifest.stages[stage].outputs
    sizes: dict[str, int] = {}
    with suppress(OSError):
        sizes = {name: (folder / name).stat().st_size for name in names}
    whole = len(sizes) == len(names)
    if stage == "emit":
        return {"files": len(names), "bytes": sum(sizes.values()) if whole else None}
    textures = [name for name in names if name.endswith(".ptm")]
    stored = sum(sizes[name] for name in textures) if whole else None
    return {"textures": len(textures), "ptm_bytes": stored}
