"""Checks a folder with an octree texture, or the octree textures of a database, and describes a
folder for `ptm info`."""

from __future__ import annotations

import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.diagnostics import FOLDER_CODES, Findings, Place, ValidationReport
from ptmtools.errors import InputError, PtmError
from ptmtools.files import open_below
from ptmtools.output.names import HINTS
from ptmtools.output.validation.files import ReadHints, ServedDatabase
from ptmtools.quantities import count, size
from ptmtools.texture.model import Limits
from ptmtools_systems.apo.declarations import OCTREES
from ptmtools_systems.apo.files import (
    COLORS,
    INDEX,
    MESH,
    NORMALS,
    OBJ,
    Index,
    inflate_texels,
    mesh_bytes,
    mesh_of,
    read_index,
    read_octree,
)
from ptmtools_systems.apo.model import ADDRESS_BITS, Octree
from ptmtools_systems.apo.octree import fault_of

#: Texels of an octree take less than this many bytes, however they are deflated: the texels are
#: fewer than the addresses.
_MOST_BYTES = 1 << 27
_NAMES = (INDEX, NORMALS, COLORS, MESH, OBJ)


def check_folder(folder: Path, limits: Limits) -> ValidationReport:
    """Checks the folder without its source model."""
    findings = Findings(FOLDER_CODES)
    try:
        present = sorted(os.listdir(folder))
    except OSError as fault:
        raise InputError(
            "PTM-I122", f"cannot be read ({fault.strerror or fault})", file=folder
        ) from None
    for name in present:
        if name not in _NAMES:
            findings.add("PTM-D806", name, "", "is not part of an octree texture")
    sizes = {name: _size(folder, name, findings) for name in present if name in _NAMES}
    readable = {name: size for name, size in sizes.items() if size is not None}
    try:
        index = read_index(folder)
    except PtmError as fault:
        findings.add("PTM-D800", INDEX, fault.place or "", fault.message)
    else:
        required = [NORMALS, MESH, OBJ, *([COLORS] if index.colors else [])]
        for name in required:
            if name not in present:
                findings.add("PTM-D803", name, "", "is missing")
        _check_octree(folder, index, readable, findings)
        if MESH in readable:
            _check_mesh(folder, index, readable[MESH], findings)
    return ValidationReport(findings.issues(), len(readable), sum(readable.values()))


def _size(folder: Path, name: str, findings: Findings) -> int | None:
    """The bytes of a regular file; None, with a finding, if it cannot be read."""
    try:
        with open_below(folder, name) as file:
            return os.fstat(file.fileno()).st_size
    except OSError as fault:
        findings.add("PTM-D803", name, "", f"cannot be read ({fault.strerror or fault})")
        return None


def _check_octree(folder: Path, index: Index, sizes: Mapping[str, int], findings: Findings) -> None:
    for stream in (index.normals, index.colors):
        if stream and sizes.get(stream["file"], 0) > stream["ends"][-1]:
            findings.add("PTM-D804", stream["file"], "", "continues after the last level")
    if NORMALS not in sizes or (index.colors and COLORS not in sizes):
        return
    try:
        octree = read_octree(folder)
    except PtmError as error:
        findings.add("PTM-D804", Path(error.file or NORMALS).name, error.place or "", error.message)
        return
    if fault := fault_of(octree):
        findings.add("PTM-D804", NORMALS, *fault)


def _check_mesh(folder: Path, index: Index, size: int, findings: Findings) -> None:
    if size != index.mesh["bytes"]:
        findings.add("PTM-D804", MESH, "", "has another length or checksum than in apo.json")
        return
    try:
        data = mesh_bytes(folder)
        if zlib.crc32(data) != index.mesh["crc32"]:
            findings.add("PTM-D804", MESH, "", "has another length or checksum than in apo.json")
            return
        mesh = mesh_of(data)
    except PtmError as fault:
        findings.add("PTM-D804", MESH, "", fault.message)
        return
    if len(mesh.triangles) != index.mesh["faces"]:
        findings.add("PTM-D804", MESH, "", "has another number of faces than in apo.json")
    q = (mesh.points - index.low) / index.side
    if outside := int(((q < 0) | (q >= 1)).any(axis=1).sum()):
        findings.add("PTM-D804", MESH, "", f"{count(outside, 'point')} outside of the cube")


def _distance_text(deviation: float | None) -> str:
    return "an unknown distance" if deviation is None else f"about {deviation:.3g} m"


def describe(folder: Path) -> tuple[tuple[str, ...], Mapping[str, Any]]:
    """The lines of `ptm info` for an octree texture, and its record as JSON."""
    index = read_index(folder)
    document, streams = index.document, [s for s in (index.normals, index.colors) if s]
    source, mesh = document["source"], index.mesh
    lines = [
        f"{'mesh':<9} {mesh['faces']:,} faces of {source['triangles']:,}, {size(mesh['bytes'])}; "
        f"deviates by {_distance_text(source['deviation'])}",
        f"{'octree':<9} {count(index.levels, 'level')}, {int(index.start[-1]):,} texels, "
        f"{size(4 * int(index.start[-1]) * len(streams))} of texture memory",
        f"{'level':>9} {'texels':>10} {'bytes':>10} {'up to here':>11}",
    ]
    ends = np.sum([stream["ends"] for stream in streams], axis=0)
    for k, (texels, part) in enumerate(
        zip(np.diff(index.start).tolist(), np.diff(ends, prepend=0).tolist(), strict=True)
    ):
        lines.append(f"{k:>9} {texels:>10,} {part:>10,} {int(ends[k]):>11,}")
    return tuple(lines), document


def check_octrees(hints: ReadHints, database: ServedDatabase) -> None:
    """Checks each octree texture: its row, its length, its levels and the order of its texels."""
    rows = hints.index.get(OCTREES.name, ())
    files = database.resolve_each(HINTS, OCTREES.name, [row["file"] for row in rows])
    for i, (row, file) in enumerate(zip(rows, files, strict=True)):
        if fault := _row_fault(row):
            database.place(HINTS, f"{OCTREES.name}[{i}]").add("PTM-D700", fault)
        elif file:
            _check_stream(row, database.head(file, row["ends"][-1] + 1), database.place(file))


def _row_fault(row: Mapping[str, Any]) -> str:
    """The fault of a row by itself; "" if there is none."""
    levels, ends = row["levels"], row["ends"]
    if not len(levels) == len(ends) == len(row["crc32"]):
        return "levels, ends and crc32 are not aligned"
    if min(b - a for a, b in zip([0, *ends], ends, strict=False)) <= 0:
        return "ends are not in ascending order"
    if sum(levels) > 1 << ADDRESS_BITS or ends[-1] > _MOST_BYTES:
        return f"has {sum(levels):,} texels in {ends[-1]:,} bytes, more than an octree can have"
    return ""


def _check_stream(row: Mapping[str, Any], data: bytes, at: Place) -> None:
    """Inflates the levels of a row, each by itself, and checks that they form an octree."""
    start = np.concatenate([[0], np.cumsum(row["levels"], dtype=np.int64)])
    if len(data) != row["ends"][-1]:
        less = len(data) < row["ends"][-1]
        at.add("PTM-D710", f"ends {'before' if less else 'after'} the last level")
    try:
        texels = inflate_texels(data, start, row)
    except InputError as error:
        at.add("PTM-D710", error.message, error.place or "")
        return
    octree = Octree(texels, start, np.array(row["cube"]["low"]), row["cube"]["side"])
    if fault := fault_of(octree):
        place, message = fault
        at.add("PTM-D710", message, place)
