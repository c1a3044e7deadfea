"""Runs readers that call third-party libraries in a child process with limited memory and time.

Libraries in C++ trust the sizes that a file declares: an STL file of 134 bytes with a header of
2 GB keeps one busy for minutes, and others crash. In a child process a crash is an error of the
file, and the size of the file bounds memory and time.

A module with such a reader ends with ``serve(reader)`` under ``__main__``. The reader gets the
``arguments`` of `run_in_sandbox` as strings and returns a value that JSON can represent. Before it
tries something that it can do without, it may call `reply_so_far`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ptmtools.child import module_process
from ptmtools.errors import InputError, LimitError, MissingComponentError, PtmError

#: Memory in bytes and time in seconds: for any model, and per byte of its files.
_MEMORY, _MEMORY_PER_BYTE = 4 << 30, 500
_SECONDS, _SECONDS_PER_BYTE = 60.0, 1e-4
#: Begins the reply on standard output, which may follow output of the library.
_MARK = "ptmtools answers: "
_ERRORS = {kind.__name__: kind for kind in (InputError, LimitError, MissingComponentError)}


def run_in_sandbox(
    module: str,
    library: str,
    model: Path,
    *arguments: str | os.PathLike[str],
    other_bytes: int = 0,
) -> Any:
    """The result of the reader of a module.

    ``library`` names the reader in messages. ``model`` is the file that errors refer to; its size
    and ``other_bytes``, the size of other files of the model, bound memory and time.

    Raises the `PtmError` of the reader, and InputError PTM-I254 if the reader raises anything else,
    crashes or exceeds its time.
    """
    size = model.stat().st_size + other_bytes
    memory = str(_MEMORY + _MEMORY_PER_BYTE * size)
    try:
        run = subprocess.run(
            **module_process(module, memory, *arguments),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_SECONDS + _SECONDS_PER_BYTE * size,
        )
    except subprocess.TimeoutExpired as error:
        reply = _last_reply(error.stdout or b"")
        reason = f"it did not end in {error.timeout:.0f} s"
    else:
        reply = _last_reply(run.stdout)
        reason = f"it ended with status {run.returncode}"
    if "error" in reply:
        kind, fields = reply["error"]
        raise _ERRORS.get(kind, InputError)(**fields)
    if "answer" not in reply:
        raise unreadable(library, model, reply.get("fault") or reason)
    return reply["answer"]


def _last_reply(output: bytes) -> dict[str, Any]:
    """The last complete reply in the output of a child; {} without one."""
    for text in reversed(output.decode("utf-8", "replace").split(_MARK)[1:]):
        with suppress(ValueError):
            reply = json.loads(text.partition("\n")[0])
            if isinstance(reply, dict):
                return reply
    return {}


def require(module: str, message: str, remedy: str, file: Path | None = None) -> None:
    """Raises MissingComponentError PTM-M100 unless a module of a library is installed."""
    if find_spec(module) is None:
        raise MissingComponentError("PTM-M100", message, file=file, remedy=remedy)


def unreadable(library: str, model: Path, reason: str) -> InputError:
    """The error for a file that a library cannot read, PTM-I254."""
    return InputError(
        "PTM-I254",
        f"{library} cannot read it ({reason})",
        file=model,
        remedy="export it again, or convert it to GLB",
    )


def serve(reader: Callable[..., Any]) -> None:
    """Replies to `run_in_sandbox` and ends this process."""
    memory, *arguments = sys.argv[1:]
    with suppress(ImportError, ValueError, OSError):  # a system without limits, or with lower ones
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (int(memory), int(memory)))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        reply = {"answer": reader(*arguments)}
    except PtmError as error:
        reply = {"error": (type(error).__name__, vars(error))}
    except Exception as error:  # the libraries share no exception class
        lines = str(error).splitlines() or [type(error).__name__]
        reply = {"fault": lines[0]}
    _send(reply)
    os._exit(0)  # a library may crash while it is unloaded


def reply_so_far(answer: Any) -> None:
    """Replies in case that this process crashes, or exceeds its time, before the reader returns."""
    _send({"answer": answer})


def _send(reply: dict[str, Any]) -> None:
    print(f"\n{_MARK}{json.dumps(reply)}", flush=True)
