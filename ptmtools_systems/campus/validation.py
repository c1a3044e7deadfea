"""The check of a campus folder: each file by itself, and what the index refers to."""

from __future__ import annotations

import io
import os
import zlib
from pathlib import Path
from typing import BinaryIO, cast

from ptmtools.diagnostics import FOLDER_CODES, Findings, ValidationReport
from ptmtools.errors import LimitError, PtmError
from ptmtools.files import open_below
from ptmtools.texture.model import Limits
from ptmtools_systems.campus.meshes import read_mesh
from ptmtools_systems.campus.model import (
    INDEX,
    LIGHT,
    LIGHT_SIZES,
    SIZES,
    Campus,
    CampusObject,
    MeshFile,
    RecordFile,
    TextureFile,
    texture_file,
)
from ptmtools_systems.campus.reading import LONGEST, read_campus
from ptmtools_systems.campus.records import fault_of


def check_campus(folder: Path, limits: Limits) -> ValidationReport:
    """Checks a campus; all faults are in the report."""
    check = _Check(folder, limits)
    if check.bytes_of(INDEX, "PTM-D800", LONGEST) is not None:
        check.index()
    return ValidationReport(check.findings.issues(), check.files, check.bytes)


class _Check:
    """One validation of one folder."""

    def __init__(self, folder: Path, limits: Limits) -> None:
        self._folder, self._limits = folder, limits
        self.findings = Findings(FOLDER_CODES)
        self.files = self.bytes = 0

    def bytes_of(self, name: str, code: str, limit: int) -> bytes | None:
        """The bytes of a file, at most ``limit`` + 1 of them."""
        try:
            with open_below(self._folder, name) as stream:
                data = stream.read(limit + 1)
        except (OSError, ValueError) as fault:
            reason = getattr(fault, "strerror", None) or str(fault)
            self.findings.add(code, name, "", f"cannot be read ({reason})")
            return None
        self.files += 1
        self.bytes += len(data)
        return data

    def index(self) -> None:
        """Checks the index and all files."""
        try:
            campus = read_campus(self._folder)
        except PtmError as fault:
            self.findings.add("PTM-D800", INDEX, fault.place or "", fault.message)
            return
        self._references(campus)
        for item in campus.objects:
            for lod, mesh in enumerate(item.meshes):
                self._mesh(campus, item, mesh, finest=lod == len(item.meshes) - 1)
            if item.record is not None:
                self._record(item.record)
        for texture in campus.textures:
            self._image(texture)
        known = {INDEX, *campus.files()}
        for folder, _, files in os.walk(self._folder):
            for file in sorted(files):
                name = (Path(folder) / file).relative_to(self._folder).as_posix()
                if name not in known:
                    self.findings.add("PTM-D806", name, "", "is not listed")

    def _references(self, campus: Campus) -> None:
        """The materials that objects name, and the textures of materials and lightmaps, exist; no
        two files have one name."""
        at = self.findings.place(INDEX)
        files = [file.file for item in campus.objects for file in item.meshes]
        files += [item.record.file for item in campus.objects if item.record is not None]
        seen: set[str] = set()
        for name in (*files, *(texture.file for texture in campus.textures)):
            if name.lower() in seen:
                at.add("PTM-D800", f"two files are named {name}", "files")
            seen.add(name.lower())
        used = {
            (material.base, side, channel): f"materials[{i}]"
            for i, material in enumerate(campus.materials)
            if material.base is not None
            for channel in material.channels
            for side in SIZES
        }
        for i, item in enumerate(campus.objects):
            for number in item.materials:
                if number >= len(campus.materials):
                    message = f"material {number} does not exist"
                    at.add("PTM-D800", message, f"objects[{i}].materials")
            if item.lightmap is not None:
                place = f"objects[{i}].lightmap"
                used |= {(item.lightmap, side, LIGHT): place for side in LIGHT_SIZES}
        present = {(t.base, t.size, t.channel) for t in campus.textures}
        for texture, place in used.items():
            if texture not in present:
                at.add("PTM-D800", f"{texture_file(*texture)} is not listed", place)
        for texture in sorted(present - used.keys()):
            at.add("PTM-D806", f"{texture_file(*texture)} is not used", "textures")

    def _read_recorded(self, file: MeshFile | TextureFile | RecordFile) -> bytes | None:
        """The bytes of a listed file; None, with an issue, if it has other bytes than recorded."""
        data = self.bytes_of(file.file, "PTM-D803", file.bytes)
        if data is None:
            return None
        if len(data) != file.bytes:
            length = "more than" if len(data) > file.bytes else f"{len(data)} bytes, not"
            self.findings.add("PTM-D804", file.file, "", f"{length} {file.bytes} bytes")
            return None
        if zlib.crc32(data) != file.crc32:
            self.findings.add("PTM-D804", file.file, "", "the CRC-32 is not the recorded one")
            return None
        return data

    def _record(self, record: RecordFile) -> None:
        data = self._read_recorded(record)
        if data is not None and (wrong := fault_of(data)) is not None:
            self.findings.add("PTM-D804", record.file, "", wrong)

    def _mesh(self, campus: Campus, item: CampusObject, mesh: MeshFile, *, finest: bool) -> None:
        """A client draws the mesh with the materials and the lightmap of its object, and culls it
        by the object's box."""
        data = self._read_recorded(mesh)
        if data is None:
            return
        at = self.findings.place(mesh.file)
        try:
            primitives = read_mesh(data)
        except ValueError as fault:
            at.add("PTM-D804", str(fault.args[0] if fault.args else fault))
            return
        if (faces := sum(len(p.triangle) for p in primitives)) != mesh.faces:
            at.add("PTM-D804", f"{faces} faces, not {mesh.faces}")
        low, high = item.box[:3], item.box[3:]
        if any(((p.point < low) | (p.point > high)).any() for p in primitives):
            at.add("PTM-D804", "extends beyond the bounding box of its object")
        if not {p.material for p in primitives} <= set(item.materials):
            at.add("PTM-D804", "the materials do not match its object")
            return
        for part in primitives:
            part_at = at.with_place(f"material {part.material}")
            textured = part.material < len(campus.materials) and (
                campus.materials[part.material].base is not None
            )
            if (part.uv is not None) != textured:
                message = "textures without coordinates, or coordinates without textures"
                part_at.add("PTM-D804", message)
            if (part.light is not None) != (finest and item.lightmap is not None):
                message = "a lightmap without coordinates, or coordinates without one"
                part_at.add("PTM-D804", message)
            elif part.light is not None and not ((part.light >= 0) & (part.light <= 1)).all():
                part_at.add("PTM-D804", "coordinates outside of the lightmap")

    def _image(self, texture: TextureFile) -> None:
        from ptmtools.texture.images.opening import load, open_image, pillow_faults
        from ptmtools.texture.images.picture import check_size

        data = self._read_recorded(texture)
        if data is None:
            return
        at = self.findings.place(texture.file)
        if not data.startswith(b"\xff\xd8\xff"):
            at.add("PTM-D804", "is not a JPEG")
            return
        try:
            with pillow_faults():
                image = open_image(cast("BinaryIO", io.BytesIO(data)), self._limits)
                check_size(*image.size, 4, self._limits)
                load(image)
        except LimitError:
            raise
        except PtmError as fault:
            at.add("PTM-D804", fault.message)
            return
        if image.size != (texture.size, texture.size):
            width, height = image.size
            at.add("PTM-D804", f"{width} x {height}, not {texture.size}²")
