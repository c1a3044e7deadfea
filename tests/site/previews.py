"""Sites whose textures have previews, made of sites by hand: so tests choose every byte."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ptmtools.site.content import Site
from ptmtools.site.entry import SiteEntry
from ptmtools.texture import EncodeOptions, encode_to, read_header
from ptmtools.texture.model import gpu_texel_bytes

Texels = NDArray[np.uint8]
MEDIA = {"webp": "image/webp", "jpg": "image/jpeg", "avif": "image/avif"}


@dataclass(frozen=True)
class Preview:
    """A preview that a texture is to have.

    Attributes
    ----------
    level: of the image. kind: its suffix. options: for Pillow. exact: whether it counts as exact.
    spoil: changes the bytes of its file.
    """

    level: int
    kind: str = "webp"
    options: Mapping[str, Any] = field(default_factory=lambda: {"quality": 75})
    exact: bool = False
    spoil: Callable[[bytes], bytes] = bytes


@dataclass(frozen=True)
class Texture:
    """A texture.

    Attributes
    ----------
    texels: (h, w, c) uint8. stored: levels of its `.ptm`; None for all.
    previews: ascending by level. tile: side of the `.ptm`'s tiles, 0 for none.
    """

    texels: Texels
    previews: Sequence[Preview]
    stored: int | None = None
    tile: int = 0


def halved(texels: Texels) -> Texels:
    """(h // 2, w // 2, c) the level below (docs/formats/ptm.md)."""
    height, width = (side // 2 for side in texels.shape[:2])
    blocks = texels[: 2 * height, : 2 * width].reshape(height, 2, width, 2, -1).astype(np.uint16)
    below: Texels = (blocks.sum(axis=(1, 3)) >> 2).astype(np.uint8)
    return below


def levels_of(texels: Texels) -> list[Texels]:
    """All levels, coarsest first."""
    levels = [texels]
    while min(levels[0].shape[:2]) > 1:
        levels.insert(0, halved(levels[0]))
    return levels


def brightened(texels: Texels, levels: Sequence[Texels]) -> list[Texels]:
    """Levels of an image, the coarsest first, as bright as the image (docs/formats/hints.md)."""
    colours = slice(texels.shape[2] - (texels.shape[2] in (2, 4)))
    missing = [0.0]
    for level, below in pairwise(levels_of(texels)[::-1]):
        blocks = level[: 2 * below.shape[0], : 2 * below.shape[1], colours]
        missing.insert(0, missing[0] + blocks.mean() - below[..., colours].mean())
    result = []
    for level, offset in zip(levels, missing, strict=False):
        bright = level.astype(int)
        bright[..., colours] += int(np.floor(offset + 0.5))
        result.append(np.clip(bright, 0, 255).astype(np.uint8))
    return result


def saved(texels: Texels, preview: Preview) -> bytes:
    """The file of an image."""
    stream = io.BytesIO()
    image = Image.fromarray(texels[..., 0] if texels.shape[2] == 1 else texels)
    if texels.shape[2] == 2:
        image = Image.fromarray(texels[..., [0, 0, 0, 1]])
    image.save(stream, {"jpg": "jpeg"}.get(preview.kind, preview.kind), **preview.options)
    return stream.getvalue()


def decoded(data: bytes, components: int) -> Texels:
    """(h, w, c) as Pillow decodes it."""
    with Image.open(io.BytesIO(data)) as image:
        rgba = np.asarray(image.convert("RGBA"))
    channels = {1: [0], 2: [0, 3], 3: [0, 1, 2], 4: [0, 1, 2, 3]}[components]
    return rgba[..., channels]


def with_previews(site: Site, textures: Mapping[int, Texture]) -> Site:
    """The same site with other textures of these numbers."""
    entries, index = dict(site.entries), {**site.index}
    rows: list[dict[str, Any]] = [dict(row) for row in site.index["textures"]]
    for number, texture in textures.items():
        rows[number] |= _row(entries, f"t{number}", texture)
    index["textures"] = rows
    return with_index(Site(entries, index), index)


def with_index(site: Site, index: Mapping[str, Any]) -> Site:
    """The same site with another index, under the same name."""
    name = next(n for n in site.entries if n.startswith("data/index-"))
    text = json.dumps(index).encode()
    entry = replace(site.entries[name], source=text, state=None)
    return Site({**site.entries, name: entry}, index)


def _row(entries: dict[str, SiteEntry], stem: str, texture: Texture) -> dict[str, Any]:
    levels, components = levels_of(texture.texels), texture.texels.shape[2]
    stored = len(levels) if texture.stored is None else texture.stored
    whole, buffer = io.BytesIO(), io.BytesIO()
    detail = encode_to(whole, texture.texels, EncodeOptions())
    encode_to(buffer, levels[stored - 1], EncodeOptions(tile=texture.tile))
    data = buffer.getvalue()
    ends = [level.end for level in read_header(data).levels]
    assert len(ends) == stored
    height, width = levels[stored - 1].shape[:2]
    row: dict[str, Any] = {
        "file": _add(entries, f"{stem}.ptm", data, "application/octet-stream"),
        "width": width,
        "height": height,
        "components": components,
        "texelBytes": components,
        "gpuTexelBytes": gpu_texel_bytes(components, components),
        "ends": ends,
        "differences": list(detail.differences),
        "color": list(detail.color),
        "offsets": list(detail.offsets),
        "previews": [],
    }
    for preview in texture.previews:
        level = levels[preview.level]
        image = saved(level, preview)
        error = np.square(decoded(image, components).astype(float) - level)
        name = f"{stem}-{preview.level}.{preview.kind}"
        row["previews"].append(
            {
                "file": _add(entries, name, preview.spoil(image), MEDIA[preview.kind]),
                "level": preview.level,
                "width": level.shape[1],
                "height": level.shape[0],
                "bytes": len(image),
                "difference": 0 if preview.exact else float(np.sqrt(error.mean(axis=2)).mean()),
                "error": float(np.sqrt(error.mean())),
                **({"exact": True} if preview.exact else {}),
            }
        )
    return row


def _add(entries: dict[str, SiteEntry], name: str, data: bytes, media: str) -> str:
    entries[f"data/{name}"] = SiteEntry(f"data/{name}", data, media)
    return name
