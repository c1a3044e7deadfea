"""Renders a reference picture of a model or database by ray casting.

    python benchmarks/render.py MODEL|DB --eye 2 1.6 3 --look 0 1.6 0 -o out.png

One ray per pixel (``--samples 2`` for 2 × 2) through Embree; rays pass through transparent
surfaces, and a face that is not two-sided is visible from its front only, as in the emitted files.
``--look-of`` selects the shading:

===========  ======================================================================
headlight    all darkened by the cosine between surface and ray; bilinear texture
x_ite        shading of the emitted files by VRML97 browsers (`database.vrml.cell`):
             only surfaces with a Material are lit, by the cosine to the direction of
             view, and glow if they have no image; trilinear texture; a black sky
view3dscene  the same with the defaults of Castle Game Engine: an ambient light of
             0.2, of which a Material takes its ambientIntensity of 0.2, and a dark
             grey sky
flat         no lighting; bilinear texture
===========  ======================================================================

The script shares only the arrays of ingest with the stages, so it is an independent reference for
browsers that show the emitted files. Coordinates are those of the world: metres, Y up, origin at
the centre of the model's floor; ``--model-space`` takes the model's own.
"""

from __future__ import annotations

import argparse
import functools
import io
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ptmtools.errors import PtmError
from ptmtools.scene.model import Material, Scene, Space

#: Transparent surfaces looked through before a ray gives up.
LAYERS = 12
Vector = Sequence[float] | NDArray[np.float64]


@dataclass(frozen=True)
class Pyramid:
    """An image and its smaller levels, looked up as OpenGL and WebGL define it (OpenGL 4.6, §8.14).

    A pixel that covers several texels shows their mean in a browser, so pictures that are compared
    with a browser's follow the same rule: the level is log2 of the longer side of the pixel's
    footprint in texels, levels are 2 × 2 means rounded to 8 bits, and two of them are blended.

    Attributes
    ----------
    levels: (h, w, 4) uint8 each, rows from the top, the full image first, 1 × 1 last.
    """

    levels: tuple[NDArray[np.uint8], ...]

    @staticmethod
    def of(image: NDArray[np.uint8], floored: bool = False) -> Pyramid:
        """The pyramid of an (h, w, 4) image; an odd last row or column is left out of the mean.

        ``floored``: means are rounded down, as those of a `.ptm` are.
        """
        levels = [image]
        while max(levels[-1].shape[:2]) > 1:
            h, w = levels[-1].shape[:2]
            rows, columns = max(h // 2, 1), max(w // 2, 1)
            even = levels[-1][: rows * min(h, 2), : columns * min(w, 2)].astype(np.uint16)
            blocks = even.reshape(rows, min(h, 2), columns, min(w, 2), 4)
            total = blocks.sum(axis=(1, 3))
            count = blocks.shape[1] * blocks.shape[3]
            half = 0 if floored else count // 2
            levels.append(((total + half) // count).astype(np.uint8))
        return Pyramid(tuple(levels))

    def reduced(self, side: int) -> Pyramid:
        """Without the levels whose longer side is above this, texels; 0 keeps all."""
        levels = [x for x in self.levels if not side or max(x.shape[:2]) <= side]
        return Pyramid(tuple(levels) or self.levels[-1:])

    def bilinear(
        self, level: int, uv: NDArray[np.float64], material: Material
    ) -> NDArray[np.float32]:
        """(n, 4) samples of one level at (n, 2) texture coordinates, v upwards, in 0…1."""
        image = self.levels[level]
        h, w = image.shape[:2]
        corners = []
        for t, n, wrap in ((uv[:, 0], w, material.wrap_s), (1 - uv[:, 1], h, material.wrap_t)):
            x = t * n - 0.5
            low = np.floor(x)
            pair = [low.astype(np.int64), low.astype(np.int64) + 1]
            pair = [i % n if wrap == "repeat" else np.clip(i, 0, n - 1) for i in pair]
            corners.append((*pair, (x - low).astype(np.float32)[:, None]))
        (x0, x1, fx), (y0, y1, fy) = corners
        top = image[y0, x0] * (1 - fx) + image[y0, x1] * fx
        bottom = image[y1, x0] * (1 - fx) + image[y1, x1] * fx
        return np.asarray((top * (1 - fy) + bottom * fy) / np.float32(255), dtype=np.float32)

    def trilinear(
        self, uv: NDArray[np.float64], footprint: NDArray[np.float64], material: Material
    ) -> NDArray[np.float32]:
        """(n, 4) samples; ``footprint`` (n, 2, 2): how uv changes to the next pixel right, up."""
        h, w = self.levels[0].shape[:2]
        sides = np.linalg.norm(footprint * [w, h], axis=2).max(axis=1)
        level = np.clip(np.log2(np.maximum(sides, 1e-9)), 0, len(self.levels) - 1)
        whole = np.floor(level).astype(np.int64)
        part = (level - whole).astype(np.float32)[:, None]
        out = np.empty((len(uv), 4), dtype=np.float32)
        for k in np.unique(whole):
            chosen = whole == k
            fine = self.bilinear(k, uv[chosen], material)
            coarse = self.bilinear(min(k + 1, len(self.levels) - 1), uv[chosen], material)
            out[chosen] = fine + (coarse - fine) * part[chosen]
        return out


@dataclass(frozen=True)
class Look:
    """What a surface looks like.

    Attributes
    ----------
    lit: which surfaces: all, none, or those emitted with a Material.
    parallel: the headlight's rays are parallel to the direction of view.
    headlight: what a surface shines that faces it, a share of its colour.
    glow: what an untextured surface shines by itself, likewise.
    ambient: what a lit surface shines besides the headlight's part.
    sky: (r, g, b) in 0…1 where nothing is.
    mipmaps: textures are looked up as graphics cards do.
    floored: in levels whose means are rounded down, as those of a `.ptm` are.
    """

    lit: Literal["all", "material", "none"] = "all"
    parallel: bool = False
    headlight: float = 1.0
    glow: float = 0.0
    ambient: float = 0.0
    sky: tuple[float, float, float] = (0.62, 0.74, 0.88)
    mipmaps: bool = False
    floored: bool = False


X_ITE = Look("material", parallel=True, glow=0.25, sky=(0, 0, 0), mipmaps=True)
LOOKS: Mapping[str, Look] = {
    "headlight": Look(),
    "x_ite": X_ITE,
    "view3dscene": replace(X_ITE, ambient=0.2 * 0.2, sky=(0.1, 0.1, 0.1)),
    "flat": Look("none"),
}


@dataclass(frozen=True)
class View:
    """A camera: ``eye`` in world metres; ``fov`` in radians over the smaller side, as in VRML97."""

    eye: Vector
    direction: Vector
    fov: float = np.pi / 4
    width: int = 800
    height: int = 600
    up: Vector = (0, 1, 0)

    @staticmethod
    def of_hint(entry: Mapping[str, Any], width: int, height: int) -> View:
        """One of the viewpoints of a ``hints.json``."""
        return View(entry["position"], entry["direction"], entry["fieldOfView"], width, height)

    def frame(self) -> NDArray[np.float64]:
        """(3, 3) rows: one pixel right, one pixel up, and the unit vector ahead."""
        ahead = np.asarray(self.direction, dtype=np.float64)
        ahead = ahead / np.linalg.norm(ahead)
        right = np.cross(ahead, self.up)
        right /= np.linalg.norm(right)
        scale = 2 * np.tan(self.fov / 2) / min(self.width, self.height)
        return np.stack([scale * right, scale * np.cross(right, ahead), ahead])

    def rays(self, samples: int = 1) -> NDArray[np.float64]:
        """(height × samples × width × samples, 3) unit directions, rows from the top."""
        n, m = self.width * samples, self.height * samples
        x = (np.arange(n) + 0.5 - n / 2) / samples
        y = (m / 2 - np.arange(m) - 0.5) / samples
        right, above, ahead = self.frame()
        rays = ahead + x[None, :, None] * right + y[:, None, None] * above
        rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
        return np.asarray(rays.reshape(-1, 3))


@dataclass(frozen=True)
class Hits:
    """The surfaces that rays meet next.

    Attributes
    ----------
    ray: (n,) which of the rays meet one; the others leave the scene.
    face: (n,) the scene's triangle.
    weight: (n, 3) barycentric coordinates there.
    distance: (n,) metres from where the ray started.
    """

    ray: NDArray[np.int64]
    face: NDArray[np.int64]
    weight: NDArray[np.float64]
    distance: NDArray[np.float64]


class Tracer:
    """A scene as seen from one point: without the faces that turn their only side away.

    The eye is subtracted in float64 before anything goes to Embree's float32.
    """

    def __init__(self, scene: Scene, eye: Vector) -> None:
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh

        self.scene = scene
        self.corners = scene.corners - np.asarray(eye, dtype=np.float64)
        a, b, c = self.corners.transpose(1, 0, 2)
        self.cross = np.cross(b - a, c - a)
        size = np.linalg.norm(self.cross, axis=1, keepdims=True)
        self.normals = self.cross / np.maximum(size, np.finfo(float).tiny)
        self._shown = np.flatnonzero(scene.two_sided | ((self.cross * a).sum(axis=1) < 0))
        self._embree = rtcore_scene.EmbreeScene()
        TriangleMesh(self._embree, np.ascontiguousarray(self.corners[self._shown], np.float32))
        #: How far behind a surface the next one is looked for, metres.
        self.nudge = 1e-5 * max(1.0, float(np.abs(self.corners).max()))

    def first(self, start: NDArray[np.float64], rays: NDArray[np.float64]) -> Hits:
        """The first surface from (n, 3) ``start``, relative to the eye, along (n, 3) ``rays``."""
        hit = self._embree.run(start.astype(np.float32), rays.astype(np.float32), output=1)
        ray = np.flatnonzero(np.asarray(hit["primID"]) >= 0)
        u, v, t = (np.asarray(hit[k], dtype=np.float64)[ray] for k in ("u", "v", "tfar"))
        face = self._shown[np.asarray(hit["primID"], dtype=np.int64)[ray]]
        return Hits(ray, face, np.stack([1 - u - v, u, v], axis=1), t)

    def uv_gradient(self, face: NDArray[np.int64]) -> NDArray[np.float64]:
        """(n, 2, 3) how uv, which is affine in the plane of a face, changes by the metre."""
        corners, cross, uv = self.corners[face], self.cross[face], self.scene.uv[face]
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = np.maximum((cross * cross).sum(axis=1), np.finfo(float).tiny)[:, None]
        gradient = np.einsum("ni,nj->nij", uv[:, 1] - uv[:, 0], np.cross(second, cross) / area)
        gradient += np.einsum("ni,nj->nij", uv[:, 2] - uv[:, 0], np.cross(cross, first) / area)
        return np.asarray(gradient)


def load(path: Path) -> Scene:
    """The scene of a model file, or of a database."""
    if path.is_dir():
        from ptmtools.pipeline.artifacts import Artifacts
        from ptmtools.pipeline.stages import SCENE
        from ptmtools.store.folder import DatabaseFolder

        return Artifacts(DatabaseFolder.open(path))[SCENE]
    from ptmtools.scene import ingest

    return ingest(path)


def to_world(space: Space, point: Vector) -> NDArray[np.float64]:
    """A point of the model in world coordinates."""
    x, y, z = (np.asarray(point, dtype=np.float64) - space.origin) * space.metres
    return np.array([x, z, -y] if space.up == "z" else [x, y, z])


@functools.lru_cache(maxsize=2)
def _pyramids(images: tuple[Any, ...], floored: bool) -> tuple[Pyramid, ...]:
    """Of every image of a scene; kept, since one scene is looked at from many places."""
    pyramids = []
    for source in images:
        with Image.open(io.BytesIO(source.load())) as image:
            pyramids.append(Pyramid.of(np.asarray(image.convert("RGBA")), floored))
    return tuple(pyramids)


def render(
    scene: Scene, view: View, look: Look, *, samples: int = 1, side: int = 0
) -> NDArray[np.uint8]:
    """(height, width, 3) picture, of textures with at most ``side`` texels a side if that is
    given."""
    pyramids = tuple(pyramid.reduced(side) for pyramid in _pyramids(scene.images, look.floored))
    tracer = Tracer(scene, view.eye)
    material = np.array([m.image < 0 or m.opacity < 1 for m in scene.materials])
    lit = {"all": material | True, "material": material, "none": material & False}[look.lit]
    glow = np.array([look.glow if m.image < 0 else 0 for m in scene.materials], dtype=np.float32)

    rays = view.rays(samples)
    color = np.zeros((len(rays), 3), dtype=np.float32)
    left = np.ones(len(rays), dtype=np.float32)
    start = np.zeros_like(rays)
    active = np.arange(len(rays))
    for _ in range(LAYERS):
        hits = tracer.first(start[active], rays[active])
        gone = np.ones(len(active), dtype=bool)
        gone[hits.ray] = False
        color[active[gone]] += left[active[gone], None] * np.asarray(look.sky, dtype=np.float32)
        active = active[hits.ray]
        if not len(active):
            break
        ray, which = rays[active], scene.triangle_material[hits.face]
        footprint = _footprints(tracer, view, hits.face, ray) / samples if look.mipmaps else None
        rgba = _unlit(scene, pyramids, hits, footprint)
        normal = tracer.normals[hits.face]
        normal = normal * np.sign((normal * ray).sum(axis=1, keepdims=True))
        # A wall that the eye sees from the side may have turned its back on parallel light.
        light = view.frame()[2] if look.parallel else ray
        facing = np.maximum((normal * light).sum(axis=1), 0).astype(np.float32)
        shade = np.where(
            lit[which], look.headlight * facing + look.ambient + glow[which], np.float32(1)
        )
        # A browser clips the light that leaves a surface, then blends.
        rgba[:, :3] = np.minimum(rgba[:, :3] * shade[:, None], 1)
        color[active] += (left[active] * rgba[:, 3])[:, None] * rgba[:, :3]
        left[active] *= 1 - rgba[:, 3]
        start[active] += ray * (hits.distance + tracer.nudge)[:, None]
        active = active[left[active] > 1 / 512]
    picture = color.reshape(view.height, samples, view.width, samples, 3).mean(axis=(1, 3))
    return np.asarray(np.clip(picture * 255 + 0.5, 0, 255).astype(np.uint8))


def _footprints(
    tracer: Tracer, view: View, face: NDArray[np.int64], rays: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n, 2, 2) by how much uv changes from a pixel to the next one right, and up.

    That is uv's gradient, times the derivative of the point where a ray meets the plane,
    P = (c·n / d·n) d, with c a corner and d the ray.
    """
    cross = tracer.cross[face]
    frame = view.frame()
    ray = rays / (rays @ frame[2])[:, None]
    slope = (ray * cross).sum(axis=1)
    slope = np.where(slope == 0, np.finfo(float).tiny, slope)
    depth = (tracer.corners[face, 0] * cross).sum(axis=1) / slope
    steps = [step - ray * (cross @ step / slope)[:, None] for step in frame[:2]]
    moved = depth[:, None, None] * np.stack(steps, axis=1)
    return np.asarray(np.einsum("nij,nkj->nki", tracer.uv_gradient(face), moved))


def _unlit(
    scene: Scene,
    pyramids: tuple[Pyramid, ...],
    hits: Hits,
    footprint: NDArray[np.float64] | None,
) -> NDArray[np.float32]:
    """(n, 4) colour and opacity of the surfaces without light, in 0…1."""
    uv = np.einsum("ij,ijk->ik", hits.weight, scene.uv[hits.face])
    which = scene.triangle_material[hits.face]
    out = np.empty((len(which), 4), dtype=np.float32)
    for m in np.unique(which):
        material, chosen = scene.materials[m], which == m
        tint = np.asarray([*material.color, material.opacity], dtype=np.float32)
        if material.image < 0:
            out[chosen] = tint
        elif footprint is None:
            out[chosen] = pyramids[material.image].bilinear(0, uv[chosen], material) * tint
        else:
            pyramid = pyramids[material.image]
            out[chosen] = pyramid.trilinear(uv[chosen], footprint[chosen], material) * tint
    return out


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Render a model or database by ray casting.")
    add = parser.add_argument
    add("path", type=Path, metavar="MODEL|DB")
    add("--eye", type=float, nargs=3, required=True, metavar=("X", "Y", "Z"))
    add("--look", type=float, nargs=3, required=True, metavar=("X", "Y", "Z"), help="at this point")
    add("--fov", type=float, default=60, help="degrees over the smaller side (default 60)")
    add("--size", default="800x600", help="WIDTHxHEIGHT (default 800x600)")
    add("--samples", type=int, default=2, help="rays along a pixel's side (default 2)")
    add("--look-of", choices=tuple(LOOKS), default="headlight", help="default headlight")
    add("--model-space", action="store_true", help="eye and look are in the model's coordinates")
    add("-o", "--output", type=Path, required=True)
    given = parser.parse_args(arguments)
    try:
        width, height = (int(n) for n in given.size.split("x"))
    except ValueError:
        parser.error(f"--size {given.size}: expected WIDTHxHEIGHT")
    try:
        scene = load(given.path)
    except PtmError as error:
        parser.exit(error.exit_status, f"render: {error}\n")
    eye, look = np.asarray(given.eye), np.asarray(given.look)
    if given.model_space:
        eye, look = to_world(scene.space, eye), to_world(scene.space, look)
    view = View(eye, look - eye, np.radians(given.fov), width, height)
    picture = render(scene, view, LOOKS[given.look_of], samples=given.samples)
    Image.fromarray(picture).save(given.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())
