"""Converts a model to OBJ files through pymeshlab, in a process of its own.

pymeshlab (GPL-3, needs libGL) does not say which face has which texture, but writes it into an
OBJ file. Its readers are many, in C++, and trust what a file declares: a header of 2 GB in an STL
file of 134 bytes keeps one busy for minutes, others end the process. So it runs where that does no
harm: a crash is an error of the file, and memory and time are bounded by the file's size.

As a program: ``python -P -m ptmtools.scene.meshlab MODEL FOLDER MEMORY`` writes ``0.obj``, … and
prints a JSON list of their labels, or an object that says why it could not.
"""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import ptmtools
from ptmtools.errors import InputError, MissingComponentError

#: Memory, bytes, and time, seconds, for any model and for each byte of its file besides.
_MEMORY, _MEMORY_PER_BYTE = 4 << 30, 500
_SECONDS, _SECONDS_PER_BYTE = 60.0, 1e-4


def convert(path: Path, scratch: Path) -> list[tuple[Path, str]]:
    """The meshes of a model as OBJ files in ``scratch``, with their labels.

    Raises InputError PTM-I254 for what pymeshlab cannot read, MissingComponentError PTM-M200.
    """
    if fault := _absence():
        raise _missing(fault)
    size = path.stat().st_size
    command = [sys.executable, "-P", "-m", __name__, os.fspath(path.absolute()), os.fspath(scratch)]
    home = os.fspath(Path(ptmtools.__file__).parent.parent)
    known = os.environ.get("PYTHONPATH")
    try:
        run = subprocess.run(
            [*command, str(_MEMORY + _MEMORY_PER_BYTE * size)],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_SECONDS + _SECONDS_PER_BYTE * size,
            env={**os.environ, "PYTHONPATH": f"{home}{os.pathsep}{known}" if known else home},
        )
    except subprocess.TimeoutExpired as error:
        raise _unreadable(path, f"it did not end in {error.timeout:.0f} s") from None
    try:
        answer = json.loads(run.stdout.splitlines()[-1])
    except (IndexError, ValueError):
        raise _unreadable(path, f"it ended with status {run.returncode}") from None
    if "missing" in answer:
        raise _missing(answer["missing"])
    if "fault" in answer:
        raise _unreadable(path, answer["fault"])
    return [(scratch / f"{i}.obj", label) for i, label in enumerate(answer["labels"])]


def _absence() -> str:
    """Why pymeshlab cannot be used. Without OpenGL it imports, prints a page of complaints and
    knows no format, so that library is looked for first."""
    try:
        if sys.platform == "linux":
            ctypes.CDLL("libOpenGL.so.0")
    except OSError as error:
        return str(error)
    return "" if find_spec("pymeshlab") else "No module named 'pymeshlab'"


def _missing(why: str) -> MissingComponentError:
    return MissingComponentError(
        "PTM-M200",
        f"pymeshlab cannot be used ({why})",
        remedy="pip install pymeshlab; apt install libopengl0 libgl1; or convert to GLB",
    )


def _unreadable(path: Path, why: str) -> InputError:
    return InputError(
        "PTM-I254", f"pymeshlab cannot read it ({why})", file=path, remedy="convert to GLB"
    )


def _convert_here(path: str, scratch: Path) -> dict[str, object]:
    """The answer that `convert` reads."""
    try:
        import pymeshlab
    except ImportError as error:
        return {"missing": str(error)}
    meshes = pymeshlab.MeshSet()
    labels: list[str] = []
    try:
        meshes.load_new_mesh(path)
        for mesh in meshes:
            if not mesh.face_number():
                continue
            meshes.set_current_mesh(mesh.id())
            meshes.apply_matrix_freeze()
            meshes.save_current_mesh(
                str(scratch / f"{len(labels)}.obj"),
                save_vertex_normal=False,
                save_vertex_color=False,
                save_textures=False,
            )
            labels.append(mesh.label())
    except Exception as error:  # what its readers raise has no class in common
        return {"fault": str(error).splitlines()[0] if str(error) else "it gives no reason"}
    return {"labels": labels}


def _main(path: str, scratch: str, memory: str) -> None:
    with suppress(ImportError, ValueError, OSError):  # a system without limits, or with lower ones
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (int(memory), int(memory)))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    print(f"\n{json.dumps(_convert_here(path, Path(scratch)))}", flush=True)
    os._exit(0)  # its libraries may fail once more as they are unloaded


if __name__ == "__main__":
    _main(*sys.argv[1:])
