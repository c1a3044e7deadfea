"""Bakes into images and coordinates what emitted files cannot express.

Neither VRML nor the GLB cells support a second image, so a mask (``map_d``) becomes the alpha
channel of the image that it belongs to. VRML always applies the alpha of a texture, so a material
whose mode ignores alpha gets an image without it, if its faces use transparent texels: an atlas
that opaque and blended materials share remains one image.

Mirrored repetition is in no emitted form either. Most surfaces with such a texture lie within one
repetition; there the coordinates are mirrored instead, exactly. Otherwise the image is doubled,
with its mirror image beside it, and repeats normally.

From afar the alpha of an image with a cutoff counts as the share of its texels that are drawn
(`ptmtools.rendering.layers`). Ramps of alpha over many texels, and even alpha between 0 and 1, are
no such shares, so they become steps a texel wide where they cross the cutoff.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.errors import InputError
from ptmtools.progress import Progress, silent
from ptmtools.scene.images import ImageStore, derived_png, integers
from ptmtools.scene.model import Wrap
from ptmtools.scene.notes import IngestNotes
from ptmtools.scene.source import SourceMaterial, SourceTexture, SourceWrap
from ptmtools.scene.texels import uses_holes

_BANDS = {"r": 0, "g": 1, "b": 2}
#: Share of soft texels in an image whose alpha becomes steps: less are edges, which stay.
_SOFT = 0.05


def bake(
    materials: Sequence[SourceMaterial],
    faces: Sequence[Ints],
    uv: Floats,
    store: ImageStore,
    notes: IngestNotes,
    progress: Progress = silent,
    *,
    workers: int = 1,
) -> tuple[list[SourceMaterial], Floats]:
    """The materials without masks, mirrored repetition and visible alpha that they ignore, and the
    changed coordinates.

    What cannot be baked is a miss: a mask is dropped and its material transparent, a texture
    repeats unmirrored. ``workers`` threads decode the images. Raises LimitError PTM-L104.

    Parameters
    ----------
    faces: for each material its rows of ``uv``, (T, 3, 2).
    """
    textures = [material.texture for material in materials]
    store.examine(filter(None, textures), workers, progress)
    converted = [
        replace(material, texture=texture and store.convert(texture))
        for material, texture in zip(materials, textures, strict=True)
    ]
    soft: dict[Callable[[], bytes], bool] = {}
    baked = [
        _step_alpha(_merge_mask(material, store, notes), store, notes, soft)
        for material in converted
    ]
    copied = False
    for number, rows in enumerate(faces):
        texture = baked[number].texture
        if texture is not None and "mirror" in (texture.wrap_s, texture.wrap_t):
            texture, coords = _bake_mirror(texture, uv[rows], store, notes)
            baked[number] = replace(baked[number], texture=texture)
            uv, copied = uv if copied else uv.copy(), True
            uv[rows] = coords
    store.examine(filter(None, (material.texture for material in baked)), workers, progress)
    return _drop_alpha(baked, faces, uv, store), uv


@dataclass(frozen=True)
class MaskedBytes:
    """The bytes of a PNG in the size of an image, with its colours, or white without an image; its
    alpha is that of the image times the opacities of a mask.

    ``channel`` of the mask as in `SourceTexture`, ``limit`` as in `ImageStore`. Raises the errors
    of reading, and InputError or LimitError for images that cannot be decoded or have no 8 or 16
    bits.
    """

    read: Callable[[], bytes] | None
    mask: Callable[[], bytes]
    channel: str
    limit: int

    def __call__(self) -> bytes:
        from ptmtools.texture.images.png import png_bytes

        mask = self.mask()
        opacity = _opacities(integers(mask, self.limit).array(), self.channel)
        if self.read is None:
            white = np.full_like(opacity, 255)
            return png_bytes(np.stack([white, opacity], axis=2))
        picture = integers(self.read(), self.limit)
        texels = picture.array()
        alpha = _resize(opacity, texels.shape[1], texels.shape[0]) / 255
        colors = _colors(texels)
        has_alpha = colors.shape[2] < texels.shape[2]
        alpha *= texels[..., -1] if has_alpha else np.iinfo(texels.dtype).max
        alpha = np.rint(alpha).astype(texels.dtype)[..., None]
        return derived_png(picture, np.concatenate([colors, alpha], axis=2), len(mask))


def _colors(texels: NDArray[Any]) -> NDArray[Any]:
    """(h, w, 1 or 3) texels without their alpha."""
    return texels[..., : texels.shape[2] - (texels.shape[2] in (2, 4))]


def _opacities(texels: NDArray[Any], channel: str) -> NDArray[np.uint8]:
    """(h, w) opacities of a mask: its matte if it has one and ``channel`` allows it, otherwise one
    of its colours or its luminance."""
    if texels.dtype != np.uint8:
        texels = (texels >> 8).astype(np.uint8)
    colors = _colors(texels)
    if colors.shape[2] < texels.shape[2] and channel in ("", "m"):
        return np.asarray(texels[..., -1])
    if colors.shape[2] == 1:
        return np.asarray(colors[..., 0])
    if channel in _BANDS:
        return np.asarray(colors[..., _BANDS[channel]])
    # ITU-R 601, as in Pillow.
    return np.asarray(np.rint(colors @ np.array([0.299, 0.587, 0.114])).astype(np.uint8))


def _resize(opacity: NDArray[np.uint8], width: int, height: int) -> Floats:
    from PIL import Image

    if opacity.shape != (height, width):
        image = Image.fromarray(opacity).resize((width, height), Image.Resampling.BILINEAR)
        opacity = np.asarray(image)
    return opacity.astype(np.float64)


def _merge_mask(material: SourceMaterial, store: ImageStore, notes: IngestNotes) -> SourceMaterial:
    mask, texture = material.mask, material.texture
    if mask is None:
        return material
    without, mask = replace(material, mask=None), store.convert(mask, mask.channel)
    opacities = store.record(mask, mask.channel)
    if opacities is None:  # an unreadable mask must not hide anything
        return replace(without, see_through=True)
    image = None if texture is None else store.record(texture)
    same_image = texture is not None and texture.read == mask.read and mask.channel in ("", "m")
    # The mask is the alpha of the image, or opaque.
    if (image is not None and image.alpha and same_image) or opacities.bits is None:
        return without
    colors = None if image is None or texture is None else texture.read
    read = MaskedBytes(colors, mask.read, mask.channel, store.limit)
    merged = replace(texture or mask, read=read, what=mask.what, place=mask.place)
    for part in (texture, mask):
        if part is not None:
            store.mark_as_input(part)
    if store.record(merged) is None:
        return replace(without, see_through=True)
    notes.note("PTM-N215", f"{mask.what}: baked into an image as its alpha", mask.place)
    return replace(without, texture=merged)


@dataclass(frozen=True)
class SteppedBytes:
    """The bytes of a PNG of an image whose alpha is 0.5 where it was ``cutoff``, and 0 or 1 beyond
    a texel from there. ``limit`` and errors as of `MaskedBytes`."""

    read: Callable[[], bytes]
    cutoff: float
    limit: int

    def __call__(self) -> bytes:
        picture = integers(self.read(), self.limit)
        alpha = (texels := picture.array())[..., -1]
        opaque, slope = np.iinfo(texels.dtype).max, np.maximum(_spans(alpha) / 2, 1)
        middle = np.ceil(round(self.cutoff * opaque, 6)) - 0.5
        steps = np.clip(0.5 + (alpha - middle) / slope, 0, 1)
        alpha = np.rint(opaque * steps).astype(texels.dtype)
        return derived_png(picture, np.concatenate([_colors(texels), alpha[..., None]], axis=2))


def _spans(alpha: NDArray[Any]) -> NDArray[Any]:
    """(h, w) differences of the greatest and the least of the 3 × 3 texels around each."""
    ends = []
    for end in (np.maximum, np.minimum):
        rows = np.pad(alpha, 1, mode="edge")
        rows = end(end(rows[:-2], rows[1:-1]), rows[2:])
        ends.append(end(end(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:]))
    return np.asarray(ends[0] - ends[1])


def _is_soft(data: bytes, limit: int) -> bool:
    """Whether the alpha of many texels lies between 0 and 1, as does that of all around them."""
    texels = integers(data, limit).array()
    alpha, opaque = texels[..., -1], np.iinfo(texels.dtype).max
    within = (alpha > 0) & (alpha < opaque) & (_spans(alpha) < opaque / 2)
    return bool(within.mean() > _SOFT)


def _step_alpha(
    material: SourceMaterial,
    store: ImageStore,
    notes: IngestNotes,
    soft: dict[Callable[[], bytes], bool],
) -> SourceMaterial:
    """A material with a cutoff whose image is soft, as ``soft`` remembers, with steps of alpha."""
    texture, cutoff = material.texture, material.cutoff
    if texture is None or not cutoff:
        return material
    image = store.record(texture)
    if image is None or image.bits is None:
        return material
    if texture.read not in soft:
        soft[texture.read] = _is_soft(texture.read(), store.limit)
    baked = replace(texture, read=SteppedBytes(texture.read, cutoff, store.limit))
    if not soft[texture.read] or store.record(baked) is None:
        return material
    store.mark_as_input(texture)
    notes.note("PTM-N215", f"{texture.what}: steps baked in for soft alpha", texture.place)
    return replace(material, texture=baked, cutoff=0.5)


@dataclass(frozen=True)
class MirroredBytes:
    """The bytes of a PNG of an image and its mirror images, ``across``, ``down`` or both.

    ``limit`` and errors as of `MaskedBytes`; also InputError PTM-I125 if the result would be too
    large.
    """

    read: Callable[[], bytes]
    across: bool
    down: bool
    limit: int

    def __call__(self) -> bytes:
        picture = integers(self.read(), self.limit)
        texels = picture.array()
        height, width, _ = texels.shape
        if 4 * height * width * (1 + self.across) * (1 + self.down) > self.limit:
            raise InputError("PTM-I125", "too large for its mirror images; repeated unmirrored")
        if self.across:
            texels = np.concatenate([texels, texels[:, ::-1]], axis=1)
        if self.down:
            texels = np.concatenate([texels, texels[::-1]], axis=0)
        return derived_png(picture, texels)


def _bake_mirror(
    texture: SourceTexture, uv: Floats, store: ImageStore, notes: IngestNotes
) -> tuple[SourceTexture, Floats]:
    """The texture without mirrored repetition, and its (n, 3, 2) coordinates."""
    wraps: list[SourceWrap] = [texture.wrap_s, texture.wrap_t]
    doubled, coords = [False, False], uv.copy()
    for axis in (0, 1):
        if wraps[axis] != "mirror":
            continue
        folded = _fold(uv[..., axis])
        if folded is None:
            wraps[axis], doubled[axis] = "repeat", True
            coords[..., axis] /= 2
        else:
            wraps[axis], coords[..., axis] = "clamp", folded
    baked = replace(texture, wrap_s=wraps[0], wrap_t=wraps[1])
    if any(doubled):
        coords[..., 1] += 0.5 * doubled[1]  # the origin is the lower left, the image is above
        baked = replace(
            baked, read=MirroredBytes(texture.read, doubled[0], doubled[1], store.limit)
        )
        store.mark_as_input(texture)  # also if it fails: another image may succeed
        if store.record(texture) is None or store.record(baked) is None:
            wrap_s, wrap_t = emitted_wraps(texture)
            return replace(texture, wrap_s=wrap_s, wrap_t=wrap_t), uv
    notes.note("PTM-N215", f"{texture.what}: mirrored repetition baked in", texture.place)
    return baked, coords


def _fold(coordinate: Floats) -> Floats | None:
    """(T, 3) coordinates of triangles mirrored into [0, 1]; None if a triangle crosses the edge of
    a repetition."""
    lowest = np.floor(coordinate.min(axis=1, initial=np.inf))
    # A triangle that ends at an edge lies in the repetition before it.
    if (coordinate.max(axis=1, initial=-np.inf) > lowest + 1).any():
        return None
    place = coordinate - lowest[:, None]
    return np.asarray(np.where(lowest[:, None] % 2 == 1, 1 - place, place))


def emitted_wraps(texture: SourceTexture | None) -> tuple[Wrap, Wrap]:
    """The wrap modes of a texture without mirrored repetition; "repeat" without a texture."""
    wrap_s, wrap_t = (texture.wrap_s, texture.wrap_t) if texture else ("repeat", "repeat")
    return "repeat" if wrap_s == "mirror" else wrap_s, "repeat" if wrap_t == "mirror" else wrap_t


@dataclass(frozen=True)
class OpaqueBytes:
    """The bytes of an image without alpha: of a lossy WebP or AVIF the rest of its file, of others
    a PNG, lossless if ``exact``: previews halve the resolution of the red and green of normals.
    ``limit`` and errors as of `MaskedBytes`."""

    read: Callable[[], bytes]
    limit: int
    exact: bool = False

    def __call__(self) -> bytes:
        from ptmtools.texture.images.bare import drop_alpha

        data = self.read()
        picture = integers(data, self.limit)
        colors = _colors(picture.array())
        if picture.lossy:
            opaque = drop_alpha(data, picture.lossy.format)
            if opaque != data and np.array_equal(integers(opaque, self.limit).array(), colors):
                return opaque
        return derived_png(replace(picture, lossy=None) if self.exact else picture, colors)


def _drop_alpha(
    materials: list[SourceMaterial], faces: Sequence[Ints], uv: Floats, store: ImageStore
) -> list[SourceMaterial]:
    """The materials with opaque images for those that ignore alpha and use transparent texels; a
    material that blends the same image keeps the original."""
    ignoring: list[tuple[int, SourceTexture, str]] = []
    visible: set[str] = set()
    for number, rows in enumerate(faces):
        texture = materials[number].texture
        if texture is None or not materials[number].ignores_alpha:
            continue
        image = store.record(texture)
        if image is None or (holes := image.holes) is None:
            continue
        ignoring.append((number, texture, image.sha256))
        if image.sha256 not in visible and uses_holes(holes, uv[rows], *emitted_wraps(texture)):
            visible.add(image.sha256)
    for number, texture, sha256 in ignoring:
        if sha256 in visible:
            opaque = replace(texture, read=OpaqueBytes(texture.read, store.limit))
            store.mark_as_input(texture)
            if store.record(opaque) is not None:
                materials[number] = replace(materials[number], texture=opaque)
    return materials


#: Coordinates up to this distance from the origin, in repetitions, are unchanged. Projected map
#: coordinates are far from it. Emitted files store single precision, which at 1,024 repetitions
#: still separates the texels of an image of 4,096, and at five million has two steps a repetition.
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
    distant, uv = (np.abs(uv).max(axis=1) > FAR) & repeats, uv.copy()
    order = np.argsort(group, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        for axis in np.flatnonzero(distant[rows].any(axis=0)):
            uv[rows, :, axis] -= 2 * np.floor(np.median(uv[rows, :, axis]) / 2)
    return uv
