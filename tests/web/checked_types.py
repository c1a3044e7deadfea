"""Types of what is written in JavaScript: told by JSDoc, checked by TypeScript's `tsc`.

python tests/web/checked_types.py    for `make lint`: complaints, and 1 if there are any
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

VERSION = "5.9.3"
ROOT = Path(__file__).resolve().parents[2]
#: Folders with a tsconfig.json.
PACKAGES = ("web/ptm", "web/client", "web/three-ptm", "web/page")
PREFIX = "build/browsers/typescript"
INSTALL = (
    "npm install --no-save --no-package-lock --ignore-scripts --no-audit --no-fund "
    f"--prefix {PREFIX} typescript@{VERSION}"
)


def compiler() -> Path | None:
    """The script: of the folder that PTM_TYPESCRIPT names, else installed under ``build``."""
    default = ROOT / PREFIX / "node_modules" / "typescript"
    script = Path(os.environ.get("PTM_TYPESCRIPT", default)) / "bin" / "tsc"
    return script if script.is_file() else None


def missing() -> str | None:
    """What to install first, or None."""
    lacking = [] if shutil.which("node") else ["apt install nodejs"]
    lacking += [] if compiler() else [f"in the checkout: {INSTALL}"]
    return "; ".join(lacking) or None


def complaints(folder: Path | None = None) -> str:
    """Of one folder, or of all packages; empty if there are none."""
    printed = []
    for package in [folder] if folder else [ROOT / name for name in PACKAGES]:
        command = ["node", str(compiler()), "--project", str(package), "--pretty", "false"]
        printed.append(subprocess.run(command, capture_output=True, text=True).stdout)
    return "".join(printed)


def main() -> int:
    """For `make lint`: without a compiler a line, and in CI an error."""
    if remedy := missing():
        print(f"The types of {', '.join(PACKAGES)} are not checked; {remedy}")
        return int(os.environ.get("CI", "").lower() == "true")
    printed = complaints()
    print(printed, end="")
    return int(bool(printed))


if __name__ == "__main__":
    sys.exit(main())
