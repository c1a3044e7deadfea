"""The Khronos glTF validator (npm, run by node): every GLB of a folder with its images.

It has a folder of its own under ``build``: npm removes what else lies in one.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

VERSION = "2.0.0-dev.3.10"
ROOT = Path(__file__).resolve().parents[3]
PREFIX = "build/browsers/gltf"
INSTALL = (
    "npm install --no-save --no-package-lock --ignore-scripts --no-audit --no-fund "
    f"--prefix {PREFIX} gltf-validator@{VERSION}"
)
#: Of an issue: 0 is an error, 1 a warning, 2 and 3 are remarks.
WARNING = 1


@dataclass(frozen=True)
class Validated:
    """What was said of one file.

    Attributes
    ----------
    complaints: errors and warnings, one line each.
    remarks: codes of what is neither.
    triangles: counted.
    images: read from other files.
    """

    complaints: tuple[str, ...]
    remarks: frozenset[str]
    triangles: int
    images: int


def package() -> Path | None:
    """The package's folder: named by PTM_GLTF_VALIDATOR, else installed under ``build``."""
    default = ROOT / PREFIX / "node_modules" / "gltf-validator"
    folder = Path(os.environ.get("PTM_GLTF_VALIDATOR", default))
    return folder if (folder / "package.json").is_file() else None


def missing() -> str | None:
    """What to install first, or None."""
    lacking = [] if shutil.which("node") else ["apt install nodejs"]
    lacking += [] if package() else [f"in the checkout: {INSTALL}"]
    return "; ".join(lacking) or None


def validate(folder: Path, *, seconds: float = 300) -> dict[str, Validated]:
    """Every GLB directly in ``folder``, by name."""
    script = Path(__file__).with_suffix(".cjs")
    done = subprocess.run(
        ["node", str(script), str(package()), str(folder)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=True,
        timeout=seconds,
    )
    return {
        name: Validated(
            complaints=tuple(
                f"{code} {pointer}: {message}"
                for severity, code, message, pointer in report["issues"]
                if severity <= WARNING
            ),
            remarks=frozenset(
                code for severity, code, *_ in report["issues"] if severity > WARNING
            ),
            triangles=report["triangles"],
            images=report["resources"],
        )
        for name, report in json.loads(done.stdout).items()
    }
