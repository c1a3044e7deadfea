"""Octree textures on a walk: what lit pictures show of them, what of it is wrong by how much, and
what their clients fetch."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from ptmtools.arrays import Floats, Ints
from ptmtools.cli.main import main
from ptmtools.errors import DatabaseError, InputError
from ptmtools.link import Conditions
from ptmtools.output.served import Served, read_served
from ptmtools.rendering.light import AMBIENT, lamps, with_lamp
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.rendering.rays import RayCamera
from ptmtools.walk import read_walk
from ptmtools_lab.client import Client, FileKind, Range
from ptmtools_lab.comparing import SimulateOptions, budget_of, play, require_hints
from ptmtools_lab.network import FluidLink, Request
from ptmtools_lab.policies import POLICIES, PolicyEntry
from ptmtools_lab.policies.apo import ApoClient
from ptmtools_lab.relief import without_octrees
from ptmtools_lab.renderer import FrameRenderer
from ptmtools_lab.simulation import WalkRun, simulate
from ptmtools_lab.tables import Drawing
from ptmtools_lab.world import World, prepare, relief_of
from ptmtools_systems.apo.lighting import descend, lamp, stop_of
from ptmtools_systems.apo.model import Octrees
from ptmtools_systems.apo.served_octrees import no_octrees, read_octrees
from ptmtools_systems.apo.traversal import look_up, stop_depth
from tests.lab.conftest import Ptm
from tests.lab.worlds import SEEDS, catalogue, raw
from tests.systems.apo.building import Node, nodes, octree_of
from tests.systems.apo.statues import STATUES, write_rooms

APO, OURS, BEST = (POLICIES[name] for name in ("apo", "best+apo", "best"))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two rooms and their statues, of which one has a texture: a database of them as
    modelled, one with octrees, and a walk of 20 s."""
    folder = tmp_path_factory.mktemp("statues")
    model = str(write_rooms(folder / "model", 4))
    build = ["-q", "build-scene", model, "-j", "1", "--samples", "4"]
    build += ["--light", "none", "-o"]
    assert main([*build, str(folder / "plain.db")]) == 0
    apo = ["--apo", "statue_*", "--apo-faces", "600", "--apo-depth", "8"]
    assert main([*build, str(folder / "light.db"), *apo]) == 0
    walk = ["-q", "path", str(folder / "light.db"), "-o", str(folder / "walk.json")]
    assert main([*walk, "--duration", "20"]) == 0
    return folder


def world_of(folder: Path, *, against: bool = False, rate: float = 1.0) -> World:
    served, plain = (with_lamp(read_served(folder / name)) for name in ("light.db", "plain.db"))
    pyramids = read_pyramids(served)
    relief = relief_of(served, pyramids, plain if against else None)
    walk = read_walk(folder / "walk.json")
    return prepare(served, walk, pyramids, rate=rate, drawing=Drawing(relief=relief))


@pytest.fixture(scope="module")
def world(made: Path) -> World:
    return world_of(made)


@pytest.fixture(scope="module")
def compared(made: Path) -> World:
    """The same, compared with the database as modelled."""
    return world_of(made, against=True)


@pytest.fixture
def db(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made / "light.db", tmp_path / "light.db"))


@settings(max_examples=30)
@given(nodes(4), SEEDS)
def test_light_is_that_of_the_nodes_a_point_lies_in(root: Node, seed: int) -> None:
    random = np.random.default_rng(seed)
    octree = replace(octree_of(root), low=random.normal(size=3), side=2.5)
    octrees = Octrees(
        octree.texels,
        np.array([0, len(octree.texels)]),
        np.array([octree.levels]),
        octree.low[None],
        np.array([octree.side]),
        np.zeros(0, np.int32),
    )
    q = random.uniform(-0.05, 1.05, (50, 3))
    light = np.zeros(64)
    for at, (x, y, z) in zip(q, (octree.low + q * octree.side).tolist(), strict=True):
        for stop in range(octree.levels):
            actual = look_up(octree, at[None], stop=stop)
            count = descend(octrees, 0, x, y, z, stop, light)
            assert count == actual.depth[0] + 1
            assert light[count - 1] == pytest.approx(lamp(*actual.normals[0]), abs=1e-12)


@given(st.lists(st.floats(-1e3, 1e3), min_size=9, max_size=9))
def test_a_flat_triangle_is_lit_by_its_normal(numbers: list[float]) -> None:
    corner = np.array(numbers).reshape(1, 3, 3)
    normal = np.cross(corner[0, 1] - corner[0, 0], corner[0, 2] - corner[0, 0])
    assert lamps(corner)[0] == pytest.approx(lamp(*normal), abs=1e-9)
    assert AMBIENT - 1e-12 <= lamps(corner)[0] <= 1 + 1e-12


def test_nodes_stop_where_they_are_pixels(world: World) -> None:
    """By the places that pixels of the screen show, not by the formula."""
    camera = replace(world.camera, width=1920, height=1080)
    renderer = FrameRenderer(world, 8, 1)
    surfaces, relief = world.served.surfaces, world.relief
    assert relief
    origin = np.array(world.served.index["origin"])
    eye = [3.0, 1.2, 1.5] - origin
    towards = STATUES["statue_01"][0] - origin + [0, 0.6, 0] - eye
    direction = (towards / np.linalg.norm(towards))[None]
    rays, axes = camera.rays(direction)
    checked = 0
    for down, right in ((540, 960), (500, 900), (600, 1000), (480, 1010), (560, 870)):
        around = [(down, right), (down, right + 1), (down + 1, right)]
        ray = np.array([rays[0, a, b] for a, b in around])
        sight = renderer.look(eye, direction[0])._replace(
            ray=ray, triangle=renderer._caster.first(eye, ray), axes=axes[0], pixel=camera.pixel
        )
        f = int(sight.triangle[0])
        if f < 0 or relief.octrees.of[f] < 0:
            continue
        normal, first = renderer._triangles.normal[f], surfaces.corner[f, 0]
        far = normal @ (first - eye) / (ray @ normal)
        place = eye + far[:, None] * ray
        side = float(relief.octrees.side[relief.octrees.of[f]])
        step = np.linalg.norm(place[1:] - place[0], axis=1).min() / side
        actual = stop_of(sight, 0, renderer._triangles, float(far[0]), side)
        # The next pixel is not infinitely near: by so little the depths may differ.
        assert actual in stop_depth(step * np.array([0.98, 1.0, 1.02]))
        checked += 1
    assert checked >= 3


def direct(world: World, frame: int, columns: Ints) -> float:
    """e by drawing the pixels of the tables: what is shown, and what should be."""
    renderer = FrameRenderer(world, world.camera.height, 1)
    renderer._camera = world.camera
    sight = renderer.look(world.track.eye[frame], world.track.direction[frame])
    renderer.width = world.camera.width
    there = np.ones(world.catalogue.cell_count, dtype=np.bool_)
    shown, full = renderer.colors(sight, there, columns), renderer.full(sight)
    return float(np.sqrt(((shown - full) ** 2).mean(axis=2)).mean())


def tabled(world: World, frame: int, columns: Ints) -> float:
    """The same by the tables."""
    views = world.views
    rows = views.rows(int(world.track.view[frame]))
    total = 0.0
    for r in range(rows.start, rows.stop):
        t = int(views.texture[r])
        total += float(views.error[r, columns[t] + 1]) if t >= 0 else 0.0
    return total


@pytest.mark.parametrize("which", ["world", "compared"])
def test_errors_are_those_of_the_pictures(which: str, request: pytest.FixtureRequest) -> None:
    """With all textures there and any levels of the octrees; the textured statue as well."""
    world: World = request.getfixturevalue(which)
    relief = world.relief
    assert relief
    random, first = np.random.default_rng(3), len(world.pyramids.levels)
    worst = 0.0
    for frame in range(0, world.frames, 3):
        columns = np.concatenate([world.pyramids.levels, relief.octrees.levels, [0]])
        for k in range(4):
            if k:
                columns[first:-1] = random.integers(0, relief.octrees.levels + 1)
            by_table, by_picture = tabled(world, frame, columns), direct(world, frame, columns)
            assert by_table == pytest.approx(by_picture, rel=1e-3, abs=2e-3)
            worst = max(worst, by_table)
    assert worst > 0.05


def test_everything_there_is_the_full_picture(world: World, compared: World) -> None:
    relief = world.relief
    assert relief
    whole = np.concatenate([world.pyramids.levels, relief.octrees.levels, [0]])
    none = whole.copy()
    none[len(world.pyramids.levels) :] = 0
    frames = range(world.frames)
    assert max(tabled(world, f, whole) for f in frames) < 1e-3
    # The relief that the mesh has lost is in the octrees, but for what its shape has lost.
    left, lost = (sum(tabled(compared, f, c) for f in frames) for c in (whole, none))
    assert 0 < left < 0.8 * lost


def test_a_database_compared_with_itself(made: Path) -> None:
    """Nothing is wrong with it that is not without the comparison."""
    served = with_lamp(read_served(made / "plain.db"))
    pyramids, walk = read_pyramids(served), read_walk(made / "walk.json")
    alone = prepare(served, walk, pyramids, rate=0.5)
    relief = relief_of(served, pyramids, served)
    same = prepare(served, walk, pyramids, rate=0.5, drawing=Drawing(relief=relief))
    for name in ("start", "cell", "texture", "error", "square", "need", "sight"):
        assert np.array_equal(getattr(alone.views, name), getattr(same.views, name)), name


def test_without_light_and_comparison_there_is_no_relief(made: Path) -> None:
    served = read_served(made / "light.db")
    pyramids = read_pyramids(served)
    assert relief_of(served, pyramids, lit=False) is None
    relief = relief_of(served, pyramids, read_served(made / "plain.db"), lit=False)
    assert relief
    assert relief.octrees.number == 0


def test_each_statue_has_its_octree(world: World) -> None:
    relief = world.relief
    assert relief
    surfaces = world.served.surfaces
    rows = [row["object"] for row in world.served.index["octrees"]]
    assert sorted(rows) == sorted(STATUES)
    for o, name in enumerate(rows):
        foot, radius = STATUES[name]
        corner = surfaces.corner[relief.octrees.of == o] + world.served.index["origin"]
        assert 0 < len(corner) <= 600
        low, high = corner.min(axis=(0, 1)), corner.max(axis=(0, 1))
        assert ((low + high) / 2)[[0, 2]] == pytest.approx([foot[0], foot[2]], abs=0.1)
        assert high - low == pytest.approx(np.full(3, 2 * radius), rel=0.15)
    assert no_octrees(surfaces).number == 0


def walked(world: World, budget: int, seconds: float = 30) -> tuple[WalkRun, list[Range]]:
    """Who stands there; and the ranges asked for, in that order."""
    asked: list[Range] = []

    def make(world: World, link: FluidLink, budget: int) -> Client:
        ask = link.request

        def request(size: int, priority: float, tag: Any, *more: Any) -> Request:
            asked.append(tag)
            return ask(size, priority, tag, *more)

        link.request = request  # type: ignore[method-assign]
        return ApoClient(world, link, budget)

    stays = world.standing(seconds)
    return simulate(stays, replace(APO, client=make), Conditions(2e6), budget), asked


def seen_from(world: World, eye: tuple[float, ...], at: tuple[float, ...]) -> World:
    """Somebody at a place of the model who looks towards another one; the screen is that of the
    first frame."""
    origin = np.array(world.served.index["origin"])
    towards = np.array(at) - eye
    direction = towards / np.linalg.norm(towards)

    def change(w: World) -> World:
        place = (eye - origin)[None]
        cell = w.served.locator.cells_along(place)
        track = w.track.looking(slice(1))
        return replace(w, track=replace(track, eye=place, direction=direction[None], cell=cell))

    return world.change_all(change)


def levels_asked(world: World, asked: list[Range]) -> dict[str, int]:
    """Of each object, how many levels of its octree were asked for."""
    own = world.in_form("octree")
    first, ends = len(own.pyramids.levels), own.catalogue.ends
    actual = {}
    for o, row in enumerate(own.served.index["octrees"]):
        mine = [a.end for a in asked if a.kind == FileKind.TEXTURE and a.number == first + o]
        levels = own.catalogue.levels[first + o]
        last = max(mine, default=0)
        assert last in ends[first + o]
        actual[row["object"]] = int(np.searchsorted(ends[first + o, : levels + 1], last))
    return actual


def test_levels_come_one_after_the_other_until_nodes_are_pixels(world: World) -> None:
    foot = STATUES["statue_01"][0]
    middle = (foot[0], 0.6, foot[2])
    near, asked = walked(seen_from(world, (2.3, 0.7, 1.2), middle), 1 << 30)
    first = len(world.pyramids.levels)
    octrees = [a for a in asked if a.kind == FileKind.TEXTURE and a.number >= first]
    assert [a.begin for a in octrees] == [0, *[a.end for a in octrees[:-1]]]
    actual = levels_asked(world, asked)
    assert world.relief
    # At 40 cm all levels are needed; of what is in the other room, nothing is there yet.
    number = [row["object"] for row in world.served.index["octrees"]].index("statue_01")
    assert actual == {"statue_01": world.relief.octrees.levels[number], "statue_02": 0}
    assert near.column[-1, first + number] == actual["statue_01"]


def test_the_transmission_pauses_where_nodes_are_pixels(world: World) -> None:
    """Seen through a narrow camera of few lines, a statue needs no more levels than it has nodes
    there."""
    foot = STATUES["statue_01"][0]
    eye, middle = (3.6, 1.0, 2.6), (foot[0], 0.6, foot[2])
    coarse = world.change_all(lambda w: replace(w, camera=replace(w.camera, lines=40)))
    _, asked = walked(seen_from(coarse, eye, middle), 1 << 30)
    relief = world.relief
    assert relief
    number = [row["object"] for row in world.served.index["octrees"]].index("statue_01")
    surfaces = world.served.surfaces
    own = surfaces.corner[relief.octrees.of == number].reshape(-1, 3) + world.served.index["origin"]
    gap = np.maximum(np.maximum(own.min(axis=0) - eye, eye - own.max(axis=0)), 0)
    pixel = np.linalg.norm(gap) * RayCamera(1, 1, coarse.camera.field_of_view, 1, 40).pixel
    nodes = relief.octrees.side[number] / pixel
    expected = int(np.ceil(np.log2(nodes))) + 1
    assert 1 < expected < relief.octrees.levels[number]
    assert levels_asked(world, asked)["statue_01"] == expected


def test_who_looks_away_fetches_none(world: World) -> None:
    """At the ceiling; what is in the frustum behind a wall counts as seen."""
    _, asked = walked(seen_from(world, (2.6, 1.9, 1.2), (2.6, 9.0, 1.3)), 1 << 30)
    assert levels_asked(world, asked) == dict.fromkeys(STATUES, 0)


@pytest.mark.parametrize("policy", [APO, OURS], ids=lambda p: p.name)
@pytest.mark.parametrize("share", [0.0, 0.05, 0.3, 1.0])
def test_no_budget_is_exceeded(world: World, policy: Any, share: float) -> None:
    own = world.in_form("octree")
    for bandwidth in (64e3, 1e6):
        run = simulate(world, policy, Conditions(bandwidth), int(share * own.catalogue.whole))
        assert run.overruns == 0
        assert (run.memory <= share * own.catalogue.whole).all()


def test_relief_comes_with_the_bytes(world: World) -> None:
    """Who fetches octrees ends with the full picture, who does not keeps the mesh's."""
    foot = STATUES["statue_02"][0]
    there = seen_from(world, (5.2, 1.2, 1.6), (foot[0], 0.4, foot[2])).in_form("octree")
    views = prepare_views(there)
    runs = {p.name: simulate(views, p, Conditions(1e6), there.catalogue.whole) for p in (APO, OURS)}
    plain = simulate(
        replace(views, form="ptm", catalogue=world.catalogue), BEST, Conditions(1e6), 1 << 30
    )
    for run in runs.values():
        assert run.error[-1] < 1e-3 < 0.05 < plain.error[-1]
        assert run.body > plain.body


def prepare_views(world: World) -> World:
    """Who stands there for 20 s, with what is really on the screen."""
    from ptmtools_lab.tables import look

    (views,) = look(
        world.served.surfaces, world.pyramids, world.camera, world.track.eye, world.track.direction,
        drawing=Drawing(relief=world.relief),
    )  # fmt: skip
    view = np.zeros(len(world.track.view), np.int64)
    track = replace(world.track, view=view)
    return replace(world, views=views, track=track, other_forms={}).standing(20)


@pytest.mark.parametrize("levels", [1, 3, 12])
def test_as_many_columns_as_the_tables_have(levels: int) -> None:
    """Whatever is deeper, a texture or an octree; policies go through all of them."""
    stock = catalogue([raw(16)], [(0, 0)])
    octrees = no_octrees_of(levels)
    actual = without_octrees(stock, octrees)
    assert actual.ends.shape == (3, 1 + max(5, levels))
    assert (actual.ends[1:] == 0).all()
    assert (actual.levels == [5, 0, 0]).all()
    assert actual.whole == stock.whole


def no_octrees_of(levels: int) -> Octrees:
    """One that nothing has."""
    return Octrees(
        np.zeros((1, 4), np.uint8), np.array([0, 1]), np.array([levels]), np.zeros((1, 3)),
        np.ones(1), np.zeros(0, np.int32),
    )  # fmt: skip


@pytest.mark.parametrize("form", ["ptm", "octree"])
def test_columns_are_those_of_the_tables(world: World, form: str) -> None:
    own = world.in_form(form)
    shape = len(world.pyramids.levels) + 3, own.views.need.shape[1] + 1
    assert own.catalogue.ends.shape == own.catalogue.differences.shape == shape


@pytest.mark.parametrize("policy", [p for p in POLICIES.values() if p.needs is None])
def test_all_policies_walk_through_lit_rooms(world: World, policy: PolicyEntry) -> None:
    if policy.form not in ("ptm", "octree"):
        return
    run = simulate(world, policy, Conditions(1e6), 1 << 16)
    assert np.isfinite(run.error).all()
    assert run.overruns == 0


def test_a_database_whose_objects_have_none(made: Path) -> None:
    """As one of before nodes said which octree is theirs."""
    served = read_served(made / "light.db")
    none = replace(served.surfaces, represented={})
    with pytest.raises(DatabaseError, match=r"no object in the GLBs.*PTM-D006"):
        read_octrees(replace(served, surfaces=none))


def test_memory_as_the_paper_counts(world: World) -> None:
    """Octrees take four bytes a texel either way."""
    counted = world.counted_by_paper()
    first = len(world.pyramids.levels)
    own, paper = (w.in_form("octree").catalogue.memory for w in (world, counted))
    assert own.shape == paper.shape
    if counted.form == "ptm":
        assert (counted.catalogue.memory[:first] <= world.catalogue.memory[:first]).all()
    assert (own[first:] == paper[first:]).all()


def test_shares_of_memory_are_of_the_textures(world: World) -> None:
    memory = SimulateOptions(memory="50%").memories[0]
    textures = int(world.catalogue.memory[: len(world.pyramids.levels), -1].sum())
    assert budget_of(world, memory, "octree") == budget_of(world, memory) == textures // 2


def test_what_a_client_of_octrees_needs(made: Path, world: World) -> None:
    with pytest.raises(InputError, match=r"lit pictures.*--lit.*PTM-I701"):
        SimulateOptions(policy="best,apo")
    plain = read_served(made / "plain.db")
    with pytest.raises(InputError, match=r"octree textures.*--apo.*PTM-I701"):
        require_hints(plain, [APO])
    with pytest.raises(InputError, match="PTM-I701"):
        replace(world, other_forms={}).in_form("octree")


def test_other_textures_are_no_comparison(made: Path, two_rooms: Path) -> None:
    served = read_served(made / "light.db")
    other = read_served(two_rooms)
    renamed = replace(other, index={**other.index, "textures": other.index["textures"][:1]})
    with pytest.raises(InputError, match=r"other textures.*PTM-I700"):
        relief_of(served, read_pyramids(served), renamed)


def damaged(data: bytes) -> bytes:
    return data[: len(data) // 2] + bytes([data[len(data) // 2] ^ 255]) + data[len(data) // 2 + 1 :]


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda f: f.unlink(), "PTM-D005"),
        (lambda f: f.write_bytes(b""), "PTM-D006"),
        (lambda f: f.write_bytes(damaged(f.read_bytes())), "PTM-D006"),
    ],
    ids=["missing", "empty", "damaged"],
)
def test_octrees_that_cannot_be_read(db: Path, change: Callable[[Path], Any], code: str) -> None:
    change(next((db / "www/apo").glob("*.bin")))
    with pytest.raises(DatabaseError, match=code):
        read_octrees(read_served(db))


@pytest.mark.parametrize(
    "change",
    [
        {"levels": [1]},
        {"levels": [1, 2**25], "ends": [5, 9], "crc32": [0, 0]},
        {"levels": [1, 8], "ends": [9, 9], "crc32": [0, 0]},
    ],
    ids=["not aligned", "too many", "not ascending"],
)
def test_rows_that_contradict_themselves(made: Path, change: dict[str, Any]) -> None:
    served = read_served(made / "light.db")
    rows = [{**served.index["octrees"][0], **change}]
    wrong: Served = replace(served, index={**served.index, "octrees": rows})
    with pytest.raises(DatabaseError, match="PTM-D006"):
        read_octrees(wrong)


def test_as_a_command(ptm: Ptm, made: Path, tmp_path: Path) -> None:
    where = [made / "light.db", "--walk", made / "walk.json", "--bandwidth", "1M"]
    call = ["simulate", *where, "--memory", "inf", "--policy", "best-exact,apo,best+apo"]
    assert ptm(*call).status == 3
    assert "--lit" in ptm(*call).err
    strip = tmp_path / "strip.png"
    printed = ptm(*call, "--lit", "--against", made / "plain.db", "--json", "--strip", strip)
    e = {run["policy"]: run["e"]["mean"] for run in json.loads(printed.out)["runs"]}
    assert e["apo"] < e["best-exact"]
    assert e["best+apo"] < e["best-exact"]
    assert strip.is_file()


def test_played_in_all_forms(world: World) -> None:
    options = SimulateOptions(policy="best,apo", bandwidth="1M", memory="inf", lit=True)
    played = play({"": world}, options)
    assert [p.run.policy for p in played] == ["best", "apo"]
    assert played[0].run.column.shape == played[1].run.column.shape
    columns: Floats = played[0].run.column[:, len(world.pyramids.levels) :].astype(np.float64)
    assert not columns.any()
