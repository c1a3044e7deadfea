"""Interlaced images as the textures of a walk: `?form=gpuii`."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.errors import DatabaseError
from ptmtools.link import Conditions
from ptmtools.output.emitters import is_other_form
from ptmtools.output.served import read_served
from ptmtools.rendering.pyramids import read_pyramids
from ptmtools.site.content import Site, site_of
from ptmtools.site.entry import SiteEntry, is_marked
from ptmtools.site.publishing import weight_of
from ptmtools.site.serving import serving
from ptmtools.site.throttle import Throttle
from ptmtools.walk import parse_walk
from ptmtools_lab.policies import POLICIES
from ptmtools_lab.simulation import simulate
from ptmtools_lab.tables import Drawing
from ptmtools_lab.world import prepare, read_forms
from ptmtools_systems.interlace import deinterlace
from tests.scene.bumpy import write_bumpy
from tests.site.conftest import PLAIN, Visiting, build
from tests.site.test_forms import check_texels
from tests.site.test_offline import browsing, forget, open_page, picture_of, wait_for
from tests.site.test_recording import AT_ONCE

GPUII = "?form=gpuii"
#: Whether texture memory is as the client wants it.
SETTLED = "s.complete && s.held.every((held, t) => held === ptm.walk.client.column[t])"
#: Whether the browser keeps the page and the data that it has requested.
KEEPS = """
async () => {
  const files = performance.getEntriesByType("resource").map(({ name }) => name);
  const data = files.filter((name) => name.includes("/data/"));
  const kept = await Promise.all(["./", ...data].map((name) => caches.match(name)));
  return data.some((name) => name.includes("/sets/0")) && kept.every(Boolean);
}
"""
#: The addresses in the order in which the page asks for them: `window.asked`.
LISTENING = """
{
  const request = window.fetch;
  window.asked = [];
  window.fetch = (url, ...more) => {
    window.asked.push(String(url));
    return request(url, ...more);
  };
}
"""
#: The texels of an image, and how many steps make it.
TEXELS = """(t) => {
  const { memory } = window.ptm.walk, { texels } = memory.texels(t);
  let text = "";
  for (const byte of texels) text += String.fromCharCode(byte);
  return [memory.held[t], btoa(text)];
}"""


@pytest.fixture(scope="module")
def hall_db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A museum of four rooms with interlaced images of five files each."""
    folder = tmp_path_factory.mktemp("sets")
    words = ["-o", folder / "model", "--rooms", 4, "--textures", 8, "--size", 512]
    command = [sys.executable, "-m", "ptmtools", "sample", "museum", *words]
    subprocess.run([str(word) for word in command], check=True, capture_output=True, timeout=300)
    model = folder / "model" / "museum.obj"
    return build(model, folder / "hall.db", "--format", "gltf,interlace", "--samples", "1")


@pytest.fixture(scope="module")
def hall(hall_db: Path) -> Site:
    return site_of(hall_db, PLAIN)


def document(site: Site) -> Any:
    return json.loads(site.entries[f"data/{site.index['sets']}"].read())


def files(paths: list[str]) -> list[tuple[int, int]]:
    """Texture and step, from 1, of each file of a set that was requested."""
    names = [path.rpartition("/")[2] for path in paths if "/sets/" in path and ".json" not in path]
    return [(int(number), int(step)) for number, step, _ in (name.split("-") for name in names)]


def test_images_are_joined_exactly(visit: Visiting, hall: Site, hall_db: Path) -> None:
    """The steps of each texture are those of `ptm deinterlace`, also after memory was scarce."""
    folders = {
        t: hall_db / "www" / "interlace" / Path(row["file"]).stem
        for t, row in enumerate(read_served(hall_db).index["textures"])
    }
    with visit(hall, query=GPUII, width=640, height=480) as visitor:
        assert visitor.complete()["policy"] == "gpuii"
        full = visitor.until(SETTLED)
        for megabytes in (64, 1.5, 64):
            visitor.page.evaluate(f"window.ptm.setBudget({megabytes} * 2 ** 20)")
            # The client's budget is that at its last look, at least half of the page's.
            share = "ptm.walk.client.budget / s.budgetBytes"
            visitor.until(f"{share} <= 1 && {share} >= 0.5 && {SETTLED}")
            held = visitor.state()["held"]
            assert sum(held) < sum(full["held"]) if megabytes == 1.5 else held == full["held"]
            assert visitor.state()["residentBytes"] <= megabytes * 2**20
            for t in np.flatnonzero(held).tolist():
                steps, texels = visitor.page.evaluate(TEXELS, t)
                assert steps == held[t]
                data = np.frombuffer(base64.b64decode(texels), np.uint8)
                check_texels(data, deinterlace(folders[t], steps))
        assert max(full["held"]) == 5
        assert visitor.messages == []
    asked = files([v.path for v in visitor.visits])
    assert len(asked) == len(set(asked)), "no file is requested twice"
    assert not [v for v in visitor.visits if v.path.endswith(".ptm")]


def test_the_order_of_files(visit: Visiting, hall: Site) -> None:
    """By step in the ring around the visitor: first files of all textures there come first.

    Requests that are open together reach the server in any order; the page's own order counts.
    """

    def listen(page: Any) -> None:
        page.add_init_script(LISTENING)

    with visit(hall, query=GPUII, throttle=Throttle(2e6, 0.02), prepare=listen) as visitor:
        visitor.complete()
        asked = files(visitor.page.evaluate("window.asked"))
    for texture in {t for t, _ in asked}:
        steps = [step for t, step in asked if t == texture]
        assert steps == list(range(1, len(steps) + 1))
    # Six requests are made at a time, and there are more textures in the first ring.
    near = {t for t, _ in asked[:6]}
    steps = [step for t, step in asked if t in near]
    assert len(near) == 6
    assert steps == sorted(steps), asked
    assert max(steps) > 2


def test_normal_maps_come_after_the_colours_of_a_room(visit: Visiting, tmp_path: Path) -> None:
    model = write_bumpy(tmp_path / "model")
    words = ["--format", "gltf,interlace", "--samples", "1"]
    site = site_of(build(model, tmp_path / "bumpy.db", *words), PLAIN)
    bumps = {t for t, row in enumerate(site.index["textures"]) if row.get("normals")}
    with visit(site, query=GPUII, width=640, height=480) as visitor:
        visitor.complete()
        visitor.until(SETTLED)
        visitor.until("ptm.walk.picture.renderer.statues?.levels[0] > 0")
        held = visitor.state()["held"]
        assert visitor.messages == []
    seen = {t for t in bumps if held[t]}
    assert seen
    asked = [t for t, _ in files([v.path for v in visitor.visits])]
    first = min(asked.index(t) for t in seen)
    assert first > 0
    assert set(asked[:first]).isdisjoint(bumps)


def test_without_a_network(chromium: Any, hall_db: Path) -> None:
    """The same images and picture as on the visit before."""
    site = site_of(hall_db, replace(PLAIN, offline=True))
    with browsing(chromium) as context:
        with serving(site.entries) as url, open_page(context, url + GPUII) as visitor:
            held = visitor.until(SETTLED)["held"]
            before = picture_of(visitor)
            assert max(held) > 1
            wait_for(visitor, KEEPS)
            forget(visitor)
        with open_page(context, url + GPUII) as visitor:
            visitor.until(f"{SETTLED} && s.held.join() === '{','.join(map(str, held))}'")
            assert np.array_equal(picture_of(visitor), before)
            assert visitor.page.evaluate("ptm.errors") == []
        assert visitor.messages == []


def test_a_site_without_sets(visit: Visiting, museum: Site) -> None:
    with visit(museum, query=GPUII) as visitor:
        visitor.page.wait_for_selector("#notices :text('no interlaced images')")
        assert visitor.complete()["policy"] == "best"
        assert visitor.picture().std() > 5


def test_who_does_not_ask_loads_nothing(visit: Visiting, hall: Site) -> None:
    with visit(hall) as visitor:
        visitor.complete()
        paths = [v.path for v in visitor.visits]
    assert [path for path in paths if "sets" in path] == []
    without = {name: entry for name, entry in hall.entries.items() if not is_other_form(name)}
    assert weight_of(hall) == weight_of(replace(hall, entries=without))
    assert all(is_marked(name) for name in hall.entries if is_other_form(name))


def test_other_policies_are_refused(visit: Visiting, hall: Site) -> None:
    with visit(hall, query=GPUII) as visitor:
        visitor.complete()
        visitor.page.evaluate("window.ptm.setPolicy('paper')")
        visitor.page.wait_for_selector("#notices :text('interlaced')")
        visitor.page.evaluate("window.ptm.compare(true)")
        assert visitor.complete()["policy"] == "gpuii"


def test_a_lost_context_comes_back(visit: Visiting, hall: Site) -> None:
    with visit(hall, query=GPUII) as visitor:
        before = visitor.complete()["held"]
        picture = visitor.picture()
        visitor.lose_context()
        visitor.restore_context()
        visitor.until(f"s.complete && s.held.join() === '{','.join(map(str, before))}'")
        assert np.abs(visitor.picture().astype(int) - picture).max() <= 2


def damaged(site: Site, changes: Mapping[str, Any]) -> dict[str, SiteEntry]:
    """A site whose files end so; each change takes the bytes of a file."""
    entries = dict(site.entries)
    for end, change in changes.items():
        (name,) = (name for name in entries if is_other_form(name) and end in name)
        entries[name] = replace(entries[name], source=change(entries[name].read()), state=None)
    return entries


def test_damaged_files(visit: Visiting, hall: Site) -> None:
    """A file is reported, and the image keeps the steps before it."""
    broken = replace(hall, entries=damaged(hall, {"/0001-3-": lambda data: data[:-9] + bytes(9)}))
    with visit(broken, query=GPUII) as visitor:
        visitor.until("s.held?.[1] === 2 && s.complete")
        assert visitor.page.evaluate("window.ptm.errors.map(({ code }) => code)") == ["PTM-V105"]


def _narrow(one: dict[str, Any]) -> dict[str, Any]:
    return {**one, "manifest": {**one["manifest"], "width": 7}}


@pytest.mark.parametrize(
    "change",
    [
        lambda d: {**d, "schema": 2},
        lambda d: {**d, "sets": d["sets"][1:]},
        lambda d: {**d, "sets": [{}, *d["sets"][1:]]},
        lambda d: {**d, "sets": [{**s, "files": []} for s in d["sets"]]},
        lambda d: {**d, "sets": [_narrow(s) for s in d["sets"]]},
    ],
    ids=["schema", "textures", "no manifest", "no names", "size"],
)  # fmt: skip
def test_a_damaged_document(visit: Visiting, hall: Site, change: Any) -> None:
    text = json.dumps(change(document(hall))).encode()
    broken = replace(hall, entries=damaged(hall, {"/sets-": lambda _: text}))
    with visit(broken, query=GPUII) as visitor:
        visitor.page.wait_for_selector("#error:not([hidden])")
        assert visitor.page.text_content("#error-code") == "PTM-V105"


def test_a_damaged_manifest(hall_db: Path, tmp_path: Path) -> None:
    database = Path(shutil.copytree(hall_db, tmp_path / "db"))
    file = min((database / "www" / "interlace").glob("*/interlace.json"))
    file.write_text(file.read_text().replace('"width"', '"wide"'))
    with pytest.raises(DatabaseError, match="PTM-D006"):
        site_of(database, PLAIN)


def test_a_recording_replays(visit: Visiting, hall: Site, hall_db: Path) -> None:
    """The simulator requests the same files of the same bytes."""
    link = Throttle(2e6, 0.05)
    prepared = {"prepare": lambda page: page.add_init_script(AT_ONCE), "throttle": link}
    with visit(hall, query=GPUII, width=320, height=240, **prepared) as visitor:
        visitor.until("s.complete")
        visitor.go(1)
        recording = visitor.page.evaluate("window.ptm.recording")
        asked = [v for v in visitor.visits if v.path.startswith("/data/")]
        assert visitor.messages == []
    walk = parse_walk(json.dumps(recording).encode())
    assert walk.browser
    assert walk.browser.policy == "gpuii"
    served = read_served(hall_db)
    pyramids = read_pyramids(served)
    forms = read_forms(served, pyramids, ["interlaced"])
    world = prepare(served, walk, pyramids, drawing=Drawing(forms=forms))
    conditions = Conditions(link.bandwidth, link.latency)
    run = simulate(world, POLICIES["gpuii"], conditions, walk.browser.budget)
    own = [v for v in asked if "/sets-" not in v.path]
    assert run.requests == pytest.approx(len(own), rel=0.1)
    assert run.body == pytest.approx(sum(v.bytes for v in own), rel=0.1)
    steps = dict.fromkeys(t for t, _ in files([v.path for v in asked]))
    for t in steps:
        last = max(step for number, step in files([v.path for v in asked]) if number == t)
        assert abs(int(run.column[:, t].max()) - last) <= 1
