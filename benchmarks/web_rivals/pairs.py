"""Pairs of pictures for a judge who does not know which is whose.

    python -m benchmarks.web_rivals.pairs three MODEL … --out FOLDER [--views 2]
    python -m benchmarks.web_rivals.pairs PTM MODEL … --out FOLDER [--views 2]

Builds each model with all defaults, and shows the first viewpoints of the database: as `ptm render`
draws it beside ``three``, a page of three.js (`pages/lit.js`), or beside the picture of
another release, by its program ``PTM`` with its own database. Each pair is a PNG, left and right
as drawn by lot; ``key.json``, which later models are added to, says which side is ours.
``--count KEY ANSWERS`` compares it with a judge's file of lines "PAIR left|right|same".
"""

from __future__ import annotations

import argparse
import json
import math
import random
import subprocess
import sys
from collections import Counter
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / name) for name in ("benchmarks", "tests/e2e", "")]

from render import load  # noqa: E402

from benchmarks.npm import ESBUILD, THREE  # noqa: E402
from benchmarks.web_rivals.images import in_form  # noqa: E402
from benchmarks.web_rivals.models import UNLIT, whole_glb  # noqa: E402
from ptmtools.output.gltf import pack, unpack  # noqa: E402

SIZE = (640, 360)
PAGE = ROOT / "benchmarks/web_rivals/pages/lit.js"
HERE = "http://pairs.invalid/"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("rival", nargs="?")
    parser.add_argument("models", nargs="*", type=Path)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--views", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", nargs=2, type=Path, metavar=("KEY", "ANSWERS"))
    given = parser.parse_args()
    if given.count:
        print(dict(count(*given.count)))
        return
    given.out.mkdir(parents=True, exist_ok=True)
    file = given.out / "key.json"
    key: dict[str, str] = json.loads(file.read_text("utf-8")) if file.exists() else {}
    ours = str(Path(sys.executable).with_name("ptm"))
    # A name of a program tells the judge nothing.
    kind = sha256(given.rival.encode()).hexdigest()[:4]
    for model in given.models:
        lot = random.Random(f"{given.seed} {model.stem} {given.rival}")
        database = build(ours, model, given.out, "ours")
        views = views_of(database)[: given.views]
        pictures = [draw(ours, database, view, given.out) for view in views]
        if given.rival == "three":
            rivals = draw_by_three(model, database, views)
        else:
            other = build(given.rival, model, given.out, kind)
            rivals = [draw(given.rival, other, view, given.out) for view in views]
        for number, (picture, rival) in enumerate(zip(pictures, rivals, strict=True)):
            name, left = f"{model.stem}-{kind}-{number}", lot.random() < 0.5
            key[name] = "left" if left else "right"
            both = (picture, rival) if left else (rival, picture)
            Image.fromarray(np.concatenate(both, axis=1)).save(given.out / f"{name}.png")
        file.write_text(json.dumps(key, indent=1) + "\n", "utf-8")
        print(f"{model.stem}: {len(views)} pairs", flush=True)


def build(ptm: str, model: Path, folder: Path, name: str) -> Path:
    """The database of a model by a release's program; one that exists is kept."""
    database = folder / f"{model.stem}-{name}.db"
    if not database.exists():
        subprocess.run([ptm, "build-scene", model, "-o", database, "--quiet"], check=True)
    return database


def views_of(database: Path) -> list[dict[str, Any]]:
    """Eye, point on the axis and vertical angle in degrees of the viewpoints of a database."""
    hints = json.loads((database / "www/hints.json").read_text("utf-8"))
    return [
        {
            "eye": view["position"],
            "look": np.add(view["position"], view["direction"]).tolist(),
            "angle": math.degrees(view["fieldOfView"]),
        }
        for view in hints["viewpoints"]
    ]


def draw(ptm: str, database: Path, view: dict[str, Any], folder: Path) -> Any:
    """(height, width, 3) picture by `ptm render`."""
    file = folder / "view.png"
    places = (f"{name}={','.join(map(str, view[name]))}" for name in ("eye", "look"))
    command = [ptm, "render", database, *(f"--{place}" for place in places)]
    command += ["--field-of-view", str(view["angle"]), "--width", str(SIZE[0])]
    command += ["--height", str(SIZE[1]), "-o", file, "--force", "--quiet"]
    subprocess.run(command, check=True)
    with Image.open(file) as opened:
        picture = np.asarray(opened.convert("RGB"))
    file.unlink()
    return picture


def draw_by_three(model: Path, database: Path, views: list[dict[str, Any]]) -> list[Any]:
    """The same views by three.js: of the file itself if it is a GLB in metres with Y up and without
    Draco, else of a GLB of all its triangles."""
    import io

    from browsers import web
    from playwright.sync_api import sync_playwright

    hints = json.loads((database / "www/hints.json").read_text("utf-8"))
    whole, shift = model.read_bytes(), np.array(hints["origin"])
    itself = model.suffix == ".glb" and b"KHR_draco_mesh_compression" not in whole
    if not itself or (hints["unit"], hints["up"]) != (1, "y"):
        scene = load(database)
        whole, shift = lit(whole_glb(scene, in_form(scene.images, "png"), "image/png"), scene), 0.0
    script = joined()
    html = (
        b'<!doctype html><style>body{margin:0}</style><script type="module" src="page.js"></script>'
    )
    answers = {"": (html, "text/html"), "page.js": (script, "text/javascript")}
    answers["model.glb"] = (whole, "model/gltf-binary")
    pictures = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=web.chromium(), args=web.FLAGS[1:])
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})

        def answer(route: Any) -> None:
            body, media = answers.get(route.request.url.removeprefix(HERE), (b"", "text/plain"))
            route.fulfill(body=body, content_type=media)

        page.route("**/*", answer)
        page.goto(HERE)
        page.wait_for_function("window.complete", timeout=120_000)
        for view in views:
            eye, look = (np.add(view[name], shift).tolist() for name in ("eye", "look"))
            page.evaluate("view => show(...view)", [eye, look, view["angle"]])
            shot = Image.open(io.BytesIO(page.screenshot()))
            pictures.append(np.asarray(shot.convert("RGB")))
    return pictures


def lit(glb: bytes, scene: Any) -> bytes:
    """A GLB whose materials are lit, with the metallic and roughness factors of the model."""
    document, binary = unpack(glb)
    document["extensionsUsed"] = [n for n in document["extensionsUsed"] if n != UNLIT] or None
    kinds = np.unique(np.stack([scene.triangle_material, scene.two_sided], axis=1), axis=0)
    for row, (number, _) in zip(document["materials"], kinds.tolist(), strict=True):
        del row["extensions"]
        material = scene.materials[number]
        row["pbrMetallicRoughness"]["metallicFactor"] = material.metallic
        row["pbrMetallicRoughness"]["roughnessFactor"] = material.roughness
    return pack({k: v for k, v in document.items() if v is not None}, binary)


def joined() -> bytes:
    """The script of the page with three.js in it."""
    command = [ESBUILD.folder / "bin/esbuild", PAGE, "--bundle", "--format=esm", "--target=esnext"]
    environment = {"NODE_PATH": str(THREE.modules), "PATH": "/usr/bin:/bin"}
    return subprocess.run(command, env=environment, check=True, capture_output=True).stdout


def count(key: Path, answers: Path) -> Counter[str]:
    """How often a judge took ours, the other's, or neither."""
    ours = json.loads(key.read_text("utf-8"))
    lines = (line.split() for line in answers.read_text("utf-8").splitlines() if line.strip())
    return Counter(
        "same" if side == "same" else "ours" if ours[pair] == side else "other"
        for pair, side, *_ in lines
    )


if __name__ == "__main__":
    main()
