"""The experiments of octree textures, interlaced images and campuses: bytes against errors.

They use the model of the database. Octree texture: the object with the most triangles. Its error is
the angle between its normals, as rays from all sides meet them, and those of the model's own mesh
under the same rays. Interlaced image: what the first file shows, beside the whole image. Campus:
the coarse meshes of its largest objects beside the model's own, by the same rays; the light at
points, beside that by far more rays; and JPEG files beside what they were made of.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Bools, Floats, Ints, areas
from ptmtools.embree import ray_tree
from ptmtools.executor import Executor
from ptmtools.light.occlusion import Occluders, normals, points_on
from ptmtools.pipeline.stages import SCENE
from ptmtools.pipeline.warm_up import warm_objects
from ptmtools.scene.model import Scene, SourceImage
from ptmtools.simplification import Mesh
from ptmtools.texture import Picture, read_image
from ptmtools_lab.tradeoff.experiment import (
    Experiment,
    Measurement,
    Setting,
    Subject,
    decibels,
    time_work,
)
from ptmtools_systems.apo.files import encode_stream, glb_of
from ptmtools_systems.apo.making import distinct, make_apo, weld
from ptmtools_systems.apo.model import ApoOptions
from ptmtools_systems.apo.normals import corner_normals
from ptmtools_systems.apo.traversal import look_up
from ptmtools_systems.campus.making import levels
from ptmtools_systems.campus.objects import ObjectPart, parts_of
from ptmtools_systems.campus.obscurance import light
from ptmtools_systems.campus.options import MAX_SAMPLES, CampusOptions
from ptmtools_systems.campus.textures import jpeg, square_image
from ptmtools_systems.interlace.model import InterlaceOptions
from ptmtools_systems.interlace.steps import stride
from ptmtools_systems.interlace.writing import interlace

if TYPE_CHECKING:
    from PIL import Image

#: Directions of view, and rays along each side of a view.
DIRECTIONS, SIDE = 24, 96
_GOLDEN = np.pi * (3 - np.sqrt(5))


@dataclass(frozen=True)
class ViewerRays:
    """Parallel rays around a box, all within its sphere.

    Attributes
    ----------
    start, along: (n, 3) origins, and unit directions.
    middle: (3,) subtracted before anything goes to float32. far: length of the rays.
    """

    start: Floats
    along: Floats
    middle: Floats
    far: float

    @staticmethod
    def from_points(points: Floats) -> ViewerRays:
        """ViewerRays at the box of (n, 3) points from all sides."""
        low, high = points.min(axis=0), points.max(axis=0)
        middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
        k = np.arange(DIRECTIONS) + 0.5
        height, turn = 1 - 2 * k / DIRECTIONS, _GOLDEN * k
        flat = np.sqrt(1 - height**2)
        ahead = np.stack([flat * np.cos(turn), height, flat * np.sin(turn)], axis=1)
        right = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin(axis=1)])
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        up = np.cross(right, ahead)
        place = ((np.arange(SIDE) + 0.5) / SIDE * 2 - 1) * radius
        x, y = (axis_places.ravel()[:, None] for axis_places in np.meshgrid(place, place))
        inside = (x**2 + y**2 < radius**2).ravel()
        start = [
            (x * r + y * u - radius * a)[inside] for a, r, u in zip(ahead, right, up, strict=True)
        ]
        along = np.repeat(ahead, int(inside.sum()), axis=0)
        return ViewerRays(middle + np.concatenate(start), along, middle, 2 * radius)


@dataclass(frozen=True)
class Seen:
    """What rays meet.

    Attributes
    ----------
    triangle: (n,) of the mesh, -1 for none. weight: (n, 3) of its corners.
    distance: (n,) along the rays.
    """

    triangle: Ints
    weight: Floats
    distance: Floats

    @cached_property
    def met(self) -> Bools:
        """(n,) whether a ray meets the mesh."""
        return self.triangle >= 0


def look(rays: ViewerRays, points: Floats, triangles: NDArray[np.int32]) -> Seen:
    """The first hits of rays on (T, 3) triangles between (P, 3) points."""
    tree = ray_tree(points - rays.middle, triangles)
    origin = np.ascontiguousarray(rays.start - rays.middle, dtype=np.float32)
    hits = tree.run(origin, rays.along.astype(np.float32), output=True)
    u, v = hits["u"].astype(np.float64), hits["v"].astype(np.float64)
    return Seen(
        hits["primID"].astype(np.int64),
        np.stack([1 - u - v, u, v], axis=1),
        hits["tfar"].astype(np.float64),
    )


def outline(a: Seen, b: Seen) -> float:
    """The share of the rays that meet only one of two meshes, of those that meet any."""
    return float((a.met != b.met).sum() / max(int((a.met | b.met).sum()), 1))


def distances_between(a: Seen, b: Seen) -> Floats:
    """Distances of two meshes along the rays that meet both."""
    both = a.met & b.met
    return np.asarray(np.abs(a.distance - b.distance)[both])


#: Objects, and images, that stand for all; texels a side of the corner used of each image.
TRIED, CORNER = 4, 512
#: Points of each object at which light is compared.
POINTS = 2_000
#: Side of the JPEG files that are compared.
JPEG_SIDE = 256


def prepare_octree(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`."""
    scene = subject.artifacts.original(SCENE)
    count = np.bincount(scene.triangle_object, minlength=len(scene.objects))
    return octree_experiment(only(scene, scene.triangle_object == count.argmax()))


def octree_experiment(scene: Scene) -> Experiment:
    """The experiment of the octree texture of all triangles of a scene."""
    points, triangles = weld(scene.points, scene.triangles)
    triangles, _ = distinct(triangles)
    rays = ViewerRays.from_points(points[triangles].reshape(-1, 3))
    truth = look(rays, points, triangles)
    normals = corner_normals(points, triangles)
    base = replace(ApoOptions(), faces=max(4, min(ApoOptions.faces, len(triangles) // 4)))
    warm_objects()

    def measure(setting: Setting) -> Measurement:
        options = replace(base, **setting.knobs)
        made, seconds = time_work(lambda: make_apo(scene, options, Executor()))
        mesh, octree = made.mesh, made.octree
        seen = look(rays, mesh.points, mesh.triangles)
        both = truth.met & seen.met
        corner = mesh.points[mesh.triangles[seen.triangle[both]]]
        place = np.einsum("nk,nkx->nx", seen.weight[both], corner)
        normal = look_up(octree, (place - octree.low) / octree.side).normals
        right = np.einsum("nk,nkx->nx", truth.weight[both], normals[truth.triangle[both]])
        angle = _angles(normal, right)
        stream, _ = encode_stream(octree.texels, octree)
        size = float(len(stream) + len(glb_of(mesh)))
        return Measurement(
            seconds=seconds,
            work=size,
            error=float(angle.mean()) if len(angle) else 0.0,
            worst=float(np.percentile(angle, 95)) if len(angle) else 0.0,
            more={"outline": outline(truth, seen), "memory": float(octree.texels.nbytes)},
        )

    settings = [
        Setting(f"--{name.replace('_', '-')} {value:g}", {name: value}, name)
        for name, values in (
            ("error", (0.4, 0.2, 0.1, 0.05, 0.025)),
            ("depth", (5, 7, 9, 11)),
            ("faces", tuple(int(base.faces * share) for share in (0.1, 0.3))),
            ("density", (1.0, 2.0, 4.0)),
        )
        for value in values
        if name != "faces" or value >= 4
    ]
    error = "mean angle of normals to those of the model, degrees"
    units = {"work": "B", "error": "°", "memory": "B"}
    return Experiment(
        "bytes of mesh and octree", error, settings, measure, by_work=True, units=units
    )


def prepare_interlaced(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`."""
    return interlaced_experiment(corners_of(subject.artifacts.original(SCENE).images))


def interlaced_experiment(images: Sequence[NDArray[np.uint8]]) -> Experiment:
    """The experiment of the least side of interlaced images, (h, w, c) of 8 bits."""
    whole = sum(image.nbytes for image in images)

    def measure(setting: Setting) -> Measurement:
        options = replace(InterlaceOptions(), **setting.knobs)
        sets, seconds = time_work(lambda: [interlace(Picture(image), options) for image in images])
        square, worst = 0.0, 0.0
        for image, written in zip(images, sets, strict=True):
            axes = [part.axis for part in written.interlaced.parts if part.axis is not None]
            down, across = stride(axes, 1)
            shown = image[::down, ::across].repeat(down, axis=0).repeat(across, axis=1)
            off = np.square(image.astype(np.float64) - shown).mean()
            square, worst = square + off * image.size, max(worst, float(np.sqrt(off)))
        error = math.sqrt(square / max(whole, 1))
        return Measurement(
            seconds=seconds,
            work=float(sum(len(written.files[0]) for written in sets)),
            error=error,
            worst=worst,
            more={
                "bytes": float(sum(written.interlaced.bytes for written in sets)),
                "files": float(sum(len(written.files) for written in sets)),
                "PSNR": decibels(error),
            },
        )

    settings = [Setting(f"--min {side}", {"min": side}, "min") for side in (256, 128, 64, 32, 16)]
    error = "RMS error of the first file's picture, of 255"
    settings = settings if images else []
    units = {"work": "B", "bytes": "B", "PSNR": "dB"}
    return Experiment(
        "bytes of the first file", error, settings, measure, by_work=True, units=units
    )


def prepare_coarse(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`."""
    scene = subject.artifacts.original(SCENE)
    return coarse_experiment(scene, _largest(scene))


def coarse_experiment(scene: Scene, parts: Sequence[ObjectPart]) -> Experiment:
    """The experiment of the coarse meshes of a campus."""
    defaults = CampusOptions(lightmaps="none")
    meshes = []
    for part in parts:
        used, index = np.unique(scene.triangles[part.triangles], return_inverse=True)
        meshes.append(Mesh(scene.points[used], index.reshape(-1, 3).astype(np.int32)))
    rays = [ViewerRays.from_points(mesh.points) for mesh in meshes]
    truths = [look(ray, m.points, m.triangles) for ray, m in zip(rays, meshes, strict=True)]

    def coarse(mesh: Mesh, options: CampusOptions) -> Mesh:
        return levels(mesh, 2, options.ratio, options.faces, options.error)[0].mesh

    def measure(setting: Setting) -> Measurement:
        options = replace(defaults, **setting.knobs)
        made, seconds = time_work(lambda: [coarse(mesh, options) for mesh in meshes])
        seen = [look(ray, m.points, m.triangles) for ray, m in zip(rays, made, strict=True)]
        off = [distances_between(a, b) for a, b in zip(truths, seen, strict=True)]
        edges = [outline(a, b) for a, b in zip(truths, seen, strict=True)]
        return Measurement(
            seconds=seconds,
            work=float(sum(len(mesh.triangles) for mesh in made)),
            error=float(np.concatenate(off).mean()),
            worst=max(float(np.percentile(distances, 95)) for distances in off),
            more={"outline": float(np.mean(edges))},
        )

    coarse(meshes[-1], defaults)  # compiles it
    settings = [
        Setting(f"--{name} {value:g}", {name: value})
        for name, values in (
            ("ratio", (0.02, 0.05, 0.1, 0.3)),
            ("error", (0.1, 0.03, 0.003)),
        )
        for value in values
    ]
    error = "mean distance along rays to the model's own surface, m"
    units = {"error": "m"}
    return Experiment(
        "triangles of the coarse meshes", error, settings, measure, by_work=True, units=units
    )


def prepare_light(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`."""
    scene = subject.artifacts.original(SCENE)
    return light_experiment(scene, _largest(scene))


def light_experiment(
    scene: Scene, parts: Sequence[ObjectPart], limit: int = MAX_SAMPLES
) -> Experiment:
    """The experiment of the rays of baked light, before it is smoothed; ``limit``: rays of the
    reference."""
    around, defaults = Occluders.from_scene(scene), CampusOptions()
    random = np.random.default_rng(0)
    chosen = []
    for part in parts:
        area = areas(scene.corners[part.triangles])
        share = area / area.sum() if area.sum() else np.full(len(area), 1 / len(area))
        chosen.append(random.choice(part.triangles, POINTS, p=share))
    face = np.concatenate(chosen)
    corner = scene.corners[face]
    point, normal = points_on(corner, np.arange(1, len(face) + 1)), normals(corner)

    def measure_light(samples: int, turn: Floats) -> Floats:
        return light(around, point, normal, turn, samples, defaults.reach).astype(np.float64)

    truth, again = (measure_light(limit, random.random(len(face))) for _ in range(2))
    turn = random.random(len(face))

    def measure(setting: Setting) -> Measurement:
        value, seconds = time_work(lambda: measure_light(setting.knobs["samples"], turn))
        off = 255 * np.abs(value - truth)
        return Measurement(
            seconds=seconds,
            work=float(setting.knobs["samples"] * len(face)),
            error=float(np.sqrt(np.square(off).mean())),
            worst=float(np.percentile(off, 95)),
        )

    settings = [
        Setting(f"--samples {n}", {"samples": n}, "samples")
        for n in (1, 4, 16, 64, 256, 1024)
        if n < limit
    ]
    noise = float(np.sqrt(np.square(255 * (truth - again)).mean() / 2))
    error = "RMS error of linear light, of 255"
    return Experiment("rays", error, settings, measure, noise, by_work=True)


def prepare_jpeg(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`."""
    return jpeg_experiment(corners_of(subject.artifacts.original(SCENE).images))


def jpeg_experiment(images: Sequence[NDArray[np.uint8]]) -> Experiment:
    """The experiment of the quality of a campus's JPEG files, of (h, w, c) images of 8 bits."""
    from PIL import Image

    squares = [square_image(_colors(image), JPEG_SIDE) for image in images]

    def measure(setting: Setting) -> Measurement:
        files, seconds = time_work(lambda: [jpeg(s, setting.knobs["quality"]) for s in squares])
        square = []
        for data, image in zip(files, squares, strict=True):
            with Image.open(io.BytesIO(data)) as opened:
                off = np.asarray(opened, np.float64) - np.asarray(image, np.float64)
            square.append(float(np.square(off).mean()))
        error = math.sqrt(sum(square) / max(len(square), 1))
        return Measurement(
            seconds=seconds,
            work=float(sum(map(len, files))),
            error=error,
            worst=math.sqrt(max(square, default=0.0)),
            more={"PSNR": decibels(error)},
        )

    settings = [Setting(f"--quality {q}", {"quality": q}, "quality") for q in (30, 50, 70, 85, 95)]
    error = f"RMS error of textures of {JPEG_SIDE}², of 255"
    settings = settings if images else []
    units = {"work": "B", "PSNR": "dB"}
    return Experiment("bytes", error, settings, measure, by_work=True, units=units)


def _colors(texels: NDArray[np.uint8]) -> Image.Image:
    """An image as RGB, without its alpha."""
    from PIL import Image

    colors = texels[:, :, : 1 if texels.shape[2] < 3 else 3]
    return Image.fromarray(np.broadcast_to(colors, (*texels.shape[:2], 3)).copy())


def corners_of(images: Sequence[SourceImage]) -> list[NDArray[np.uint8]]:
    """(h, w, c) corners of a few images, with sides of powers of two."""
    result = []
    for i in np.unique(np.linspace(0, len(images) - 1, min(TRIED, len(images))).astype(int)):
        texels = read_image(images[i].load())
        height, width = (1 << min(CORNER, side).bit_length() - 1 for side in texels.shape[:2])
        result.append(np.ascontiguousarray(texels[:height, :width]))
    return result


def only(scene: Scene, kept: NDArray[np.bool_]) -> Scene:
    """Some triangles of a scene."""
    used, index = np.unique(scene.triangles[kept], return_inverse=True)
    return replace(
        scene,
        points=scene.points[used],
        triangles=index.reshape(-1, 3).astype(np.int32),
        uv=scene.uv[kept],
        triangle_object=scene.triangle_object[kept],
        triangle_material=scene.triangle_material[kept],
        two_sided=scene.two_sided[kept],
        colors=None if scene.colors is None else scene.colors[kept],
    )


def _largest(scene: Scene) -> list[ObjectPart]:
    """The objects of a campus with the most triangles."""
    parts = parts_of(scene, CampusOptions.small)
    return sorted(parts, key=lambda part: -len(part.triangles))[:TRIED]


def _angles(a: Floats, b: Floats) -> Floats:
    """(n,) degrees between (n, 3) vectors."""
    long = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    cosine = np.einsum("nx,nx->n", a, b) / np.maximum(long, np.finfo(float).tiny)
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
