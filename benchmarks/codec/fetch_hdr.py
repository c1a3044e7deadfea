"""Fetches three photographed high-dynamic-range panoramas for `floats.py`.

    python benchmarks/codec/fetch_hdr.py

They come out of the npm package @pmndrs/assets (CC0; photographs of Poly Haven, 512 × 256, half
floats, OpenEXR), which holds them as base64 in JavaScript. Needs npm; nothing else does.
"""

from __future__ import annotations

import base64
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

from images import OUTPUT

PACKAGE = "@pmndrs/assets@1.7.0"
NAMES = ("apartment", "city", "forest")


def main() -> None:
    """Writes the files that are not there."""
    folder = OUTPUT / "hdr"
    wanted = {name: folder / f"{name}.exr" for name in NAMES}
    if all(path.exists() for path in wanted.values()):
        return
    if not shutil.which("npm"):
        sys.exit("no npm here: panoramas are left out (on Debian or Ubuntu: apt install npm)")
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as place:
        subprocess.run(["npm", "pack", "--silent", PACKAGE], cwd=place, check=True)
        (archive,) = Path(place).glob("*.tgz")
        with tarfile.open(archive) as packed:
            for name, path in wanted.items():
                member = packed.extractfile(f"package/hdri/{name}.exr.js")
                assert member is not None
                found = re.search(rb"base64,([A-Za-z0-9+/=]+)", member.read())
                assert found is not None
                path.write_bytes(base64.b64decode(found[1]))
                print(path)


if __name__ == "__main__":
    main()
