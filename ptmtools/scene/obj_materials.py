"""Materials of an OBJ file: finds the libraries that it names, and in them what it uses."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Set
from pathlib import Path

from ptmtools.scene.model import Shine, Wrap
from ptmtools.scene.mtl import MapStatement, MtlMaterial, read_mtl
from ptmtools.scene.source import FileRange, Findings, SourceMaterial, Texture

#: The next file of a mtllib statement, which ends as such files do, or all that is left.
_LIBRARIES = re.compile(r".*?\.mtl[\"']*(?: |$)|.+", re.IGNORECASE)


def library_names(text: str) -> list[str]:
    """The files of a mtllib statement: several, divided by blanks that names may contain too."""
    return [name.strip() for name in _LIBRARIES.findall(text) if name.strip()]


def resolved(
    path: Path,
    libraries: Iterable[tuple[str, int]],
    named: Mapping[str, tuple[int, int]],
    used: Set[int],
    findings: Findings,
) -> tuple[tuple[SourceMaterial, ...], dict[int, MapStatement]]:
    """The materials of an OBJ file, and the map_Kd of those that have one, by number.

    Parameters
    ----------
    libraries: what each mtllib statement says, and its line.
    named: of the materials in their order, by name: number, and line of the first usemtl.
    used: the numbers of those that some face has; of the others no image is looked for.

    Raises what `read_mtl` raises.
    """
    defined: dict[str, MtlMaterial] = {}
    read: set[Path] = set()
    for text, line in libraries:
        place = f"{path.name}:{line}"
        for name in library_names(text):
            there = findings.folder.find(name).path is not None
            suggestion = "" if there else _suggestion(path, name)
            file = findings.locate(name, f"mtllib {name}", place, "PTM-N203", hint=suggestion)
            if file is None or (real := file.resolve()) in read:
                continue
            read.add(real)
            for key, material in read_mtl(file, findings).items():
                defined.setdefault(key, material)

    materials: list[SourceMaterial] = []
    maps: dict[int, MapStatement] = {}
    for name, (index, line) in named.items():
        known = defined.get(name)
        if known is None:
            if name and index in used:
                findings.miss("PTM-N207", f"usemtl {name}: no such material", f"{path.name}:{line}")
            materials.append(SourceMaterial(name or "default"))
            continue
        texture = mask = None
        if index in used:
            texture = _texture(known, "map_Kd", known.map_kd, findings)
            mask = _texture(known, "map_d", known.map_d, findings)
        if texture is not None and known.map_kd is not None:
            maps[index] = known.map_kd
        materials.append(
            SourceMaterial(
                name=name,
                color=known.color,
                opacity=known.dissolve,
                # A mask that cannot be read: better see too much than too little.
                see_through=known.dissolve < 1 or (known.map_d is not None and mask is None),
                texture=texture,
                mask=mask,
                shine=_shine(known),
            )
        )
    return tuple(materials), maps


def _shine(material: MtlMaterial) -> Shine | None:
    colors, said, base = material.map_kd, material.map_ks, material.library.parent
    if material.map_ks_fault:
        return Shine("", base, f"map_Ks: {material.map_ks_fault}")
    if said is None:
        return None
    alike = colors is None or (colors.scale, colors.offset) == (said.scale, said.offset)
    return Shine(said.file, base, "" if alike else "other texture coordinates")


def _suggestion(path: Path, name: str) -> str:
    """What to do about a missing library: a model that was renamed still asks for what its
    library was called."""
    beside = [p.name for p in path.absolute().parent.glob("*") if p.suffix.lower() == ".mtl"]
    if len(beside) != 1:
        return ""
    return f"; if {beside[0]} beside the model is meant, rename it to {Path(name).name}"


def _texture(
    material: MtlMaterial, key: str, statement: MapStatement | None, findings: Findings
) -> Texture | None:
    if statement is None:
        return None
    place = f"{findings.folder.label(material.library)}:{statement.line}"
    what = f"{key} {statement.file}"
    file = findings.locate(statement.file, what, place, base=material.library.parent)
    if file is None:
        return None
    if statement.ignored:
        findings.say("PTM-N215", f"{what}: ignored {' '.join(statement.ignored)}", place)
    if statement.scale != (1.0, 1.0) or statement.offset != (0.0, 0.0):
        if key == "map_Kd":
            findings.say("PTM-N216", f"{what}: -s and -o are baked into its faces", place)
        elif material.map_kd is None or (statement.scale, statement.offset) != (
            material.map_kd.scale,
            material.map_kd.offset,
        ):
            findings.say("PTM-N215", f"{what}: ignored -s -o", place)
    wrap: Wrap = "clamp" if statement.clamp else "repeat"
    return Texture(
        read=FileRange(file),
        label=file.name,
        what=what,
        place=place,
        wrap_s=wrap,
        wrap_t=wrap,
        channel=statement.channel,
    )
