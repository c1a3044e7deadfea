"""CampusTables of errors against pictures drawn pixel by pixel, in plain Python."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.arrays import Floats, Ints
from ptmtools.errors import InputError
from ptmtools.rendering.rays import RayCamera
from ptmtools.walk import Walk
from ptmtools_lab.campus.options import CampusWalkOptions
from ptmtools_lab.campus.simulation import CampusRun, simulate_campus
from ptmtools_lab.campus.stock import read_stock, read_surfaces, read_textures
from ptmtools_lab.campus.world import (
    COARSE,
    FINE,
    NOTHING,
    CampusFrames,
    CampusTables,
    CampusWorld,
    FullPicture,
    look,
    prepare_campus,
)
from ptmtools_lab.forms import mip_levels
from ptmtools_systems.campus import read_campus
from ptmtools_systems.campus.meshes import read_mesh
from ptmtools_systems.campus.model import SIZES

PIXELS = (16, 9)
#: At each of them one looks at houses and the dome, past a house, down at the lawn, at nothing.
EYES = np.array([[0.0, 4, 20], [-20, 1.6, 5], [0, 12, 15], [15, 1.6, 50]])
LOOKS = np.array([[0.3, -0.05, -1], [1, 0.05, -0.4], [0.2, -1, -0.6], [0, 0.3, 1]])
LOOKS /= np.linalg.norm(LOOKS, axis=1, keepdims=True)
WALK = Walk(np.arange(4.0), EYES, LOOKS, 1.0472, 16 / 9)
CAMERA = RayCamera(*PIXELS, WALK.field_of_view, WALK.aspect)


class Picture:
    """The meshes of one level of a campus, drawn one ray at a time."""

    def __init__(self, folder: Path, level: int) -> None:
        campus = read_campus(folder)
        self.bases = read_stock(folder).bases
        self.faces: list[tuple[Floats, Floats, int, int, Floats, bool]] = []
        for number, each in enumerate(campus.objects):
            for part in read_mesh((folder / each.meshes[level].file).read_bytes()):
                look = campus.materials[part.material]
                texture = self.bases.index(look.base) if look.base else -1
                for triangle in part.triangle:
                    uv = np.zeros((3, 2)) if part.uv is None else part.uv[triangle]
                    self.faces.append((part.point[triangle], uv, number, texture,
                                       np.array(look.color), look.two_sided))  # fmt: skip
        self.levels = {
            (base, size): [
                level.astype(float)
                for level in mip_levels(
                    np.asarray(Image.open(folder / f"textures/{self.bases[base]}_{size}_d.jpg"))
                )
            ]
            for base, size in product(range(len(self.bases)), SIZES)
        }

        self._corner = np.array([face[0] for face in self.faces])
        self._both = np.array([face[5] for face in self.faces])

    @cache  # noqa: B019 - there are two pictures
    def hits(self, frame: int) -> list[int]:
        """The first face along each ray of a frame, -1 for none; one-sided ones are passed from
        behind."""
        return [self._hit(EYES[frame], ray) for ray in rays_of(frame)]

    def _hit(self, eye: Floats, ray: Floats) -> int:
        corner = self._corner
        a, b = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        matrix = np.stack([np.broadcast_to(-ray, a.shape), a, b], axis=2)
        met = abs(np.linalg.det(matrix)) > 1e-12
        met &= self._both | (np.cross(a, b) @ ray <= 0)
        t = np.full(len(corner), np.inf)
        at = np.linalg.solve(matrix[met], (eye - corner[met, 0])[..., None])[..., 0]
        inside = (at[:, 0] > 0) & (at[:, 1:] >= 0).all(axis=1) & (at[:, 1:].sum(axis=1) <= 1)
        t[met] = np.where(inside, at[:, 0], np.inf)
        return int(t.argmin()) if np.isfinite(t).any() else -1

    def color(self, face: int, size: int, eye: Floats, ray: Floats, axes: Floats) -> Floats:
        """(3,) what a face shows along a ray, with its texture in a size."""
        if face < 0:
            return np.zeros(3)
        corner, uv, _, texture, factor, _ = self.faces[face]
        if texture < 0:
            return 255 * factor

        def at(along: Floats) -> Floats:
            a, b = corner[1] - corner[0], corner[2] - corner[0]
            _, p, q = np.linalg.solve(np.stack([-along, a, b], axis=1), eye - corner[0])
            return uv[0] + p * (uv[1] - uv[0]) + q * (uv[2] - uv[0])

        here, step = at(ray), 1e-6
        moved = [np.linalg.norm(at(ray + step * axis) - here) / step for axis in axes]
        levels = self.levels[texture, size]
        detail = np.clip(np.log2(max(moved) * CAMERA.pixel * size), 0, len(levels) - 1)
        fine = len(levels) - 1 - int(detail)
        near, far = (bilinear(levels[max(n, 0)], here) for n in (fine, fine - 1))
        return (near + (detail - int(detail)) * (far - near)) * factor


def rays_of(frame: int) -> Floats:
    """(n, 3) those of the pixels."""
    return CAMERA.rays(LOOKS[frame][None])[0].reshape(-1, 3)


def bilinear(image: Floats, at: Floats) -> Floats:
    """A sample of a square that repeats."""
    side = len(image)
    x, y = at * side - 0.5
    low = np.floor([x, y]).astype(int)
    across, down = x - low[0], y - low[1]
    total = np.zeros(3)
    for i, j in product((0, 1), (0, 1)):
        weight = (across if i else 1 - across) * (down if j else 1 - down)
        total += weight * image[(low[1] + j) % side, (low[0] + i) % side]
    return total


@pytest.fixture(scope="module")
def world(folder: Path) -> CampusWorld:
    return prepare_campus(folder, WALK, frames=CampusFrames(1.0, PIXELS))


@pytest.fixture(scope="module")
def pictures(folder: Path) -> dict[int, Picture]:
    return {COARSE: Picture(folder, 0), FINE: Picture(folder, -1)}


def expected(pictures: dict[int, Picture], frame: int, mesh: Ints, column: Ints) -> float:
    """e of a frame, each pixel by itself."""
    rays, axes = rays_of(frame), CAMERA.rays(LOOKS[frame][None])[1]
    total, eye = 0.0, EYES[frame]
    for i, ray in enumerate(rays):
        face = {kind: drawn.hits(frame)[i] for kind, drawn in pictures.items()}
        full = pictures[FINE].color(face[FINE], 512, eye, ray, axes[0])
        kind = FINE if face[FINE] >= 0 else COARSE
        if face[kind] < 0:
            continue
        state = mesh[pictures[kind].faces[face[kind]][2]]
        shown = np.full(3, 128.0)
        if state != NOTHING:
            drawn, hit = pictures[state], face[state]
            texture = drawn.faces[hit][3] if hit >= 0 else -1
            held = column[texture] if texture >= 0 else 3
            if held:
                shown = drawn.color(hit, SIZES[held - 1], eye, ray, axes[0])
        total += np.sqrt(((shown - full) ** 2).mean())
    return total / len(rays)


def tables(world: CampusWorld) -> CampusTables:
    assert world.tables is not None
    return world.tables


@pytest.mark.parametrize("state", [NOTHING, COARSE, FINE])
@pytest.mark.parametrize("held", [0, 1, 2, 3])
def test_all_alike(world: CampusWorld, pictures: dict[int, Picture], state: int, held: int) -> None:
    mesh = np.full(world.stock.objects, state)
    column = np.full(len(world.stock.bases), held)
    for frame in range(4):
        actual = tables(world).wrong(int(world.view[frame]), mesh, column)
        assert actual == pytest.approx(expected(pictures, frame, mesh, column), rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("seed", range(4))
def test_each_in_its_own_state(world: CampusWorld, pictures: dict[int, Picture], seed: int) -> None:
    random = np.random.default_rng(seed)
    mesh = random.integers(0, 3, world.stock.objects)
    column = random.integers(0, 4, len(world.stock.bases))
    for frame in range(4):
        actual = tables(world).wrong(int(world.view[frame]), mesh, column)
        assert actual == pytest.approx(expected(pictures, frame, mesh, column), rel=1e-4, abs=1e-4)


def test_nothing_is_wrong_with_all_of_it_and_something_with_less(world: CampusWorld) -> None:
    def e(state: int, held: int) -> float:
        mesh = np.full(world.stock.objects, state)
        column = np.full(len(world.stock.bases), held)
        return sum(tables(world).wrong(f, mesh, column) for f in range(4))

    assert e(FINE, 3) < 1e-4
    assert 0.1 < e(FINE, 2) < e(FINE, 1) < e(FINE, 0)
    assert e(COARSE, 3) > 0.1
    assert e(NOTHING, 3) == e(NOTHING, 0) >= e(FINE, 0) > 10


def test_another_full_picture(folder: Path, world: CampusWorld) -> None:
    stock = read_stock(folder)
    finest, coarsest = (read_surfaces(folder, stock, level) for level in (-1, 0))
    small, middle, large = (read_textures(folder, stock, size) for size in SIZES)
    sizes = small, middle, large
    poses, own = (CAMERA, EYES, LOOKS), tables(world)
    same = look(FullPicture(replace(finest), large), finest, coarsest, sizes, *poses)
    mesh, column = np.full(stock.objects, COARSE), np.full(len(stock.bases), 2)
    for frame in range(4):
        actual = same.wrong(frame, mesh, column)
        assert actual == own.wrong(int(world.view[frame]), mesh, column)
    # What the campus does not have at all is wrong in every run.
    nothing = read_surfaces(folder, replace(stock, campus=replace(stock.campus, objects=())), 0)
    empty = look(FullPicture(finest, large), nothing, nothing, sizes, *poses)
    none = np.zeros(0, np.int64)
    picture = Picture(folder, -1)
    for frame in range(4):
        axes = CAMERA.rays(LOOKS[frame][None])[1][0]
        shown = np.array([
            picture.color(face, 512, EYES[frame], ray, axes)
            for face, ray in zip(picture.hits(frame), rays_of(frame), strict=True)
        ])  # fmt: skip
        expected = np.sqrt((shown**2).mean(axis=1)).mean()
        assert empty.wrong(frame, none, column) == pytest.approx(expected, rel=1e-4)


def test_what_files_weigh(folder: Path) -> None:
    stock = read_stock(folder)
    for number, each in enumerate(stock.campus.objects):
        for file, mesh in zip(stock.meshes(number), each.meshes, strict=True):
            parts = read_mesh((folder / mesh.file).read_bytes())
            bytes_ = sum(
                12 * len(p.point)
                + (0 if p.uv is None else 8 * len(p.uv))
                + (0 if p.color is None else 8 * len(p.color))
                + 2 * p.triangle.size
                for p in parts
            )
            assert stock.memory[file] == bytes_ < stock.most[file] == mesh.bytes
            assert stock.sent[file] < stock.stored[file] == mesh.bytes
    texture = stock.names.index("textures/wall_256_d.jpg")
    assert stock.memory[texture] == 4 * (4**9 - 1) // 3
    assert stock.sent[texture] == stock.stored[texture]
    assert stock.memory[0] == 0


def walk_campus(folder: Path, options: CampusWalkOptions) -> list[CampusRun]:
    world = prepare_campus(folder, WALK)
    return [simulate_campus(world, quality, options) for quality in options.qualities]


def test_a_walk_with_every_preset(folder: Path) -> None:
    runs = walk_campus(folder, CampusWalkOptions(bandwidth="inf", latency="1ms"))
    low, medium, high, ultra, cached = runs
    # Without a limit of the bandwidth all is there after a few requests.
    assert low.e > medium.e == high.e > ultra.e
    assert cached.e <= ultra.e
    assert walk_campus(folder, CampusWalkOptions("low", memory="1"))[0].e > low.e


def test_a_campus_that_is_not_whole(folder: Path, tmp_path: Path) -> None:
    names = ("missing", "changed", "unlisted")
    missing, changed, unlisted = (Path(shutil.copytree(folder, tmp_path / name)) for name in names)
    next(missing.glob("meshes/*.glb")).unlink()
    file = next(changed.glob("textures/*.jpg"))
    file.write_bytes(file.read_bytes()[:-1] + b"x")
    index = json.loads((unlisted / "campus.json").read_text())
    index["textures"] = [t for t in index["textures"] if t["size"] != 256]
    (unlisted / "campus.json").write_text(json.dumps(index))
    for made, what in ((missing, "cannot be read"), (changed, "is not the file"),
                       (unlisted, "does not list textures/")):  # fmt: skip
        with pytest.raises(InputError, match=what) as fault:
            read_stock(made)
        assert fault.value.code == "PTM-I122"


def test_materials_that_no_object_has_need_no_textures(folder: Path, tmp_path: Path) -> None:
    made = Path(shutil.copytree(folder, tmp_path / "made"))
    index = json.loads((made / "campus.json").read_text())
    index["materials"].append(dict(index["materials"][0], base="nothing", channels=["d"]))
    (made / "campus.json").write_text(json.dumps(index))
    assert "nothing" not in read_stock(made).bases
    (one,), (two,) = (walk_campus(each, CampusWalkOptions("low")) for each in (made, folder))
    assert np.array_equal(one.error, two.error)


@pytest.mark.parametrize(
    "wrong",
    [{"preset": "best"}, {"memory": "10%"}, {"nearest": -1}, {"threads": 0}, {"move": -1.0}],
)
def test_options_out_of_range(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError) as fault:
        CampusWalkOptions(**wrong)  # type: ignore[arg-type]
    assert fault.value.code == "PTM-I111"
