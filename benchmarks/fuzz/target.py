"""What is fuzzed: something that makes hostile inputs, and reads them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, Protocol


@dataclass(frozen=True)
class Case:
    """One input, and what its maker wants to remember of it."""

    data: bytes
    told: Any = None


class Target(Protocol):
    """A reader under test. It is made in the process that uses it.

    Attributes
    ----------
    limit: bytes that a read may take by its own options, whatever the input says.
    """

    limit: int

    def __init__(self, folder: Path, outside: Path) -> None:
        """``folder`` is all that may be written in, ``outside`` lies beside it and is nobody's."""

    def make(self, rng: Random) -> Case:
        """An input; the same for the same state of ``rng``."""

    def read(self, case: Case) -> str:
        """Reads it, and says in a word or two what came out.

        Raises PtmError for what is refused; anything else that is raised is a finding.
        """
