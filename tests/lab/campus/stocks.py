"""Campuses made by hand, without files: boxes in a row along x that share their textures."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from ptmtools.arrays import Floats
from ptmtools_lab.campus.stock import Stock
from ptmtools_lab.campus.world import CampusWorld
from ptmtools_systems.campus.model import (
    CHANNELS,
    DIFFUSE,
    INDEX,
    LIGHT,
    LIGHT_SIZES,
    SIZES,
    Campus,
    CampusMaterial,
    CampusObject,
    MeshFile,
    TextureFile,
    mesh_file,
    texture_file,
)

#: Metres from one box to the next, and of a side.
APART, SIDE = 20.0, 10.0
#: Bytes of files.
INDEX_BYTES, COARSE, FINE = 900, 2_000, 30_000
TEXTURE = {128: 3_000, 256: 11_000, 512: 79_000}
LIGHTMAP = {512: 88_000, 1024: 259_000, 2048: 784_000}
#: Of a mesh's file so many bytes are neither vertices nor indices.
HEAD = 500
RATE = 5.0


def campus(
    materials: list[tuple[int, ...]], *, channels: tuple[str, ...] = (DIFFUSE,), lit: bool = False
) -> Campus:
    """An object for each row of the materials that it has."""
    count = max((m for row in materials for m in row), default=-1) + 1
    objects, textures = [], []
    for i, used in enumerate(materials):
        low, name = APART * i, f"box{i}"
        objects.append(
            CampusObject(
                name=name,
                label=name,
                parts=(name,),
                box=(low, 0, 0, low + SIDE, SIDE, SIDE),
                barycentre=(low + SIDE / 2, SIDE / 2, SIDE / 2),
                viewpoint=((low, 2, -9), (0, 0, 1)),
                materials=used,
                lightmap=name if lit else None,
                meshes=(
                    MeshFile(mesh_file(name, 0), 10, COARSE, 0, 1.0),
                    MeshFile(mesh_file(name, 1), 100, FINE, 0, 0.0),
                ),
            )
        )
        if lit:
            textures += [_texture(name, size, LIGHT, LIGHTMAP[size]) for size in LIGHT_SIZES]
    for m in range(count):
        textures += [
            _texture(f"base{m}", size, channel, TEXTURE[size])
            for size in SIZES
            for channel in channels
        ]
    made = tuple(CampusMaterial(f"m{m}", f"base{m}", channels) for m in range(count))
    light = "bake" if lit else "none"
    return Campus((0, 0, 0), 1.0, "y", 2, light, tuple(objects), made, tuple(textures))


def _texture(base: str, size: int, channel: str, count: int) -> TextureFile:
    return TextureFile(texture_file(base, size, channel), base, size, channel, count, 0, (512, 512))


def stock(of: Campus) -> Stock:
    """What can be fetched of it; all bytes are those of the index."""
    files = of.files()
    sizes = {t.file: t.size for t in of.textures}
    sent = np.array([INDEX_BYTES, *(count for count, _ in files.values())])
    memory = [4 * (4 * sizes[n] ** 2 - 1) // 3 if n in sizes else files[n][0] - HEAD for n in files]
    most = [4 * (4 * sizes[n] ** 2 - 1) // 3 if n in sizes else files[n][0] for n in files]
    return Stock(
        campus=of,
        names=(INDEX, *files),
        sent=sent,
        stored=sent,
        memory=np.array([0, *memory]),
        most=np.array([0, *most]),
        boxes=np.array([o.box for o in of.objects], dtype=np.float64).reshape(-1, 6),
        barycentres=np.array([o.barycentre for o in of.objects], dtype=np.float64).reshape(-1, 3),
        bases=tuple(m.base or "" for m in of.materials),
    )


def world(made: Stock, x: Floats) -> CampusWorld:
    """Who is at (F,) places along the row, a few metres beside it."""
    eye = np.stack([x, np.full(len(x), 1.6), np.full(len(x), -5.0)], axis=1)
    time = np.arange(len(x)) / RATE
    seen = np.ones((len(x), made.objects), np.bool_)
    return CampusWorld(made, None, np.arange(len(x)), time, eye, seen, RATE)


SEEDS = st.integers(0, 2**32 - 1)


def any_campus(seed: int) -> Campus:
    """A few boxes with some of a few materials."""
    random = np.random.default_rng(seed)
    materials = []
    for _ in range(int(random.integers(1, 9))):
        some = random.choice(6, int(random.integers(0, 4)), replace=False)
        materials.append(tuple(some.tolist()))
    channels = CHANNELS[: int(random.integers(1, 4))]
    return campus(materials, channels=channels, lit=bool(random.integers(2)))


def any_walk(seed: int, boxes: int) -> Floats:
    """Up and down along the row, with stops and leaps."""
    random = np.random.default_rng(seed)
    frames = int(random.integers(20, 120))
    step = np.where(random.random(frames) < 0.8, random.normal(0, 6, frames), 0)
    leap = np.where(random.random(frames) < 0.05, random.normal(0, 60, frames), 0)
    return np.clip(np.cumsum(step + leap), -APART, APART * boxes)
