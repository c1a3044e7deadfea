"""A reader with every fault that is looked for, to see that each is found."""

from __future__ import annotations

import contextlib
import ctypes
import os
import subprocess
import time
from pathlib import Path
from random import Random

import numpy as np

from benchmarks.fuzz.mutation import Case
from ptmtools.errors import InputError

#: What is wrong → words of the finding.
FAULTS = {
    "nothing": "",
    "an error of ours": "",
    "another error": "ZeroDivisionError",
    "memory that is not to be had": "memory ran out",
    "the same, raised as an error of ours": "memory ran out",
    "more memory than is allowed": "took 6",
    "too slow": "took",
    "writes beside": "for writing",
    "links beside": "os.symlink",
    "removes beside": "os.remove",
    "removes beside, by a descriptor": "os.remove",
    "opens beside, by way of a link": "opened",
    "calls a program": "subprocess.Popen",
    "writes beside without Python": "something changed beside",
    "dies": "ended with status",
    "hangs": "hangs",
}


class Planted:
    """As `Target`."""

    limit = 1 << 20

    def __init__(self, folder: Path, outside: Path) -> None:
        self._folder, self._outside = folder, outside
        for name in ("secret", "old", "older"):
            (outside / name).write_bytes(b"secret")
        os.symlink(outside, folder / "link")
        self._warm = 30

    def make(self, rng: Random) -> Case:
        """One of the faults."""
        return Case(b"", rng.choice(list(FAULTS)))

    def read(self, case: Case) -> str:
        """Commits it, but not while it is warmed up."""
        self._warm -= 1
        if self._warm >= 0:
            return "warm"
        match case.facts:
            case "an error of ours":
                raise InputError("PTM-I001", "refused")
            case "another error":
                return str(1 // self._warm.imag)
            case "memory that is not to be had":
                np.zeros(1 << 45)
            case "the same, raised as an error of ours":
                try:
                    np.zeros(1 << 45)
                except MemoryError as error:
                    raise InputError("PTM-I001", "damaged") from error
            case "more memory than is allowed":
                np.ones(600_000_000, np.uint8)
            case "too slow":
                start = time.process_time()
                while time.process_time() < start + 1:
                    pass
            case "writes beside":
                (self._outside / "new").write_bytes(b"")
            case "links beside":
                os.symlink("a", self._outside / os.urandom(9).hex())
            case "removes beside":
                (self._outside / "old").unlink(missing_ok=True)
            case "removes beside, by a descriptor":
                descriptor = os.open(self._folder / "link", os.O_RDONLY)
                with contextlib.suppress(FileNotFoundError):
                    os.unlink("older", dir_fd=descriptor)
                os.close(descriptor)
            case "opens beside, by way of a link":
                (self._folder / "link/secret").read_bytes()
            case "calls a program":
                subprocess.run(["true"])
            case "writes beside without Python":
                libc = ctypes.CDLL(None)
                libc.creat(os.fsencode(self._outside / os.urandom(9).hex()), 0o644)
            case "dies":
                os.abort()
            case "hangs":
                time.sleep(3600)
        return "read"
