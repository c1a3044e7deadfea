"""Runs through a campus as Markdown: cost and quality of each preset, and received bytes over
time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ptmtools_lab.campus.simulation import PAUSE, CampusRun

FORMAT, SCHEMA = "ptmtools campus walk", 1
#: Seconds from one row of the table of bytes to the next.
EVERY = 30.0


def table(runs: Sequence[CampusRun]) -> list[str]:
    """Rows of measures, a column for each preset."""
    rows: list[tuple[str, Callable[[CampusRun], str]]] = [
        ("textures / lightmaps", lambda r: f"{r.quality.diffuse} / {r.quality.light}"),
        ("time until all coarsest meshes are loaded, s", lambda r: _or(r.begun, "{:.1f}")),
        ("graphics memory of these meshes, MB", lambda r: _mega(r.floor)),
        ("maximum graphics memory, MB", lambda r: _mega(int(r.memory.max()))),
        ("received with headers, MB", lambda r: _mega(r.body + r.overhead)),
        ("requests", lambda r: f"{r.requests:,}"),
        ("link idle", lambda r: f"{r.idle_share:.0%}"),
        (f"pauses of {PAUSE:g} s or more", lambda r: f"{r.pauses}"),
        ("time with an incomplete nearest object", lambda r: f"{r.late:.0%}"),
        ("mean time from near to complete, s", lambda r: _or(r.delay, "{:.1f}")),
        ("objects completed too late, of all that came near", lambda r: f"{r.never} of {_all(r)}"),
        ("textures already loaded when first needed", lambda r: f"{r.reused:.0%}"),
        ("e", lambda r: _or(r.e, "{:.2f}")),
    ]
    return [*_head("", runs), *(_row(name, [of(run) for run in runs]) for name, of in rows)]


def received(runs: Sequence[CampusRun]) -> list[str]:
    """MB of files received by time, a column for each preset; in brackets the increase since the
    row before."""
    time = runs[0].time
    instants = [*np.arange(EVERY, time[-1], EVERY).tolist(), float(time[-1])]
    lines, before = _head("MB of files after, s", runs), [0.0] * len(runs)
    for instant in instants:
        at = int(np.searchsorted(time, instant, "right")) - 1
        now = [float(run.fetched[at]) for run in runs]
        cells = [f"{_mega(n)} (+{_mega(n - b)})" for n, b in zip(now, before, strict=True)]
        lines.append(_row(f"{instant:.0f}", cells))
        before = now
    return lines


def document(campus: str, runs: Sequence[CampusRun]) -> dict[str, Any]:
    """All runs as a JSON document of its schema."""
    return {
        "format": FORMAT,
        "schema": SCHEMA,
        "campus": campus,
        "seconds": float(runs[0].time[-1]),
        "runs": [
            {
                "preset": run.quality.name,
                "bandwidth": run.conditions.bandwidth,
                "begun": run.begun,
                "memory": {"start": run.floor, "most": int(run.memory.max())},
                "bytes": round(run.body),
                "overheadBytes": round(run.overhead),
                "requests": run.requests,
                "idle": run.idle_share,
                "pauses": run.pauses,
                "late": run.late,
                "delay": _known(run.delay),
                "shown": len(run.delays),
                "never": run.never,
                "reused": run.reused,
                "e": _known(run.e),
            }
            for run in runs
        ],
    }


def _known(value: float) -> float | None:
    return None if np.isnan(value) else value


def _head(first: str, runs: Sequence[CampusRun]) -> list[str]:
    return [_row(first, [run.quality.name for run in runs]), "|---|" + "--:|" * len(runs)]


def _row(name: str, cells: Sequence[str]) -> str:
    return f"| {name} | {' | '.join(cells)} |"


def _all(run: CampusRun) -> int:
    return len(run.delays) + run.never


def _mega(count: float) -> str:
    return f"{count / 1e6:.1f}"


def _or(value: float | None, form: str) -> str:
    return "–" if value is None or np.isnan(value) else form.format(value)
