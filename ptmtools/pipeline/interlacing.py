"""The interlaced images of a database's textures: what the emitter `interlace` writes and checks.

Of each `.ptm` the finest level is interlaced, as it is served: with what `--max-error` and `--trim`
have left of it. Sides that are no powers of two are scaled, and one that is short is one file
(docs/formats/interlace.md). Floats, which images do not hold, are taken in eight bits, as clients
show them.

A database and an interlaced image know nothing of each other; this is above both.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError, InputError, PtmError, naming
from ptmtools.neighbours.interlace.model import INDEX, Interlaced
from ptmtools.neighbours.interlace.reading import deinterlace, read_manifest, validate_interlaced
from ptmtools.neighbours.interlace.steps import scaled
from ptmtools.neighbours.interlace.writing import Written, interlace
from ptmtools.output.content import Content
from ptmtools.output.emitters import INTERLACE
from ptmtools.output.model import TextureRecord
from ptmtools.output.names import HINTS, INTERLACE_FILES, INTERLACE_FOLDER, texture_name
from ptmtools.output.validation.files import ServedDatabase
from ptmtools.output.validation.textures import ReadTexture
from ptmtools.texture import reader
from ptmtools.texture.images import Picture
from ptmtools.texture.model import Limits
from ptmtools.texture.parallel import ordered
from ptmtools.texture.samples import KINDS, in_eight_bits

#: Files that no manifest of a set names are found by the check of the database.
_STRAY = "PTM-D806"
#: Samples of what floats are shown as.
EIGHT_BITS = "uint8"


def interlaced_files(content: Content) -> Iterator[tuple[str, str | bytes]]:
    """The files of each texture's set, in the order of the hints, the manifest of each set last.

    Raises
    ------
    DatabaseError: PTM-D602 a texture is not at hand.
    InputError, LimitError: what reading a `.ptm` and `interlace` raise.
    """
    for record in content.textures:
        if record.stored is None:
            raise DatabaseError(
                "PTM-D602",
                f"the texture {record.file!r} was not encoded",
                remedy="run the stage `textures` again",
            )
    sets = ordered(_interlaced, content.textures, content.workers)
    for record, written in zip(content.textures, sets, strict=True):
        folder = INTERLACE_FILES.replace("{name}", texture_name(record.file))
        for name, data in written.named():
            yield f"{folder}{name}", data


def _interlaced(record: TextureRecord) -> Written:
    assert record.stored
    finest = record.levels[-1]
    # What was encoded once can be decoded: its levels, and room to work in.
    limits = Limits(64 * finest.width * finest.height * record.components + (1 << 20))
    with naming(record.stored):
        return interlace(Picture(_finest(record.stored, limits)), limits=limits)


def _finest(file: Path, limits: Limits) -> NDArray[Any]:
    """The finest level of a `.ptm`, as it is shown."""
    with reader.open(file, limits=limits) as ptm:
        texels = ptm.level(len(ptm.header.levels) - 1)
    return np.ascontiguousarray(in_eight_bits(texels) if texels.dtype.kind == "f" else texels)


def read_file(path: str, data: bytes) -> int:
    """Nothing of a file is kept but its length: the sets are checked one by one."""
    return len(data)


def check_sets(database: ServedDatabase) -> Mapping[str, int]:
    """Checks each texture's set, and that it is that of its texture; counts nothing."""
    hints = database.hints
    if hints is None:
        return {}
    template = hints.index.get("textureSets", {}).get(INTERLACE.name)
    if template is None:
        database.at(HINTS, "textureSets").add("PTM-D741", f"{INTERLACE.name} is there, not named")
        return {}
    rows = hints.index["textures"]
    wanted = [template.replace("{name}", texture_name(row["file"])) + INDEX for row in rows]
    found = database.resolve_each(HINTS, "textureSets", wanted)
    for row, images, path in zip(rows, hints.images, found, strict=True):
        if path is not None:
            _check_set(database, path.removesuffix(INDEX), row, images)
    sets = {p for p in database.files if p.startswith(f"{INTERLACE_FOLDER}/") and _is_index(p)}
    for path in sorted(sets - set(found)):
        database.at(path).add("PTM-D744", "is of no texture")
    return {}


def _is_index(path: str) -> bool:
    return path.endswith(f"/{INDEX}")


def _check_set(
    database: ServedDatabase, folder: str, row: Mapping[str, Any], images: Sequence[str | None]
) -> None:
    """One set, by the check of interlaced images, and beside its texture."""
    report = validate_interlaced(database.folder / folder, database.limits)
    database.take(folder, (issue for issue in report.issues if issue.code != _STRAY))
    try:
        interlaced = read_manifest(database.folder / folder)
    except InputError:
        return  # has been found
    texture = database.textures.get(images[-1] or "")
    wrong = _misfit(interlaced, row, texture)
    if not wrong and texture and not report.issues:
        wrong = _other_texels(database, folder, interlaced, images[-1] or "")
    if wrong:
        database.at(f"{folder}{INDEX}").add("PTM-D744", wrong)


def _other_texels(
    database: ServedDatabase, folder: str, interlaced: Interlaced, texture: str
) -> str:
    """How many texels of a set are not those of its texture; empty if all are, or if there is more
    than can be read."""
    try:
        texels = _finest(database.folder / texture, database.limits)
        shown = deinterlace(database.folder / folder, limits=database.limits)
    except PtmError:
        return ""  # has been found, or is too large
    width, height = interlaced.width, interlaced.height
    if texels.shape[:2] != (height, width):
        texels = scaled(texels, width, height)
    differ = (texels.reshape(shown.shape) != shown).any(axis=-1)
    return f"{differ.sum():,} texels differ from those of the texture" if differ.any() else ""


def _misfit(interlaced: Interlaced, row: Mapping[str, Any], texture: ReadTexture | None) -> str:
    """In what a set is not that of a texture; empty if it is."""
    if not interlaced.lossless:
        return f"{interlaced.container} is not exact"
    size = row["width"], row["height"]
    if interlaced.original != size:
        old = " x ".join(map(str, interlaced.original))
        return f"was made of {old} texels, the texture has {size[0]} x {size[1]}"
    if interlaced.components != row["components"]:
        return f"has {interlaced.components} components, the texture {row['components']}"
    if texture:
        kind = KINDS[texture.header.kind]
        if interlaced.kind != (EIGHT_BITS if kind.is_float else kind.name):
            return f"has samples of {interlaced.kind}, the texture of {kind.name}"
    return ""
