"""three.js in headless Chromium, with the package `web/three-ptm`.

A script is run in a page that has three.js, the package and the decoder by name, and GL calls that
are counted; `walk` is the script that walks from cell to cell of a served folder.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.npm import THREE
from browsers import web

ROOT = Path(__file__).resolve().parents[3]
ADAPTER = ROOT / "web" / "three-ptm"
#: `gpu.bytes` and `gpu.most` are of all storage in sRGB that there is and that there was at once.
#: `levelsOf` reads a texture back: SHA-256 of its levels, coarsest first.
HEAD = (
    web.REPORTING
    + """\
<script type="importmap">
{ "imports": { "three": "/three/build/three.module.js",
               "three/addons/": "/three/examples/jsm/",
               "ptm-client": "/client/src/index.js",
               "ptm-decoder": "/decoder/src/index.js",
               "three-ptm": "/adapter/src/index.js" } }
</script>
<script>
const gpu = { bytes: 0, most: 0, uploads: 0, largest: 0, storages: new Map() };
const calls = WebGL2RenderingContext.prototype;
const { texStorage2D, texSubImage2D, deleteTexture } = calls;
calls.texStorage2D = function (target, levels, format, width, height) {
  texStorage2D.apply(this, arguments);
  if (format !== this.SRGB8_ALPHA8) return;
  let bytes = 0;
  for (let k = 0; k < levels; k++) bytes += 4 * Math.max(1, width >> k) * Math.max(1, height >> k);
  gpu.storages.set(this.getParameter(this.TEXTURE_BINDING_2D), bytes);
  gpu.bytes += bytes;
  gpu.most = Math.max(gpu.most, gpu.bytes);
};
calls.texSubImage2D = function (target, level, x, y, width, height) {
  texSubImage2D.apply(this, arguments);
  gpu.uploads += 4 * width * height;
  gpu.largest = Math.max(gpu.largest, 4 * width * height);
};
calls.deleteTexture = function (texture) {
  deleteTexture.apply(this, arguments);
  gpu.bytes -= gpu.storages.get(texture) ?? 0;
  gpu.storages.delete(texture);
};
const two = (byte) => byte.toString(16).padStart(2, "0");
const hex = (bytes) => [...new Uint8Array(bytes)].map(two).join("");
async function levelsOf(renderer, texture) {
  const gl = renderer.getContext(), found = [];
  const framebuffer = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  const { __webglTexture: handle } = renderer.properties.get(texture);
  for (let mip = texture.level; mip >= 0; mip--) {
    const { width, height } = texture.mipmaps[mip];
    const texels = new Uint8Array(4 * width * height);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, handle, mip);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, texels);
    found.push(hex(await crypto.subtle.digest("SHA-256", texels)));
  }
  gl.deleteFramebuffer(framebuffer);
  renderer.resetState();
  return found;
}
</script>
"""
)
FRAME = """\
<script type="module">
import * as THREE from "three";
import { PtmTexture, RangeFile, Walk } from "three-ptm";

const settings = SETTINGS;
try {
  const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
  renderer.setSize(settings.width, settings.height);
  document.body.append(renderer.domElement);
  const answer = await (async () => {
    SCRIPT
  })();
  await post("/done", JSON.stringify(answer));
} catch (fault) {
  await post("/say", `error: ${fault.stack}`);
  await post("/done", "null");
}
</script>
"""
WALK = """
const walk = await Walk.open(renderer, "/www/hints.json");
const view = walk.index.viewpoints[settings.viewpoint];
const camera = new THREE.PerspectiveCamera(
  THREE.MathUtils.radToDeg(view.fieldOfView), settings.width / settings.height, 0.05, 1000);
camera.position.set(...view.position);
camera.lookAt(camera.position.clone().add(new THREE.Vector3(...view.direction)));
const scene = new THREE.Scene().add(walk.shown);
const stays = [];
for (const [cell, budget] of settings.stays) {
  await walk.enter(cell ?? (await walk.locate(camera.position)), budget);
  renderer.render(scene, camera);
  stays.push({
    cell: walk.cell,
    levels: walk.textures.map(({ number, texture }) =>
      [walk.index.textures[number].file, texture.level]),
    told: walk.gpuBytes,
    counted: gpu.bytes,
    most: gpu.most,
    geometries: renderer.info.memory.geometries,
    textures: renderer.info.memory.textures,
    groups: walk.shown.children.length,
  });
  gpu.most = gpu.bytes;
}
const picture = renderer.domElement.toDataURL("image/png");
walk.dispose();
return { stays, picture, left: { ...renderer.info.memory, bytes: gpu.bytes } };
"""


@dataclass(frozen=True)
class Walked:
    """What the walk came to.

    Attributes
    ----------
    png: the last picture.
    stays: for each cell that was entered: the cell, levels of the textures by URL, bytes of texture
        memory as told and as counted, and the most since the cell before.
    left: what was there when all had been given back.
    files: paths below the served folder that were fetched.
    ranges: of the textures, see `web.Visit`.
    messages: lines of the console.
    """

    png: bytes
    stays: tuple[dict[str, Any], ...]
    left: dict[str, int]
    files: frozenset[str]
    ranges: tuple[tuple[str, int, int], ...]
    messages: tuple[str, ...]


def missing() -> str | None:
    """What to install first, or None."""
    lacking = [] if web.chromium() else ["apt install chromium"]
    lacking += [remedy] if (remedy := THREE.remedy()) else []
    return "; ".join(lacking) or None


def folders() -> dict[str, Path]:
    """What the names in the page's import map stand for."""
    if remedy := missing():
        raise FileNotFoundError(remedy)
    web_packages = {"client": ROOT / "web" / "client", "decoder": ROOT / "web" / "ptm"}
    return {"three": THREE.folder, "adapter": ADAPTER, **web_packages}


def run(
    script: str,
    served: Mapping[str, Path],
    *,
    width: int = 64,
    height: int = 64,
    seconds: float = 120,
    **settings: Any,
) -> tuple[Any, web.Visit]:
    """What the body of an asynchronous function returns; it has ``renderer``, ``settings``."""
    reported = json.dumps({"width": width, "height": height, **settings})
    page = HEAD + FRAME.replace("SETTINGS", reported).replace("SCRIPT", script)
    everything = {**folders(), **served}
    seen = web.visit(page, everything, width=width, height=height, seconds=seconds)
    return json.loads(seen.body), seen


def walk(
    www: Path,
    *,
    viewpoint: int = 0,
    stays: Sequence[tuple[int | None, int]] = ((None, 1 << 40),),
    width: int = 640,
    height: int = 480,
) -> Walked:
    """Enters cells, each with so much texture memory (None: that of the viewpoint), and looks."""
    answer, seen = run(
        WALK, {"www": www}, viewpoint=viewpoint, stays=stays, width=width, height=height
    )
    answer = answer or {"stays": [], "picture": ",", "left": {}}
    return Walked(
        png=base64.b64decode(answer["picture"].partition(",")[2]),
        stays=tuple(answer["stays"]),
        left=answer["left"],
        files=frozenset(p.removeprefix("/www/") for p in seen.paths if p.startswith("/www/")),
        ranges=tuple(seen.ranges),
        messages=tuple(seen.messages),
    )
