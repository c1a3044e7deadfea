"""The interlaced images of a database in its site: visitors with ``?form=gpuii`` walk among them
(`web/page/sets.js`), and others download none of them.

One document has the manifests of all sets, so that a client orders files
by the sizes of all images after one request.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ptmtools.errors import InputError, LimitError
from ptmtools.output.names import texture_name
from ptmtools.site.entry import DIGITS, Entry, state_of
from ptmtools.store.folder import damage_error
from ptmtools.store.layout import sha256
from ptmtools_systems.interlace.declarations import INTERLACED
from ptmtools_systems.interlace.model import INDEX
from ptmtools_systems.interlace.reading import read_manifest

FORMAT, SCHEMA = "ptmtools interlaced images", 1


def set_entries(
    index: Mapping[str, Any], place: Callable[[str], tuple[Path, str]]
) -> Iterator[Entry]:
    """The files of the sets of all textures, the document last.

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
            yield Entry(name, file, media, True, state=state_of(file.stat()), digest=digest)
        sets.append({"manifest": interlaced.document(), "files": files})
    document = {"format": FORMAT, "schema": SCHEMA, "sets": sets}
    text = json.dumps(document, ensure_ascii=False, separators=(",", ":")).encode()
    name = f"{folder}/sets-{sha256(text)[:DIGITS]}.json"
    yield Entry(name, text, "application/json", True, compressed=True)
