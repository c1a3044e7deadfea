"""The interlaced images of a database's textures, written, checked, and in its site.

The finest served level of each `.ptm`, after `--max-error` and `--trim`, is interlaced. Sides that
are no powers of two are scaled; a short side is not split (docs/formats/interlace.md). Floats
become eight bits, as clients show them, since the image formats lack them.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError, InputError, LimitError, naming
from ptmtools.output.content import Content
from ptmtools.output.model import TextureRecord
from ptmtools.output.names import HINTS, texture_name
from ptmtools.output.validation.files import ServedDatabase
from ptmtools.parallel import map_in_order
from ptmtools.site.entry import DIGITS, SiteEntry, state_of
from ptmtools.store.folder import damage_error
from ptmtools.store.layout import sha256
from ptmtools.texture import reader
from ptmtools.texture.images import Picture
from ptmtools.texture.model import Limits
from ptmtools.texture.previews import decode_preview
from ptmtools.texture.samples import in_eight_bits
from ptmtools.texture.sources import first_bytes
from ptmtools_systems.interlace.declarations import INTERLACED
from ptmtools_systems.interlace.model import INDEX
from ptmtools_systems.interlace.reading import read_manifest, validate_interlaced
from ptmtools_systems.interlace.writing import Written, interlace

#: Files that a set's manifest does not name; the check of the database reports them.
_STRAY = "PTM-D806"
#: Of the document of all sets of a site.
_FORMAT, _SCHEMA = "ptmtools interlaced images", 1


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
    sets = map_in_order(_interlace_record, content.textures, content.extras.workers)
    for record, written in zip(content.textures, sets, strict=True):
        folder = INTERLACED.texture_files.replace("{name}", texture_name(record.file))
        for name, data in written.named_files():
            yield f"{folder}{name}", data


def _interlace_record(record: TextureRecord) -> Written:
    width, height = record.finest
    # Enough for all levels of a texture that has been encoded.
    limits = Limits(64 * width * height * record.components + (1 << 20))
    with naming(record.file):
        return interlace(Picture(_finest(record, limits)), limits=limits)


def _finest(record: TextureRecord, limits: Limits) -> NDArray[Any]:
    """The finest level of a texture, floats in eight bits."""
    if record.level_count > len(record.levels):
        finest = record.previews[-1]
        assert finest.stored
        data = first_bytes(finest.stored, finest.preview.bytes)
        return decode_preview(data, record.components)
    assert record.stored
    with reader.open(record.stored, limits=limits) as ptm:
        texels = ptm.level(len(ptm.header.levels) - 1)
    return np.ascontiguousarray(in_eight_bits(texels) if texels.dtype.kind == "f" else texels)


def read_file(path: str, data: bytes) -> int:
    """The length of a file; `check_files` reads the sets."""
    return len(data)


def check_files(database: ServedDatabase) -> None:
    """Checks each texture's set by itself."""
    hints = database.hints
    if hints is None:
        return
    template = hints.index.get("textureSets", {}).get(INTERLACED.name)
    if template is None:
        database.place(HINTS, "textureSets").add(
            "PTM-D700", f"does not name {INTERLACED.name}, whose files exist"
        )
        return
    names = [texture_name(row["file"]) for row in hints.index["textures"]]
    expected = [template.replace("{name}", name) + INDEX for name in names]
    indices = database.resolve_each(HINTS, "textureSets", expected)
    for path in filter(None, indices):
        folder = path.removesuffix(INDEX)
        report = validate_interlaced(database.folder / folder, database.limits)
        database.take(folder, (issue for issue in report.issues if issue.code != _STRAY))
    (folder,) = INTERLACED.owns
    sets = {p for p in database.files if p.startswith(folder) and p.endswith(f"/{INDEX}")}
    for path in sorted(sets - set(indices)):
        database.place(path).add("PTM-D710", "belongs to no texture")


def set_entries(
    index: Mapping[str, Any], place: Callable[[str], tuple[Path, str]]
) -> Iterator[SiteEntry]:
    """The files of the sets of all textures in a site, the document last.

    Visitors with ``?form=gpuii`` walk among them (`web/systems/sets.js`), and others download none
    of them. One document has the manifests of all sets, so that a client orders files by the sizes
    of all images after one request.

    Parameters
    ----------
    index: of the hints, with sets. place: the file of a URL of the index, and its SHA-256.

    Raises DatabaseError: PTM-D006 a manifest is damaged; and as ``place``.
    """
    assert INTERLACED.site
    folder, sets = INTERLACED.site.folder, []
    for number, row in enumerate(index["textures"]):
        url = index["textureSets"][INTERLACED.name].replace("{name}", texture_name(row["file"]))
        manifest, _ = place(url + INDEX)
        try:
            interlaced = read_manifest(manifest.parent)
        except (InputError, LimitError) as fault:
            raise damage_error(manifest, fault.message) from None
        media = f"image/{'jpeg' if interlaced.container == 'jpg' else interlaced.container}"
        files = []
        for part in interlaced.parts:
            file, digest = place(url + part.name)
            files.append(f"{number:04}-{file.stem}-{digest[:DIGITS]}{file.suffix}")
            name = f"{folder}/{files[-1]}"
            yield SiteEntry(name, file, media, True, state=state_of(file.stat()), digest=digest)
        sets.append({"manifest": interlaced.document(), "files": files})
    document = {"format": _FORMAT, "schema": _SCHEMA, "sets": sets}
    text = json.dumps(document, ensure_ascii=False, separators=(",", ":")).encode()
    name = f"{folder}/sets-{sha256(text)[:DIGITS]}.json"
    yield SiteEntry(name, text, "application/json", True, compressed=True)
