"""Models through npm's ``@gltf-transform/cli``, kept by content below ``build``."""

from __future__ import annotations

import hashlib
import subprocess
import tempfile
from pathlib import Path

from benchmarks.npm import GLTF_TRANSFORM
from benchmarks.web_rivals.images import KEPT, keep

#: Of `optimize`, as its documentation recommends for the web.
OPTIMIZE = ("--compress", "meshopt", "--texture-compress", "webp", "--texture-size", "1024")


def gltf_transform(command: str, model: bytes, *options: str) -> bytes:
    """A GLB after a command. Raises SystemExit with what to install."""
    GLTF_TRANSFORM.require()
    key = hashlib.sha256(f"{GLTF_TRANSFORM.version} {command} {options}".encode() + model)
    kept = KEPT / f"{key.hexdigest()[:16]}.glb"
    if not kept.is_file():
        with tempfile.TemporaryDirectory(prefix="gltf-transform-") as name:
            given, out = Path(name) / "given.glb", Path(name) / "out.glb"
            given.write_bytes(model)
            program = GLTF_TRANSFORM.folder / "bin/cli.js"
            call = ["node", str(program), command, str(given), str(out), *options]
            subprocess.run(call, stdout=subprocess.DEVNULL, check=True)
            keep(kept, out.read_bytes())
    return kept.read_bytes()
