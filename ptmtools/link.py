"""Conditions of a network link, and their change over time: bandwidth, latency and loss.

A trace is a row of steps in which nothing changes; behind the last one the first begins again. It
is read from JSON (`ptmtools/schemas/trace.schema.json`) or from CSV, whose first line names the
columns: ``seconds``, and those of ``bandwidth``, ``latency`` and ``loss`` that matter.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from os import PathLike
from typing import Any

from ptmtools import schemas
from ptmtools.errors import InputError, LimitError, naming
from ptmtools.files import open_regular

#: Largest file that is read, MiB: a day in steps of a tenth of a second as CSV.
LARGEST = 32
_COLUMNS = ("seconds", "bandwidth", "latency", "loss")


@dataclass(frozen=True)
class Step:
    """For `seconds`, the link carries at most `bandwidth` bit/s (None: no limit, 0: it is down),
    the first byte takes `latency` s longer, and a share `loss` of the packets is lost."""

    seconds: float
    bandwidth: float | None = None
    latency: float = 0.0
    loss: float = 0.0


@dataclass(frozen=True)
class Trace:
    """At least one step, in one of which at least something gets through."""

    steps: tuple[Step, ...]


def read_trace(path: str | PathLike[str]) -> Trace:
    """The trace in a file, CSV if its name ends so, else JSON.

    Raises
    ------
    InputError: PTM-I710 it is no trace: it does not match the schema, or transmits nothing.
    LimitError: PTM-L204 it is larger than `LARGEST`.
    OSError: it cannot be read.
    """
    with open_regular(path) as file:
        data = file.read((LARGEST << 20) + 1)
    with naming(path):
        if len(data) > LARGEST << 20:
            raise LimitError(
                "PTM-L204", f"more than {LARGEST} MiB", remedy="use a shorter trace: it repeats"
            )
        try:
            if str(path).lower().endswith(".csv"):
                document = _table(data)
                schemas.check(document, schemas.TRACE)
            else:
                document = schemas.read(data, schemas.TRACE)
        except schemas.ShapeError as fault:
            raise _trace_error(fault.message, fault.place or None) from None
        trace = Trace(
            tuple(
                Step(**{name: step[name] for name in _COLUMNS if name in step})
                for step in document["steps"]
            )
        )
        if not any(step.bandwidth != 0 for step in trace.steps):
            raise _trace_error("the bandwidth of every step is 0", "steps")
        return trace


def _table(data: bytes) -> dict[str, Any]:
    """The JSON document equivalent to a CSV file; an empty field is left out."""
    try:
        lines = data.decode("utf-8-sig").splitlines()
        header, *rows = list(csv.reader(lines, strict=True)) or [[]]
    except (UnicodeDecodeError, csv.Error) as fault:
        raise schemas.ShapeError(f"not CSV ({fault})") from None
    columns = [name.strip() for name in header]
    if "seconds" not in columns or set(columns) - {*_COLUMNS} or len({*columns}) < len(columns):
        raise schemas.ShapeError("the first line does not name the columns").under("line 1")
    steps = []
    for number, row in enumerate(rows, 2):
        if len(row) not in (0, len(columns)):
            wrong = f"{len(row)} fields for {len(columns)} columns"
            raise schemas.ShapeError(wrong).under(f"line {number}")
        try:
            fields = zip(columns, row, strict=False)
            steps.append({name: float(text) for name, text in fields if text.strip()})
        except ValueError:
            raise schemas.ShapeError("a field is no number").under(f"line {number}") from None
    return {
        "format": "ptmtools trace",
        "schema": 1,
        "steps": [step for step in steps if step],
    }


def _trace_error(problem: str, place: str | None) -> InputError:
    return InputError(
        "PTM-I710",
        f"no trace of a network: {problem}",
        place=place,
        remedy="see docs/formats/walk.md#traces",
    )


PROTOCOLS = ("h1", "h2")


@dataclass(frozen=True)
class Conditions:
    """The state of a link.

    Attributes
    ----------
    bandwidth: bit/s, or None if it has no limit.
    latency: s from a request to the first byte of its response.
    overhead: bytes of headers a request.
    protocol: one of `PROTOCOLS`.
    connections: at most, on ``h1``.
    trace: how the link changes over time: at each moment the lesser bandwidth of the two holds, and
        the sum of the latencies.
    seed: of the random losses.

    Raises InputError PTM-I111 for an invalid value.
    """

    bandwidth: float | None = None
    latency: float = 0.1
    overhead: int = 300
    protocol: str = "h1"
    connections: int = 6
    trace: Trace | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        wrong = ""
        if self.bandwidth is not None and not 0 < self.bandwidth < math.inf:
            wrong = f"a bandwidth of {self.bandwidth:g} bit/s"
        elif not 0 <= self.latency < math.inf:
            wrong = f"a latency of {self.latency:g} s"
        elif self.overhead < 0:
            wrong = f"an overhead of {self.overhead} bytes"
        elif self.protocol not in PROTOCOLS:
            wrong = f"the protocol {self.protocol!r}, which is none of {', '.join(PROTOCOLS)}"
        elif self.connections < 1:
            wrong = f"{self.connections} connections"
        if wrong:
            raise InputError(
                "PTM-I111", f"no link has {wrong}", remedy="leave it out for its default"
            )
