"""The decoder in a real browser: in its workers, from ranges, with either engine."""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.texture import EncodeOptions, decode_levels, encode
from tests.texture.coding import textured
from tests.web.node import PACKAGE

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "e2e"))
from browsers import web  # noqa: E402

#: Slices stand for ranges, which the page's server does not know.
PAGE = """
<script type="module">
import { DecoderWorkers, loadEngine, openPtm } from "/ptm/src/index.js";
const file = new Uint8Array(await (await fetch("/files/image.ptm")).arrayBuffer());
const ptm = await openPtm(async (offset, length) => file.slice(offset, offset + length));
const byte = (b) => b.toString(16).padStart(2, "0");
const hex = (bytes) => [...new Uint8Array(bytes)].map(byte).join("");
const told = { here: (await loadEngine()).name };
for (const wasm of [undefined, new Uint8Array(0)]) {
  const workers = new DecoderWorkers({ count: 2, wasm });
  const levels = [];
  for await (const { data } of ptm.decode({ workers })) {
    levels.push(hex(await crypto.subtle.digest("SHA-256", data)));
  }
  told[workers.lanes[0].engine] = levels;
  workers.close();
}
post("/done", JSON.stringify(told));
</script>
"""


@pytest.fixture(scope="module")
def browser(require: Callable[[str, str], None]) -> Any:
    if web.chromium() is None:
        require("Chromium", "apt install chromium")
    return web


def test_workers_decode_what_python_does(browser: Any, tmp_path: Path) -> None:
    file = encode(textured(150, 141, 3), EncodeOptions(tile=64))
    (tmp_path / "image.ptm").write_bytes(file)
    visit = browser.visit(browser.REPORTING + PAGE, {"ptm": PACKAGE, "files": tmp_path})
    assert visit.messages == []
    told = json.loads(visit.body)
    levels = []
    for level in decode_levels(file):
        opaque = np.dstack([level, np.full(level.shape[:2], 255, np.uint8)])
        levels.append(hashlib.sha256(opaque.tobytes()).hexdigest())
    assert told == {"here": "wasm", "wasm": levels, "js": levels}
