"""The meshes of a campus as surfaces, and its textures with their mip levels."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Floats
from ptmtools.campus.meshes import Primitive, read_mesh
from ptmtools.errors import PtmError
from ptmtools.scene.colors import to_srgb
from ptmtools.texture.images.opening import load, opened, pillow_faults
from ptmtools.texture.model import Limits
from ptmtools.walkthrough.campus.stock import Stock, file_bytes, refused
from ptmtools.walkthrough.served import Surfaces
from ptmtools.walkthrough.view.records import Pyramids


def read_surfaces(folder: Path, stock: Stock, level: int) -> Surfaces:
    """The meshes of all objects of one level, 0 or -1: the coarsest or the finest.

    ``cell`` is the object, ``texture`` the number in `Stock.bases`. Light in the colours of
    vertices is left out, and with it, where there is some, the colours of the model.

    Raises InputError PTM-I714.
    """
    campus = stock.campus
    rows: list[tuple[int, Primitive]] = []
    for number, each in enumerate(campus.objects):
        name = each.meshes[level].file
        try:
            primitives = read_mesh(file_bytes(folder, name))
        except ValueError as fault:
            raise refused(folder / name, f"is no mesh of a campus ({fault})") from None
        if max(p.material for p in primitives) >= len(campus.materials):
            raise refused(folder / name, "has a material that the campus does not have")
        rows += [(number, p) for p in primitives]
    count = [len(p.triangle) for _, p in rows]
    looks = [campus.materials[p.material] for _, p in rows]
    base = {name: number for number, name in enumerate(stock.bases)}
    texture = [
        base.get(m.base or "", -1) if p.uv is not None else -1
        for m, (_, p) in zip(looks, rows, strict=True)
    ]

    def spread(values: object, kind: type[np.generic], *shape: int) -> NDArray[Any]:
        held = np.array(values, dtype=kind).reshape(len(rows), *shape)
        return np.repeat(held, count, axis=0)

    corner = _joined([p.point[p.triangle] for _, p in rows], 3)
    lit = campus.lightmaps != "none" and any(len(o.meshes) > 1 for o in campus.objects)
    bright = [_brightness(p, lit and level == 0) for _, p in rows]
    color = np.concatenate([np.zeros((0, 3)), *bright])
    color = color * spread([m.color for m in looks], np.float64, 3)
    glass = [m.alpha == "blend" and t < 0 for m, t in zip(looks, texture, strict=True)]
    return Surfaces(
        corner=corner,
        uv=_joined([_texture_points(p) for _, p in rows], 2),
        cell=spread([number for number, _ in rows], np.int32),
        shape=np.repeat(np.arange(len(rows), dtype=np.int32), count),
        texture=spread(texture, np.int32),
        color=color,
        two_sided=spread([m.two_sided for m in looks], np.bool_),
        glass=spread(glass, np.bool_),
        clamped=spread([[w == "clamp" for w in m.wrap] for m in looks], np.bool_, 2),
        seen=np.repeat(np.arange(len(corner))[:, None], 2, axis=1),
        octree=np.full(len(corner), -1, np.int32),
    )


def read_textures(folder: Path, stock: Stock, size: int) -> Pyramids:
    """The colours of all bases in one size, and their mip levels, made as `generateMipmap` does.

    Raises InputError PTM-I714.
    """
    deepest = size.bit_length()
    count = len(stock.bases)
    start, levels = np.zeros((count, deepest), np.int64), np.full(count, deepest, np.int64)
    sides = np.zeros((count, deepest, 2), np.int64)
    parts: list[NDArray[np.uint8]] = []
    at = 0
    for base in range(count):
        image = _image(folder, stock.names[stock.diffuse(base, size)], size)
        for n, level in enumerate(mip_levels(image)):
            start[base, n], sides[base, n] = at, len(level)
            at += level.size
            parts.append(level.ravel())
    texel = np.concatenate(parts) if parts else np.zeros(0, np.uint8)
    return Pyramids(texel, start, sides, levels, np.zeros((count, 3)), np.zeros((count, deepest)))


def mip_levels(image: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """A square (s, s, 3), s a power of two, and its mip levels, the coarsest first: each texel is
    the rounded mean of four."""
    found = [image]
    while len(image) > 1:
        held = image.astype(np.uint16)
        total = held[::2, ::2] + held[1::2, ::2] + held[::2, 1::2] + held[1::2, 1::2]
        image = ((total + 2) >> 2).astype(np.uint8)
        found.append(image)
    return found[::-1]


def _image(folder: Path, name: str, size: int) -> NDArray[np.uint8]:
    limits = Limits()
    try:
        with pillow_faults():
            image = opened(io.BytesIO(file_bytes(folder, name)), limits)
            load(image)
            held = np.asarray(image.convert("RGB"))
    except PtmError as fault:
        raise refused(folder / name, fault.message) from None
    if held.shape[:2] != (size, size):
        raise refused(folder / name, f"is not a square of {size} texels")
    return np.ascontiguousarray(held)


def _brightness(primitive: Primitive, lit: bool) -> Floats:
    """(m, 3) what multiplies the texel of each triangle, sRGB, without the material's colour."""
    if primitive.color is None or lit:
        return np.ones((len(primitive.triangle), 3))
    colors: Floats = to_srgb(primitive.color)[primitive.triangle].mean(axis=1)
    return colors


def _texture_points(primitive: Primitive) -> Floats:
    if primitive.uv is None:
        return np.zeros((len(primitive.triangle), 3, 2))
    return primitive.uv[primitive.triangle]


def _joined(rows: list[Floats], width: int) -> Floats:
    return np.concatenate([np.zeros((0, 3, width)), *rows])
