"""Textures as browsers read them: `.ptm` version 2, profiles `fast` and `raw`, of 8 bits."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ptmtools.errors import InputError, naming
from ptmtools.files import open_regular
from ptmtools.store.folder import damaged, unreadable

#: What the decoder of the page reads.
PROFILES, KIND, VERSION = ("fast", "raw"), "uint8", 2


@dataclass(frozen=True)
class Texture:
    """A texture of a site.

    Attributes
    ----------
    row: its row of the index, but for the name of the file.
    data: its bytes if it was encoded anew; None if the file is sent as it is. note: what to say.
    """

    row: Mapping[str, Any]
    data: bytes | None = None
    note: str = ""


def web_texture(file: Path, row: Mapping[str, Any]) -> Texture:
    """A texture of an index, in a form that browsers read. One of another profile, version or kind
    of sample is encoded again with the same levels: integers lose their low bits, floats count from
    0 to 1, as wherever such a texture is shown.

    Raises
    ------
    DatabaseError: PTM-D005, D006 the file is missing or damaged, or not what the index says.
    LimitError: those of `ptmtools.texture.open` and `PtmReader.level`.
    """
    from ptmtools.texture.container import HEAD_MAX, read_header

    try:
        with open_regular(file) as stream, naming(file):
            header = read_header(stream.read(HEAD_MAX))
            size = os.fstat(stream.fileno()).st_size
    except OSError as fault:
        raise unreadable(file, fault) from None
    except InputError as fault:
        raise damaged(file, fault.message) from None
    if size != header.file_size or [level.end for level in header.levels] != row["ends"]:
        raise damaged(file, "is not the texture that the index has")
    if header.profile in PROFILES and header.kind == KIND and header.version == VERSION:
        return Texture(row)
    return _encoded_again(file, row)


def _encoded_again(file: Path, row: Mapping[str, Any]) -> Texture:
    from ptmtools.texture import EncodeOptions, encode_to, open as open_ptm, read_header
    from ptmtools.texture.model import gpu_texel_bytes
    from ptmtools.texture.samples import in_eight_bits

    try:
        with open_ptm(file) as ptm:
            was = f"{ptm.header.profile}, {ptm.header.kind}"
            texels = in_eight_bits(ptm.level(len(ptm.header.levels) - 1))
    except InputError as fault:
        raise damaged(file, fault.message) from None
    buffer = io.BytesIO()
    options = EncodeOptions(min_level=-len(row["ends"]))
    detail = encode_to(buffer, texels, options)
    data = buffer.getvalue()
    components = int(row["components"])
    changed = {
        "texelBytes": components,
        "gpuTexelBytes": gpu_texel_bytes(components, components),
        "ends": [level.end for level in read_header(data).levels],
        "differences": list(detail.differences),
        "color": list(detail.color),
    }
    note = f"{file.name} was {was}, which browsers do not read: encoded again as fast, 8 bits"
    return Texture({**row, **changed}, data, note)
