"""The tables of the benchmark as Markdown, from what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from benchmarks.web_rivals.entrants import WALK
from benchmarks.web_rivals.memory import Held
from benchmarks.web_rivals.timeline import Timeline, difference

GOALS = {"(a) FLIP ≤ 0.05": 0.05, "(b) ≤ 0.01": 0.01}
EVERYTHING = "(c) all"
LOSSLESS = "glb-png"

#: Seconds and bytes, or None for what is not reached.
Reached = tuple[float, float] | None


def times_table(runs: Mapping[str, Timeline]) -> str:
    """A line for each page, of runs over one link."""
    reached = {name: goals_of(run) for name, run in runs.items()}
    columns = [*GOALS, EVERYTHING]
    beside = [_beside([(name, by[column]) for name, by in reached.items()]) for column in columns]
    lines = [f"| | {' | '.join(columns)} | lossy | requests |"]
    lines.append("|---" + "|--:" * (len(columns) + 2) + "|")
    for name, run in runs.items():
        cells = [_cell(reached[name][c], b) for c, b in zip(columns, beside, strict=True)]
        lossy = ""
        if LOSSLESS in runs and name != WALK:
            lossy = f"{difference(runs[LOSSLESS].full, run.full):.3f}"
        lines.append(f"| {name} | {' | '.join(cells)} | {lossy} | {run.requests} |")
    return "\n".join(lines)


def goals_of(run: Timeline) -> dict[str, Reached]:
    """When a run reached each of the goals."""
    actual: dict[str, Reached] = {c: run.until(most, run.full) for c, most in GOALS.items()}
    return actual | {EVERYTHING: (run.done, run.everything)}


def _beside(rows: Sequence[tuple[str, Reached]]) -> float:
    """Seconds of the walk page, or else of the best."""
    seconds = {name: actual[0] for name, actual in rows if actual}
    return seconds.get(WALK, min(seconds.values()))


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
