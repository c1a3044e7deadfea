"""Compares a browser's picture with a ray-cast reference outside edges.

Along an edge two renderers may differ by a whole pixel: the pixel may show either surface or a mix
(X_ITE smooths edges, view3dscene does not). Such pixels carry no information about the files and
are masked. Reference rays alone define edges, three by three per pixel: between two adjacent rays
the material changes, or the plane of the surface changes (by more than `BEND`, or by a step of more
than `STEP` of the distance), or one of them hits nothing; also behind glass. A pixel is masked if
it or one of its eight neighbours contains an edge. Texture is no edge: render.py models the
browser's treatment of textures.

The PSNR excludes the sky too, since empty background would raise it; the share of sky pixels that
show something else is counted separately.

(Rejected: an additional threshold of 40 levels on the colour's step to the next pixel. It masks up
to 4 % more of a picture and changes no PSNR by more than 1 dB.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from render import LAYERS, Look, Tracer, View

from ptmtools.scene.model import Scene

#: Rays along a pixel's side.
RAYS = 3
#: Degrees between the normals of two surfaces that meet in an edge.
BEND = 5.0
#: How far a surface lies off the plane of the one beside it, a share of the distance.
STEP = 1e-3
#: How far texture coordinates jump, a share of the image.
SEAM = 0.01
#: A pixel of the sky shows something else if it differs by more levels of 255 than this.
STRAY = 4
#: A pixel is off if it differs by more levels of 255 than this.
OFF = 32


@dataclass(frozen=True)
class Outline:
    """What of a picture is compared.

    Attributes
    ----------
    edge: (height, width) pixels that are left out.
    sky: (height, width) pixels with nothing in them, outside edges.
    """

    edge: NDArray[np.bool_]
    sky: NDArray[np.bool_]


@dataclass(frozen=True)
class Likeness:
    """How a picture compares with our own.

    Attributes
    ----------
    psnr: dB over the surfaces outside edges; infinite if equal, NaN if there are none.
    whole: dB over all pixels.
    masked: share of the pixels that were left out as edges.
    sky: share of the pixels that are sky.
    stray: share of the pixels that should be sky and show something else.
    off: share of the pixels that are neither sky nor at edges and differ by more than `OFF`.
    """

    psnr: float
    whole: float
    masked: float
    sky: float
    stray: float
    off: float


def outline(scene: Scene, view: View) -> Outline:
    """Edges and sky of a view."""
    tracer = Tracer(scene, view.eye)
    rays = view.rays(RAYS)
    shape = (view.height * RAYS, view.width * RAYS)
    glass = np.array([m.transparent for m in scene.materials])
    cut = [np.zeros((shape[0], shape[1] - 1), bool), np.zeros((shape[0] - 1, shape[1]), bool)]
    start = np.zeros_like(rays)
    active = np.arange(len(rays))
    empty = None
    for _ in range(LAYERS):
        hits = tracer.first(start[active], rays[active])
        active = active[hits.ray]
        face = np.full(len(rays), -1)
        face[active] = hits.face
        start[active] += rays[active] * hits.distance[:, None]
        for axis in (0, 1):
            cut[axis] |= _cuts(tracer, face.reshape(shape), start.reshape(*shape, 3), axis)
        empty = (face < 0).reshape(shape) if empty is None else empty
        active = active[glass[scene.triangle_material[hits.face]]]
        if not len(active):
            break
        start[active] += rays[active] * tracer.nudge
    assert empty is not None
    fine = np.zeros(shape, dtype=bool)
    fine[:, 1:] |= cut[0]
    fine[:, :-1] |= cut[0]
    fine[1:] |= cut[1]
    fine[:-1] |= cut[1]
    edge = _grown(_pixels(fine).any(axis=(1, 3)))
    return Outline(edge, _pixels(empty).all(axis=(1, 3)) & ~edge)


def _cuts(
    tracer: Tracer, face: NDArray[np.int64], point: NDArray[np.float64], axis: int
) -> NDArray[np.bool_]:
    """Whether there is an edge between a ray and the next, right (axis 0) or below (axis 1)."""
    one, two = (np.s_[:, :-1], np.s_[:, 1:]) if axis == 0 else (np.s_[:-1], np.s_[1:])
    a, b = face[one], face[two]
    cut = (a < 0) != (b < 0)
    both = (a >= 0) & (b >= 0) & (a != b)
    a, b, p, q = a[both], b[both], point[one][both], point[two][both]
    material = tracer.scene.triangle_material
    normal, other = tracer.normals[a], tracer.normals[b]
    corner, uv = tracer.corners, tracer.scene.uv
    jump = uv[b, 0] + np.einsum("nij,nj->ni", tracer.uv_gradient(b), q - corner[b, 0])
    jump -= uv[a, 0] + np.einsum("nij,nj->ni", tracer.uv_gradient(a), q - corner[a, 0])
    jump -= np.round(jump)
    step = np.abs(((q - p) * normal).sum(axis=1))
    actual = material[a] != material[b]
    actual |= np.abs((normal * other).sum(axis=1)) < np.cos(np.radians(BEND))
    actual |= np.abs(jump).max(axis=1) > SEAM
    actual |= step > STEP * np.linalg.norm(p, axis=1)
    cut[both] = actual
    return cut


def _pixels(fine: NDArray[np.bool_]) -> NDArray[np.bool_]:
    h, w = fine.shape
    return fine.reshape(h // RAYS, RAYS, w // RAYS, RAYS)


def _grown(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A mask and the eight neighbours of its pixels."""
    padded = np.pad(mask, 1)
    h, w = mask.shape
    shifts = [padded[y : y + h, x : x + w] for y in range(3) for x in range(3)]
    return np.asarray(np.logical_or.reduce(shifts))


def psnr(error: NDArray[np.float64]) -> float:
    """dB of differences in levels of 255."""
    if not error.size:
        return float("nan")
    mean = float((error**2).mean())
    return float("inf") if mean == 0 else float(10 * np.log10(255**2 / mean))


def likeness(
    shown: NDArray[np.uint8], own: NDArray[np.uint8], outline: Outline, look: Look
) -> Likeness:
    """Of a browser's (height, width, 3) picture to our own of the same size.

    Raises ValueError if the sizes differ.
    """
    if shown.shape != own.shape:
        raise ValueError(f"pictures of {shown.shape} and {own.shape}")
    error = shown.astype(np.float64) - own
    surface = ~outline.edge & ~outline.sky
    stray = np.abs(shown - 255 * np.asarray(look.sky)).max(axis=2) > STRAY
    return Likeness(
        psnr=psnr(error[surface]),
        whole=psnr(error),
        masked=float(outline.edge.mean()),
        sky=float(outline.sky.mean()),
        stray=float((stray & outline.sky).mean()),
        off=float(((np.abs(error).max(axis=2) > OFF) & surface).mean()),
    )
