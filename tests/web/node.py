"""The decoder of ``web/ptm``, run by node beside Python's."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import struct
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ptmtools.errors import PtmError
from ptmtools.texture import Limits, open as open_ptm

HERE = Path(__file__).resolve().parent
PACKAGE = HERE.parents[1] / "web" / "ptm"
#: Modules, private members and top-level await of what is shipped.
OLDEST = 18
INSTALL = f"apt install nodejs (version {OLDEST} or newer)"


@dataclass(frozen=True)
class Decoded:
    """What a decoder made of a file.

    Attributes
    ----------
    levels: SHA-256 of the texels of each, coarsest first, as far as they came out.
    error: code of what stopped it, or None.
    """

    levels: tuple[str, ...]
    error: str | None


def missing() -> str | None:
    """What to install first, or None."""
    node = shutil.which("node")
    if node is None:
        return INSTALL
    reported = subprocess.run(
        [node, "--version"], capture_output=True, text=True, check=True
    ).stdout
    actual = re.match(r"v(\d+)", reported)
    return None if actual and int(actual[1]) >= OLDEST else INSTALL


def run(*arguments: str | Path, seconds: float = 300) -> str:
    """What a script prints; AssertionError with its complaints if it fails."""
    command = ["node", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=seconds)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def decode_all(
    folder: Path, files: Sequence[bytes], *options: str, seconds: float = 300
) -> list[Decoded]:
    """What the decoder makes of files, in one process; ``options`` are those of ``decode.mjs``."""
    cases = folder / "cases"
    cases.write_bytes(b"".join(struct.pack("<I", len(file)) + file for file in files))
    lines = run(HERE / "decode.mjs", cases, *options, seconds=seconds).splitlines()
    assert len(lines) == len(files)
    reported = map(json.loads, lines)
    return [Decoded(tuple(one["levels"]), one["error"]) for one in reported]


@cache
def by_python(file: bytes, limits: Limits | None = None) -> Decoded:
    """What Python's decoder makes of a file: as far as levels are whole."""
    levels = []
    try:
        with open_ptm(file, limits=limits or Limits()) as ptm:
            for level in ptm.levels():
                levels.append(hashlib.sha256(level.tobytes()).hexdigest())
    except PtmError as error:
        return Decoded(tuple(levels), error.code)
    return Decoded(tuple(levels), None)
