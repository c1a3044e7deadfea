"""Runs targets in processes that may die or hang, and gathers what they find."""

from __future__ import annotations

import multiprocessing
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.fuzz.child import Told, work

#: Processor time that an input may take, seconds; and after how many of the clock it hangs, several
#: times as many on a busy machine.
SLOW, HANGS = 5.0, 60.0
#: Setting a target up takes this long at most.
SETUP = 600.0
#: After so many findings of one kind of input the rest of it is left.
ENOUGH = 200


@dataclass
class Summary:
    """What became of all inputs of one kind."""

    name: str
    wanted: int
    told: Told = field(default_factory=Told)
    seconds: float = 0.0

    @property
    def read(self) -> int:
        """How many inputs were read to the end."""
        return self.told.outcomes.total()


def run(
    name: str,
    make: Callable[..., Any],
    seed: int,
    start: int,
    count: int,
    jobs: int = 1,
    slow: float = SLOW,
    hangs: float = HANGS,
) -> Summary:
    """Reads ``count`` inputs from number ``start`` on, in ``jobs`` processes."""
    summary = Summary(name, count)
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix=f"fuzz-{name}-") as scratch:
        parts = [_Part(name, make, Path(scratch) / str(j), seed, start + j, start + count, jobs,
                       slow, hangs)
                 for j in range(min(jobs, count))]  # fmt: skip
        while any(part.running for part in parts):
            for part in parts:
                if part.running:
                    part.attend(summary.told)
            if len(summary.told.findings) > ENOUGH:
                for part in parts:
                    part.stop()
                break
            time.sleep(0.02)
    summary.seconds = time.perf_counter() - begun
    summary.told.findings.sort()
    return summary


class _Part:
    """The share of one process at a time; one that dies or hangs has a successor."""

    def __init__(
        self, name: str, make: Callable[..., Any], folder: Path, seed: int,
        start: int, stop: int, step: int, slow: float, hangs: float,
    ) -> None:  # fmt: skip
        self._settings: Mapping[str, Any] = {
            "make": make, "name": name, "seed": seed, "stop": stop, "step": step, "slow": slow
        }  # fmt: skip
        self._folder = folder
        self._next = start
        self._step = step
        self._stop = stop
        self._hangs = hangs
        self._lives = 0
        self.running = True
        self._begin()

    def _begin(self) -> None:
        self._lives += 1
        context = multiprocessing.get_context("spawn")
        self._told, sends = context.Pipe(duplex=False)
        self._current = context.Value("q", -1, lock=False)
        self._seen, self._since = -1, time.monotonic()
        folder = self._folder / str(self._lives)
        self._process = context.Process(
            target=work,
            kwargs={**self._settings, "folder": str(folder), "start": self._next,
                    "current": self._current, "told": sends},
            daemon=True,
        )  # fmt: skip
        self._process.start()
        sends.close()

    def attend(self, told: Told) -> None:
        """Takes what was told, and sees whether the process lives and goes on."""
        while self._told.poll():
            try:
                batch = self._told.recv()
            except EOFError:
                self._died(told)
                return
            if batch is None:
                self.stop()
                return
            _add(told, batch)
            self._next = batch.done
        number = self._current.value
        if number != self._seen:
            self._seen, self._since = number, time.monotonic()
        waited = time.monotonic() - self._since
        if waited > (self._hangs if number >= 0 else SETUP):
            if number < 0:
                told.findings.append((number, "could not be set up"))
                self.stop()
                return
            told.findings.append((number, f"hangs: no end after {waited:.0f} s"))
            self._process.kill()
            self._succeed(number, told)

    def _died(self, told: Told) -> None:
        self._process.join(5)
        number = self._current.value
        told.findings.append((number, f"the process ended with status {self._process.exitcode}"))
        if number < 0:
            self.stop()
            return
        self._succeed(number, told)

    def _succeed(self, number: int, told: Told) -> None:
        """The next process goes on behind the input that ended this one. What was not told of the
        batch is lost, and is not counted."""
        self.stop()
        self._next = number + self._step
        if self._next < self._stop and self._lives < ENOUGH:
            self.running = True
            self._begin()

    def stop(self) -> None:
        """Ends the process."""
        self.running = False
        self._process.kill()
        self._process.join()
        self._told.close()


def _add(told: Told, batch: Told) -> None:
    told.outcomes += batch.outcomes
    told.findings += batch.findings
    told.longest = max(told.longest, batch.longest)
    told.most = max(told.most, batch.most)
