"""One database in three renderers: our own rays, view3dscene, and X_ITE in headless Chromium.

    python benchmarks/screenshots.py DB -o DIR [--viewpoint K] [--size 640x480]

Writes `own.png`, `view3dscene.png`, `x_ite.png` and all of them side by side, `side_by_side.png`,
and prints what the browsers complained about. The browsers show the emitted VRML files; the first
picture is cast from the scene that ingest made, so whatever differs was lost or bent on the way.
Another viewpoint than the first is shown through a copy of `root.wrl` with that one in front.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests" / "e2e")]
from browsers import view3dscene, x_ite  # noqa: E402
from render import load, render  # noqa: E402

from ptmtools.errors import PtmError  # noqa: E402


def reordered(root: str, number: int) -> str:
    """``root.wrl`` with its viewpoint ``number`` before the others: browsers bind the first."""
    lines = root.splitlines()
    where = [k for k, line in enumerate(lines) if " Viewpoint { " in line]
    lines.insert(where[0], lines.pop(where[number]))
    return "\n".join(lines) + "\n"


def side_by_side(pictures: list[tuple[str, Path]], output: Path) -> None:
    images = [(name, Image.open(path).convert("RGB")) for name, path in pictures if path.exists()]
    width, height = images[0][1].size
    sheet = Image.new("RGB", (width * len(images), height + 24), (255, 255, 255))
    draw = ImageDraw.Draw(sheet)
    for k, (name, image) in enumerate(images):
        sheet.paste(image.resize((width, height)), (k * width, 24))
        draw.text((k * width + 6, 4), name, fill=(0, 0, 0), font=ImageFont.load_default(14))
    sheet.save(output)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Pictures of a database by three renderers.")
    add = parser.add_argument
    add("database", type=Path, metavar="DB")
    add("-o", "--output", type=Path, required=True, metavar="DIR")
    add("--viewpoint", type=int, default=0, metavar="K", help="number of the viewpoint, from 0")
    add("--size", default="640x480", help="WIDTHxHEIGHT (default 640x480)")
    given = parser.parse_args(arguments)
    width, height = (int(n) for n in given.size.split("x"))
    given.output.mkdir(parents=True, exist_ok=True)
    www = given.database / "www"
    try:
        scene = load(given.database)
    except PtmError as error:
        parser.exit(error.exit_status, f"screenshots: {error}\n")
    views = json.loads((www / "hints.json").read_text())["viewpoints"]
    if not 0 <= given.viewpoint < len(views):
        parser.error(f"--viewpoint {given.viewpoint}: there are {len(views)}")
    view = views[given.viewpoint]

    own, castle, web = (given.output / f"{n}.png" for n in ("own", "view3dscene", "x_ite"))
    picture = render(
        scene,
        view["position"],
        view["direction"],
        fov=view["fieldOfView"],
        width=width,
        height=height,
        samples=2,
        shading="browser",
    )
    Image.fromarray(np.ascontiguousarray(picture)).save(own)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(shutil.copytree(www, Path(folder) / "www"))
        root = copy / "root.wrl"
        root.write_text(reordered(root.read_text(), given.viewpoint))
        if view3dscene.missing():
            print(f"view3dscene: left out, apt install {view3dscene.missing()}")
        else:
            for line in view3dscene.screenshot(root, castle, width=width, height=height):
                print(f"view3dscene: {line}")
        if x_ite.missing():
            print(f"X_ITE: left out, {x_ite.missing()}")
        else:
            shot = x_ite.screenshot(root, width=width, height=height, seconds=500)
            web.write_bytes(shot.png)
            for line in shot.messages:
                print(f"X_ITE: {line}")
    labels = [("own rays", own), ("view3dscene", castle), ("X_ITE", web)]
    side_by_side(labels, given.output / "side_by_side.png")
    print(given.output / "side_by_side.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
