"""A reference picture of a model or database, by ray casting.

    python benchmarks/render.py MODEL|DB --eye 2 1.6 3 --look 0 1.6 0 -o out.png

One ray a pixel (``--samples 2`` for 2 × 2) through Embree; texture bilinear from the full image,
repeated or clamped, times the material's colour; transparent surfaces are looked through.
``--shading headlight`` darkens all by the cosine between surface and ray; ``browser`` only what
has no image, by the cosine to the direction of view, before a black sky, as VRML97 browsers do
with the emitted files; ``flat`` nothing.

It shares nothing with the stages but ingest's arrays, so that it can be held against what
browsers make of the emitted files. Coordinates are the world's: metres, Y up, origin at the
centre of the model's floor; ``--model-space`` takes the model's own.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ptmtools.errors import PtmError
from ptmtools.scene.model import Material, Scene, Space

SKY = (0.62, 0.74, 0.88)
#: What the emitted materials shine by themselves, a share of their colour.
GLOW = 0.25
#: Transparent surfaces looked through before a ray gives up.
LAYERS = 12
Vector = Sequence[float] | NDArray[np.float64]
Shading = Literal["headlight", "browser", "flat"]


def load(path: Path) -> Scene:
    """The scene of a model file, or of a database."""
    if path.is_dir():
        from ptmtools.pipeline.folder import DatabaseFolder
        from ptmtools.pipeline.run import Artifacts

        return Artifacts(DatabaseFolder.open(path)).scene
    from ptmtools.scene import ingest

    return ingest(path)


def to_world(space: Space, point: Vector) -> NDArray[np.float64]:
    """A point of the model in world coordinates."""
    x, y, z = (np.asarray(point, dtype=np.float64) - space.origin) * space.metres
    return np.array([x, z, -y] if space.up == "z" else [x, y, z])


def texels(scene: Scene) -> list[NDArray[np.float32]]:
    """(h, w, 4) in 0…1, rows from the top, for every image."""
    images = []
    for source in scene.images:
        with Image.open(io.BytesIO(source.load())) as image:
            images.append(np.asarray(image.convert("RGBA"), dtype=np.float32) / np.float32(255))
    return images


def sample(
    image: NDArray[np.float32], uv: NDArray[np.float64], material: Material
) -> NDArray[np.float32]:
    """(n, 4) bilinear samples at (n, 2) texture coordinates, v upwards."""
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
    return np.asarray(top * (1 - fy) + bottom * fy, dtype=np.float32)


def camera_rays(
    ahead: NDArray[np.float64], up: Vector, fov: float, width: int, height: int
) -> NDArray[np.float64]:
    """(height × width, 3) unit directions through pixel centres around the unit vector ``ahead``.

    As VRML97 has it, ``fov`` (radians) is the angle over the smaller side of the picture.
    """
    right = np.cross(ahead, up)
    right /= np.linalg.norm(right)
    above = np.cross(right, ahead)
    scale = 2 * np.tan(fov / 2) / min(width, height)
    x = (np.arange(width) + 0.5 - width / 2) * scale
    y = (height / 2 - np.arange(height) - 0.5) * scale
    rays = ahead + x[None, :, None] * right + y[:, None, None] * above
    rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    return np.asarray(rays.reshape(-1, 3))


def render(
    scene: Scene,
    eye: Vector,
    direction: Vector,
    *,
    up: Vector = (0, 1, 0),
    fov: float = np.pi / 4,
    width: int = 800,
    height: int = 600,
    samples: int = 1,
    shading: Shading = "headlight",
) -> NDArray[np.uint8]:
    """(height, width, 3) picture from ``eye`` (world metres) along ``direction``.

    The eye is subtracted in float64 before anything goes to Embree's float32.
    """
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    origin = np.asarray(eye, dtype=np.float64)
    corners = scene.corners - origin
    tracer = rtcore_scene.EmbreeScene()
    TriangleMesh(tracer, np.ascontiguousarray(corners, dtype=np.float32))
    images = texels(scene)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)

    plain = np.array([m.image < 0 for m in scene.materials])[scene.triangle_material]
    sky, glow = ((0, 0, 0), GLOW) if shading == "browser" else (SKY, 0.0)
    lit = {"headlight": plain | True, "browser": plain, "flat": plain & False}[shading]

    ahead = np.asarray(direction, dtype=np.float64)
    ahead = ahead / np.linalg.norm(ahead)
    rays = camera_rays(ahead, up, fov, width * samples, height * samples)
    color = np.zeros((len(rays), 3), dtype=np.float32)
    left = np.ones(len(rays), dtype=np.float32)
    start = np.zeros_like(rays)
    active = np.arange(len(rays))
    nudge = 1e-5 * max(1.0, float(np.abs(corners).max()))
    for _ in range(LAYERS):
        hit = tracer.run(
            start[active].astype(np.float32), rays[active].astype(np.float32), output=1
        )
        face = np.asarray(hit["primID"], dtype=np.int64)
        gone = face < 0
        color[active[gone]] += left[active[gone], None] * np.asarray(sky, dtype=np.float32)
        u, v, t = (np.asarray(hit[k], dtype=np.float64)[~gone] for k in ("u", "v", "tfar"))
        active, face = active[~gone], face[~gone]
        if not len(active):
            break
        rgba = _shaded(scene, images, face, np.stack([1 - u - v, u, v], 1))
        light = ahead if shading == "browser" else rays[active]
        facing = np.abs((normals[face] * light).sum(axis=1)).astype(np.float32)
        rgba[:, :3] *= np.where(lit[face], facing + np.float32(glow), np.float32(1))[:, None]
        color[active] += (left[active] * rgba[:, 3])[:, None] * rgba[:, :3]
        left[active] *= 1 - rgba[:, 3]
        start[active] += rays[active] * (t + nudge)[:, None]
        active = active[left[active] > 1 / 512]
    picture = color.reshape(height, samples, width, samples, 3).mean(axis=(1, 3))
    return np.asarray(np.clip(picture * 255 + 0.5, 0, 255).astype(np.uint8))


def _shaded(
    scene: Scene,
    images: list[NDArray[np.float32]],
    face: NDArray[np.int64],
    weights: NDArray[np.float64],
) -> NDArray[np.float32]:
    """(n, 4) unlit colour and opacity where rays hit ``face`` at barycentric ``weights``."""
    uv = np.einsum("ij,ijk->ik", weights, scene.uv[face])
    which = scene.triangle_material[face]
    out = np.empty((len(face), 4), dtype=np.float32)
    for m in np.unique(which):
        material, chosen = scene.materials[m], which == m
        tint = np.asarray([*material.color, material.opacity], dtype=np.float32)
        if material.image >= 0:
            out[chosen] = sample(images[material.image], uv[chosen], material) * tint
        else:
            out[chosen] = tint
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
    add("--shading", choices=("headlight", "browser", "flat"), default="headlight")
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
    picture = render(
        scene,
        eye,
        look - eye,
        fov=np.radians(given.fov),
        width=width,
        height=height,
        samples=given.samples,
        shading=given.shading,
    )
    Image.fromarray(picture).save(given.output)
    return 0


if __name__ == "__main__":
    sys.exit(main())
