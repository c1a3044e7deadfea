"""The process that reads hostile inputs one after the other and reports the outcome of each.

It also watches what a reader does besides reading. Python reports to an audit hook every file that
is opened, renamed, linked or removed, and processes and connections; what compiled libraries open
without Python shows in a comparison of the folders that must stay untouched.
"""

from __future__ import annotations

import contextlib
import io
import os
import resource
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from typing import Any

from benchmarks.fuzz.mutation import Case, Target

#: What a reader may take besides its limit, bytes: tables, copies, and the input itself many times.
ALLOWANCE = 1 << 28
#: Address space beyond what the process has when it begins. Reserving it is no fault; not getting
#: it must be an error of ours.
ADDRESSES = 1 << 31
#: Inputs per report; the untouched folders are compared after each report.
BATCH = 250
#: Inputs that are read before the measured ones; a target may have a number of its own, `warm_ups`.
WARM = 30


@dataclass
class Tally:
    """Outcomes of some inputs.

    Attributes
    ----------
    outcomes: number of inputs by outcome.
    findings: number of the input, and the fault.
    longest: processor time of the slowest input, seconds.
    most: memory of the largest input, bytes.
    done: number of the next input.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    findings: list[tuple[int, str]] = field(default_factory=list)
    longest: float = 0.0
    most: int = 0
    done: int = 0


def generator(seed: int, name: str, number: int) -> Random:
    """The chances of one input."""
    return Random(f"{seed} {name} {number}")


def work(
    make: Any, name: str, folder: str, seed: int, start: int, stop: int, step: int, slow: float,
    current: Any, reports: Connection,
) -> None:  # fmt: skip
    """Reads the inputs ``start``, ``start + step``, … below ``stop``; runs in a process of its own.

    slow: processor time that an input may take, seconds.
    current: shared number of the input that is being read.
    reports: receives a `Tally` after every batch, then None.
    """
    quiet()
    inside, outside, elsewhere = places(Path(folder))
    target: Target = make(inside, outside)
    watch = Watch(inside, outside, getattr(target, "allowed", ()))
    warm(target, seed, name)
    with open("/proc/self/statm", "rb") as file:
        taken = int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (taken + ADDRESSES, taken + ADDRESSES))
    before = listing(outside) | listing(elsewhere)
    batch = Tally()
    numbers = range(start, stop, step)
    for count, number in enumerate(numbers, 1):
        current.value = number
        case = target.make(generator(seed, name, number))
        read(target, watch, case, number, slow, batch)
        # At once if there is a finding: the next input may end this process.
        if batch.findings or not count % BATCH or count == len(numbers):
            if listing(outside) | listing(elsewhere) != before:
                batch.findings.append((number, "something changed beside the folder"))
                before = listing(outside) | listing(elsewhere)
            batch.done = number + step
            reports.send(batch)
            batch = Tally()
    reports.send(None)


def places(folder: Path) -> tuple[Path, Path, Path]:
    """The folder for reading and writing, one beside it, and one to be in; temporary files and
    caches lie in the first."""
    inside, outside, elsewhere = (folder / name for name in ("inside", "outside", "elsewhere"))
    for made in (inside, outside, elsewhere, inside / "tmp"):
        made.mkdir(parents=True, exist_ok=True)
    os.environ["TMPDIR"] = str(inside / "tmp")
    os.environ["XDG_CACHE_HOME"] = str(inside / "cache")
    os.chdir(elsewhere)
    return inside, outside, elsewhere


def quiet() -> None:
    """What libraries print goes nowhere."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    warnings.simplefilter("ignore")


def warm(target: Target, seed: int, name: str) -> None:
    """Modules are imported and kernels compiled before anything is measured."""
    for number in range(-getattr(target, "warm_ups", WARM), 0):
        with contextlib.suppress(Exception):
            target.read(target.make(generator(seed, name, number)))


def read(target: Target, watch: Watch, case: Case, number: int, slow: float, batch: Tally) -> None:
    """Reads one input and notes what came of it.

    An input at which kernels are compiled is read again: their compilation is not its cost.
    """
    from ptmtools.errors import PtmError
    from ptmtools.jit import compilations

    compiled = compilations()
    forget_most_memory()
    before, start = memory_now(), time.process_time()
    fault = ""
    watch.begin()
    try:
        outcome = target.read(case)
    except PtmError as error:
        outcome = error.code
        if error.exit_status == 1 or _out_of_memory(error):
            fault = f"memory ran out: {error}"
        elif "\n" in str(error):
            fault = f"an error of several lines: {str(error)!r:.200}"
    except MemoryError:
        outcome, fault = "memory", f"memory ran out: {_where()}"
    except BaseException:
        outcome, fault = "crash", _where()
    done = watch.end()
    took = time.process_time() - start
    grown = most_memory() - before
    if compilations() != compiled and not (fault or done):
        read(target, watch, case, number, slow, batch)
        return
    batch.outcomes[outcome] += 1
    batch.longest, batch.most = max(batch.longest, took), max(batch.most, grown)
    if fault:
        batch.findings.append((number, fault))
    batch.findings += [(number, deed) for deed in done[:3]]
    if took > slow:
        batch.findings.append((number, f"took {took:.1f} s"))
    if grown > target.limit + ALLOWANCE:
        batch.findings.append((number, f"took {grown / 1e6:,.0f} MB"))


def _out_of_memory(error: BaseException | None) -> bool:
    """Whether an error arose because the memory that was asked for was not to be had."""
    while error is not None:
        if isinstance(error, MemoryError):
            return True
        error = error.__cause__ or error.__context__
    return False


def _where() -> str:
    """The last lines of a traceback, on one line."""
    lines = traceback.format_exc(limit=-3).strip().splitlines()[1:]
    return " | ".join(line.strip() for line in lines[::-1] if "^^^" not in line)[:500]


def captured() -> contextlib.AbstractContextManager[io.StringIO]:
    """What commands print."""
    return contextlib.redirect_stdout(io.StringIO())


_WRITE = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
#: Event → which of its arguments are paths that it changes, and which the descriptor of a folder
#: that goes with each.
_CHANGES: dict[str, tuple[tuple[int, int | None], ...]] = {
    "os.rename": ((0, 2), (1, 3)), "os.link": ((1, 3),), "os.symlink": ((1, 2),),
    "os.mkdir": ((0, 2),), "os.rmdir": ((0, 1),), "os.remove": ((0, 1),),
    "os.truncate": ((0, None),), "os.chmod": ((0, 2),), "os.chown": ((0, 3),),
    "os.utime": ((0, 3),),
    "os.setxattr": ((0, None),), "os.removexattr": ((0, None),),
    "shutil.rmtree": ((0, 1),), "shutil.move": ((0, None), (1, None)),
}  # fmt: skip
_FORBIDDEN = ("subprocess.", "os.system", "os.exec", "os.posix_spawn", "os.fork", "socket.connect",
              "socket.bind", "socket.getaddrinfo", "urllib.", "pickle.find_class")  # fmt: skip


class Watch:
    """Notes what is done outside of ``inside`` between `begin` and `end`.

    Parameters
    ----------
    inside: the folder in which anything may be written.
    outside: a folder that may not even be read.
    allowed: events of the audit hook that are no faults.
    """

    def __init__(self, inside: Path, outside: Path, allowed: Collection[str] = ()) -> None:
        self._allowed = allowed
        self._inside = os.path.realpath(inside)
        self._outside = os.path.realpath(outside)
        self._watching = False
        self._faults: list[str] = []
        sys.addaudithook(self._hook)

    def begin(self) -> None:
        """From now on."""
        self._faults = []
        self._watching = True

    def end(self) -> list[str]:
        """What was done since that may not be done."""
        self._watching = False
        return self._faults

    def _hook(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self._watching:
            return
        if event == "open":
            self._opened(*arguments)
        elif event in _CHANGES:
            for path, folder in _CHANGES[event]:
                self._changed(event, arguments[path], None if folder is None else arguments[folder])
        elif event.startswith(_FORBIDDEN) and event not in self._allowed:
            self._faults.append(f"{event} {str(arguments)[:200]}")

    def _opened(self, path: Any, mode: Any, flags: Any) -> None:
        if isinstance(path, int) or path is None:
            return
        real = os.path.realpath(os.fsdecode(path))
        if isinstance(flags, int) and flags & os.O_NOFOLLOW:
            real = _itself(os.fsdecode(path))
        if isinstance(flags, int) and flags & _WRITE and not self._mine(real):
            self._faults.append(f"opened {real} for writing")
        elif self._within(real, self._outside):
            self._faults.append(f"opened {real}")

    def _changed(self, event: str, path: Any, descriptor: Any) -> None:
        if isinstance(path, int):
            return
        name = os.fsdecode(path)
        if isinstance(descriptor, int) and descriptor >= 0 and not os.path.isabs(name):
            name = os.path.join(os.path.realpath(f"/proc/self/fd/{descriptor}"), name)
        real = _itself(name)
        if not self._mine(real):
            self._faults.append(f"{event} {real}")

    def _mine(self, real: str) -> bool:
        # Kernels that are compiled on the way are kept beside their modules.
        return self._within(real, self._inside) or "__pycache__" in real

    @staticmethod
    def _within(path: str, folder: str) -> bool:
        return path == folder or path.startswith(folder + os.sep)


def _itself(path: str) -> str:
    """Where a path leads, a link at its end being itself."""
    folder, name = os.path.split(os.path.abspath(path))
    return os.path.join(os.path.realpath(folder), name)


def listing(folder: Path) -> dict[str, tuple[int, int, int]]:
    """Kind, size and time of change of all that lies in a folder; links are not followed."""
    actual = {}
    for path in sorted(folder.rglob("*")):
        status = os.lstat(path)
        actual[str(path)] = (status.st_mode, status.st_size, status.st_mtime_ns)
    return actual


def memory_now() -> int:
    """Bytes of memory that this process holds."""
    with open("/proc/self/statm", "rb") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def most_memory() -> int:
    """The most that it held since `forget_most_memory`."""
    with open("/proc/self/status", "rb") as file:
        for line in file:
            if line.startswith(b"VmHWM:"):
                return int(line.split()[1]) * 1024
    return 0


def forget_most_memory() -> None:
    """Starts to count anew."""
    with open("/proc/self/clear_refs", "wb") as file:
        file.write(b"5")
