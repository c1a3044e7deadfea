"""Draws the pictures of the docs. ``python benchmarks/docs_pictures.py build/museum.db``

Takes the database of the sample museum and writes into ``docs/pictures``:

plan.png     both floors, with what the middle room sees shaded by its coverage hints
levels.jpg   a painting, as its levels show it while the `.ptm` arrives
view.jpg     the view from a viewpoint with the first levels of all textures, and with all of them:
             rays cast at the model, no browser
walk.jpg     the page of `ptm serve` in Chromium, with the map and the details open
door-*.png   two rooms with a door leaf in the doorway: with the door closed one is lost
"""

from __future__ import annotations

import argparse
import io
import json
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

sys.path[:0] = [str(Path(__file__).parent)]
from render import LOOKS, View, load, render  # noqa: E402

from ptmtools import texture  # noqa: E402
from ptmtools.cli.main import main as command  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ROOT / "docs" / "pictures"
TWO_ROOMS = ROOT / "sample_data/two_rooms"
#: The room whose visible set is shaded, and the viewpoint that is shown.
CELL, VIEWPOINT = 9, 5
PAINTING, LEVELS, SIDE = "painting_09", (4, 6, 8, 10), 240
#: The coarse picture has textures of 2⁵ texels a side.
COARSE, WIDTH, HEIGHT = 5, 480, 340
#: A door leaf that fills the doorway of the two rooms, as a line to add to the OBJ file.
DOOR_LEAF = "o door_leaf\nusemtl doorway\nf 9/1 14/2 12/3 11/4\n"


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

    from ptmtools.server.running import serving
    from ptmtools.viewer.site import site_of

    program = shutil.which("chromium")
    with serving(site_of(database).entries) as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 720})
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
