"""Objects with octree textures in the rooms of a walk."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import hurried

from ptmtools.output.served import read_served
from ptmtools.rendering.drawing import ViewOptions, draw_view, eye_of
from ptmtools.rendering.rays import Caster, RayCamera
from ptmtools.site.client import OVERHEAD, SURROUNDINGS
from ptmtools.site.content import Site, site_of
from ptmtools.site.entry import SiteEntry
from ptmtools_lab.allocation import best_step
from tests.site.conftest import OCTREES, PLAIN, Visiting, build
from tests.systems.apo.statues import write_rooms
from tests.web import node

HERE = Path(__file__).parent
WIDTH, HEIGHT = 320, 240
#: Levels of each octree that has been in view.
LEVELS = "window.ptm.walk.picture.renderer.statues?.levels ?? []"


@pytest.fixture(scope="module")
def database(statues_db: Path) -> Path:
    return statues_db


@pytest.fixture(scope="module")
def site(statues: Site) -> Site:
    return statues


def pose(database: Path, statue: int, away: float) -> tuple[np.ndarray, float]:
    """An eye in front of a statue, level with its middle, and its yaw in degrees."""
    row = read_served(database).index["octrees"][statue]
    middle = np.array(row["cube"]["low"]) + row["cube"]["side"] / 2
    inwards = 1.0 if middle[2] < 0 else -1.0
    return middle + [0, 0, inwards * away], 0.0 if inwards > 0 else 180.0


def address(eye: np.ndarray, yaw: float) -> str:
    return "#" + ",".join(f"{x:.4f}" for x in (*eye, yaw))


def test_they_are_drawn_as_by_render(visit: Visiting, site: Site, database: Path) -> None:
    served = read_served(database)
    eye, yaw = pose(database, 1, 0.9)
    angle = float(np.degrees(served.index["viewpoints"][0]["fieldOfView"]))
    options = ViewOptions(
        eye=(*np.round(eye, 4), yaw), field_of_view=angle, width=WIDTH, height=HEIGHT, lit=True
    )
    expected = draw_view(served, options)
    view = eye_of(served, options)
    camera = RayCamera(WIDTH, HEIGHT, view.field_of_view, WIDTH / HEIGHT, HEIGHT)
    sight = Caster(served.surfaces).look(camera, view.position, view.direction)
    shown = np.where(sight.triangle < 0, -1, served.surfaces.represented["octree"][sight.triangle])
    mask = inside = (shown == 1).reshape(HEIGHT, WIDTH)
    for dy in range(-3, 4):
        for dx in range(-3, 4):
            inside = inside & np.roll(mask, (dy, dx), (0, 1))
    assert inside.sum() > 0.1 * mask.size
    with visit(site, query=address(eye, yaw), width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete")
        assert visitor.page.evaluate(LEVELS)[1] >= 6
        picture = visitor.picture()
        assert visitor.messages == []
    error = ((picture[inside].astype(float) - expected[inside]) ** 2).mean()
    assert 10 * np.log10(255**2 / error) >= 38


def test_levels_follow_the_distance(visit: Visiting, site: Site, database: Path) -> None:
    far, yaw = pose(database, 0, 2.0)
    (file,) = (e.name for e in site.entries.values() if "statue_01" in e.name)
    with visit(site, query=address(far, yaw), width=80, height=60) as visitor:
        visitor.until("s.complete")
        asked = [v for v in visitor.visits if v.path.endswith(file)]
        assert len(asked) == 1  # seven levels at once
        assert asked[0].range
        visitor.page.set_viewport_size({"width": 1280, "height": 960})
        visitor.until(f"{LEVELS.replace('?? []', '')}[0] > 7")
        visitor.until("s.complete")
        assert len([v for v in visitor.visits if v.path.endswith(file)]) > 1


def test_a_context_that_is_lost(visit: Visiting, site: Site, database: Path) -> None:
    eye, yaw = pose(database, 1, 0.9)
    statue = slice(80, 160), slice(120, 200)
    with visit(site, query=address(eye, yaw), width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete")
        before = visitor.picture()[statue]
        assert np.ptp(before) > 10  # lit
        levels = visitor.page.evaluate(LEVELS)[1]
        visitor.lose_context()
        visitor.restore_context()
        visitor.until(f"({LEVELS})[1] >= {levels}")
        visitor.complete()
        after = visitor.picture()[statue]
        assert np.abs(after.astype(int) - before).max() <= 2


CODES = {"cut": "PTM-V104", "other": "PTM-V105", "missing": "PTM-V103", "empty": "PTM-V103"}


@pytest.mark.parametrize("damage", CODES)
def test_a_damaged_octree_leaves_the_walk(
    visit: Visiting, site: Site, database: Path, damage: str
) -> None:
    eye, yaw = pose(database, 0, 0.9)
    (name,) = (n for n in site.entries if "statue_01" in n)
    entries: dict[str, SiteEntry] = dict(site.entries)
    data = entries[name].read()
    changed = {"cut": data[:99], "other": data[:50] + bytes(99) + data[149:], "empty": b""}
    if damage == "missing":
        del entries[name]
    else:
        entries[name] = SiteEntry(name, changed[damage], entries[name].media)
    damaged = Site(entries, site.index)
    with visit(damaged, query=address(eye, yaw), prepare=hurried) as visitor:
        visitor.page.wait_for_function("window.ptm?.errors.length > 0", timeout=90_000)
        assert visitor.page.evaluate("window.ptm.errors[0].code") == CODES[damage]
        visitor.until("s.complete")
        assert not visitor.page.is_visible("#error")
        asked = len([v for v in visitor.visits if v.path.endswith(name)])
        assert asked == {"missing": 1, "empty": 1, "other": 2, "cut": 6}[damage]


def test_a_level_that_fails_later_leaves_those_before(
    visit: Visiting, site: Site, database: Path
) -> None:
    eye, yaw = pose(database, 0, 0.9)
    (name,) = (n for n in site.entries if "statue_01" in n)
    row = site.index["octrees"][0]
    data = site.entries[name].read()
    end = row["ends"][6]
    spoilt = data[:end] + bytes(len(data) - end)
    entries = {**site.entries, name: SiteEntry(name, spoilt, site.entries[name].media)}
    with visit(Site(entries, site.index), query=address(eye, yaw)) as visitor:
        visitor.page.wait_for_function("window.ptm?.errors.length > 0", timeout=90_000)
        assert visitor.page.evaluate(LEVELS)[0] == 7
        visitor.until("s.complete")


def test_a_wrong_row_leaves_the_walk(visit: Visiting, site: Site, database: Path) -> None:
    eye, yaw = pose(database, 0, 0.9)
    (name,) = (n for n in site.entries if "/index-" in n)
    document = json.loads(site.entries[name].read())
    del document["octrees"][0]["cube"]
    entries = {
        **site.entries,
        name: SiteEntry(name, json.dumps(document).encode(), "application/json"),
    }
    with visit(Site(entries, site.index), query=address(eye, yaw)) as visitor:
        visitor.until("s.complete")
        assert visitor.page.evaluate("window.ptm.errors[0].code") == "PTM-V105"


def test_it_begins_without_textures(visit: Visiting, tmp_path: Path) -> None:
    model = write_rooms(tmp_path / "model", 4)
    for file in model.parent.glob("*.mtl"):
        lines = file.read_text().splitlines()
        file.write_text("\n".join(line for line in lines if "map_" not in line))
    build(model, tmp_path / "db", *OCTREES)
    eye, yaw = pose(tmp_path / "db", 1, 0.9)
    plain = site_of(tmp_path / "db", PLAIN)
    with visit(plain, query=address(eye, yaw), width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete", 60)
        assert visitor.page.evaluate(LEVELS)[1] > 0
        visitor.complete()
        assert np.ptp(visitor.picture()[80:160, 120:200]) > 10
        assert visitor.messages == []


def test_freezing_and_comparing(visit: Visiting, site: Site, database: Path) -> None:
    near, yaw = pose(database, 1, 0.9)
    far, turned = pose(database, 0, 1.6)
    (name,) = (n for n in site.entries if "statue_02" in n)
    with visit(site, query=address(far, turned), width=WIDTH, height=HEIGHT) as visitor:
        visitor.until("s.complete")
        visitor.page.evaluate("window.ptm.freeze(true)")
        go = f"window.ptm.goTo({{eye: {near.tolist()}, yaw: {np.radians(yaw)}, pitch: 0}})"
        visitor.page.evaluate(go)
        visitor.frames(60)
        assert not any(v.path.endswith(name) for v in visitor.visits)
        visitor.page.evaluate("window.ptm.freeze(false)")
        visitor.until(f"({LEVELS})[1] > 0 && s.complete")
        visitor.page.evaluate("window.ptm.compare(true)")
        visitor.page.wait_for_function("window.ptm.walk.comparison")
        visitor.until("s.complete")
        picture = visitor.picture()[100:140].astype(int)
        halves = picture[:, 140:159], picture[:, 162:181]
        assert abs(halves[0].mean() - halves[1].mean()) < 12  # both lit


def test_other_sites_do_not_load_the_script(
    visit: Visiting, site: Site, museum: Site, database: Path
) -> None:
    def loads(of: Site) -> bool:
        with visit(of, width=64, height=48) as visitor:
            visitor.until("s.complete")
            return any(v.path.endswith("statues.js") for v in visitor.visits)

    assert loads(site)
    assert not loads(museum)


def expected_order(case: dict[str, Any]) -> list[list[Any]]:
    """The requests of the simulator, of which each takes the step of most worth for its bytes."""
    rows = [case["texture"], case["octree"]]
    shares = [case["sight"] + SURROUNDINGS, case["share"]]
    worth = [np.array([0, *np.maximum(row["differences"], 0.5)]) * share
             for row, share in zip(rows, shares, strict=True)]  # fmt: skip
    ends = [np.array([0, *row["ends"]]) for row in rows]
    have, order = [0, case["there"]], []
    while any(have[k] + 1 < len(ends[k]) for k in range(2)):
        steps = [
            best_step(worth[k], ends[k], have[k], ends[k][have[k]] - OVERHEAD, len(ends[k]) - 1)
            for k in range(2)
        ]
        first = int(steps[1][0] > steps[0][0])
        have[first] = int(steps[first][1])
        order.append([bool(first), have[first]])
    return order


def test_levels_and_textures_come_by_worth() -> None:
    """With `?octrees=best`, as for `best+apo`: the greater worth for its bytes first, of either."""
    random = np.random.default_rng(3)

    def row(levels: int) -> dict[str, Any]:
        ends = np.cumsum(random.integers(1, 900, levels) + 10)
        return {"ends": ends.tolist(), "differences": random.uniform(0, 60, levels).tolist()}

    cases = [
        {"texture": row(7), "octree": row(9), "there": int(random.integers(1, 8)),
         "sight": float(random.uniform(0, 0.5)), "share": float(random.uniform(0, 0.5))}
        for _ in range(100)
    ]  # fmt: skip
    actual = json.loads(node.run(HERE / "levels.mjs", json.dumps(cases)))
    assert actual == [expected_order(case) for case in cases]
    first = [order[0][0] for order in actual]
    assert 20 < sum(first) < 80
    assert any(a[0] < b[0] for order in actual for a, b in pairwise(order))  # they take turns


def test_all_levels_come_by_worth(visit: Visiting, site: Site, database: Path) -> None:
    """On the page: those of little worth together with one of great worth behind them."""
    (name,) = (n for n in site.entries if "/index-" in n)
    document = json.loads(site.entries[name].read())
    row = document["octrees"][0]
    assert len(row["differences"]) == len(row["ends"])
    assert max(row["differences"]) > 1
    row["differences"] = [255.0 * (k == 7) for k in range(len(row["ends"]))]
    index = SiteEntry(name, json.dumps(document).encode(), "application/json")
    eye, yaw = pose(database, 0, 0.9)
    query = f"?octrees=best{address(eye, yaw)}"
    with visit(Site({**site.entries, name: index}, document), query=query) as visitor:
        visitor.until("s.complete")
        assert visitor.page.evaluate(LEVELS)[0] > 7
        assert visitor.messages == []
        asked = [v.range for v in visitor.visits if "statue_01" in v.path]
    assert int(str(asked[0]).rpartition("-")[2]) > row["ends"][6]
    # Another policy requests them as without the option.
    with visit(site, query=query.replace("?", "?policy=whole&")) as visitor:
        visitor.until("s.complete")
        asked = [v.range for v in visitor.visits if "statue_01" in v.path]
    assert asked[0] == f"bytes=2-{row['ends'][6] - 1}"


def test_glass_is_drawn_beside_them(visit: Visiting, tmp_path: Path) -> None:
    """In a building with lightmaps; glass has none."""
    pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")
    model = write_rooms(tmp_path / "model", 3)
    (model.parent / "two_rooms.mtl").open("a").write("newmtl glass\nKd 1 0 0\nd 0.5\n")
    count = sum(line.startswith("v ") for line in model.read_text().splitlines())
    pane = [f"v {x} {y} 0.3" for x, y in ((0.2, 0.1), (3.8, 0.1), (3.8, 2.9), (0.2, 2.9))]
    pane += ["o pane", "usemtl glass", "f " + " ".join(str(count + 1 + k) for k in range(4))]
    model.open("a").write("\n".join(pane) + "\n")
    light = ["--light", "bake", "--light-samples", "4", "--light-density", "4"]
    database = build(model, tmp_path / "db", *OCTREES, *light)
    (eye, yaw), served = pose(database, 0, 2.0), read_served(database)
    angle = float(np.degrees(served.index["viewpoints"][0]["fieldOfView"]))
    view = ViewOptions(eye=(*eye, yaw), field_of_view=angle, width=WIDTH, height=HEIGHT)
    expected = draw_view(served, view)[60, 250].astype(int)
    assert expected[0] > 2 * expected[1]
    query = address(eye, yaw)
    with visit(site_of(database, PLAIN), query=query, width=WIDTH, height=HEIGHT) as visitor:
        visitor.until(f"({LEVELS})[0] > 0")
        visitor.complete()
        assert np.abs(visitor.picture()[60, 250] - expected).max() <= 3
        assert visitor.messages == []
