"""The Khronos glTF validator (npm, run by node): every GLB of a folder with its images."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

from benchmarks.npm import GLTF_VALIDATOR

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


def validate(folder: Path, *, seconds: float = 300) -> dict[str, Validated]:
    """Every GLB directly in ``folder``, by name."""
    script = Path(__file__).with_suffix(".cjs")
    done = subprocess.run(
        ["node", str(script), str(GLTF_VALIDATOR.folder), str(folder)],
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
