"""The check of a campus folder: every file against the index, and the index against itself."""

from __future__ import annotations

import io
import json
import math
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np

from ptmtools import schemas
from ptmtools.diagnostics import FOLDER_CODES, Findings, ValidationReport
from ptmtools.errors import LimitError, PtmError
from ptmtools.files import open_below
from ptmtools.neighbours.campus.meshes import Primitive, read_mesh
from ptmtools.neighbours.campus.model import (
    INDEX,
    LIGHT,
    LIGHT_SIZES,
    SIZES,
    Campus,
    CampusObject,
    MeshFile,
    TextureFile,
    mesh_file,
    texture_file,
)
from ptmtools.neighbours.campus.reading import LONGEST
from ptmtools.texture.model import Limits
from ptmtools.tolerance import UNIT_SHARE


def check_campus(folder: Path, limits: Limits) -> ValidationReport:
    """Checks a campus; all faults are in the report."""
    check = _Check(folder, limits)
    data = check.bytes_of(INDEX, "PTM-D800", LONGEST)
    if data is not None:
        check.index(data)
    return ValidationReport(check.findings.issues(), check.files, check.bytes)


class _Check:
    """One validation of one folder."""

    def __init__(self, folder: Path, limits: Limits) -> None:
        self._folder, self._limits = folder, limits
        self.findings = Findings(FOLDER_CODES)
        self.files = self.bytes = 0

    def bytes_of(self, name: str, code: str, most: int) -> bytes | None:
        """The bytes of a file, at most ``most`` + 1 of them."""
        try:
            with open_below(self._folder, name) as stream:
                data = stream.read(most + 1)
        except (OSError, ValueError) as fault:
            reason = getattr(fault, "strerror", None) or str(fault)
            self.findings.add(code, name, "", f"cannot be read ({reason})")
            return None
        self.files += 1
        self.bytes += len(data)
        return data

    def index(self, data: bytes) -> None:
        try:
            document = schemas.parse(data)
            schemas.check(document, schemas.CAMPUS)
        except schemas.ShapeError as fault:
            self.findings.add("PTM-D800", INDEX, fault.place, fault.message)
            return
        campus = Campus.from_document(document)
        self._names(campus)
        self._sums(campus, document)
        self._textures(campus)
        for place, each in enumerate(campus.objects):
            self._object(campus, f"objects[{place}]", each)
        for texture in campus.textures:
            self._image(texture)
        self._unlisted({INDEX, *campus.files()})

    def _names(self, campus: Campus) -> None:
        at = self.findings.at(INDEX)
        listed = [m.file for o in campus.objects for m in o.meshes]
        listed += [t.file for t in campus.textures]
        for kind, names in (("objects", [o.name for o in campus.objects]), ("files", listed)):
            seen: set[str] = set()
            for name in names:
                if name.lower() in seen:
                    at.add("PTM-D800", f"two {kind} are named {name}", kind)
                seen.add(name.lower())
        for place, t in enumerate(campus.textures):
            if t.file != texture_file(t.base, t.size, t.channel):
                at.add("PTM-D800", f"{t.file} is not named after its base", f"textures[{place}]")

    def _sums(self, campus: Campus, document: Mapping[str, Any]) -> None:
        at = self.findings.at(INDEX)
        if document["start"] != campus.start:
            at.add("PTM-D800", f"{document['start']} is not {campus.start}", "start")
        expected = json.loads(json.dumps([vars(preset) for preset in campus.presets]))
        for i, (listed, preset) in enumerate(zip(document["presets"], expected, strict=False)):
            for name, value in preset.items():
                if listed[name] != value:
                    at.add("PTM-D800", f"{listed[name]} is not {value}", f"presets[{i}].{name}")
        if len(document["presets"]) != len(expected):
            at.add("PTM-D800", f"{len(expected)} presets expected", "presets")

    def _textures(self, campus: Campus) -> None:
        at = self.findings.at(INDEX)
        present = {(t.base, t.size, t.channel) for t in campus.textures}
        used: set[tuple[str, int, str]] = set()
        for place, material in enumerate(campus.materials):
            material_at = at.at(f"materials[{place}]")
            if (material.base is None) != (not material.channels):
                material_at.add("PTM-D800", "a base without channels, or channels without a base")
            if (material.cutoff is None) != (material.alpha != "mask"):
                material_at.add("PTM-D800", "a cutoff without a mask, or a mask without one")
            base = material.base or ""
            for channel in material.channels if base else ():
                for side in SIZES:
                    used.add((base, side, channel))
                    if (base, side, channel) not in present:
                        file = texture_file(base, side, channel)
                        material_at.add("PTM-D800", f"{file} is not listed")
        owners: dict[str, str] = {}
        for place, each in enumerate(campus.objects):
            object_at = at.at(f"objects[{place}].lightmap")
            if (each.lightmap is None) != (campus.lightmaps == "none"):
                object_at.add("PTM-D800", f"differs from lightmaps, {campus.lightmaps}")
            if each.lightmap is None:
                continue
            if each.lightmap in owners:
                object_at.add("PTM-D800", f"{owners[each.lightmap]} has the same")
            owners[each.lightmap] = each.name
            for side in LIGHT_SIZES:
                used.add((each.lightmap, side, LIGHT))
                if (each.lightmap, side, LIGHT) not in present:
                    file = texture_file(each.lightmap, side, LIGHT)
                    object_at.add("PTM-D800", f"{file} is not listed")
        for base, side, channel in sorted(present - used):
            code = "PTM-D800" if channel == LIGHT else "PTM-D806"
            at.add(code, f"{texture_file(base, side, channel)} is not used", "textures")

    def _object(self, campus: Campus, where: str, each: CampusObject) -> None:
        at = self.findings.at(INDEX, where)
        low, high = np.array(each.box[:3]), np.array(each.box[3:])
        middle = np.array(each.barycentre)
        if not ((low <= middle) & (middle <= high)).all():
            at.add("PTM-D800", "the barycentre is not in the box", f"{where}.barycentre")
        eye, direction = map(np.array, each.viewpoint)
        if ((low <= eye) & (eye <= high)).all():
            at.add("PTM-D800", "lies in the box", f"{where}.viewpoint.position")
        if abs(math.hypot(*direction) - 1) > UNIT_SHARE:
            at.add("PTM-D800", "is not a unit vector", f"{where}.viewpoint.direction")
        if beyond := [m for m in each.materials if m >= len(campus.materials)]:
            at.add("PTM-D800", f"material {beyond[0]} does not exist", f"{where}.materials")
            return
        if len(each.meshes) != campus.lods:
            at.add("PTM-D800", f"{campus.lods} meshes expected", f"{where}.meshes")
        faces = [mesh.faces for mesh in each.meshes]
        if faces != sorted(faces):
            at.add("PTM-D800", "a finer mesh has fewer faces", f"{where}.meshes")
        meshes: list[tuple[Primitive, ...]] = []
        for lod, mesh in enumerate(each.meshes):
            if mesh.file != mesh_file(each.name, lod):
                at.add("PTM-D800", f"{mesh.file} is not named after its object", f"{where}.meshes")
            primitives = self._mesh(campus, each, mesh, finest=lod == len(each.meshes) - 1)
            if primitives is not None:
                meshes.append(primitives)
        if len(meshes) == len(each.meshes):
            point = np.concatenate([p.point for primitives in meshes for p in primitives])
            box = (*point.min(axis=0).tolist(), *point.max(axis=0).tolist())
            if box != each.box:
                at.add("PTM-D804", "is not that of the meshes", f"{where}.box")

    def _recorded(self, file: MeshFile | TextureFile) -> bytes | None:
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

    def _mesh(
        self, campus: Campus, each: CampusObject, mesh: MeshFile, *, finest: bool
    ) -> tuple[Primitive, ...] | None:
        data = self._recorded(mesh)
        if data is None:
            return None
        try:
            primitives = read_mesh(data)
        except ValueError as fault:
            message = str(fault.args[0] if fault.args else fault)
            self.findings.add("PTM-D804", mesh.file, "", message)
            return None
        at = self.findings.at(mesh.file)
        if (faces := sum(len(p.triangle) for p in primitives)) != mesh.faces:
            at.add("PTM-D804", f"{faces} faces, not {mesh.faces}")
        numbers = [p.material for p in primitives]
        if not set(numbers) <= set(each.materials) or (finest and numbers != list(each.materials)):
            at.add("PTM-D804", "the materials are not those of its object")
            return primitives
        for part in primitives:
            part_at = at.at(f"material {part.material}")
            if (part.uv is None) != (campus.materials[part.material].base is None):
                part_at.add(
                    "PTM-D804", "textures without coordinates, or coordinates without textures"
                )
            lit = finest and each.lightmap is not None
            if (part.light is not None) != lit:
                part_at.add(
                    "PTM-D804", "a lightmap without coordinates, or coordinates without one"
                )
            elif part.light is not None and not ((part.light >= 0) & (part.light <= 1)).all():
                part_at.add("PTM-D804", "coordinates outside of the lightmap")
        return primitives

    def _image(self, texture: TextureFile) -> None:
        from ptmtools.texture.images.opening import load, opened, pillow_faults
        from ptmtools.texture.images.picture import check_size

        data = self._recorded(texture)
        if data is None:
            return
        at = self.findings.at(texture.file)
        if not data.startswith(b"\xff\xd8\xff"):
            at.add("PTM-D804", "is not a JPEG")
            return
        try:
            with pillow_faults():
                image = opened(cast("BinaryIO", io.BytesIO(data)), self._limits)
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

    def _unlisted(self, known: set[str]) -> None:
        for folder, _, files in os.walk(self._folder):
            for file in sorted(files):
                name = (Path(folder) / file).relative_to(self._folder).as_posix()
                if name not in known:
                    self.findings.add("PTM-D806", name, "", "is not listed")
