"""The decoder in a real browser: in its workers, from ranges."""

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
import { DecoderWorkers, openPtm } from "/ptm/src/index.js";
const file = new Uint8Array(await (await fetch("/files/image.ptm")).arrayBuffer());
const ptm = await openPtm(async (offset, length) => file.slice(offset, offset + length));
const byte = (b) => b.toString(16).padStart(2, "0");
const hex = (bytes) => [...new Uint8Array(bytes)].map(byte).join("");
const told = { levels: [] };
const workers = new DecoderWorkers({ count: 2 });
for await (const { data } of ptm.decode({ workers })) {
  told.levels.push(hex(await crypto.subtle.digest("SHA-256", data)));
}
workers.close();
// A worker fetches the module itself where the page cannot.
const wasm = Promise.reject(new Error("none"));
const alone = new DecoderWorkers({ count: 1, wasm });
told.alone = (await ptm.image(0, { workers: alone })).width;
const useless = new DecoderWorkers({ count: 2, wasm: new Uint8Array(8) });
told.error = await ptm.image(0, { workers: useless }).catch(({ name }) => name);
useless.decoder(ptm.header);
while (!useless.failed) await new Promise((resolve) => setTimeout(resolve, 20));
told.failed = useless.failed;
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
    reported = json.loads(visit.body)
    levels = []
    for level in decode_levels(file):
        opaque = np.dstack([level, np.full(level.shape[:2], 255, np.uint8)])
        levels.append(hashlib.sha256(opaque.tobytes()).hexdigest())
    assert reported == {"levels": levels, "alone": 1, "error": "Error", "failed": True}
