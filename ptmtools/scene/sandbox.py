"""Runs readers of other people's making in a process of their own.

Libraries in C++ trust what a file declares: a header of 2 GB in an STL file of 134 bytes keeps one
busy for minutes, others end the process. Here that does no harm: a crash is an error of the file,
and memory and time are bounded by the file's size.

A module that is to be run so ends with ``serve(reader)`` under ``__main__``, where the reader is
called with what `run_apart` was given as ``arguments`` and returns something that JSON can hold.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import ptmtools
from ptmtools.errors import InputError, LimitError, MissingComponentError, PtmError

#: Memory, bytes, and time, seconds, for any model and for each byte of its file besides.
_MEMORY, _MEMORY_PER_BYTE = 4 << 30, 500
_SECONDS, _SECONDS_PER_BYTE = 60.0, 1e-4
#: Where an answer begins: what a library prints may come before it.
_MARK = "ptmtools answers: "
_ERRORS = {kind.__name__: kind for kind in (InputError, LimitError, MissingComponentError)}


def run_apart(
    module: str,
    library: str,
    model: Path,
    *arguments: str | os.PathLike[str],
    beside: int = 0,
) -> Any:
    """What a module's reader answers.

    ``library`` is what the reader is called in messages; ``model`` the file that is at fault, and
    whose size bounds memory and time, with the ``beside`` bytes of other files of the model. Raises
    the reader's own `PtmError`, and InputError PTM-I254 where it raises anything else, crashes, or
    takes too long.
    """
    size = model.stat().st_size + beside
    home = os.fspath(Path(ptmtools.__file__).parent.parent)
    known = os.environ.get("PYTHONPATH")
    command = [sys.executable, "-P", "-m", module, str(_MEMORY + _MEMORY_PER_BYTE * size)]
    try:
        run = subprocess.run(
            command + [os.fspath(argument) for argument in arguments],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_SECONDS + _SECONDS_PER_BYTE * size,
            env={**os.environ, "PYTHONPATH": f"{home}{os.pathsep}{known}" if known else home},
        )
    except subprocess.TimeoutExpired as error:
        raise unreadable(library, model, f"it did not end in {error.timeout:.0f} s") from None
    _, found, text = run.stdout.decode("utf-8", "replace").rpartition(_MARK)
    try:
        answer = json.loads(text) if found else {}
    except ValueError:
        answer = {}
    if not isinstance(answer, dict):
        answer = {}
    if "error" in answer:
        kind, fields = answer["error"]
        raise _ERRORS.get(kind, InputError)(**fields)
    if "answer" not in answer:
        why = answer.get("fault") or f"it ended with status {run.returncode}"
        raise unreadable(library, model, why)
    return answer["answer"]


def unreadable(library: str, model: Path, why: str) -> InputError:
    """The error for a file that a library cannot read, PTM-I254."""
    return InputError(
        "PTM-I254",
        f"{library} cannot read it ({why})",
        file=model,
        remedy="export it again, or convert it to GLB",
    )


def serve(reader: Callable[..., Any]) -> None:
    """Answers `run_apart` and ends this process."""
    memory, *arguments = sys.argv[1:]
    with suppress(ImportError, ValueError, OSError):  # a system without limits, or with lower ones
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (int(memory), int(memory)))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        answer = {"answer": reader(*arguments)}
    except PtmError as error:
        answer = {"error": (type(error).__name__, vars(error))}
    except Exception as error:  # what libraries raise has no class in common
        lines = str(error).splitlines() or [type(error).__name__]
        answer = {"fault": lines[0]}
    print(f"\n{_MARK}{json.dumps(answer)}", flush=True)
    os._exit(0)  # libraries may fail once more as they are unloaded
