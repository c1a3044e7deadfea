"""Previews of textures: what they show, what they are worth, and when they are fetched."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from numpy.typing import NDArray
from PIL import Image

from ptmtools.arrays import Bools, Floats, Ints
from ptmtools.errors import DatabaseError
from ptmtools.link import Conditions
from ptmtools.output.served import Served, read_served
from ptmtools.rendering.pyramids import pack_pyramids, read_preview, read_pyramids
from ptmtools.site.choice import Previews, next_fetch, previews_of
from ptmtools.site.client import AVERAGING, LEAST_DIFFERENCE
from ptmtools.texture import decode, encode, read_header
from ptmtools.walk import read_walk
from ptmtools_lab.allocation import choose_sources
from ptmtools_lab.catalogue import catalogue_of
from ptmtools_lab.client import Client, FileKind
from ptmtools_lab.lossy import Lossy, pictures, read_lossy
from ptmtools_lab.network import FluidLink
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.policies.engine import _drops
from ptmtools_lab.renderer import FrameRenderer
from ptmtools_lab.simulation import WalkRun, simulate
from ptmtools_lab.tables import Drawing, look
from ptmtools_lab.world import World, prepare
from tests.lab.test_forms import pose
from tests.lab.test_view import CAMERA, room
from tests.lab.worlds import SEEDS, Texture, any_world, catalogue, standing

Texels = NDArray[np.uint8]


def rows(random: np.random.Generator) -> list[dict[str, Any]]:
    """Textures of an index: up to four, of up to five levels."""
    result: list[dict[str, Any]] = []
    for _ in range(int(random.integers(1, 5))):
        levels = int(random.integers(1, 6))
        chosen = np.flatnonzero(random.random(levels) < 0.5).tolist()
        previews = [
            {
                "level": level,
                "bytes": int(random.integers(1, 40)),
                "difference": 9 * random.random(),
            }
            for level in chosen
        ]
        ends = np.cumsum(random.integers(1, 40, int(random.integers(1, levels + 1)))).tolist()
        if chosen and chosen[-1] == levels - 1 and random.random() < 0.5:
            previews[-1]["exact"] = True
        result.append({"ends": ends, "previews": previews})
    return result


@given(SEEDS)
def test_the_loss_of_a_preview(seed: int) -> None:
    """By its definition: a pixel sees the error of the finest column that it wants and that is
    resident, and that error halves with each level below the preview's."""
    random = np.random.default_rng(seed)
    previews = previews_of(rows(random))
    columns = 7
    losses = previews.losses(columns)
    share = -np.sort(-random.random(columns + 1))
    for p in range(len(previews.column)):
        c = int(previews.column[p])
        for k in range(1, c + 1):
            finest = np.append(share[1:k] - share[2 : k + 1], share[k])
            error = previews.difference[p] * AVERAGING ** (c - np.arange(1, k + 1))
            expected = float((finest * error).sum())
            assert float((share[1 : k + 1] * losses[p, 1 : k + 1]).sum()) == pytest.approx(expected)
        assert not losses[p, [0, *range(c + 1, columns)]].any()
        assert previews.difference[p] >= LEAST_DIFFERENCE or previews.exact[p]


class Case:
    """Textures with previews, the worth of each source, and what of them is there."""

    def __init__(self, seed: int) -> None:
        self.random = random = np.random.default_rng(seed)
        self.rows = rows(random)
        self.previews: Previews = previews_of(self.rows)
        count, wide = len(self.rows), 6
        self.stored: Ints = np.array([len(row["ends"]) for row in self.rows])
        self.ends = np.zeros((count, wide), np.int64)
        for into, row in zip(self.ends, self.rows, strict=True):
            into[1:] = [*row["ends"], *row["ends"][-1:] * (wide - 1 - len(row["ends"]))]
        self.worth: Floats = random.integers(-3, 20, (count + len(self.previews.column), wide)) / 4
        self.worth[:, 0] = 0
        for p in np.flatnonzero(self.previews.exact):
            self.worth[count + p] = self.worth[self.previews.texture[p]]
        self.present: Bools = random.random(len(self.previews.column)) < 0.5

    def value(self, source: int, column: int) -> float:
        """The value of a column of a source."""
        return float(self.worth[source, 1 : column + 1].sum())

    def of(self, texture: int) -> range:
        """The previews of a texture."""
        return range(*self.previews.first[texture : texture + 2].tolist())


@given(SEEDS)
def test_sources_of_columns(seed: int) -> None:
    """The exact one if it is there, else the preview of the greatest value."""
    case = Case(seed)
    count, wide = case.ends.shape
    have = case.random.integers(0, case.stored + 1)
    step, source = np.zeros((count, wide)), np.zeros((count, wide), np.int64)
    last = np.zeros(count, np.int64)
    choose_sources(case.worth, have, case.previews, case.present, step, source, last)
    for t in range(count):
        mine = [p for p in case.of(t) if case.present[p]]
        assert last[t] == max([have[t], *case.previews.column[mine]])
        before = 0.0
        for k in range(1, int(last[t]) + 1):
            able = [p for p in mine if case.previews.column[p] >= k]
            exact = [count + p for p in able if case.previews.exact[p]]
            if k <= have[t] or exact:
                best = [t] if k <= have[t] else exact
            else:
                values = {count + p: case.value(count + p, k) for p in able}
                best = [s for s, value in values.items() if value == max(values.values())][-1:]
            assert [source[t, k]] == best
            value = case.value(int(source[t, k]), k)
            assert step[t, k] == pytest.approx(value - before)
            before = value


@given(SEEDS)
def test_the_next_bytes_of_all_steps(seed: int) -> None:
    """Of ranges to each column and of whole previews the one that adds most for its bytes to the
    best that was requested."""
    case = Case(seed)
    random, count = case.random, len(case.stored)
    requested = random.integers(0, case.ends[:, -1] + 1)
    busy, overhead = random.random(count) < 0.3, int(random.integers(0, 30))
    last = random.integers(0, case.ends.shape[1], count)
    levels = [max([len(r["ends"]), *(p["level"] + 1 for p in r["previews"])]) for r in case.rows]
    last = np.minimum(last, levels)
    pending = case.present
    options: dict[tuple[int, int], float] = {}
    for t in range(count):
        until = int(min(last[t], case.stored[t]))
        exact = [k for k in range(until + 1) if case.ends[t, k] <= requested[t]]
        values = [(k, case.value(t, k)) for k in exact]
        before = {p: min(int(case.previews.column[p]), int(last[t])) for p in case.of(t)}
        values += [(k, case.value(count + p, k)) for p, c in before.items() if pending[p]
                   for k in range(c + 1)]  # fmt: skip
        most = max(value for _, value in values)
        coarse = max(value for k, value in values if k <= until)
        for k in range(exact[-1] + 1, until + 1):
            if not busy[t] and case.value(t, k) > coarse:
                size = float(case.ends[t, k] - requested[t] + overhead)
                options[t, k] = (case.value(t, k) - coarse) / size
        for p, c in before.items():
            for k in range(1, c + 1):
                if not pending[p] and case.value(count + p, k) > most:
                    size = float(case.previews.bytes[p] + overhead)
                    options[count + p, k] = (case.value(count + p, k) - most) / size
    density, source, column = next_fetch(
        case.worth, case.ends, case.stored, requested, busy, last, case.previews, pending, overhead
    )
    if not options:
        assert (density, source, column) == (0.0, -1, 0)
    else:
        assert density == pytest.approx(max(options.values()), rel=1e-9)
        assert options[source, column] == pytest.approx(density, rel=1e-9)


def test_a_leap_and_the_exact_levels_after_it() -> None:
    """From nothing to a preview of the finest level, then to exact levels: each time the greatest
    worth per byte."""
    row = {"ends": [10, 1000, 100_000], "previews": [{"level": 2, "bytes": 900, "difference": 2.0}]}
    previews = previews_of([row])
    gains = np.array([[0.0, 30, 20, 10]])
    worth = np.concatenate([gains, gains - previews.losses(4)])
    ends = np.array([[0, *row["ends"]]])  # type: ignore[misc]
    last, free, stored = np.array([3]), np.zeros(1, np.bool_), np.array([3])

    def following(requested: int, pending: bool) -> tuple[int, int]:
        given = np.array([requested]), free, last, previews, np.array([pending]), 0
        return next_fetch(worth, ends, stored, *given)[1:]

    assert following(0, False) == (0, 1)
    assert following(10, False) == (1, 3)
    assert following(10, True) == (0, 3)
    assert following(100_000, True) == (-1, 0)


@pytest.mark.parametrize("policy", ["best", "oracle"])
@settings(max_examples=30)
@given(SEEDS)
def test_at_rest_all_is_exact(policy: str, seed: int) -> None:
    """With time and memory, whatever previews there are; and the budget holds."""
    world = any_world(seed, previews=True)
    assume(len(world.catalogue.previews.texture))
    world = world.standing(60.0)
    world = replace(world, track=replace(world.track, still=np.ones(301, np.bool_)))
    client, run = watched(world, policy, Conditions(1e6, 0.02), 1 << 30)
    stock = client.world.catalogue
    wants = client.sight(1) > 0 if policy == "best" else np.zeros(stock.ends.shape, np.bool_)  # type: ignore[attr-defined]
    exact = [any(stock.previews.exact[stock.previews.first[t] : stock.previews.first[t + 1]])
             for t in range(stock.texture_count)]  # fmt: skip
    for t in range(stock.texture_count):
        reachable = stock.levels[t] if exact[t] else stock.stored[t]
        if wants[t, 1] and not wants[t, reachable + 1 :].any():
            shown = int(client.source[t]) - stock.texture_count
            assert shown < 0 or stock.previews.exact[shown]
            assert (np.flatnonzero(wants[t]) <= client.column[t]).all()
    assert run.overruns == 0
    small = simulate(world, POLICIES[policy], Conditions(1e6, 0.02), int(stock.whole // 3))
    assert small.overruns == 0


def watched(
    world: World, policy: str, conditions: Conditions, budget: int
) -> tuple[Client, WalkRun]:
    """The client of a run, afterwards, and the run."""
    clients: list[Client] = []

    def client(world: World, link: FluidLink, budget: int) -> Client:
        clients.append(POLICIES[policy].client(world, link, budget))
        return clients[0]

    run = simulate(world, replace(POLICIES[policy], client=client), conditions, budget)
    return clients[0], run


@settings(max_examples=20)
@given(SEEDS)
def test_the_oracle_knows_the_errors_of_all_states(seed: int) -> None:
    """What a column of a source removes of a frame, from the mean colour on."""
    world = any_world(seed, frames=4, previews=True)
    stock, views = world.catalogue, world.views
    columns, cells = _drops(world)
    assert columns.shape == (4, *stock.gains.shape)
    for f in range(world.frames):
        for source in range(stock.gains.shape[0]):
            p = source - stock.texture_count
            t = int(stock.previews.texture[p]) if p >= 0 else source
            before = int(stock.previews.state[p]) if p >= 0 else 0
            last = int(stock.previews.column[p] if p >= 0 else stock.levels[t])
            rows = [r for r in range(*views.start[f : f + 2].tolist()) if views.texture[r] == t]
            for k in range(1, last + 1):
                drop = sum(float(views.error[r, 1] - views.error[r, before + k + 1]) for r in rows)
                removed = float(columns[f, source, 1 : k + 1].sum())
                assert removed == pytest.approx(drop, abs=1e-4)
            assert not columns[f, source, last + 1 :].any()
        assert cells[f].sum() == pytest.approx(views.error[views.rows(f), 0].sum(), rel=1e-5)


def test_exact_levels_that_suffice_stay() -> None:
    """A preview of levels that the view does not want does not take their place."""
    levels = 5
    groups, sizes = tuple(40 * 4**k for k in range(levels)), tuple(4**k for k in range(levels))
    texture = Texture(groups[:3], sizes, ((levels - 1, 60, 0.5),))
    world = standing(catalogue([texture], [(0, 0)]), 60.0)
    few = np.where(np.arange(levels) < 3, world.views.need, 0).astype(np.float32)
    views = replace(world.views, need=few, sight=few)
    client, _ = watched(replace(world, views=views), "best", Conditions(64e3, 0.02), 1 << 30)
    assert client.previews.whole.all()
    assert (client.source[0], client.column[0]) == (0, 3)
    client, _ = watched(world, "best", Conditions(64e3, 0.02), 1 << 30)
    assert (client.source[0], client.column[0]) == (1, 5)


@settings(max_examples=20)
@given(SEEDS)
def test_a_client_that_knows_no_previews(seed: int) -> None:
    """Sees a world without them: the same run as where there are none."""
    world = any_world(seed, previews=True)
    bare = replace(world, catalogue=world.catalogue.without_previews, opening=())
    conditions, budget = Conditions(2e4, 0.05), int(world.catalogue.whole // 2)
    for ours, theirs in (("best-exact", "best"), ("ach", "ach"), ("paper", "paper")):
        one = simulate(world, POLICIES[ours], conditions, budget)
        other = simulate(bare, POLICIES[theirs], conditions, budget)
        for name in ("error", "column", "state", "fetched"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert (one.state == one.column).all()


def test_previews_make_thin_links_better() -> None:
    """One of a tenth of the bytes halves the error of a while; a useless one is not fetched."""
    levels = 6
    groups, memory = tuple(40 * 4**k for k in range(levels)), tuple(4**k for k in range(levels))
    kinds = {
        "none": (),
        "good": ((levels - 1, 4000, 1.0),),
        "useless": ((levels - 1, 4000, 60.0),),
    }
    error = {}
    for name, previews in kinds.items():
        world = standing(catalogue([Texture(groups, memory, previews)], [(0, 0)]), 60.0)
        client, run = watched(world, "best", Conditions(16e3, 0.05), 1 << 30)
        error[name] = run.error.mean()
        assert client.previews.whole.tolist() == [True] * (name == "good") + [False] * (
            name == "useless"
        )
        assert run.error[-1] == 0
    assert error["useless"] == pytest.approx(error["none"], rel=1e-4)
    assert error["good"] < 0.6 * error["none"]


def lossy_of(made: Any, random: np.random.Generator) -> Lossy:
    """Previews of some levels of the textures of a room, with other texels than those."""
    chains: list[list[Texels]] = []
    first, state = [0], []
    for t, levels in enumerate(made.pyramids.levels.tolist()):
        following = levels
        for level in np.flatnonzero(random.random(levels) < 0.6).tolist():
            width, height = made.pyramids.size[t, level].tolist()
            chains.append(
                [random.integers(0, 256, (max(1, height >> k), max(1, width >> k), 3), np.uint8)
                 for k in range(level, -1, -1)]
            )  # fmt: skip
            state.append(following)
            following += level + 1
        first.append(len(chains))
    return Lossy(pack_pyramids(chains), np.array(first), np.array(state, dtype=np.int64))


@settings(max_examples=10)
@given(SEEDS)
def test_errors_of_states_against_pictures_as_a_form(seed: int) -> None:
    """The kernel of forms samples each picture on its own."""
    random = np.random.default_rng(seed)
    made, eyes = room(random), pose(random)
    lossy = lossy_of(made, random)
    shows = pictures(made.pyramids, lossy)
    views, form = look(
        made.surfaces, made.pyramids, CAMERA, *eyes, drawing=Drawing(lossy, {"": shows})
    )
    (bare,) = look(made.surfaces, made.pyramids, CAMERA, *eyes)
    for name in ("start", "cell", "texture", "need", "sight"):
        assert getattr(views, name).tobytes() == getattr(bare, name).tobytes(), name
    wide = views.error.shape[1]
    assert wide == 2 + max(lossy.states, int(made.pyramids.levels.max()))
    for r, t in enumerate(views.texture.tolist()):
        known = int(shows.last[t]) + 2 if t >= 0 else 1
        for name in ("error", "square"):
            own, other = getattr(views, name)[r], getattr(form, name)[r]
            np.testing.assert_allclose(own[:known], other[:known], rtol=2e-6, atol=1e-6)
            mine = int(made.pyramids.levels[t]) + 2 if t >= 0 else 1
            assert (own[:mine] == getattr(bare, name)[r, :mine]).all()


def write_previews(db: Path, change: Callable[[int, list[Texels]], list[dict[str, Any]]]) -> Served:
    """Gives the textures of a database previews: ``change`` returns rows with ``texels``, ``level``
    and maybe other fields, from the number of a texture and its levels."""
    served = read_served(db)
    pyramids = read_pyramids(served)
    index = json.loads((served.folder / "hints.json").read_text())
    (served.folder / "previews").mkdir(exist_ok=True)
    for t, row in enumerate(index["textures"]):
        levels = []
        for n in range(int(pyramids.levels[t])):
            width, height = pyramids.size[t, n].tolist()
            begin = int(pyramids.start[t, n])
            texels = pyramids.texel[begin : begin + 3 * width * height]
            levels.append(texels.reshape(height, width, 3))
        row["previews"] = []
        for preview in change(t, levels):
            texels = preview.pop("texels")
            out = io.BytesIO()
            Image.fromarray(texels).save(out, "WEBP", quality=75)
            name = f"previews/{t}-{preview['level']}.webp"
            (served.folder / name).write_bytes(out.getvalue())
            height, width = texels.shape[:2]
            row["previews"].append(
                {"file": name, "width": width, "height": height, "bytes": len(out.getvalue()),
                 "difference": 3.0, "error": 3.0, **preview}
            )  # fmt: skip
    (served.folder / "hints.json").write_text(json.dumps(index))
    return read_served(db)


@pytest.fixture
def copy(interlaced_rooms: Path, tmp_path: Path) -> Path:
    """A copy of a database whose textures have up to 300 texels a side."""
    return Path(shutil.copytree(interlaced_rooms, tmp_path / "db"))


def finest_two(t: int, levels: list[Texels]) -> list[dict[str, Any]]:
    """Previews of the finest two levels."""
    count = len(levels)
    return [{"level": n, "texels": levels[n]} for n in range(max(count - 2, 0), count)]


def test_pictures_of_a_database(copy: Path, walk_file: Path) -> None:
    """Levels of a preview are means of 2 × 2 of its decoded texels; e of a run's state is that of
    the rendered picture."""
    served = write_previews(copy, finest_two)
    lossy = read_lossy(served)
    assert np.diff(lossy.first).tolist() == [2] * len(served.index["textures"])
    for t, row in enumerate(served.index["textures"]):
        for number, preview in enumerate(row["previews"]):
            with Image.open(served.folder / preview["file"]) as image:
                decoded = np.asarray(image.convert("RGB"))
            levels = read_preview(served, t, number)
            assert (levels[-1] == decoded).all()
            for below, above in pairwise(levels):
                height, width = below.shape[:2]
                blocks = above[: 2 * height, : 2 * width].reshape(height, 2, width, 2, 3)
                assert (below == blocks.sum(axis=(1, 3), dtype=np.int64) // 4).all()
    world = prepare(served, read_walk(walk_file), drawing=Drawing(lossy))
    run = simulate(world, POLICIES["best"], Conditions(2e5), 1 << 24)
    differs = np.flatnonzero((run.state != run.column).any(axis=1))
    assert len(differs)
    renderer = FrameRenderer(world, world.camera.height, samples=1)
    f = int(differs[len(differs) // 2])
    sight = renderer.look(world.track.eye[f], world.track.direction[f])
    apart = renderer.colors(sight, run.loaded[f], run.state[f]) - renderer.full(sight)
    e = float(np.sqrt(np.square(apart).mean(axis=2)).mean())
    assert run.error[f] == pytest.approx(e, rel=1e-4)
    plain = renderer.colors(sight, run.loaded[f], run.column[f]) - renderer.full(sight)
    assert float(np.sqrt(np.square(plain).mean(axis=2)).mean()) != pytest.approx(e, rel=1e-2)


def test_previews_with_the_texels_of_others_show(copy: Path, walk_file: Path) -> None:
    """Whatever the hints say of them, e tells."""

    def wrong(t: int, levels: list[Texels]) -> list[dict[str, Any]]:
        return [{**row, "texels": 255 - row["texels"]} for row in finest_two(t, levels)]

    error = []
    for change in (finest_two, wrong):
        world = prepare(write_previews(copy, change), read_walk(walk_file))
        error.append(simulate(world, POLICIES["best"], Conditions(2e5), 1 << 24).error.mean())
    assert error[1] > 2 * error[0]


def without_finest(db: Path, levels: int) -> Served:
    """Leaves out the finest levels of all `.ptm`s of a database whose previews have them."""
    served = read_served(db)
    index = json.loads((served.folder / "hints.json").read_text())
    for row in index["textures"]:
        file = served.folder / row["file"]
        texels = decode(file.read_bytes(), level=max(len(row["ends"]) - 1 - levels, 0))
        file.write_bytes(encode(texels))
        header = read_header(file.read_bytes())
        row["ends"] = [level.end for level in header.levels]
        row["height"], row["width"] = texels.shape[:2]
    (served.folder / "hints.json").write_text(json.dumps(index))
    return read_served(db)


@pytest.mark.parametrize("exact", [True, False])
def test_levels_that_exist_as_previews_only(copy: Path, walk_file: Path, exact: bool) -> None:
    """The reference has their decoded texels. Of a source that is its own exact form all columns
    are exact; other finest previews have no error either, but are no exact source."""

    def finest(t: int, levels: list[Texels]) -> list[dict[str, Any]]:
        row = {"level": len(levels) - 1, "texels": levels[-1], "difference": 0.0 if exact else 0.1}
        return [{**row, "exact": True} if exact else row]

    write_previews(copy, finest)
    served = without_finest(copy, 2)
    pyramids, lossy = read_pyramids(served), read_lossy(served)
    stock = catalogue_of(served, pyramids.differences, pyramids.mean)
    assert (stock.levels - stock.stored).tolist() == [2] * stock.texture_count
    assert (stock.levels == pyramids.levels).all()
    assert len(lossy.state) == (0 if exact else stock.texture_count)
    for t, row in enumerate(served.index["textures"]):
        with Image.open(served.folder / row["previews"][0]["file"]) as image:
            decoded = np.asarray(image.convert("RGB"))
        last = int(pyramids.levels[t]) - 1
        begin = int(pyramids.start[t, last])
        assert (pyramids.texel[begin : begin + decoded.size] == decoded.ravel()).all()
        assert (pyramids.size[t, last] == decoded.shape[1::-1]).all()
        texels = np.cumsum(pyramids.size[t, : last + 1].prod(axis=1))
        channels = 1 if row.get("light") is not None else 4
        assert (stock.memory[t, 1 : last + 2] == channels * texels).all()
    world = prepare(served, read_walk(walk_file), pyramids, drawing=Drawing(lossy))
    client, run = watched(world, "best", Conditions(1e7), 1 << 26)
    # Coarse levels of other previews differ from those of the `.ptm`.
    assert run.error[-1] == pytest.approx(0, abs=1e-6 if exact else 0.3)
    assert client.previews.whole.any()
    few = simulate(world, POLICIES["best-exact"], Conditions(1e7), 1 << 26)
    assert (few.column <= stock.stored).all()
    assert few.error[-1] > 0.1
    assert (client.exact >= client.column).all() or not exact


@pytest.mark.parametrize("damage", ["cut", "size", "level", "gone"])
def test_previews_that_cannot_be(copy: Path, damage: str) -> None:
    served = write_previews(copy, finest_two)
    index = json.loads((served.folder / "hints.json").read_text())
    row = index["textures"][0]["previews"][-1]
    file = served.folder / row["file"]
    if damage == "cut":
        file.write_bytes(file.read_bytes()[:40])
    if damage == "size":
        Image.new("RGB", (row["width"] + 2, row["height"])).save(file)
    if damage == "level":
        row["level"] -= 1
    if damage == "gone":
        file.unlink()
    (served.folder / "hints.json").write_text(json.dumps(index))
    with pytest.raises(DatabaseError) as fault:
        read_lossy(read_served(copy))
    assert fault.value.code == ("PTM-D005" if damage == "gone" else "PTM-D006")
    assert str(file.name) in str(fault.value.file)


def test_bytes_of_previews(copy: Path, walk_file: Path) -> None:
    """Received bytes are those of the files; what was shown is no waste."""
    world = prepare(write_previews(copy, finest_two), read_walk(walk_file))
    client, run = watched(world, "best", Conditions(2e5), 1 << 24)
    stock = client.world.catalogue
    assert client.previews.whole.any()
    loaded = sum(int(files.loaded.sum()) for files in client.files.values())
    assert loaded <= run.body <= loaded + sum(request.size for request in client.waiting)
    assert client.files[FileKind.PREVIEW].size.tolist() == stock.previews.bytes.tolist()
    assert 0 < run.useful <= run.body - run.documents
