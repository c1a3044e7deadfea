"""How much of the light in a campus's lightmaps is that of the surface on which it is seen.

Called by benchmarks/campus.py. Points of each object's finest mesh, spread by area, and one on each
of as many of its faces, whatever their size: a face that is thinner than a texel counts there as
much as a wall. The light that a client finds for a point in the lightmap as written, bilinearly, is
compared with that of rays from the point itself. A point is off where they differ by more than
`OFF`.

A face with two sides has one light for both. Which side is right is found by sight, not by light:
visitors stand on the ground and on roofs all over the campus, and some fly. Where they see one side
of a point, its light counts; where both, that which is nearer; where none, the point is left out.
"Of the other side" are points that are off and have the light of the side that no visitor sees.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from ptmtools.arrays import Bools, Floats
from ptmtools.campus.building import Made
from ptmtools.campus.meshes import read_mesh
from ptmtools.campus.model import LIGHT_SIZES, CampusObject
from ptmtools.campus.occlusion import Surroundings, light, normals
from ptmtools.scene.colors import to_linear

#: Linear light by which a point is off: four times what 64 rays and their smoothing leave.
OFF = 0.1
#: Points of each object, by area and by face.
POINTS = 400
#: Places of visitors, and how high over what lies there they are, metres.
PLACES, HEIGHTS = 128, (1.6, 12.0)
RAYS = 256


@dataclass(frozen=True)
class Sampled:
    """(n, 3) points with (n, 3) unit normals, (n, 2) coordinates of the lightmap from the upper
    left, and (n,) whether their faces have two sides."""

    point: Floats
    normal: Floats
    light: Floats
    both: Bools


def say_light(folder: Path, made: Made, reach: float) -> None:
    """Print the shares of points that are off, by size of lightmap."""
    around = Surroundings.of(made.scene)
    eyes = visitors(around)
    random = np.random.default_rng(0)
    lit = [each for each in made.campus.objects if each.lightmap is not None]
    off: dict[int, list[list[Bools]]] = {size: [[], []] for size in LIGHT_SIZES}
    other: dict[int, list[list[Bools]]] = {size: [[], []] for size in LIGHT_SIZES}
    for each in lit:
        for kind, points in enumerate(sampled(folder, made, each, random)):
            front, back, true = seen(around, eyes, points, reach)
            for size in LIGHT_SIZES:
                texels = lightmap(folder, each, size)
                found = bilinear(texels, points.light)
                wrong = np.minimum(
                    np.where(true[0], np.abs(found - front), np.inf),
                    np.where(true[1], np.abs(found - back), np.inf),
                )
                counted = true[0] | true[1]
                bad = (wrong > OFF)[counted]
                hidden = np.where(true[0], np.abs(found - back), np.abs(found - front))[counted]
                one_side = (true[0] ^ true[1])[counted] & points.both[counted]
                off[size][kind].append(bad)
                other[size][kind].append(bad & one_side & (hidden <= OFF))
    print("\n| lightmap | points off | of the worst object | of the other side | faces off |")
    print("|---|---|---|---|---|")
    for size in LIGHT_SIZES:
        area, face = (np.concatenate(these) for these in off[size])
        turned = np.concatenate(other[size][0])
        worst = max(float(these.mean()) for these in off[size][0] if len(these))
        shares = f"{area.mean():.1%} | {worst:.1%} | {turned.mean():.1%} | {face.mean():.1%}"
        print(f"| {size}² | {shares} |")
    count = sum(map(len, off[LIGHT_SIZES[0]][0]))
    print(f"\nof {count:,} points and as many faces that visitors see; off: by more than {OFF}")


def sampled(
    folder: Path, made: Made, each: CampusObject, random: np.random.Generator
) -> tuple[Sampled, Sampled]:
    """Points of an object by area, and by face."""
    parts = read_mesh((folder / each.meshes[-1].file).read_bytes())
    corner = np.concatenate([part.point[part.triangle] for part in parts])
    uv = np.concatenate([part.light[part.triangle] for part in parts if part.light is not None])
    both = np.concatenate(
        [
            np.full(len(part.triangle), made.campus.materials[part.material].two_sided)
            for part in parts
        ]
    )
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(across, axis=1)
    normal = normals(corner)
    found = []
    for chance in (area / area.sum(), (area > 0) / (area > 0).sum()):
        face = random.choice(len(corner), POINTS, p=chance)
        share = np.sort(random.random((POINTS, 2)), axis=1)
        share = np.diff(share, axis=1, prepend=0, append=1)
        point, at = (np.einsum("nk,nkx->nx", share, held[face]) for held in (corner, uv))
        found.append(Sampled(point, normal[face], at, both[face]))
    return found[0], found[1]


def visitors(around: Surroundings) -> Floats:
    """(m, 3) eyes over what lies highest, so none is within a solid."""
    low, high = around.points.min(axis=0), around.points.max(axis=0)
    place = np.arange(1, PLACES + 1)[:, None] * [0.7548776662466927, 0.5698402909980532] % 1.0
    column = np.insert(low[[0, 2]] + place * (high - low)[[0, 2]], 1, high[1] + 1, axis=1)
    column[:, 1] = around.below(column, high[1] - low[1] + 2)
    return np.concatenate([column + [0, height, 0] for height in HEIGHTS])


def seen(
    around: Surroundings, eyes: Floats, points: Sampled, reach: float
) -> tuple[Floats, Floats, tuple[Bools, Bools]]:
    """The light before and behind each point, and which of the two sides count."""
    count = len(points.point)
    visible = np.zeros((2, count), np.bool_)
    for eye in eyes:
        way = np.einsum("nx,nx->n", eye - points.point, points.normal)
        free = around.free(np.broadcast_to(eye, points.point.shape), points.point)
        visible[0] |= free & (way > 0)
        visible[1] |= free & (way < 0) & points.both
    turn = np.zeros(count)
    front, back = (
        light(around, points.point, way, turn, RAYS, reach).astype(np.float64)
        for way in (points.normal, -points.normal)
    )
    return front, back, (visible[0], visible[1])


def lightmap(folder: Path, each: CampusObject, size: int) -> Floats:
    """(size, size) linear light."""
    with Image.open(folder / f"textures/{each.lightmap}_{size}_l.jpg") as image:
        return np.asarray(to_linear(np.asarray(image, np.float64) / 255))


def bilinear(texels: Floats, at: Floats) -> Floats:
    """(n,) at (n, 2) coordinates from the upper left."""
    size = len(texels)
    place = np.clip(at * size - 0.5, 0, size - 1)
    first = np.minimum(np.floor(place).astype(np.int64), size - 2)
    (s, t), (column, row) = (place - first).T, first.T
    upper = texels[row, column] * (1 - s) + texels[row, column + 1] * s
    lower = texels[row + 1, column] * (1 - s) + texels[row + 1, column + 1] * s
    return np.asarray(upper * (1 - t) + lower * t)
