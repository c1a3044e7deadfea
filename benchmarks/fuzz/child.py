"""A process that reads hostile inputs, one after the other, and tells what became of each."""

from __future__ import annotations

import contextlib
import io
import os
import resource
import time
import traceback
import warnings
from collections import Counter
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from typing import Any

from benchmarks.fuzz.target import Case, Target
from benchmarks.fuzz.watch import (
    Watch,
    forget_most_memory,
    listing,
    memory_now,
    most_memory,
)

#: What a reader may take besides its limit, bytes: tables, copies, and the input itself many times.
ALLOWANCE = 1 << 28
#: Address space beyond what the process has when it begins. Reserving it is no fault; not getting
#: it must be an error of ours.
ADDRESSES = 1 << 31
#: So many inputs are told of at a time, and the folder beside is looked at after as many.
BATCH = 250


@dataclass
class Told:
    """What became of some inputs.

    Attributes
    ----------
    outcomes: of each kind, how many.
    findings: number of the input, and what is wrong.
    longest: processor time of one, seconds.
    most: memory of one, bytes.
    done: the number of the next.
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
    current: Any, told: Connection,
) -> None:  # fmt: skip
    """Reads the inputs ``start``, ``start + step``, … below ``stop``; runs in a process of its own.

    slow: processor time that an input may take, seconds.
    current: shared number of the input that is being read.
    told: where a `Told` goes after every batch; None is the end.
    """
    quiet()
    inside, outside, elsewhere = places(Path(folder))
    watch = Watch(inside, outside)
    target: Target = make(inside, outside)
    warm(target, seed, name)
    with open("/proc/self/statm", "rb") as file:
        taken = int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (taken + ADDRESSES, taken + ADDRESSES))
    before = listing(outside) | listing(elsewhere)
    batch = Told()
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
            told.send(batch)
            batch = Told()
    told.send(None)


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
    for number in range(-30, 0):
        with contextlib.suppress(Exception):
            target.read(target.make(generator(seed, name, number)))


def read(target: Target, watch: Watch, case: Case, number: int, slow: float, batch: Told) -> None:
    """Reads one input and notes what came of it."""
    from ptmtools.errors import PtmError

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
