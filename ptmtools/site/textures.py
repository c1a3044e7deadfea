"""Textures of a site, in a form that browsers read, with or without their exact levels."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ptmtools.errors import InputError, naming
from ptmtools.files import open_regular
from ptmtools.output.model import offsets_of, sizes_of
from ptmtools.store.folder import damaged, unreadable

#: Textures that the page decodes.
PROFILES, KIND, VERSION = ("fast", "raw"), "uint8", 2


@dataclass(frozen=True)
class Texture:
    """A texture of a site.

    Attributes
    ----------
    row: its row of the index, but for the name of the file.
    data: its bytes if it was encoded anew; None if the file is sent as it is.
    note: a remark for the user.
    """

    row: Mapping[str, Any]
    data: bytes | None = None
    note: str = ""


def web_texture(file: Path, row: Mapping[str, Any]) -> Texture:
    """A texture of an index, in a form that browsers read. One of another profile, version or kind
    of sample is encoded again with the same levels: integers lose their low bits, floats count from
        0 to 1, as in every display of such a texture.

    Raises
    ------
    DatabaseError: PTM-D005, D006 the file is missing, damaged, or another than the index says.
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


def without_exact(file: Path, texture: Texture) -> Texture:
    """A texture of a site without the exact levels that finer previews replace, if a preview has
    the finest level; raises DatabaseError as `web_texture`."""
    from ptmtools.texture.container import cut, read_header
    from ptmtools.texture.previews import coarse_levels

    row, sizes = texture.row, sizes_of(texture.row)
    levels = coarse_levels([max(size) for size in sizes])
    previews = row.get("previews", ())
    if not previews or previews[-1]["level"] < len(sizes) - 1 or levels >= len(row["ends"]):
        return texture
    data = texture.data
    if data is None:
        try:
            data = file.read_bytes()
        except OSError as fault:
            raise unreadable(file, fault) from None
    data = cut(data, levels)
    changed = {
        "width": sizes[levels - 1][0],
        "height": sizes[levels - 1][1],
        "ends": [level.end for level in read_header(data).levels],
    }
    return Texture({**row, **changed}, data, texture.note)


def _encoded_again(file: Path, row: Mapping[str, Any]) -> Texture:
    from ptmtools.texture import EncodeOptions, encode_to, open as open_ptm, read_header
    from ptmtools.texture.model import gpu_texel_bytes
    from ptmtools.texture.samples import in_eight_bits

    try:
        with open_ptm(file) as ptm:
            before = f"{ptm.header.profile}, {ptm.header.kind}"
            texels = in_eight_bits(ptm.level(len(ptm.header.levels) - 1))
    except InputError as fault:
        raise damaged(file, fault.message) from None
    buffer = io.BytesIO()
    options = EncodeOptions(min_level=-len(row["ends"]))
    detail = encode_to(buffer, texels, options)
    data = buffer.getvalue()
    components = int(row["components"])
    # Of the levels that are not stored, the row knows more.
    kept = len(row["ends"])
    beyond = offsets_of(row)[kept - 1]
    changed = {
        "texelBytes": components,
        "gpuTexelBytes": gpu_texel_bytes(components, components),
        "ends": [level.end for level in read_header(data).levels],
        "differences": [*detail.differences, *row["differences"][kept:]],
        "color": [min(255, max(0, value + beyond)) for value in detail.color],
        "offsets": [*(n + beyond for n in detail.offsets), *offsets_of(row)[kept:]],
    }
    note = f"{file.name} was {before}, which browsers do not read: encoded again as fast, 8 bits"
    return Texture({**row, **changed}, data, note)
