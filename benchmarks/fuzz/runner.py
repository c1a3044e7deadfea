"""Runs targets in processes that may die or hang, and gathers what they find."""

from __future__ import annotations

import multiprocessing
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.fuzz.child import Tally, work

#: Processor time that an input may take, seconds; and after how many of the clock it hangs, several
#: times as many on a busy machine.
SLOW, HANGS = 5.0, 60.0
#: Setting a target up takes this long at most.
SETUP = 600.0
#: A kind of input ends after this many findings.
ENOUGH = 200


@dataclass
class Summary:
    """What became of all inputs of one kind."""

    name: str
    wanted: int
    tally: Tally = field(default_factory=Tally)
    seconds: float = 0.0

    @property
    def read(self) -> int:
        """How many inputs were read to the end."""
        return self.tally.outcomes.total()


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
                    part.attend(summary.tally)
            if len(summary.tally.findings) > ENOUGH:
                for part in parts:
                    part.stop()
                break
            time.sleep(0.02)
    summary.seconds = time.perf_counter() - begun
    summary.tally.findings.sort()
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
        self._reports, sends = context.Pipe(duplex=False)
        self._current = context.Value("q", -1, lock=False)
        self._seen, self._since = -1, time.monotonic()
        folder = self._folder / str(self._lives)
        self._process = context.Process(
            target=work,
            kwargs={**self._settings, "folder": str(folder), "start": self._next,
                    "current": self._current, "reports": sends},
            daemon=True,
        )  # fmt: skip
        self._process.start()
        sends.close()

    def attend(self, tally: Tally) -> None:
        """Adds the reports of the process to the tally; replaces a process that died or hangs."""
        while self._reports.poll():
            try:
                batch = self._reports.recv()
            except EOFError:
                self._died(tally)
                return
            if batch is None:
                self.stop()
                return
            _add(tally, batch)
            self._next = batch.done
        number = self._current.value
        if number != self._seen:
            self._seen, self._since = number, time.monotonic()
        waited = time.monotonic() - self._since
        if waited > (self._hangs if number >= 0 else SETUP):
            if number < 0:
                tally.findings.append((number, "could not be set up"))
                self.stop()
                return
            tally.findings.append((number, f"hangs: no end after {waited:.0f} s"))
            self._process.kill()
            self._succeed(number, tally)

    def _died(self, tally: Tally) -> None:
        self._process.join(5)
        number = self._current.value
        tally.findings.append((number, f"the process ended with status {self._process.exitcode}"))
        if number < 0:
            self.stop()
            return
        self._succeed(number, tally)

    def _succeed(self, number: int, tally: Tally) -> None:
        """Starts the next process behind the input that ended this one. The unreported rest of the
        batch is lost and not counted."""
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
        self._reports.close()


def _add(tally: Tally, batch: Tally) -> None:
    tally.outcomes += batch.outcomes
    tally.findings += batch.findings
    tally.longest = max(tally.longest, batch.longest)
    tally.most = max(tally.most, batch.most)
