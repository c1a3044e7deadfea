"""view3dscene (Castle Game Engine): a parser with an opinion, and pictures under Xvfb.

Its exit code is 0 even for files that it gives up on, and its complaints go to a log in the
user's configuration folder; each call here gets a folder of its own for that. ``--write`` reads a
file with its Inlines in 0.05 s and needs no display, but opens no texture; a screenshot does.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

#: Of every run, whatever the file.
HARMLESS = "before the Application.OnInitialize was called"
#: Lines of the log that a complaint does not continue on.
BEGINNINGS = ("Path:", "Config:", "Rendering", "Log for", "ZLib", "LibPng", "OpenAL", "-----")


def missing() -> str | None:
    """The Debian packages that must be installed first, or None."""
    needs = {"view3dscene": "view3dscene", "xvfb-run": "xvfb", "xauth": "xauth"}
    lacking = [package for program, package in needs.items() if shutil.which(program) is None]
    return " ".join(lacking) or None


def complaints(log: str) -> list[str]:
    """The warnings of a log, one line each."""
    actual: list[str] = []
    open_ended = False
    for line in log.splitlines():
        if line.startswith("Warning:"):
            open_ended = HARMLESS not in line
            if open_ended:
                actual.append(line)
        elif line.startswith(BEGINNINGS):
            open_ended = False
        elif open_ended:
            actual[-1] += f" {line.strip()}"
    return actual


def _run(arguments: list[str], folder: Path, *, display: bool, seconds: float) -> list[str]:
    """The complaints of one run in ``folder``, its exit status among them if it is not 0."""
    with tempfile.TemporaryDirectory(prefix="view3dscene-") as config:
        command = ["view3dscene", *arguments]
        if display:
            command = ["xvfb-run", "-a", "-s", "-screen 0 1600x1200x24", *command]
        done = subprocess.run(
            command,
            cwd=folder,
            env={**os.environ, "XDG_CONFIG_HOME": config, "HOME": config},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=seconds,
        )
        log = Path(config) / "view3dscene" / "view3dscene.log"
        actual = complaints(log.read_text(errors="replace")) if log.exists() else ["no log"]
    if done.returncode:
        printed = done.stderr.decode(errors="replace").strip().replace("\n", " ")
        actual.append(f"exit status {done.returncode}: {printed}")
    return actual


def check(path: Path, *, seconds: float = 60) -> list[str]:
    """What view3dscene complains about when it reads a file and what the file inlines."""
    return _run(["--write", path.name], path.parent, display=False, seconds=seconds)


def check_all(www: Path) -> dict[str, list[str]]:
    """The complaints about every ``.wrl`` below a folder; only files with any are named."""
    actual = {str(p.relative_to(www)): check(p) for p in sorted(www.rglob("*.wrl"))}
    return {name: lines for name, lines in actual.items() if lines}


def screenshot(
    path: Path,
    picture: Path,
    *,
    viewpoint: int = 0,
    width: int = 640,
    height: int = 480,
    seconds: float = 120,
) -> list[str]:
    """Writes a PNG of a viewpoint, counted from 0 in the order of view3dscene's menu.

    Returns the complaints, unreadable textures included.
    """
    arguments = [path.name, "--geometry", f"{width}x{height}", "--viewpoint", str(viewpoint)]
    arguments += ["--screenshot", "0", str(picture.resolve())]
    return _run(arguments, path.parent, display=True, seconds=seconds)
