"""three.js in headless Chromium, with the client of docs/gltf.md as it stands there.

The page knows nothing but the address of the served folder: it finds the cell of a viewpoint, loads
what can be seen from it with the PNG files as textures, and takes a picture.
"""

from __future__ import annotations

import base64
import json
import os
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from browsers import web

VERSION = "0.187.0"
ROOT = Path(__file__).resolve().parents[3]
PREFIX = "build/browsers/three"
INSTALL = (
    "npm install --no-save --no-package-lock --ignore-scripts --no-audit --no-fund "
    f"--prefix {PREFIX} three@{VERSION}"
)
PAGE = (
    web.REPORTING
    + """\
<script type="importmap">
{ "imports": { "three": "/three/build/three.module.js",
               "three/addons/": "/three/examples/jsm/" } }
</script>
<script type="module">
import * as THREE from "three";
import { Walk } from "/client/walk.js";

const { width, height, gpuBytes, place } = SETTINGS;
try {
  const base = new URL("/www/", location).href;
  const index = await (await fetch(base + "hints.json")).json();
  const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  renderer.setSize(width, height);
  document.body.append(renderer.domElement);
  const levels = [];
  const images = new THREE.TextureLoader();
  const walk = new Walk(base, index, (row, level) => {
    levels.push([row.file, level]);
    return images.loadAsync(base + row.fallback);
  });
  const view = index.viewpoints[place];
  const camera = new THREE.PerspectiveCamera(
    THREE.MathUtils.radToDeg(view.fieldOfView), width / height, 0.05, 1000);
  camera.position.set(...view.position);
  camera.lookAt(camera.position.clone().add(new THREE.Vector3(...view.direction)));
  const cell = await walk.locate(camera.position);
  await walk.enter(cell, gpuBytes);
  renderer.render(new THREE.Scene().add(walk.shown), camera);
  const picture = renderer.domElement.toDataURL("image/png");
  await post("/done", JSON.stringify({ cell, levels, picture }));
} catch (fault) {
  await post("/say", `error: ${fault.stack}`);
  await post("/done", JSON.stringify({ cell: -1, levels: [], picture: "," }));
}
</script>
"""
)


@dataclass(frozen=True)
class Walked:
    """What the client saw.

    Attributes
    ----------
    png: the picture.
    cell: in which it found the viewpoint.
    levels: (texture's URL, level) in the order in which they were asked for.
    files: paths below the served folder that were fetched.
    messages: lines of the console.
    """

    png: bytes
    cell: int
    levels: tuple[tuple[str, int], ...]
    files: frozenset[str]
    messages: tuple[str, ...]


def package() -> Path | None:
    """three.js' folder: named by PTM_THREE, else installed under ``build``."""
    folder = Path(os.environ.get("PTM_THREE", ROOT / PREFIX / "node_modules" / "three"))
    return folder if (folder / "build" / "three.module.js").is_file() else None


def missing() -> str | None:
    """What to install first, or None."""
    lacking = [] if web.chromium() else ["apt install chromium"]
    lacking += [] if package() else [f"in the checkout: {INSTALL}"]
    return "; ".join(lacking) or None


def client() -> str:
    """The module in docs/gltf.md."""
    (module,) = re.findall(r"```js\n(.*?)```", (ROOT / "docs/gltf.md").read_text(), re.DOTALL)
    return str(module)


def walk(
    www: Path,
    *,
    viewpoint: int = 0,
    gpu_bytes: int = 1 << 40,
    width: int = 640,
    height: int = 480,
    seconds: float = 120,
) -> Walked:
    """Enters the cell of a viewpoint with so much texture memory, and looks."""
    three = package()
    if three is None:
        raise FileNotFoundError(missing())
    settings: dict[str, Any] = {
        "width": width,
        "height": height,
        "gpuBytes": gpu_bytes,
        "place": viewpoint,
    }
    page = PAGE.replace("SETTINGS", json.dumps(settings))
    with tempfile.TemporaryDirectory(prefix="three-") as folder:
        (Path(folder) / "walk.js").write_text(client())
        folders = {"three": three, "client": Path(folder), "www": www}
        seen = web.visit(page, folders, width=width, height=height, seconds=seconds)
    answer = json.loads(seen.body)
    return Walked(
        png=base64.b64decode(answer["picture"].partition(",")[2]),
        cell=answer["cell"],
        levels=tuple((file, level) for file, level in answer["levels"]),
        files=frozenset(p.removeprefix("/www/") for p in seen.paths if p.startswith("/www/")),
        messages=tuple(seen.messages),
    )
