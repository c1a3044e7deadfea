"""Types of what is written in JavaScript: told by JSDoc, checked by TypeScript's `tsc`.

python -m tests.web.checked_types    for `make lint`: complaints, and 1 if there are any
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from benchmarks.npm import TYPESCRIPT

ROOT = Path(__file__).resolve().parents[2]
#: Folders with a tsconfig.json.
PACKAGES = ("web/ptm", "web/client", "web/three-ptm", "web/page", "web/systems", "web/embed")
#: For the second of `make lint` and `make test`, which takes half of the time of the first.
CACHE = ROOT / "build/types"


def complaints(folder: Path | None = None, cache: Path = CACHE) -> str:
    """Of one folder, or of all packages, also that the compiler broke off; empty if none.

    The compiler keeps what it learns about unchanged files in the folder ``cache``."""
    printed = []
    compiler = TYPESCRIPT.folder / "bin/tsc"
    for package in [folder] if folder else [ROOT / name for name in PACKAGES]:
        info = cache / f"{package.name}.tsbuildinfo"
        command = ["node", str(compiler), "--project", str(package), "--pretty", "false"]
        command += ["--incremental", "--tsBuildInfoFile", str(info)]
        done = subprocess.run(command, capture_output=True, text=True)
        printed.append(done.stdout)
        if done.returncode and not done.stdout:
            printed.append(f"{package}: tsc ended with {done.returncode}\n{done.stderr}")
    return "".join(printed)


def main() -> int:
    """For `make lint`: without a compiler a line, and in CI an error."""
    if remedy := TYPESCRIPT.remedy():
        print(f"The types of {', '.join(PACKAGES)} are not checked; {remedy}")
        return int(os.environ.get("CI", "").lower() == "true")
    printed = complaints()
    print(printed, end="")
    return int(bool(printed))


if __name__ == "__main__":
    sys.exit(main())
