"""Fills the disk under a build, and looks whether the database that was there is intact.

Needs to be root, for a disk of its own in memory (tmpfs, 50 MB unless asked otherwise). A database
is built there; then, again and again, ballast leaves so many bytes free, and the build is asked to
bring the database up to date with other options. It must end with a clear error (PTM-O003, status
4), the database must be what it was, and once the ballast is gone the next build must end with the
bytes of one that had room from the start.

    python benchmarks/full_disk.py MODEL [--size 50] [--steps 12]
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(Path(__file__).parent)]
from kills import UPDATE, state  # noqa: E402


def ptm(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "ptmtools", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True)


def free(folder: Path) -> int:
    found = os.statvfs(folder)
    return found.f_bavail * found.f_frsize


def database(folder: Path) -> dict[str, str]:
    """The files of a database, without what waits for the next run."""
    return {name: digest for name, digest in state(folder).items() if ".ptm-" not in name}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("model", type=Path)
    parser.add_argument("--size", type=int, default=50, metavar="MB")
    parser.add_argument("--steps", type=int, default=12)
    parser.add_argument("--options", default="", help="of the build")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="full-") as made:
        disk = Path(made) / "disk"
        disk.mkdir()
        size = f"size={asked.size}m"
        subprocess.run(["mount", "-t", "tmpfs", "-o", size, "tmpfs", str(disk)], check=True)
        try:
            return fill(asked.model, disk, Path(made), asked.steps, asked.options.split())
        finally:
            subprocess.run(["umount", str(disk)], check=True)


def fill(model: Path, disk: Path, spare: Path, steps: int, options: list[str]) -> int:
    old, new = spare / "old", spare / "new"
    assert ptm("build-scene", model, "-o", old, *options).returncode == 0
    shutil.copytree(old, new)
    assert ptm("build-scene", model, "-o", new, *options, *UPDATE).returncode == 0
    wanted, before = database(new), database(old)
    need = sum(f.stat().st_size for f in new.rglob("*") if f.is_file())
    db, ballast = disk / "db", disk / "ballast"
    failed = full = 0
    for step in range(steps):
        shutil.rmtree(db, ignore_errors=True)
        ballast.unlink(missing_ok=True)
        shutil.copytree(old, db)
        left = int(need * step / steps)
        ballast.write_bytes(bytes(max(0, free(disk) - left)))
        done = ptm("build-scene", model, "-o", db, *options, *UPDATE)
        printed = done.stderr.strip()
        if done.returncode == 0:
            outcome = "room enough" if database(db) == wanted else "OTHER bytes"
        else:
            full += 1
            clear = done.returncode == 4 and "the disk is full" in printed and "PTM-O003" in printed
            # What an earlier stage of the update committed is new, and whole.
            sound = ptm("validate", db, "--json").returncode in (0, 8)
            whole = all(
                digest in (before.get(name), wanted.get(name))
                for name, digest in database(db).items()
                if name != "manifest.json"
            )
            ballast.unlink()
            again = ptm("build-scene", model, "-o", db, *options, *UPDATE).returncode == 0
            mended = again and state(db) == state(new)
            faults = {"clear": clear, "sound": sound, "whole": whole, "mended": mended}
            wrong = [name for name, good in faults.items() if not good]
            outcome = "full: clear error, intact, mended by the next"
            if wrong:
                outcome = f"WRONG, not {' nor '.join(wrong)}: {printed[:200]}"
        failed += "OTHER" in outcome or "WRONG" in outcome
        print(f"{left / 1e6:6.2f} MB free: {outcome}")
    print(f"{full} of {steps} builds found the disk full; {failed} wrong")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
