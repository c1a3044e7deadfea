"""Textures that are mirrored where they repeat, which neither VRML nor the clients know.

Most surfaces with such a texture lie within one repetition, for which its coordinates can be
mirrored instead, exactly. Where one does not, the image is made twice as large, with its mirror
image beside it, and repeats as others do. (Rejected: to carry the mode over. VRML97 has none, so
its files would show something else than the GLB cells.)

Texture coordinates far from the origin, as projected map coordinates are.

Files have them in single precision, which at 1,024 repetitions still tells apart the texels of an
image of 4,096, and at five million has two steps to a repetition. Where a texture repeats, whole
repetitions more or less show the same."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.errors import InputError
from ptmtools.scene.images import ImageStore, integers
from ptmtools.scene.model import Wrap
from ptmtools.scene.source import Findings, Source, SourceWrap, Texture


@dataclass(frozen=True)
class MirroredBytes:
    """The bytes of a PNG of an image beside its mirror images, ``across``, ``down`` or both.

    ``limit`` as of `ImageStore`. Raises what reading raises, and InputError or LimitError for what
    cannot be decoded; InputError PTM-I125 for what would be too large.
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
            raise InputError("PTM-I125", "would be too large beside its mirror images; it repeats")
        if self.across:
            texels = np.concatenate([texels, texels[:, ::-1]], axis=1)
        if self.down:
            texels = np.concatenate([texels, texels[::-1]], axis=0)
        return png_bytes(texels, description)


def unmirrored(
    source: Source,
    used: Ints,
    faces: Sequence[Ints],
    uv: Floats,
    store: ImageStore,
    findings: Findings,
) -> tuple[Source, Floats]:
    """The same without textures that are mirrored, and their coordinates.

    ``faces`` are the rows of ``uv``, (T, 3, 2), of each material that is ``used``, by number. A
    texture that cannot be made so repeats as it is, and a miss is recorded.
    """
    materials = list(source.materials)
    wanted = [
        (index, rows)
        for index, rows in zip(used.tolist(), faces, strict=True)
        if (texture := materials[index].texture) is not None
        and "mirror" in (texture.wrap_s, texture.wrap_t)
    ]
    uv = uv.copy() if wanted else uv
    for index, rows in wanted:
        given = materials[index].texture
        assert given is not None
        made, coords = _unmirrored(given, uv[rows], store.limit)
        if made.read != given.read:
            store.made_into_another(given)  # also where it fails: another image may not
            if store.has_alpha(given) is None or store.has_alpha(made) is None:
                plain = replace(given, wrap_s=told(given.wrap_s), wrap_t=told(given.wrap_t))
                materials[index] = replace(materials[index], texture=plain)
                continue
        materials[index], uv[rows] = replace(materials[index], texture=made), coords
        findings.say("PTM-N222", f"{given.what}: its mirrored repeat is baked in", given.place)
    return replace(source, materials=tuple(materials)), uv


def _unmirrored(texture: Texture, uv: Floats, limit: int) -> tuple[Texture, Floats]:
    """The texture, and its (n, 3, 2) coordinates, which are changed."""
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
    if doubled[1]:  # from the lower left: its own half is the upper one
        uv[..., 1] += 0.5
    read = (
        MirroredBytes(texture.read, doubled[0], doubled[1], limit) if any(doubled) else texture.read
    )
    return replace(texture, read=read, wrap_s=wraps[0], wrap_t=wraps[1]), uv


def _folded(coordinate: Floats) -> Floats | None:
    """(T, 3) coordinates of triangles brought into [0, 1]; None if one leaves its repetition."""
    lowest = np.floor(coordinate.min(axis=1, initial=np.inf))
    # What ends at the edge of a repetition lies in the one before it.
    if (coordinate.max(axis=1, initial=-np.inf) > lowest + 1).any():
        return None
    place = coordinate - lowest[:, None]
    return np.asarray(np.where(lowest[:, None] % 2 == 1, 1 - place, place))


def told(wrap: SourceWrap) -> Wrap:
    """As a scene has it, which has no mirrored repetition (any more)."""
    return "repeat" if wrap == "mirror" else wrap


#: Repetitions from the origin up to which coordinates stay as they are.
FAR = 1024.0
#: Beyond it single precision has no fractions.
MOST = 2.0**24


def near_origin(uv: Floats, group: Ints, repeats: Bools) -> Floats:
    """(T, 3, 2) finite coordinates, moved near the origin by whole repetitions.

    Parameters
    ----------
    group: (T,) what is moved as one: faces of one group stay as far from each other as they were.
    repeats: (T, 2) whether the texture repeats along each axis, alike in a group. By an even number
        it may be moved even where every other repetition is mirrored.
    """
    if not (uv.max(initial=0.0) > FAR or uv.min(initial=0.0) < -FAR):
        return uv
    far, uv = (np.abs(uv).max(axis=1) > FAR) & repeats, uv.copy()
    order = np.argsort(group, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        for axis in np.flatnonzero(far[rows].any(axis=0)):
            uv[rows, :, axis] -= 2 * np.floor(np.median(uv[rows, :, axis]) / 2)
    return uv
