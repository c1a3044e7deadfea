"""Bakes mirrored repetition into textures, and moves texture coordinates near the origin.

Neither VRML nor the clients support mirrored repetition. Most surfaces with such a texture lie
within one repetition; there the coordinates are mirrored instead, exactly. Otherwise the image is
doubled, with its mirror image beside it, and repeats normally. (Rejected: emitting the mode. VRML97
has none, so its files would differ from the GLB cells.)

Projected map coordinates are far from the origin. Emitted files store single precision, which at
1,024 repetitions still separates the texels of an image of 4,096, and at five million has two steps
per repetition. A repeating texture looks the same after a shift by whole repetitions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.errors import InputError
from ptmtools.scene.images import ImageStore, integers
from ptmtools.scene.model import Wrap
from ptmtools.scene.notes import Findings
from ptmtools.scene.source import Source, SourceWrap, Texture


@dataclass(frozen=True)
class MirroredBytes:
    """The bytes of a PNG of an image and its mirror images, ``across``, ``down`` or both.

    ``limit`` as in `ImageStore`. Raises the errors of ``read``; InputError or LimitError if the
    image cannot be decoded; InputError PTM-I125 if the result would be too large.
    """

    read: Callable[[], bytes]
    across: bool
    down: bool
    limit: int

    def __call__(self) -> bytes:
        from ptmtools.texture.images.png import png_bytes

        texels, description = integers(self.read(), self.limit)
        height, width, _ = texels.shape
        if 4 * height * width * (1 + self.across) * (1 + self.down) > self.limit:
            raise InputError("PTM-I125", "too large for its mirror images; repeated unmirrored")
        if self.across:
            texels = np.concatenate([texels, texels[:, ::-1]], axis=1)
        if self.down:
            texels = np.concatenate([texels, texels[::-1]], axis=0)
        return png_bytes(texels, description)


def bake_mirrors(
    source: Source,
    used: Ints,
    faces: Sequence[Ints],
    uv: Floats,
    store: ImageStore,
    findings: Findings,
) -> tuple[Source, Floats]:
    """The source without mirrored textures, and the changed coordinates.

    ``used`` are numbers of materials, and ``faces`` the rows of ``uv``, (T, 3, 2), of each. A
    texture that cannot be converted repeats unmirrored, which is a miss.
    """
    materials = list(source.materials)
    mirrored = [
        (index, rows)
        for index, rows in zip(used.tolist(), faces, strict=True)
        if (texture := materials[index].texture) is not None
        and "mirror" in (texture.wrap_s, texture.wrap_t)
    ]
    uv = uv.copy() if mirrored else uv
    for index, rows in mirrored:
        texture = materials[index].texture
        assert texture is not None
        baked, coords = _bake_mirror(texture, uv[rows], store.limit)
        if baked.read != texture.read:
            store.mark_as_input(texture)  # also if it fails: another image may succeed
            if store.has_alpha(texture) is None or store.has_alpha(baked) is None:
                wrap_s, wrap_t = emitted_wraps(texture)
                plain = replace(texture, wrap_s=wrap_s, wrap_t=wrap_t)
                materials[index] = replace(materials[index], texture=plain)
                continue
        materials[index], uv[rows] = replace(materials[index], texture=baked), coords
        findings.note("PTM-N215", f"{texture.what}: mirrored repetition baked in", texture.place)
    return replace(source, materials=tuple(materials)), uv


def _bake_mirror(texture: Texture, uv: Floats, limit: int) -> tuple[Texture, Floats]:
    """The converted texture, and its (n, 3, 2) coordinates, changed in place."""
    wraps: list[SourceWrap] = [texture.wrap_s, texture.wrap_t]
    doubled = [False, False]
    for axis in (0, 1):
        if wraps[axis] != "mirror":
            continue
        folded = _folded(uv[..., axis])
        if folded is None:
            wraps[axis], doubled[axis] = "repeat", True
            uv[..., axis] /= 2
        else:
            wraps[axis], uv[..., axis] = "clamp", folded
    if doubled[1]:  # the origin is the lower left, and the image is the upper half
        uv[..., 1] += 0.5
    read = (
        MirroredBytes(texture.read, doubled[0], doubled[1], limit) if any(doubled) else texture.read
    )
    return replace(texture, read=read, wrap_s=wraps[0], wrap_t=wraps[1]), uv


def _folded(coordinate: Floats) -> Floats | None:
    """(T, 3) coordinates of triangles mirrored into [0, 1]; None if a triangle crosses the edge of
    a repetition."""
    lowest = np.floor(coordinate.min(axis=1, initial=np.inf))
    # A triangle that ends at an edge lies in the repetition before it.
    if (coordinate.max(axis=1, initial=-np.inf) > lowest + 1).any():
        return None
    place = coordinate - lowest[:, None]
    return np.asarray(np.where(lowest[:, None] % 2 == 1, 1 - place, place))


def emitted_wraps(texture: Texture | None) -> tuple[Wrap, Wrap]:
    """The wrap modes of a texture without mirrored repetition; "repeat" without a texture."""
    wrap_s, wrap_t = (texture.wrap_s, texture.wrap_t) if texture else ("repeat", "repeat")
    return "repeat" if wrap_s == "mirror" else wrap_s, "repeat" if wrap_t == "mirror" else wrap_t


#: Coordinates up to this distance from the origin, in repetitions, are unchanged.
FAR = 1024.0
#: Larger coordinates have no fractions in single precision.
LARGEST = 2.0**24


def near_origin(uv: Floats, group: Ints, repeats: Bools) -> Floats:
    """(T, 3, 2) finite coordinates, shifted near the origin by even numbers of repetitions, which
    also preserves mirrored repetition.

    Parameters
    ----------
    group: (T,) faces of one group are shifted together.
    repeats: (T, 2) whether the texture repeats along each axis, equal within a group.
    """
    if not (uv.max(initial=0.0) > FAR or uv.min(initial=0.0) < -FAR):
        return uv
    far, uv = (np.abs(uv).max(axis=1) > FAR) & repeats, uv.copy()
    order = np.argsort(group, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        for axis in np.flatnonzero(far[rows].any(axis=0)):
            uv[rows, :, axis] -= 2 * np.floor(np.median(uv[rows, :, axis]) / 2)
    return uv
