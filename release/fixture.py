"""Keeps a database and a site of this release, for the tests of later ones.

    python release/fixture.py

The archive ``tests/releases/VERSION.zip`` has the model of the two rooms, its database and the
site published from it. Run it when a release is made; it changes no archive that exists.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Of every member, so that the same files give the same archive.
_DATE = (2000, 1, 1, 0, 0, 0)


def main() -> None:
    """Writes the archive and prints its path and size."""
    from ptmtools.version import __version__

    archive = ROOT / "tests/releases" / f"{__version__}.zip"
    if archive.exists():
        raise SystemExit(f"{archive.relative_to(ROOT)} exists and is not changed")
    with tempfile.TemporaryDirectory(prefix="release-") as name:
        folder = Path(name)
        shutil.copytree(ROOT / "sample_data/two_rooms", folder / "model")
        command = [sys.executable, "-m", "ptmtools", "-q"]
        for words in (
            ["build-scene", "model/two_rooms.obj", "-o", "rooms.db", "-j", "1"],
            ["publish", "rooms.db", "-o", "site"],
        ):
            subprocess.run([*command, *words], cwd=folder, check=True)
        pack(folder, archive)
    print(f"{archive.relative_to(ROOT)}: {archive.stat().st_size:,} bytes")


def pack(folder: Path, archive: Path) -> None:
    """Writes the files below ``folder`` into a ZIP archive, in the order of their names."""
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as file:
        for path in sorted(path for path in folder.rglob("*") if path.is_file()):
            member = zipfile.ZipInfo(path.relative_to(folder).as_posix(), _DATE)
            member.compress_type = zipfile.ZIP_DEFLATED
            file.writestr(member, path.read_bytes())


if __name__ == "__main__":
    main()
