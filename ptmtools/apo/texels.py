"""The nodes of an octree as texels, and back (docs/formats/apo.md; paper 2, §3.2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ptmtools.apo.cube import Cube
from ptmtools.apo.model import ADDRESS_BITS, Octree
from ptmtools.apo.octree import Level, popcount
from ptmtools.arrays import Ints, Singles
from ptmtools.errors import LimitError

_BYTE = np.array([1, 1 << 8, 1 << 16])


def normal_bytes(normal: Singles) -> NDArray[np.uint8]:
    """(n, 3) of (n, 3) unit normals."""
    found: NDArray[np.uint8] = np.rint((normal / 2 + 0.5).clip(0, 1) * 255).astype(np.uint8)
    return found


def check_count(texels: int) -> None:
    """Raises LimitError PTM-L840 if so many texels have no addresses."""
    if texels > 1 << ADDRESS_BITS:
        raise LimitError(
            "PTM-L840",
            f"the octree has {texels:,} texels, more than the {1 << ADDRESS_BITS:,} that addresses "
            f"of {ADDRESS_BITS} bits can tell apart",
            remedy="give a greater --error, a smaller --depth or a smaller --density",
        )


def octree_of(levels: list[Level], cube: Cube) -> Octree:
    """The octree texture of levels, from the root on.

    Raises LimitError PTM-L840: too many texels.
    """
    inner = [level.children > 0 for level in levels]
    counts = [len(level.code) + int(some.sum()) for level, some in zip(levels, inner, strict=True)]
    start: Ints = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    check_count(int(start[-1]))
    colored = levels[0].value.shape[1] > 3
    texels = np.zeros((int(start[-1]), 4), np.uint8)
    colors = np.zeros_like(texels) if colored else None
    for k, level in enumerate(levels):
        at = start[k] + addresses(inner[k])
        texels[at, :3] = normal_bytes(level.value[:, :3])
        texels[at, 3] = level.children
        if colors is not None:
            colors[at, :3] = np.rint(level.value[:, 3:].clip(0, 1) * 255)
            colors[at, 3] = 255
        if inner[k].any():
            children = level.children[inner[k]]
            each = popcount(children)
            first = np.cumsum(each) - each
            below = inner[k + 1]
            address = start[k + 1] + addresses(below)[first]
            flags = np.zeros((len(children), 8), bool)
            flags[np.unpackbits(children[:, None], axis=1, bitorder="little") > 0] = below
            pointer = at[inner[k]] + 1
            texels[pointer, :3] = address[:, None] // _BYTE % 256
            texels[pointer, 3] = np.packbits(flags, axis=1, bitorder="little")[:, 0]
    return Octree(texels, start, cube.low, cube.side, colors)


def addresses(inner: NDArray[np.bool_]) -> Ints:
    """(n,) where each node of a level begins, in texels from the level's first."""
    size = 1 + inner.astype(np.int64)
    found: Ints = np.cumsum(size) - size
    return found


def fault_of(octree: Octree) -> tuple[str, str] | None:
    """(place, what is wrong) of an octree whose texels are not in order, or None."""
    texels, start = octree.texels, octree.start
    inner = np.array([texels[0, 3] > 0])
    for k in range(octree.levels):
        at = start[k] + addresses(inner)
        end = int(at[-1]) + 1 + int(inner[-1])
        if end != start[k + 1]:
            return (
                f"level {k}",
                f"takes {end - start[k]} texels instead of {start[k + 1] - start[k]}",
            )
        if ((texels[at, 3] > 0) != inner).any():
            return f"level {k}", "a node is a leaf, and its parent says that it is none"
        if not inner.any():
            last = k == octree.levels - 1
            return None if last else (f"level {k + 1}", "is below leaves only")
        children, pointer = texels[at[inner], 3], texels[at[inner] + 1]
        there, flags = (
            np.unpackbits(bits[:, None], axis=1, bitorder="little") > 0
            for bits in (children, pointer[:, 3])
        )
        if (flags & ~there).any():
            return f"level {k}", "a child that is not there is said to be an inner node"
        below = flags[there]
        each = popcount(children)
        first = start[k + 1] + addresses(below)[np.cumsum(each) - each]
        if (pointer[:, :3].astype(np.int64) @ _BYTE != first).any():
            return f"level {k}", "an address is not that of the first child"
        if k == octree.levels - 1:
            return f"level {k}", "has inner nodes, and there is no level below"
        inner = below
    return None
