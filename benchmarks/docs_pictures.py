"""Draws the pictures of the docs: ``python benchmarks/docs_pictures.py build/museum.db``

Reads the database of the sample museum and its images (`make sample`), and writes to
``docs/pictures``:

plan.png     both floors, with the area visible from the middle room shaded by coverage hints
levels.jpg   a painting at the levels that it shows while the `.ptm` arrives
view.jpg     the view from a viewpoint with the first levels of all textures, and with all of them,
             by rays cast at the model
walk.jpg     the page of `ptm serve` in Chromium, with the map and the details open
door-*.png   two rooms with a door leaf in the doorway; a closed door makes one unreachable
interlace.jpg  two paintings at an eighth and a quarter of their sides: means of texels (a level of
             the `.ptm`) beside the texels of the first interlaced files, with bytes and PSNR
light.jpg    the same view with `--light none` and with light, as `ptm render` draws it
gloss.jpg    two rooms of the sample lit-hall likewise, whose floors and metals reflect
apo.jpg      a bust as modelled, simplified, and with some levels of its octree
"""

from __future__ import annotations

import argparse
import io
import json
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "benchmarks"))
from interlace import box, by_files, by_ptm, psnr  # noqa: E402
from ptmtools_samples.options import StatueOptions  # noqa: E402
from ptmtools_samples.statues.model import make_statue  # noqa: E402
from render import LOOKS, View, load, render  # noqa: E402

from ptmtools import texture  # noqa: E402
from ptmtools.cli.main import main as command  # noqa: E402
from ptmtools.output.served import read_served  # noqa: E402
from ptmtools.parallel import open_executor  # noqa: E402
from ptmtools.rendering.drawing import ViewOptions, draw_view  # noqa: E402
from ptmtools.scene.model import Material, Scene  # noqa: E402
from ptmtools.scene.orientation.main_axes import tolerance_of  # noqa: E402
from ptmtools.texture import read_image  # noqa: E402
from ptmtools_systems.apo.making import make_apo, smooth, weld  # noqa: E402
from ptmtools_systems.apo.model import ApoOptions  # noqa: E402
from ptmtools_systems.apo.picture import RenderOptions, render as draw_octree  # noqa: E402

PICTURES = ROOT / "docs" / "pictures"
TWO_ROOMS = ROOT / "sample_data/two_rooms"
#: The room whose visible set is shaded, and the viewpoint that is shown.
CELL, VIEWPOINT = 9, 5
PAINTING, LEVELS, SIDE = "painting_09", (4, 6, 8, 10), 240
#: The viewpoint without and with light.
LIT = 2
#: Eyes and points to look at in the lit hall.
GLOSSY = (((4.0, 1.7, 3.2), (-1.5, 1.3, -3.5)), ((-6.5, 1.7, 2.5), (-13.2, 1.5, -3.0)))
#: The coarse picture has textures of 2⁵ texels a side.
COARSE, WIDTH, HEIGHT = 5, 480, 340
#: A door leaf that fills the doorway of the two rooms, as a line to add to the OBJ file.
DOOR_LEAF = "o door_leaf\nusemtl doorway\nf 9/1 14/2 12/3 11/4\n"
#: Of `interlace.jpg`.
PAINTINGS = ("painting_09", "painting_10")
DRAWN, GAP, CAPTION = 256, 8, 22
HALVINGS = (3, 2)
#: Of `apo.jpg`.
TRIANGLES, FACES = 400_000, 2_000
#: Levels of the octree beside the source and the simplified mesh.
OCTREE_LEVELS = (7, 8, 9, None)
#: Pixels of a panel, which is drawn larger by a factor.
PANEL_WIDTH, PANEL_HEIGHT, TIMES = 260, 330, 2


def ptm(*arguments: str) -> None:
    """Runs the command, quietly."""
    status = command([*arguments, "--quiet"])
    if status:
        sys.exit(status)


def levels(file: Path) -> Image.Image:
    """Some levels of a `.ptm` side by side at one size, with the bytes that they take to arrive."""
    sheet = Image.new("RGB", (len(LEVELS) * (SIDE + 10) - 10, SIDE + 24), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(13)
    with texture.open(file) as reader:
        for place, number in enumerate(LEVELS):
            texels = Image.fromarray(np.asarray(reader.level(number)))
            x = place * (SIDE + 10)
            sheet.paste(texels.resize((SIDE, SIDE), Image.Resampling.BILINEAR), (x, 0))
            level = reader.header.levels[number]
            size = f"level {number}: {level.width} x {level.height}, {level.end:,} bytes"
            draw.text((x, SIDE + 5), size, "black", font)
    return sheet


def views(database: Path) -> Image.Image:
    """A viewpoint with coarse and with whole textures, with the bytes of the visible ones."""
    index = json.loads((database / "www/hints.json").read_text("utf-8"))
    viewpoint = index["viewpoints"][VIEWPOINT]
    name = index["cells"][viewpoint["cell"]]["name"]
    record = json.loads((database / f"www/hints/{name}.json").read_text("utf-8"))
    used = {image for images in record["textures"] for image in images}
    rows = [index["textures"][image] for image in sorted(used)]
    sheet = Image.new("RGB", (2 * WIDTH + 10, HEIGHT + 24), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(13)
    view, scene = View.of_hint(viewpoint, WIDTH, HEIGHT), load(database)
    for x, number in ((0, COARSE), (WIDTH + 10, len(rows[0]["ends"]) - 1)):
        side = rows[0]["width"] >> (len(rows[0]["ends"]) - 1 - number)
        size = sum(row["ends"][number] for row in rows)
        sheet.paste(
            Image.fromarray(render(scene, view, LOOKS["flat"], samples=2, side=side)), (x, 0)
        )
        label = f"{len(used)} visible textures up to {side} x {side} texels: {size:,} bytes"
        draw.text((x, HEIGHT + 5), label, "black", font)
    return sheet


def walk(database: Path) -> Image.Image:
    """The page at a viewpoint, once everything is there."""
    from playwright.sync_api import sync_playwright

    from ptmtools.site.content import site_of
    from ptmtools.site.serving import serving

    program = shutil.which("chromium")
    with serving(site_of(database).entries) as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 720}, bypass_csp=True)
        page.goto(url)
        page.wait_for_function("window.ptm")
        page.evaluate("(place) => window.ptm.goTo(place)", VIEWPOINT)
        for name in ("Map", "Details"):
            page.get_by_role("button", name=name).click()
        page.wait_for_function("window.ptm.state().complete", timeout=300_000)
        page.wait_for_timeout(1000)
        picture = Image.open(io.BytesIO(page.screenshot()))
        browser.close()
    return picture.convert("RGB")


def interlaced(folder: Path) -> Image.Image:
    """Rows: paintings; columns: sizes, each as means and as interlaced."""
    columns = 2 * len(HALVINGS)
    size = columns * (DRAWN + GAP) - GAP, len(PAINTINGS) * (DRAWN + CAPTION)
    drawn = Image.new("RGB", size, "white")
    draw, font = ImageDraw.Draw(drawn), ImageFont.load_default(12)
    for row, name in enumerate(PAINTINGS):
        image = read_image(folder / f"{name}.png")
        bytes_of = by_ptm(image), by_files("png")(image)
        for place, halvings in enumerate(HALVINGS):
            every = 1 << halvings
            side = len(image) >> halvings
            means, picked = box(image, every, every), image[::every, ::every]
            size_of = f"{side} x {side}"
            texts = (
                f"means, {size_of}: {bytes_of[0][side]:,} B (.ptm)",
                f"interlaced, {size_of}: {bytes_of[1][side]:,} B, {psnr(means, picked):.1f} dB",
            )
            for kind, (texels, text) in enumerate(zip((means, picked), texts, strict=True)):
                x, y = (2 * place + kind) * (DRAWN + GAP), row * (DRAWN + CAPTION)
                shown = Image.fromarray(texels).resize((DRAWN, DRAWN), Image.Resampling.NEAREST)
                drawn.paste(shown, (x, y))
                draw.text((x, y + DRAWN + 3), text, "black", font)
    return drawn


def octree_levels() -> Image.Image:
    """A bust: its triangles, the simplified mesh, and that mesh with levels of the octree."""
    statue = make_statue("bust", StatueOptions(triangles=TRIANGLES))
    points, triangles = weld(statue.points.astype(np.float64), statue.triangles)
    n = len(triangles)
    none = np.zeros(n, np.int32)
    scene = Scene(
        points,
        triangles,
        np.zeros((n, 3, 2)),
        none,
        none,
        np.ones(n, bool),
        ("bust",),
        (Material("stone"),),
        tolerance_of(points, triangles),
    )
    with open_executor() as executor:
        made = make_apo(scene, ApoOptions(faces=FACES), executor)
    look = RenderOptions(
        azimuth=20, elevation=8, distance=1.75, field_of_view=32,
        width=PANEL_WIDTH * TIMES, height=PANEL_HEIGHT * TIMES,
    )  # fmt: skip
    own, source, octree = made.mesh, smooth(points, triangles), made.octree
    plain = replace(look, levels=0)
    panels = [
        (
            f"{n:,} triangles",
            draw_octree(octree, points, triangles, plain, source.normals.astype(float)),
        ),
        (
            f"{len(own.triangles):,} triangles",
            draw_octree(octree, own.points, own.triangles, plain, own.normals.astype(float)),
        ),
    ]
    for levels in OCTREE_LEVELS:
        name = f"and {levels or octree.levels} levels"
        wanted = replace(look, levels=levels)
        panels.append((name, draw_octree(octree, own.points, own.triangles, wanted)))
    sheet = Image.new("RGB", (PANEL_WIDTH * len(panels), PANEL_HEIGHT))
    font = ImageFont.load_default(15)
    for k, (name, drawn) in enumerate(panels):
        panel = Image.fromarray(drawn.picture).resize(
            (PANEL_WIDTH, PANEL_HEIGHT), Image.Resampling.BOX
        )
        sheet.paste(panel, (PANEL_WIDTH * k, 0))
        ImageDraw.Draw(sheet).text(
            (PANEL_WIDTH * k + 8, PANEL_HEIGHT - 24), name, font=font, fill="white"
        )
    return sheet


def lit(database: Path) -> Image.Image:
    """A viewpoint of the museum without and with light."""
    with tempfile.TemporaryDirectory() as folder:
        unlit = Path(folder, "unlit.db")
        shutil.copytree(database, unlit)
        ptm(
            "build-scene",
            str(ROOT / "build/museum/museum.obj"),
            "-o",
            str(unlit),
            "--light",
            "none",
        )
        view = ViewOptions(viewpoint=LIT, width=WIDTH, height=HEIGHT)
        pictures = [draw_view(read_served(each), view) for each in (unlit, database)]
    return Image.fromarray(np.concatenate(pictures, axis=1))


def glossy() -> Image.Image:
    """Two rooms of the lit hall side by side."""
    with tempfile.TemporaryDirectory() as folder:
        ptm("sample", "lit-hall", "-o", f"{folder}/hall")
        ptm("build-scene", f"{folder}/hall/lit_hall.glb", "-o", f"{folder}/hall.db")
        served = read_served(f"{folder}/hall.db")
        views = (ViewOptions(eye=a, look=b, width=WIDTH, height=HEIGHT) for a, b in GLOSSY)
        return Image.fromarray(np.concatenate([draw_view(served, v) for v in views], axis=1))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("database", type=Path, help="of the sample museum")
    database: Path = parser.parse_args().database
    PICTURES.mkdir(exist_ok=True)
    plan = str(PICTURES / "plan.png")
    ptm("plot", str(database), "--cell", str(CELL), "--dpi", "90", "-o", plan, "--force")
    levels(database / f"www/textures/{PAINTING}.ptm").save(PICTURES / "levels.jpg", quality=85)
    views(database).save(PICTURES / "view.jpg", quality=85)
    walk(database).save(PICTURES / "walk.jpg", quality=85)
    lit(database).save(PICTURES / "light.jpg", quality=85)
    glossy().save(PICTURES / "gloss.jpg", quality=85)
    interlaced(ROOT / "build/museum/textures").save(PICTURES / "interlace.jpg", quality=80)
    octree_levels().save(PICTURES / "apo.jpg", quality=88)
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(TWO_ROOMS, f"{folder}/model")
        model = Path(folder, "model", "two_rooms.obj")
        model.write_text(model.read_text("utf-8") + DOOR_LEAF, "utf-8")
        for name, options in (("shut", ["--doors", "closed", "--reach", "main"]), ("open", [])):
            ptm("cells", str(model), "-o", f"{folder}/{name}", *options)
            picture = str(PICTURES / f"door-{name}.png")
            ptm("plot", f"{folder}/{name}", "-o", picture, "--force", "--width", "6", "--dpi", "60")


if __name__ == "__main__":
    main()
