"""Reports runs as a table of text, as a JSON document, and as CSV with a row for each frame."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import groupby
from types import MappingProxyType
from typing import Any

import numpy as np

from ptmtools.link import Conditions
from ptmtools.quantities import count, size
from ptmtools_lab.campus.world import CampusWorld
from ptmtools_lab.comparing import RunResult
from ptmtools_lab.measures import FRAMES, PER_DEGREE, PIXELS, SHARES
from ptmtools_lab.policies.paper import PaperOptions
from ptmtools_lab.world import World

FORMAT, SCHEMA = "ptmtools simulation", 1
#: Explanation of the table.
INTRODUCTION = (
    "e is the difference from the fully loaded image: the root mean square over red, green and",
    "blue (0 to 255), averaged over the pixels. 0 is no difference, 1 a step of 8-bit colour.",
    "Waste is the share of received bytes that no frame used. For a visitor who stays at the start",
    "of the walk, the columns 50%, 90% and 99% give the seconds until e has fallen by that share.",
)
#: Columns of the CSV.
COLUMNS = (
    *("policy", "bandwidth", "latency", "protocol", "memory", "walk", "time", "still"),
    *("e", "rmse", "missing", "quality", "texture_bytes", "received_bytes"),
)
_DIGITS = 6


def table(
    played: Sequence[RunResult],
    worlds: Mapping[str, World],
    *,
    lit: bool = False,
    against: str | None = None,
    campuses: Mapping[str, CampusWorld] = MappingProxyType({}),
) -> list[str]:
    """Lines of text: a block for each link and memory, a row for each policy, means over walks."""
    lines = [*INTRODUCTION]
    if lit:
        lines.append("A lamp lights the scene.")
    if against is not None:
        lines.append(f"The reference is {against}, fully loaded.")
    if campuses:
        lacking = np.mean([place.lacking for place in campuses.values()])
        lines.append(
            f"The fully loaded campus has an e of {lacking:.2f}, because its meshes are "
            "simplified. They count as memory, too."
        )
    several, flip = len(worlds) > 1, any(p.flip is not None for p in played)
    if flip:
        lines.append(
            f"FLIP: mean over {FRAMES} frames of {PIXELS:,} pixels, {PER_DEGREE:g} per degree; 0 "
            "to 1."
        )
    lines.append("")
    lines += [
        f"{name}: {world.track.time[-1]:.0f} s, {world.frames:,} frames, the viewpoint at rest in "
        f"{world.track.still.mean():.0%} of them"
        for name, world in worlds.items()
    ]
    wide = max(len(p.run.policy) for p in played)
    spread = f"{'of walks':>13} " if several else ""
    final = " ".join(f"{f'{share:.0%}':>6}" for share in SHARES)
    head = (
        f"  {'policy':<{wide}} {'e':>6} {spread}{'p95':>6} {'still':>6} {'moving':>6} "
        f"{'rmse':>6} {'  FLIP ' if flip else ''}{'missing':>7} {'quality':>7} {'received':>9} "
        f"{'waste':>5} {'requests':>8} {'stalled':>7}  {final}"
    )
    for (link, memory), runs in groupby(played, lambda p: (p.run.conditions, p.memory)):
        block = list(runs)
        budget = block[0].run.budget
        lines += ["", f"{link_text(link)}; texture memory {memory} ({size(budget)})", head]
        for policy, some in groupby(block, lambda p: p.run.policy):
            lines.append(_row(f"{policy:<{wide}}", list(some), flip=flip))
    over = sum(p.measures.overruns for p in played)
    if over:
        lines += ["", f"{count(over, 'frame')} above the budget"]
    return lines


def rate_text(bandwidth: float | None) -> str:
    """A bandwidth in bit/s with a decimal prefix."""
    if bandwidth is None:
        return "unlimited bandwidth"
    power, unit = next((p, u) for p, u in _UNITS if bandwidth >= p or p == 1)
    return f"{bandwidth / power:g} {unit}"


def link_text(link: Conditions) -> str:
    """A link in words."""
    traced = ", by a trace" if link.trace else ""
    return f"{rate_text(link.bandwidth)}, {link.latency * 1000:g} ms, {link.protocol}{traced}"


_UNITS = ((10**9, "Gbit/s"), (10**6, "Mbit/s"), (10**3, "kbit/s"), (1, "bit/s"))


def _row(name: str, some: list[RunResult], *, flip: bool) -> str:
    measures = [p.measures for p in some]
    e = [m.e.mean for m in measures]
    spread = f"{f'{min(e):.2f}–{max(e):.2f}':>13} " if len(some) > 1 else ""
    flips = [p.flip for p in some if p.flip is not None]
    flip_text = f"{_mean(flips, '.4f'):>6} " if flip else ""
    stalled = _mean([m.stalls for m in measures], ".1f")
    final = []
    for k in range(len(SHARES)):
        times = [m.final[k] for m in measures]
        known = [t for t in times if t is not None]
        final.append(f"{np.mean(known):6.1f}" if len(known) == len(times) else f"{'–':>6}")
    return (
        f"  {name} {np.mean(e):6.2f} {spread}{_mean([m.e.p95 for m in measures]):>6} "
        f"{_mean([m.e.still for m in measures]):>6} {_mean([m.e.moving for m in measures]):>6} "
        f"{_mean([m.rmse.mean for m in measures]):>6} {flip_text}"
        f"{_mean([m.missing.mean for m in measures], '.1%'):>7} "
        f"{_mean([m.quality.mean for m in measures], '.1%'):>7} "
        f"{size(round(np.mean([m.bytes for m in measures]))):>9} "
        f"{_mean([m.waste for m in measures], '.0%'):>5} "
        f"{np.mean([m.requests for m in measures]):8,.0f} "
        f"{f'{stalled} s' if stalled != '–' else stalled:>7}  {' '.join(final)}"
    )


def _mean(values: list[float], form: str = ".2f") -> str:
    """The mean of the numbers, without NaN."""
    known = [v for v in values if not np.isnan(v)]
    return format(np.mean(known), form) if known else "–"


def document(
    database: str,
    played: Sequence[RunResult],
    worlds: Mapping[str, World],
    *,
    lit: bool = False,
    against: str | None = None,
    paper: PaperOptions | None = None,
) -> Any:
    """All runs as a JSON document of a published schema. Numbers have `_DIGITS` digits."""
    some = next(iter(worlds.values()))
    return {
        "format": FORMAT,
        "schema": SCHEMA,
        "database": database,
        "lit": lit,
        "against": against,
        "textureMemory": some.catalogue.whole,
        "framesPerSecond": some.track.rate,
        "pixels": [some.camera.width, some.camera.height],
        "walks": [
            {
                "name": name,
                "seconds": round(float(world.track.time[-1]), _DIGITS),
                "frames": world.frames,
                "still": round(float(world.track.still.mean()), _DIGITS),
            }
            for name, world in worlds.items()
        ],
        "runs": [_run_document(p) for p in played],
        **({"paper": _paper_document(paper)} if paper else {}),
    }


def _paper_document(options: PaperOptions) -> dict[str, Any]:
    return {
        "deltaT": options.delta_t,
        "deltaTStatic": options.delta_t_static,
        "staticMemory": options.static_memory or None,
        "staticAfter": options.static_after,
    }


def _run_document(played: RunResult) -> dict[str, Any]:
    run, m = played.run, played.measures
    figures = {
        "policy": run.policy,
        "bandwidth": run.conditions.bandwidth,
        "latency": run.conditions.latency,
        "protocol": run.conditions.protocol,
        "traced": run.conditions.trace is not None,
        "memory": run.budget,
        "walk": played.walk,
        "e": asdict(m.e),
        "rmse": m.rmse.mean,
        "missing": m.missing.mean,
        "quality": m.quality.mean,
        "bytes": m.bytes,
        "overheadBytes": m.overhead,
        "cancelledBytes": 0,  # no client cancels requests
        "waste": m.waste,
        "requests": m.requests,
        "stalled": m.stalls,
        "uploadedBytes": m.uploads,
        "switchesPerMinute": m.switches,
        "overruns": m.overruns,
        "secondsTo": {f"{s:.0%}": t for s, t in zip(SHARES, m.final, strict=True)},
        "details": {name: asdict(getattr(m, name)) for name in ("rmse", "missing", "quality")},
    }
    if played.flip is not None:
        figures["flip"] = played.flip
    rounded: dict[str, Any] = _round_numbers(figures)
    return rounded


def _round_numbers(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _round_numbers(inner) for name, inner in value.items()}
    return round(value, _DIGITS) if isinstance(value, float) else value


def as_csv(played: Sequence[RunResult]) -> str:
    """CSV with a row for each frame of each run. Empty are the bandwidth without a limit, and
    measures that do not apply to a client."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(COLUMNS)
    for result in played:
        run = result.run
        link = run.conditions
        rate = "" if link.bandwidth is None else f"{link.bandwidth:g}"
        head = [run.policy, rate, f"{link.latency:g}", link.protocol, run.budget, result.walk]
        numbers = np.stack([run.error, np.sqrt(run.square), run.missing, run.quality], axis=1)
        whole = np.stack([run.still, run.memory, np.rint(run.fetched)], axis=1).astype(np.int64)
        for time, (still, memory, received), row in zip(
            run.time.tolist(), whole.tolist(), numbers.tolist(), strict=True
        ):
            known = ["" if math.isnan(v) else f"{v:.6g}" for v in row]
            rows.writerow([*head, f"{time:g}", still, *known, memory, received])
    return text.getvalue()
