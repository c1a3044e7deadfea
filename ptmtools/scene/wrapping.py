"""Textures that are mirrored where they repeat, which neither VRML nor the clients know.

Most surfaces with such a texture lie within one repetition, for which its coordinates can be
mirrored instead, exactly. Where one does not, the image is made twice as large, with its mirror
image beside it, and repeats as others do. (Rejected: to carry the mode over. VRML97 has none, so
its files would show something else than the GLB cells.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ptmtools.arrays import Floats, Ints
from ptmtools.scene.images import ImageStore
from ptmtools.scene.model import Wrap
from ptmtools.scene.source import Findings, Source, SourceMaterial, SourceWrap


@dataclass(frozen=True)
class MirroredBytes:
    """The bytes of a PNG of an image beside its mirror images, ``across``, ``down`` or both.

    Raises what reading raises, and InputError or LimitError for what cannot be decoded.
    """

    read: Callable[[], bytes]
    across: bool
    down: bool

    def __call__(self) -> bytes:
        from ptmtools.texture.images.png import png_bytes
        from ptmtools.texture.images.reading import load_image

        picture = load_image(self.read())
        texels = picture.texels[0 : picture.texels.shape[0]]
        if self.across:
            texels = np.concatenate([texels, texels[:, ::-1]], axis=1)
        if self.down:
            texels = np.concatenate([texels, texels[::-1]], axis=0)
        return png_bytes(texels, picture.description)


def unmirrored(
    source: Source,
    used: Ints,
    faces: Sequence[Ints],
    uv: Floats,
    store: ImageStore,
    findings: Findings,
) -> tuple[Source, Floats]:
    """The same without textures that are mirrored, and their coordinates.

    ``faces`` are the rows of ``uv``, (T, 3, 2), of each material that is ``used``, by number.
    """
    materials = list(source.materials)
    for index, rows in zip(used.tolist(), faces, strict=True):
        texture = materials[index].texture
        if texture is not None and "mirror" in (texture.wrap_s, texture.wrap_t):
            store.made_into_another(texture)
            uv = uv.copy()
            materials[index], uv[rows] = _unmirrored(materials[index], uv[rows])
            findings.say(
                "PTM-N222", f"{texture.what}: its mirrored repeat is baked in", texture.place
            )
    return replace(source, materials=tuple(materials)), uv


def _unmirrored(material: SourceMaterial, uv: Floats) -> tuple[SourceMaterial, Floats]:
    texture = material.texture
    assert texture is not None
    wraps: list[SourceWrap] = [texture.wrap_s, texture.wrap_t]
    doubled = [False, False]
    uv = uv.copy()
    for axis in (0, 1):
        if wraps[axis] != "mirror":
            continue
        folded = _folded(uv[..., axis])
        if folded is None:
            wraps[axis], doubled[axis] = "repeat", True
            uv[..., axis] /= 2
        else:
            wraps[axis], uv[..., axis] = "clamp", folded
    if any(doubled):
        # From the lower left: its own half is the upper one of an image made longer downwards.
        if doubled[1]:
            uv[..., 1] += 0.5
        texture = replace(texture, read=MirroredBytes(texture.read, *doubled))
    texture = replace(texture, wrap_s=wraps[0], wrap_t=wraps[1])
    return replace(material, texture=texture), uv


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
