"""What comes back from a worker: results of some tasks, and what stopped it."""

from __future__ import annotations

import pickle
import traceback
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Outcome:
    """The results of the first tasks, and the exception of the one after, if any."""

    results: list[Any]
    fault: Exception | None = None

    def __iter__(self) -> Iterator[Any]:
        """The results; then raises the exception."""
        yield from self.results
        if self.fault:
            raise self.fault


def outcome(work: Iterable[Any]) -> Outcome:
    """What ``work`` yields, up to its exception."""
    results: list[Any] = []
    try:
        for result in work:
            results.append(result)
    except Exception as fault:
        return failed(fault, results)
    return Outcome(results)


def failed(fault: Exception, results: Sequence[Any] = ()) -> Outcome:
    """What came before an exception, and it."""
    return Outcome(list(results), _travelling(fault))


def _travelling(fault: Exception) -> Exception:
    """The exception with its traceback as a note, or one that says the same if it would not
    survive the journey."""
    fault.add_note("In a worker:\n" + "".join(traceback.format_exception(fault)))
    fault.__cause__ = fault.__context__ = None
    try:
        if type(pickle.loads(pickle.dumps(fault))) is type(fault):
            return fault
    except Exception:  # whatever its class does
        pass
    plain = RuntimeError(f"{type(fault).__name__}: {fault}")
    for note in fault.__notes__:
        plain.add_note(note)
    return plain
