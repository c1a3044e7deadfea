"""The tables of the benchmark as Markdown, from what was measured."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from statistics import median

from benchmarks.web_rivals.entrants import WALK, WALKS
from benchmarks.web_rivals.memory import Held
from benchmarks.web_rivals.timeline import Picture, Timeline, difference

GOALS = {"(a) FLIP ≤ 0.05": 0.05, "(b) ≤ 0.01": 0.01}
EVERYTHING = "(c) all"

#: Seconds and bytes, or None for what is not reached.
Reached = tuple[float, float] | None


def times_table(runs: Mapping[str, Sequence[Timeline]], full: Mapping[str, Picture]) -> str:
    """A line for each page, of its runs over one link: medians. ``full``: the full picture of each
    page, as its renderer draws it."""
    reached = {name: goals_of(rows, full[name]) for name, rows in runs.items()}
    columns = [*GOALS, EVERYTHING]
    beside = [_beside([(name, by[column]) for name, by in reached.items()]) for column in columns]
    lines = [f"| | {' | '.join(columns)} | FLIP at the end | requests | connections |"]
    lines.append("|---" + "|--:" * (len(columns) + 3) + "|")
    for name, rows in runs.items():
        cells = [_cell(reached[name][c], b) for c, b in zip(columns, beside, strict=True)]
        lossy = median(difference(full[name], run.full) for run in rows)
        counts = [median(run.requests for run in rows), median(run.connections for run in rows)]
        cells += [f"{lossy:.3f}", *(f"{count:.0f}" for count in counts)]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def round_trips_table(
    runs: Mapping[str, Sequence[Sequence[Timeline]]],
    full: Mapping[str, Picture],
    ways: tuple[float, float],
) -> str:
    """A line for each page: by how many round trips each goal comes later over the longer way.
    ``runs``: over the shorter way, and over the longer; ``ways``: s of a round trip."""
    lines = [f"| round trips | {' | '.join((*GOALS, EVERYTHING))} |"]
    lines.append("|---" + "|--:" * (len(GOALS) + 1) + "|")
    for name, both in runs.items():
        near, far = (goals_of(rows, full[name]) for rows in both)
        cells = []
        for goal, short in near.items():
            long = far[goal]
            trips = math.nan
            if short is not None and long is not None and long[0] < math.inf:
                trips = (long[0] - short[0]) / (ways[1] - ways[0])
            cells.append("–" if math.isnan(trips) else f"{trips:.1f}")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def summary_table(runs: Mapping[str, Mapping[str, Mapping[str, Reached]]]) -> str:
    """A line for each scene and link: when the walk page reaches each goal, and the best of the
    rivals. ``runs``: by scene and link, and by page, see `goals_of`."""
    heads = [head for goal in GOALS for head in (f"{WALK} {goal}", "best rival")]
    lines = [f"| | {' | '.join(heads)} |", "|---" + "|--:" * len(heads) + "|"]
    for title, pages in runs.items():
        cells = []
        for goal in GOALS:
            ours = pages[WALK][goal]
            cells.append("–" if ours is None else f"{ours[0]:.1f} s, {ours[1] / 1e6:.2f} MB")
            rivals = [
                (reached[goal] or (math.inf, 0.0), name)
                for name, reached in pages.items()
                if name not in WALKS
            ]
            (seconds, sent), name = min(rivals)
            if seconds == math.inf:
                cells.append("–")
                continue
            times = f" ({seconds / ours[0]:.1f} ×)" if ours else ""
            cells.append(f"{name} {seconds:.1f} s, {sent / 1e6:.2f} MB{times}")
        lines.append(f"| {title} | {' | '.join(cells)} |")
    return "\n".join(lines)


def goals_of(rows: Sequence[Timeline], full: Picture) -> dict[str, Reached]:
    """When the runs reached each of the goals; medians of seconds and of bytes."""
    actual = {c: _middle([run.until(most, full) for run in rows]) for c, most in GOALS.items()}
    return actual | {EVERYTHING: _middle([(run.done, run.everything) for run in rows])}


def _middle(rows: Sequence[Reached]) -> Reached:
    """None if half of them or more reached nothing."""
    seconds, sent = zip(*(row or (math.inf, math.inf) for row in rows), strict=True)
    middle = median(seconds), median(sent)
    return None if middle[0] == math.inf else middle


def _beside(rows: Sequence[tuple[str, Reached]]) -> float:
    """Seconds of the walk page, or else of the best; NaN if there are none."""
    seconds = {name: actual[0] for name, actual in rows if actual}
    return seconds.get(WALK, min(seconds.values(), default=math.nan))


def _cell(found: Reached, beside: float) -> str:
    if found is None:
        return "–"
    seconds, sent = found
    return f"{seconds:.1f} s, {sent / 1e6:.2f} MB ({seconds / beside:.1f} ×)"


def memory_table(rows: Sequence[Held]) -> str:
    """A line for each budget, the largest being one that holds everything; FLIP, and the MiB that
    are used."""
    forms = list(dict.fromkeys(row.form for row in rows))
    budgets = list(dict.fromkeys(row.budget for row in rows))
    lines = [f"| MiB | {' | '.join(forms)} |", "|--:" * (len(forms) + 1) + "|"]
    for budget in budgets:
        of = {row.form: row for row in rows if row.budget == budget}
        cells = [f"{of[form].flip:.4f} ({of[form].used / 2**20:.1f})" for form in forms]
        size = "all" if budget == max(budgets) else f"{budget / 2**20:g}"
        lines.append(f"| {size} | {' | '.join(cells)} |")
    return "\n".join(lines)
