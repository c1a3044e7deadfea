"""A site holds what its page names, under names that change with the contents."""

from __future__ import annotations

import hashlib
import io
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from ptmtools import schemas
from ptmtools.errors import DatabaseError, InputError
from ptmtools.output.emission import compress
from ptmtools.site import content, pictures as drawing
from ptmtools.site.about import MANIFEST
from ptmtools.site.content import Site, SiteOptions, site_of, title_of
from ptmtools.site.conversion import SiteTexture, lean_glb, web_texture, without_exact
from ptmtools.site.entry import is_marked, link_bytes
from ptmtools.site.files import DATA
from ptmtools.site.opening import parts_of
from ptmtools.site.program import ELEMENT, LATER, PROGRAM, attached_scripts
from ptmtools.site.publishing import weight_of
from ptmtools.texture import EncodeOptions, decode, decode_levels, encode, read_header

PLAIN = SiteOptions(pictures=False)
#: Bytes of the page itself, compressed.
LARGEST_PAGE = 56_400


def with_poster(database: Path) -> Site:
    """As a larger one has it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(content, "POSTER_SHARE", 10.0)
        return site_of(database)


@pytest.fixture(scope="module")
def site(two_rooms: Path) -> Site:
    return with_poster(two_rooms)


@pytest.fixture
def changed(two_rooms: Path, tmp_path: Path) -> Path:
    """A copy of the database, to be damaged."""
    shutil.copytree(two_rooms, tmp_path / "db")
    return tmp_path / "db"


@contextmanager
def refused(code: str) -> Iterator[None]:
    with pytest.raises((DatabaseError, InputError)) as raised:
        yield
    assert raised.value.code == code


def config_of(site: Site) -> Any:
    """What the page tells its script."""
    page = site.entries["index.html"].read().decode()
    actual = re.search(r'<script type="application/json" id="site">(.*?)</script>', page, re.DOTALL)
    assert actual
    return json.loads(actual[1])


def test_names_are_hashes(site: Site, two_rooms: Path) -> None:
    previews = set()
    for row in site.index["textures"]:
        files = [f"data/{preview['file']}" for preview in row.get("previews", ())]
        assert all(file in site.entries for file in files)
        # Those of a texture have one hash, which differs from those of others.
        marks = {re.fullmatch(r"data/[\w-]+-([0-9a-f]{10})\.\w+", file)[1] for file in files}  # type: ignore[index]
        assert len(marks) <= 1
        previews.update(files)
    assert previews
    for name, entry in site.entries.items():
        assert entry.name == name
        assert entry.forever is is_marked(name) is (name not in ("index.html", ELEMENT, MANIFEST))
        if name.startswith(DATA) and name not in previews and "/opening-" not in name:
            digest = hashlib.sha256(entry.read()).hexdigest()
            assert re.fullmatch(rf"data/[\w-]+-{digest[:10]}\.\w+", name)
    program = {name for name in site.entries if name.startswith("viewer-")}
    assert len({name.split("/")[0] for name in program}) == 1
    assert {name.split("/")[1] for name in program} == {*PROGRAM, *attached_scripts()}
    again = with_poster(two_rooms)
    assert {n: e.read() for n, e in again.entries.items()} == {
        n: e.read() for n, e in site.entries.items()
    }


def test_the_index(site: Site, two_rooms: Path) -> None:
    """What the index names is there, of the size that it tells; the rest is that of the hints."""
    config = config_of(site)
    data = site.entries[config["index"]].read()
    index = schemas.read(data, schemas.SITE)
    assert index == site.index
    hints = json.loads((two_rooms / "www" / "hints.json").read_bytes())
    for field in ("record", "geometry", "statistics"):
        assert field not in index
        hints.pop(field)
    for cell, was in zip(index["cells"], hints.pop("cells"), strict=True):
        record = site.entries[f"data/{cell.pop('record')}"]
        geometry = site.entries[f"data/{cell.pop('geometry')}"]
        assert record.read() == (two_rooms / f"www/hints/{cell['name']}.json").read_bytes()
        whole = (two_rooms / f"www/gltf/{cell['name']}.glb").read_bytes()
        assert geometry.read() == lean_glb(whole)
        assert cell.pop("recordBytes") == len(compress(record.read()))
        assert cell.pop("geometryBytes") == len(compress(geometry.read()))
        assert record.compressed
        assert geometry.compressed
        assert cell == was
    for row, was in zip(index["textures"], hints.pop("textures"), strict=True):
        texture = site.entries[f"data/{row['file']}"]
        assert texture.read() == (two_rooms / "www" / was["file"]).read_bytes()
        assert not texture.compressed
        assert (row["fallback"], row["fallbackLevel"]) == (None, None)
        same = was.keys() - {"file", "fallback", "fallbackLevel", "previews"}
        assert {name: row[name] for name in same} == {name: was[name] for name in same}
        assert ("previews" in row) == ("previews" in was)
        for preview, before in zip(row.get("previews", ()), was.get("previews", ()), strict=True):
            image = site.entries[f"data/{preview['file']}"]
            assert image.read() == (two_rooms / "www" / before["file"]).read_bytes()
            assert image.media == "image/webp"
            assert {**preview, "file": before["file"], "error": before["error"]} == before
    for row in index["viewpoints"]:
        row.pop("thumbnail")
    hints["format"] = index["format"]
    assert {name: index[name] for name in hints} == hints


def test_without_exact_levels(two_rooms: Path, site: Site) -> None:
    """Textures whose finest level a preview has keep only the coarsest levels in their `.ptm`."""
    never = site_of(two_rooms, SiteOptions(pictures=False, exact="never"))
    assert weight_of(never).whole < weight_of(site).whole
    cut = 0
    for row, whole in zip(never.index["textures"], site.index["textures"], strict=True):
        data = never.entries[f"data/{row['file']}"].read()
        levels = [*decode_levels(data)]
        before = [*decode_levels(site.entries[f"data/{whole['file']}"].read())]
        for level, expected in zip(levels, before, strict=False):
            assert np.array_equal(level, expected)
        assert row["ends"] == [level.end for level in read_header(data).levels]
        assert (row["height"], row["width"]) == levels[-1].shape[:2]
        finest = row["previews"][-1] if "previews" in row else None
        assert len(levels) == len(before) or (finest and finest["level"] == len(before) - 1)
        cut += len(levels) < len(before)
    assert cut
    schemas.read(never.entries[config_of(never)["index"]].read(), schemas.SITE)


def test_without_a_lossless_image(tmp_path: Path) -> None:
    """Where a lossy preview has the finest level, too."""
    images = (6, False), (7, False), (7, True)
    rows = [{"level": n, "width": 1 << n, "height": 1 << n, "exact": e} for n, e in images]
    row = {"width": 2, "height": 2, "ends": [9, 20], "previews": rows}
    texture = without_exact(tmp_path / "none.ptm", SiteTexture(row))
    assert (texture.row["previews"], texture.data) == (rows[:2], None)
    for previews in (rows[:2], [rows[0], rows[2]]):
        kept = SiteTexture(row | {"width": 1, "height": 1, "previews": previews, "ends": [9]})
        assert without_exact(tmp_path / "none.ptm", kept) is kept


def test_without_previews(two_rooms: Path) -> None:
    plain = site_of(two_rooms, SiteOptions(pictures=False, preview=False))
    assert not any("previews" in row for row in plain.index["textures"])
    assert not any(name.endswith(".webp") for name in plain.entries)


def test_the_page(site: Site, two_rooms: Path) -> None:
    config = config_of(site)
    page = site.entries["index.html"].read().decode()
    assert "{{" not in page
    for kind in ("index", "worker", "wasm", "poster"):
        assert config[kind] in site.entries
    assert f'<img id="poster" src="{config["poster"]}" alt="">' in page
    linked = re.findall(r'<link rel="preload" as="fetch" href="([^"]+)" crossorigin>', page)
    assert linked == [config["index"], config["wasm"]]
    (opening,) = re.findall(r'<link id="opening" rel="next" as="fetch" href="([^"]+)"', page)
    digest = hashlib.sha256(site.entries[opening].read()).hexdigest()
    mark = hashlib.sha256(digest.encode()).hexdigest()  # of the hashes of all, here one
    assert opening == f"data/opening-{mark[:10]}-0.bin"
    assert set(re.findall(r'src="(viewer-[^"]+)"', page)) <= site.entries.keys()
    odd = site_of(two_rooms, SiteOptions("</script><b>&", pictures=False))
    text = odd.entries["index.html"].read().decode()
    assert "<title>&lt;/script&gt;&lt;b&gt;&amp;</title>" in text
    assert config_of(odd)["title"] == "</script><b>&"
    plain = site_of(two_rooms, SiteOptions(pictures=False, opening=False))
    text = plain.entries["index.html"].read().decode()
    first = site.index["cells"][site.index["viewpoints"][0]["cell"]]
    assert all(f'href="data/{first[kind]}"' in text for kind in ("record", "geometry"))
    assert "data-views" not in text
    assert "<img" not in text  # without an address browsers show it as broken
    assert title_of(Path("a/old_town-hall.db")) == "Old town hall"


def test_pictures(site: Site) -> None:
    poster = site.entries[config_of(site)["poster"]].read()
    assert len(poster) <= drawing.POSTER.most
    image = Image.open(io.BytesIO(poster))
    assert (image.format, image.size) == ("JPEG", drawing.POSTER.size)
    # Not a blank one.
    assert np.asarray(image.convert("L")).std() > 5
    for row in site.index["viewpoints"]:
        small = site.entries[f"data/{row['thumbnail']}"].read()
        assert len(small) <= drawing.SMALL.most
        assert Image.open(io.BytesIO(small)).size == drawing.SMALL.size


def test_a_poster_heavier_than_the_building_is_not_shown(two_rooms: Path) -> None:
    """Link previews have it."""
    site = site_of(two_rooms)
    (picture,) = (name for name in site.entries if name.startswith("data/picture-"))
    assert config_of(site)["poster"] is None
    page = site.entries["index.html"].read().decode()
    assert f'<meta property="og:image" content="{picture}">' in page
    assert "<img" not in page
    unseen = {name: entry for name, entry in site.entries.items() if name != picture}
    assert weight_of(site) == weight_of(Site(unseen, site.index))


def test_the_poster_shows_the_first_viewpoint(two_rooms: Path, site: Site) -> None:
    """It is what the compiled renderer of the simulation draws there, but for the light."""
    from ptmtools.output.served import read_served
    from ptmtools.rendering.kernels import shade
    from ptmtools.rendering.pyramids import read_pyramids
    from ptmtools.rendering.rays import Caster, RayCamera
    from ptmtools.rendering.records import own_levels, triangles_of

    served = read_served(two_rooms)
    viewpoint = served.index["viewpoints"][0]
    camera = RayCamera(160, 90, viewpoint["fieldOfView"], 16 / 9)
    eye, direction = (np.array(viewpoint[name]) for name in ("position", "direction"))
    sight = Caster(served.surfaces).look(camera, eye, direction)
    sight = sight._replace(pixel=2 * np.tan(camera.field_of_view / 2) / 90)
    pyramids, shown = read_pyramids(served), np.empty((160 * 90, 3))
    triangles = triangles_of(served.surfaces)
    there = np.ones(served.cell_count, dtype=np.bool_)
    shade(sight, triangles, own_levels(pyramids), there, pyramids.levels, shown)
    picture = site.entries[config_of(site)["poster"]].read()
    poster = Image.open(io.BytesIO(picture)).resize((160, 90))
    textured = (sight.triangle >= 0) & (triangles.texture[sight.triangle] >= 0)
    assert textured.mean() > 0.2
    off = np.abs(np.asarray(poster, dtype=float).reshape(-1, 3) - shown)[textured]
    assert np.median(off) < 12
    assert off.mean() < 20


def test_pictures_of_others(two_rooms: Path, tmp_path: Path, monkeypatch: Any) -> None:
    file = tmp_path / "own.png"
    Image.new("RGB", (8, 8)).save(file)
    own = site_of(two_rooms, SiteOptions(poster=str(file), pictures=False))
    assert own.entries[config_of(own)["poster"]].read() == file.read_bytes()
    assert own.entries[config_of(own)["poster"]].media == "image/png"
    assert "thumbnail" not in own.index["viewpoints"][0]
    for name in ("model/two_rooms.obj", "gone.png"):
        with refused("PTM-I125"):
            site_of(two_rooms, SiteOptions(poster=str(two_rooms.parent / name), pictures=False))

    def without(served: object) -> None:
        raise ImportError("embreex")

    monkeypatch.setattr(drawing, "pictures", without)
    bare = site_of(two_rooms)
    assert config_of(bare)["poster"] is None
    assert any("embreex" in note for note in bare.notes)


def test_databases_that_have_no_site(changed: Path) -> None:
    with refused("PTM-D001"):
        site_of(changed / "gone")
    glb = next((changed / "www" / "gltf").iterdir())
    before = glb.read_bytes()
    glb.write_bytes(before[:-4] + b"\1\1\1\1")
    with refused("PTM-D006"):
        site_of(changed, PLAIN)
    glb.unlink()
    with refused("PTM-D005"):
        site_of(changed, PLAIN)
    glb.write_bytes(before)
    texture = next((changed / "www" / "textures").glob("*.ptm"))
    data = texture.read_bytes()
    for damage, code in ((data[:-1], "PTM-D006"), (b"x" * 99, "PTM-D006"), (None, "PTM-D005")):
        texture.unlink() if damage is None else texture.write_bytes(damage)
        with refused(code):
            site_of(changed, PLAIN)
    texture.write_bytes(data)
    manifest = json.loads((changed / "manifest.json").read_text())
    stage = manifest["stages"].pop("emit")
    (changed / "manifest.json").write_text(json.dumps(manifest))
    with refused("PTM-D004"):
        site_of(changed, PLAIN)
    manifest["stages"]["emit"] = stage
    (changed / "manifest.json").write_text(json.dumps({**manifest, "schema": 1}))
    with refused("PTM-D003"):
        site_of(changed, PLAIN)


def test_without_gltf(changed: Path, ptm: Any) -> None:
    assert ptm("emit", changed, "--format", "vrml").status == 0
    with refused("PTM-D606"):
        site_of(changed, PLAIN)
    assert ptm("emit", changed, "--format", "gltf").status == 0
    assert site_of(changed, PLAIN)
    with refused("PTM-D606"):
        site_of(changed, SiteOptions(pictures=False, clients="vrml"))


def test_for_vrml(two_rooms: Path, site: Site) -> None:
    both = site_of(two_rooms, SiteOptions(pictures=False, clients="vrml"))
    more = both.entries.keys() - site.entries.keys()
    assert {"root.wrl", "cells/c0000.wrl"} <= more
    assert any(name.endswith(".png") for name in more)
    assert not any(both.entries[name].forever for name in more if not name.startswith(DATA))
    assert weight_of(both).whole < sum(map(link_bytes, both.entries.values()))


@pytest.mark.parametrize(
    ("kind", "profile"),
    [("uint8", "small"), ("uint8", "raw"), ("uint16", "fast"), ("float32", "fast")],
)
def test_textures_that_browsers_do_not_read(tmp_path: Path, kind: str, profile: str) -> None:
    rng = np.random.default_rng(3)
    image = rng.integers(0, 256, (40, 56, 3)).astype(kind)
    if kind == "uint16":
        image = image * 257
    if kind == "float32":
        image = image / 255 * 1.5 - 0.2
    image = image.astype(kind)
    file = tmp_path / "a.ptm"
    file.write_bytes(encode(image, EncodeOptions(profile, min_side=4)))
    header = read_header(file.read_bytes())
    row = {
        "ends": [level.end for level in header.levels], "components": 3, "width": 56, "height": 40,
        "texelBytes": header.texel_bytes, "gpuTexelBytes": 4, "color": [0, 0, 0], "differences": [],
    }  # fmt: skip
    actual = web_texture(file, row)
    if profile == "raw":
        assert (actual.row, actual.data, actual.note) == (row, None, "")
        return
    assert actual.data
    assert "a.ptm" in actual.note
    new = read_header(actual.data)
    assert (new.profile, new.kind, new.version) == ("fast", "uint8", 2)
    assert [level.end for level in new.levels] == actual.row["ends"]
    assert [(o.width, o.height) for o in new.levels] == [(o.width, o.height) for o in header.levels]
    assert (actual.row["texelBytes"], actual.row["gpuTexelBytes"]) == (3, 4)
    scale = {"uint8": 1.0, "uint16": 1 / 257, "float32": 255.0}[kind]
    wanted = np.clip(image.astype(float) * scale, 0, 255)
    assert np.abs(decode(actual.data) - wanted).max() <= 1
    coarsest = next(iter(decode_levels(actual.data))).reshape(-1, 3).mean(axis=0)
    offset = actual.row["offsets"][0]
    assert offset > 0
    assert np.abs(coarsest + offset - actual.row["color"]).max() <= 1


#: The product alone, as if the other packages were not installed.
ALONE = """
import sys
from pathlib import Path
from ptmtools import plugins

points = plugins.points
plugins.points = lambda kind: {
    name: point for name, point in points(kind).items() if not point.value.startswith("ptmtools_")
}
sys.modules |= dict.fromkeys(("ptmtools_systems", "ptmtools_lab", "ptmtools_samples"))
from ptmtools.site.content import SiteOptions, site_of

site = site_of(Path(sys.argv[1]), SiteOptions(pictures=False))
print(*sorted(name.split("/")[1] for name in site.entries if name.startswith("viewer-")))
"""


def test_the_product_alone(two_rooms: Path) -> None:
    """It publishes a walk without the scripts of other packages."""
    command = [sys.executable, "-c", ALONE, two_rooms]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.split() == sorted(PROGRAM)


def test_weight(site: Site) -> None:
    """Sums of what is on the disk."""
    weight = weight_of(site)
    sizes = {name: link_bytes(entry) for name, entry in site.entries.items()}
    later = tuple(f"/{name}" for name in (*LATER, *attached_scripts()))
    needed = [name for name in sizes if not name.endswith(later)]
    beside = "data/icon-", "data/vp-", "data/opening-"
    assert {prefix for prefix in beside for name in sizes if name.startswith(prefix)} == {*beside}
    needed = [n for n in needed if n not in (ELEMENT, MANIFEST) and not n.startswith(beside)]
    assert weight.page == sum(sizes[name] for name in needed if not name.startswith("data/"))
    (begin,) = (name for name in sizes if name.startswith("data/opening-"))
    separate = 0
    for kind, number, size in parts_of(site.entries[begin].read()):
        in_cell = kind in ("record", "geometry")
        separate += site.index["cells"][number][f"{kind}Bytes"] if in_cell else size
    assert weight.whole == sum(sizes[name] for name in needed) - separate + sizes[begin]
    row = site.index["cells"][site.index["viewpoints"][0]["cell"]]
    record = json.loads(site.entries[f"data/{row['record']}"].read())
    room = sizes[f"data/{row['record']}"] + sizes[f"data/{row['geometry']}"]
    for texture in record["textures"][0]:
        header = read_header(site.entries[f"data/{site.index['textures'][texture]['file']}"].read())
        room += max(o.end for o in header.levels if max(o.width, o.height) <= 64)
    config = config_of(site)
    assert (
        weight.first_room == weight.page + sizes[config["index"]] + sizes[config["poster"]] + room
    )
    assert weight.mean_room <= weight.worst_room
    assert weight.page < LARGEST_PAGE


def test_hints_of_an_earlier_release(changed: Path) -> None:
    """The manifest lists them as they are, without what came later."""
    hints, manifest = changed / "www" / "hints.json", changed / "manifest.json"
    document = json.loads(hints.read_text())
    for row in document["textures"]:
        del row["color"]
    before = hashlib.sha256(hints.read_bytes()).hexdigest()
    hints.write_text(json.dumps(document))
    after = hashlib.sha256(hints.read_bytes()).hexdigest()
    manifest.write_text(manifest.read_text().replace(before, after))
    with refused("PTM-D003"):
        site_of(changed)
