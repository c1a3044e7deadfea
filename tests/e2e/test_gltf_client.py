"""Cells as glTF in three.js: the walk of `web/three-ptm` shows what rays see, within its memory."""

from __future__ import annotations

import base64
import io
import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "e2e"), str(ROOT / "benchmarks")]
from browsers import web  # noqa: E402
from likeness import likeness, outline  # noqa: E402
from render import Look, View, load, render  # noqa: E402

from ptmtools.cli.main import main  # noqa: E402
from ptmtools.output.served import read_served  # noqa: E402
from ptmtools.rendering.drawing import ViewOptions, draw_view  # noqa: E402
from ptmtools.site.content import SiteOptions, site_of  # noqa: E402
from ptmtools.site.conversion import lean_glb  # noqa: E402
from tests.e2e.conftest import make_museum  # noqa: E402
from tests.site.mirrors import mirror_site, mirrors_of  # noqa: E402
from tests.site.strips import EXPOSURE, EYES, compressed, lit_site, view_of  # noqa: E402
from tests.site.test_geometry import painted_glb  # noqa: E402
from tests.systems.apo.statues import write_rooms  # noqa: E402

#: What MeshBasicMaterial shows before a background of nothing.
LOOK = Look("none", sky=(0, 0, 0), mipmaps=True)
#: dB, outside edges.
LIKE = 30.0


@pytest.fixture(scope="module")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What is served of a museum without light in which not every cell sees all the others."""
    folder = tmp_path_factory.mktemp("rooms")
    model = make_museum(folder / "model", rooms=3)
    build = ["-q", "build-scene", str(model), "-o", str(folder / "db"), "-j", "1"]
    assert main([*build, "--light", "none"]) == 0
    return folder / "db" / "www"


def read(www: Path, name: str) -> dict[str, Any]:
    actual: dict[str, Any] = json.loads((www / name).read_text())
    return actual


def record_of(www: Path, cell: int) -> dict[str, Any]:
    return read(www, f"hints/c{cell:04d}.json")


def seen_from(www: Path, cell: int) -> tuple[list[int], dict[str, float]]:
    """The cells that a cell sees; for each texture of these, by its URL, how much of the view the
    cells cover that use it."""
    row, textures = record_of(www, cell), read(www, "hints.json")["textures"]
    share: dict[str, float] = {}
    for other, part in zip(row["visible"], row["ach"], strict=True):
        for texture in record_of(www, other)["textures"][0]:
            url = textures[texture]["file"]
            share[url] = share.get(url, 0) + max(part, row["floor"])
    return row["visible"], share


def test_three_js_shows_what_rays_see(three: Any, gltf_museum: Path) -> None:
    """With what can be seen from the viewpoint's cell, and nothing else."""
    www = gltf_museum / "www"
    index, scene = read(www, "hints.json"), load(gltf_museum)
    textures = {row["file"]: row for row in index["textures"]}
    width, height = 320, 240
    mirrored = []
    for place, viewpoint in enumerate(index["viewpoints"][:2]):
        walked = three.walk(www, viewpoint=place, width=width, height=height)
        assert walked.messages == ()
        (stay,) = walked.stays
        assert stay["cell"] == viewpoint["cell"]
        cells, share = seen_from(www, stay["cell"])
        records = {file for file in walked.files if file.startswith("hints/")}
        assert f"hints/c{stay['cell']:04d}.json" in records
        assert len(records) <= 3, "those whose boxes hold the eye"
        previews = {p["file"] for url in share for p in textures[url]["previews"]}
        assert walked.files & previews
        assert walked.files - records - previews == {
            "hints.json",
            *(f"gltf/c{cell:04d}.glb" for cell in cells),
            *share,
        }
        whole = {url: len(textures[url]["ends"]) - 1 for url in share}
        assert dict(stay["levels"]) == whole
        with Image.open(io.BytesIO(walked.png)) as image:
            shown = np.asarray(image.convert("RGB"))
        view = View.of_hint(viewpoint, width, height)
        own, edges = render(scene, view, LOOK, samples=2), outline(scene, view)
        actual = likeness(shown, own, edges, LOOK)
        assert actual.psnr > LIKE
        assert actual.stray == 0
        mirrored.append(likeness(shown[:, ::-1], own, edges, LOOK).psnr)
    assert min(mirrored) < LIKE - 10


def gpu_bytes(texture: dict[str, Any], level: int) -> int:
    """Texture memory of the pyramid up to a level; RGB is held as RGBA."""
    last = len(texture["ends"]) - 1
    halved = range(last - level, last + 1)
    return 4 * sum((texture["width"] >> k) * (texture["height"] >> k) for k in halved)


def test_three_js_shares_out_memory(three: Any, gltf_museum: Path) -> None:
    """By what covers the view, never more than there is, as counted at GL; without memory, the
    coarsest level. What a texture leaves of its part is the others'."""
    www = gltf_museum / "www"
    index = read(www, "hints.json")
    textures = {row["file"]: row for row in index["textures"]}
    _, share = seen_from(www, index["viewpoints"][0]["cell"])
    whole = sum(gpu_bytes(textures[url], len(textures[url]["ends"]) - 1) for url in share)
    half = whole // 2
    walked = three.walk(www, stays=[(None, half), (None, half // 4), (None, half), (None, 0)])
    assert walked.messages == ()
    most, less, again, none = walked.stays
    coarsest = sum(gpu_bytes(textures[url], 0) for url in share)
    for stay, budget in ((most, half), (less, half // 4), (again, half)):
        assert sorted(url for url, _ in stay["levels"]) == sorted(share)
        used = sum(gpu_bytes(textures[url], level) for url, level in stay["levels"])
        assert coarsest < used == stay["told"] == stay["counted"] <= budget
        levels = dict(stay["levels"])
        spare = max(gpu_bytes(textures[url], max(level - 1, 0)) for url, level in levels.items())
        for url, level in levels.items():
            part = (budget - 4 * spare) * share[url] / sum(share.values())
            finer = min(level + 1, len(textures[url]["ends"]) - 1)
            assert level == finer or gpu_bytes(textures[url], finer) > part * (1 - 1e-9)
    assert most["most"] <= half, "storage that is exchanged is there twice"
    assert again["most"] <= half
    assert less["counted"] < most["counted"] == again["counted"]
    assert {level for _, level in none["levels"]} == {0}


def test_three_js_frees_what_is_out_of_sight(three: Any, rooms: Path) -> None:
    """From cell to cell there is what the cell sees and no more; at last nothing."""
    cells = range(len(read(rooms, "hints.json")["cells"]))
    route = [cell for cell in cells if len(seen_from(rooms, cell)[0]) < len(cells)]
    assert len({tuple(sorted(seen_from(rooms, cell)[0])) for cell in route}) > 1
    route += route[:1]
    walked = three.walk(rooms, stays=[(cell, 1 << 40) for cell in route])
    assert walked.messages == ()
    for cell, stay in zip(route, walked.stays, strict=True):
        visible, share = seen_from(rooms, cell)
        assert stay["cell"] == cell
        assert stay["groups"] == len(visible)
        assert {url for url, _ in stay["levels"]} == set(share)
        assert stay["told"] == stay["counted"]
    alone = three.walk(rooms, stays=[(route[0], 1 << 40)]).stays[0]
    for stay in (walked.stays[0], walked.stays[-1]):
        assert sorted(stay["levels"]) == sorted(alone["levels"])
        for what in ("counted", "groups", "geometries"):
            assert stay[what] == alone[what]
    assert walked.left["bytes"] == walked.left["geometries"] == 0


HURRY = """
const walk = await Walk.open(renderer, "/www/hints.json");
const [here, there] = settings.cells;
const first = walk.enter(here);
await new Promise((resolve) => setTimeout(resolve, settings.after));
const second = walk.enter(there);
return { done: [await first, await second], groups: walk.shown.children.length,
         files: walk.textures.map(({ number }) => walk.index.textures[number].file) };
"""


@pytest.mark.parametrize("after", [0, 60])
def test_three_js_moves_on(three: Any, rooms: Path, after: int) -> None:
    """What a cell alone needed is called off when the viewer enters another."""
    seen = [set(seen_from(rooms, cell)[0]) for cell in range(len(list(rooms.glob("gltf/*.glb"))))]
    here, there = next((a, b) for a, at in enumerate(seen) for b, to in enumerate(seen) if at - to)
    actual, visit = three.run(HURRY, {"www": rooms}, cells=[here, there], after=after)
    assert visit.messages == []
    visible, share = seen_from(rooms, there)
    assert actual["done"][1] is True
    assert actual["groups"] == len(visible)
    assert set(actual["files"]) == set(share)
    if not after:
        assert actual["done"][0] is False
        alone = seen[here] - seen[there]
        assert not [path for path in visit.paths for cell in alone if f"c{cell:04d}.glb" in path]


def test_three_js_refuses_another_schema(three: Any, gltf_museum: Path, tmp_path: Path) -> None:
    www = Path(shutil.copytree(gltf_museum / "www", tmp_path / "www"))
    (www / "hints.json").write_text(json.dumps(read(www, "hints.json") | {"schema": 4}))
    assert "hints of schema 4, not 3" in " ".join(three.walk(www, width=64, height=64).messages)


def test_three_js_complains(three: Any, gltf_museum: Path, tmp_path: Path) -> None:
    """Of a cell and of a texture that are not there; the others are shown."""
    www = Path(shutil.copytree(gltf_museum / "www", tmp_path / "www"))
    cell = read(www, "hints.json")["viewpoints"][0]["cell"]
    visible, share = seen_from(www, cell)
    others = {t for other in visible[1:] for t in record_of(www, other)["textures"][0]}
    glb = f"gltf/c{cell:04d}.glb"
    ptm = read(www, "hints.json")["textures"][min(others)]["file"]
    assert ptm in share
    (www / glb).unlink()
    (www / ptm).unlink()
    walked = three.walk(www, width=64, height=64)
    printed = " ".join(walked.messages)
    assert f"{glb}: 404" in printed
    assert f"{ptm}: 404" in printed
    assert walked.stays[0]["groups"] == len(visible) - 1


EXAMPLE = """
<iframe style="border: 0" width="320" height="240"
  src="/node_modules/three-ptm/example/index.html?index=/www/hints.json&budget=1"></iframe>
<script type="module">
const frame = document.querySelector("iframe");
const pause = (ms) => new Promise((go) => setTimeout(go, ms));
const line = () => frame.contentDocument?.getElementById("status")?.textContent ?? "";
const seen = [];
for (let n = 0; n < 600 && !(seen.length > 9 && new Set(seen.slice(-9)).size === 1); n++) {
  await pause(100);
  if (/ [1-9][0-9]* cells in sight/.test(line())) seen.push(line());
}
await new Promise((drawn) => frame.contentWindow.requestAnimationFrame(drawn));
const paper = new OffscreenCanvas(32, 24).getContext("2d");
paper.drawImage(frame.contentDocument.querySelector("canvas"), 0, 0, 32, 24);
const colors = new Set(new Uint32Array(paper.getImageData(0, 0, 32, 24).data.buffer)).size;
await post("/done", JSON.stringify({ line: line(), colors }));
</script>
"""


def test_the_example_walks(three: Any, gltf_museum: Path, tmp_path: Path) -> None:
    """As it is shipped, beside the packages as npm installs them."""
    folders = three.folders()
    names = {
        "three": "three",
        "ptm-client": "client",
        "ptm-decoder": "decoder",
        "three-ptm": "adapter",
    }
    for name, folder in names.items():
        (tmp_path / name).symlink_to(folders[folder])
    served = {"node_modules": tmp_path, "www": gltf_museum / "www"}
    visit = web.visit(web.REPORTING + EXAMPLE, served)
    actual = json.loads(visit.body)
    index = read(gltf_museum / "www", "hints.json")
    first = index["viewpoints"][0]["cell"]
    visible, _ = seen_from(gltf_museum / "www", first)
    assert visit.messages == []
    assert actual["line"].startswith(f"cell {first}, {len(visible)} cells in sight, textures: ")
    assert actual["colors"] > 50


def test_three_js_shows_objects_as_modelled(
    three: Any, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """The files of a cell's objects follow it, and none of the simplified meshes stays."""
    folder = tmp_path_factory.mktemp("statues")
    model = write_rooms(folder / "model", 5)
    build = ["-q", "build-scene", str(model), "-o", str(folder / "db"), "-j", "1"]
    assert main([*build, "--light", "none"]) == 0
    www = folder / "db" / "www"
    rows = read(www, "hints.json")["meshes"]
    assert len(rows) == 2
    walked = three.walk(www, width=320, height=240, stays=[(0, 1 << 30)] * 2)
    assert walked.messages == ()
    cells, _ = seen_from(www, 0)
    own = [row["files"] for row in rows if row["cell"] in cells]
    assert {file for file in walked.files if file.startswith("gltf/m")} == {f[-1] for f in own}
    for stay in walked.stays:
        assert stay["groups"] == len(cells) + len(own)
    assert walked.left["bytes"] == walked.left["geometries"] == 0


@pytest.fixture(scope="module")
def lit_rooms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Databases of two rooms, ``lit`` with light at half of its exposure, and ``plain``."""
    pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")
    folder = tmp_path_factory.mktemp("lit")
    model = write_rooms(folder / "model", 3)
    build = ["-q", "build-scene", str(model), "-j", "1", "--backend", "embree"]
    for name, light in (("lit", "bake"), ("plain", "none")):
        assert main([*build, "-o", str(folder / name), "--light", light]) == 0
    hints = folder / "lit/www/hints.json"
    index = json.loads(hints.read_text())
    for cell in index["cells"]:
        cell["exposure"] = [0.5, 0.5, 0.5]
    hints.write_text(json.dumps(index))
    return folder


def test_three_js_shows_lightmaps(three: Any, lit_rooms: Path) -> None:
    """As `ptm render` draws them."""
    width, height = 320, 240
    walked = three.walk(lit_rooms / "lit/www", width=width, height=height)
    assert walked.messages == ()
    assert any("light~" in file for file in walked.files)
    with Image.open(io.BytesIO(walked.png)) as image:
        shown = np.asarray(image.convert("RGB")).astype(float)
    lit, plain = (
        draw_view(read_served(lit_rooms / name), ViewOptions(width=width, height=height))
        for name in ("lit", "plain")
    )
    error = [((shown - each.astype(float)) ** 2).mean() for each in (lit, plain)]
    assert 10 * np.log10(255**2 / error[0]) > LIKE - 3
    assert error[1] > 3 * error[0]


STRIPS = """
const walk = await Walk.open(renderer, "/www/hints.json");
const camera = new THREE.PerspectiveCamera(
  THREE.MathUtils.radToDeg(settings.angle), settings.width / settings.height, 0.05, 1000);
const scene = new THREE.Scene().add(walk.shown);
if (walk.surroundings) scene.add(walk.surroundings);
const pictures = [];
for (const [cell, eye] of settings.eyes.entries()) {
  camera.position.set(...eye);
  await walk.enter(cell);
  renderer.render(scene, camera);
  pictures.push([renderer.domElement.toDataURL("image/png"), walk.exposure]);
}
// Through the door, and back by a jump.
const exposures = [];
for (const [x, pause] of [[0.2, 0], [0, 0], [0, 60], [0, 1200], [3, 0]]) {
  await new Promise((resolve) => setTimeout(resolve, pause));
  await walk.update(new THREE.Vector3(x, 1.5, 0));
  exposures.push(walk.exposure);
}
walk.dispose();
return { pictures, exposures };
"""


@pytest.mark.parametrize(
    ("tone", "form"), [("neutral", compressed), ("agx", bytes), ("plain", bytes)]
)
def test_three_js_follows_the_formula_of_light(
    three: Any, lit_rooms: Path, tmp_path: Path, tone: str, form: Callable[[bytes], bytes]
) -> None:
    """Of lightmaps, of light at vertices, under a normal map, and around."""
    site = lit_site(
        site_of(lit_rooms / "plain", SiteOptions(pictures=False, opening=False)),
        lambda index: index["light"].update(tone=tone),
    )
    for name, entry in site.entries.items():
        if name.startswith("data/"):
            path = "hints.json" if "/index-" in name else name.removeprefix("data/")
            data = entry.read()
            (tmp_path / path).write_bytes(form(data) if name.endswith(".glb") else data)
    width, height = 320, 240
    angle = site.index["viewpoints"][0]["fieldOfView"]
    settings = {"width": width, "height": height, "angle": angle, "eyes": EYES}
    answer, visit = three.run(STRIPS, {"www": tmp_path}, **settings)
    assert visit.messages == []
    for eye, (png, exposed), expected in zip(EYES, answer["pictures"], EXPOSURE, strict=True):
        assert exposed == expected
        with Image.open(io.BytesIO(base64.b64decode(png.partition(",")[2]))) as image:
            shown = np.asarray(image.convert("RGB")).astype(float)
        wanted, parts = view_of(eye, angle, (width, height), expected, tone)
        apart = np.abs(shown - wanted).max(axis=2)
        unlike = {name for name, part in parts.items() if apart[part].max() > 3}
        # It does not shade unlit surfaces by their angle, nor choose a background without sky.
        assert unlike == {"unlit"} | ({"around"} if tone == "plain" else set())
    less, more = EXPOSURE
    before, *_, soon, late, after = answer["exposures"]
    assert (before, late, after) == (more, less, more)
    assert all(least <= part < most for least, part, most in zip(less, soon, more, strict=True))


PAINTED = """
const { CellLoader } = await import("three-ptm");
const answer = [];
for (const name of ["whole", "lean"]) {
  const shapes = [], materials = new Set(), paints = new Set();
  (await new CellLoader().load(`/www/${name}.glb`)).traverse(({ geometry, material }) => {
    if (!geometry) return;
    const { attributes: { position, color, ...others }, index } = geometry;
    const paint = color && [color.array.constructor.name, color.itemSize, color.normalized];
    const numbers = [position, index, ...(color ? [color] : [])].map(({ array }) => [...array]);
    shapes.push([material.vertexColors, paint, Object.keys(others), numbers]);
    materials.add(material);
    paints.add(color);
  });
  answer.push({ shapes, materials: materials.size, paints: paints.size });
}
return answer;
"""


def test_three_js_reads_the_colours_of_a_site(three: Any, tmp_path: Path) -> None:
    """As GLTFLoader reads those of the database; shapes of one look share material and colours."""
    whole, _ = painted_glb()
    for name, data in (("whole", whole), ("lean", lean_glb(whole))):
        (tmp_path / f"{name}.glb").write_bytes(data)
    (before, after), visit = three.run(PAINTED, {"www": tmp_path})
    assert visit.messages == []
    assert sorted(before["shapes"], key=str) == sorted(after["shapes"], key=str)
    assert sorted(painted for painted, *_ in after["shapes"]) == [False, True, True]
    assert (after["materials"], after["paints"]) == (2, 2), "painted and white"


MIRRORS = """
const pictures = [], textures = [];
for (const reflections of [true, false]) {
  const walk = await Walk.open(renderer, "/www/hints.json", { reflections });
  const camera = new THREE.PerspectiveCamera(
    THREE.MathUtils.radToDeg(settings.angle), settings.width / settings.height, 0.05, 1000);
  const scene = new THREE.Scene().add(walk.shown);
  camera.position.set(...settings.eye);
  await walk.enter(0);
  renderer.render(scene, camera);
  pictures.push(renderer.domElement.toDataURL("image/png"));
  textures.push(walk.textures.map(({ number }) => number));
  walk.dispose();
}
return { pictures, textures };
"""


def test_three_js_follows_the_formula_of_reflections(
    three: Any, lit_rooms: Path, tmp_path: Path
) -> None:
    """Of metal, flat and bent, of a floor, and of glass before a bright and a dark surface."""
    site = mirror_site(site_of(lit_rooms / "plain", SiteOptions(pictures=False, opening=False)))
    for name, entry in site.entries.items():
        if name.startswith("data/"):
            path = "hints.json" if "/index-" in name else name.removeprefix("data/")
            (tmp_path / path).write_bytes(entry.read())
    width, height = 320, 240
    angle = site.index["viewpoints"][0]["fieldOfView"]
    settings = {"width": width, "height": height, "angle": angle, "eye": EYES[0]}
    answer, visit = three.run(MIRRORS, {"www": tmp_path}, **settings)
    assert visit.messages == []
    expected, parts = mirrors_of(angle, EYES[0], (width, height), shaded=False)
    probe = len(site.index["textures"]) - 2
    for reflects, png, textures in zip(
        (True, False), answer["pictures"], answer["textures"], strict=True
    ):
        assert (probe in textures) is reflects
        with Image.open(io.BytesIO(base64.b64decode(png.partition(",")[2]))) as image:
            shown = np.asarray(image.convert("RGB")).astype(float)
        apart = np.abs(shown - expected).max(axis=2)
        alike = {name for name, part in parts.items() if apart[part].max() <= 3}
        assert alike == (parts.keys() if reflects else set())
