"""The interlaced images of a database's textures, written and checked.

The finest served level of each `.ptm`, after `--max-error` and `--trim`, is interlaced. Sides that
are no powers of two are scaled; a short side is not split (docs/formats/interlace.md). Floats
become eight bits, as clients show them, since the image formats lack them.
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
from ptmtools.output.model import TextureRecord
from ptmtools.output.names import HINTS, INTERLACE, INTERLACE_FILES, INTERLACE_FOLDER, texture_name
from ptmtools.output.validation.files import ServedDatabase
from ptmtools.output.validation.textures import ReadTexture
from ptmtools.parallel import ordered
from ptmtools.texture import reader
from ptmtools.texture.images import Picture
from ptmtools.texture.model import Limits
from ptmtools.texture.samples import KINDS, in_eight_bits

#: Files that a set's manifest does not name; the check of the database reports them.
_STRAY = "PTM-D806"
#: The kind of samples that floats become.
EIGHT_BITS = "uint8"


def interlaced_files(content: Content) -> Iterator[tuple[str, str | bytes]]:
    """The files of each texture's set, in the order of the hints, the manifest of each set last.

    Raises
    ------
    DatabaseError: PTM-D004 a texture was not encoded.
    InputError, LimitError: what reading a `.ptm` and `interlace` raise.
    """
    for record in content.textures:
        if record.stored is None:
            raise DatabaseError(
                "PTM-D004",
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
    # Enough for all levels of a texture that has been encoded.
    limits = Limits(64 * finest.width * finest.height * record.components + (1 << 20))
    with naming(record.stored):
        return interlace(Picture(_finest(record.stored, limits)), limits=limits)


def _finest(file: Path, limits: Limits) -> NDArray[Any]:
    """The finest level of a `.ptm`, floats in eight bits."""
    with reader.open(file, limits=limits) as ptm:
        texels = ptm.level(len(ptm.header.levels) - 1)
    return np.ascontiguousarray(in_eight_bits(texels) if texels.dtype.kind == "f" else texels)


def read_file(path: str, data: bytes) -> int:
    """The length of a file; `check_files` reads the sets."""
    return len(data)


def check_files(database: ServedDatabase) -> Mapping[str, int]:
    """Checks each texture's set against the texture; returns no counts."""
    hints = database.hints
    if hints is None:
        return {}
    template = hints.index.get("textureSets", {}).get(INTERLACE)
    if template is None:
        database.at(HINTS, "textureSets").add(
            "PTM-D700", f"does not name {INTERLACE}, whose files exist"
        )
        return {}
    rows = hints.index["textures"]
    expected = [template.replace("{name}", texture_name(row["file"])) + INDEX for row in rows]
    indices = database.resolve_each(HINTS, "textureSets", expected)
    for row, images, path in zip(rows, hints.images, indices, strict=True):
        if path is not None:
            _check_set(database, path.removesuffix(INDEX), row, images)
    folder = f"{INTERLACE_FOLDER}/"
    sets = {p for p in database.files if p.startswith(folder) and p.endswith(f"/{INDEX}")}
    for path in sorted(sets - set(indices)):
        database.at(path).add("PTM-D710", "belongs to no texture")
    return {}


def _check_set(
    database: ServedDatabase, folder: str, row: Mapping[str, Any], images: Sequence[str | None]
) -> None:
    """Checks one set by itself and against its texture."""
    report = validate_interlaced(database.folder / folder, database.limits)
    database.take(folder, (issue for issue in report.issues if issue.code != _STRAY))
    try:
        interlaced = read_manifest(database.folder / folder)
    except InputError:
        return  # already reported
    texture = database.textures.get(images[-1] or "")
    fault = _fault(interlaced, row, texture)
    if not fault and texture and not report.issues:
        fault = _other_texels(database, folder, interlaced, images[-1] or "")
    if fault:
        database.at(f"{folder}{INDEX}").add("PTM-D710", fault)


def _other_texels(
    database: ServedDatabase, folder: str, interlaced: Interlaced, texture: str
) -> str:
    """The number of texels of a set that differ from the texture's, as a message; "" if none do or
    the images cannot be read."""
    try:
        texels = _finest(database.folder / texture, database.limits)
        joined = deinterlace(database.folder / folder, limits=database.limits)
    except PtmError:
        return ""  # already reported, or beyond the limit
    width, height = interlaced.width, interlaced.height
    if texels.shape[:2] != (height, width):
        texels = scaled(texels, width, height)
    differ = (texels.reshape(joined.shape) != joined).any(axis=-1)
    return f"{differ.sum():,} texels differ from those of the texture" if differ.any() else ""


def _fault(interlaced: Interlaced, row: Mapping[str, Any], texture: ReadTexture | None) -> str:
    """The reason why a set is not that of a texture; "" if it is."""
    if not interlaced.lossless:
        return f"{interlaced.container} is not lossless"
    size = row["width"], row["height"]
    if interlaced.original != size:
        old = " x ".join(map(str, interlaced.original))
        return f"has {old} texels, the texture {size[0]} x {size[1]}"
    if interlaced.components != row["components"]:
        return f"has {interlaced.components} components, the texture {row['components']}"
    if texture:
        kind = KINDS[texture.header.kind]
        if interlaced.kind != (EIGHT_BITS if kind.is_float else kind.name):
            return f"has samples of {interlaced.kind}, the texture of {kind.name}"
    return ""
