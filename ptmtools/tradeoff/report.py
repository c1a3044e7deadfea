"""The outcome of experiments as a table of text, as CSV, and as pictures."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence

from ptmtools.tradeoff.experiment import Trade

#: Of the CSV.
COLUMNS = (
    *("stage", "setting", "cpu_s", "work", "work_unit"),
    *("error", "worst", "error_of", "best", "more"),
)


def table(trade: Trade, wanted: float | None = None) -> list[str]:
    """Lines of text: every trial by cost, a star where no other is as good for less; the rates; and
    the cheapest setting for the wanted error."""
    names = [t.setting.name for t in trade.trials]
    wide = max(map(len, [*names, "setting"]))
    lines = [
        f"{trade.stage}: error is the {trade.error}; work counts {trade.work}; seconds of one core",
        f"  {'setting':<{wide}}  {'seconds':>9} {'work':>11} {'error':>8} {'worst':>8}",
    ]
    for trial in trade.trials:
        m = trial.measured
        star = "*" if trial.best else " "
        more = "".join(f"  {k} {v:.3g}" for k, v in m.more.items() if v)
        lines.append(
            f"{star} {trial.setting.name:<{wide}}  {m.seconds:9.2f} {m.work:11,.0f} "
            f"{m.error:8.4f} {m.worst:8.4f}{more}  {m.note}".rstrip()
        )
    if trade.reference_error:
        lines.append(f"  standard error of the reference: {trade.reference_error:.4f}")
    for family, rate in trade.rates.items():
        lines.append(f"  {family}: error ∝ work^{rate:.2f}")
    if wanted is not None:
        found = trade.cheapest(wanted)
        answer = (
            found.setting.name if found else "none of these; the last one with a star comes closest"
        )
        lines.append(f"  cheapest for an error of at most {wanted:g}: {answer}")
    return lines


def as_csv(trades: Sequence[Trade]) -> str:
    """All trials of all stages: what is in `Measured`, other figures as ``name=value``."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(COLUMNS)
    for trade in trades:
        for trial in trade.trials:
            m = trial.measured
            more = " ".join([*(f"{k}={v:.6g}" for k, v in m.more.items()), m.note]).strip()
            cost = [f"{m.seconds:.4f}", f"{m.work:.6g}", trade.work]
            error = [f"{m.error:.6g}", f"{m.worst:.6g}", trade.error]
            rows.writerow([trade.stage, trial.setting.name, *cost, *error, int(trial.best), more])
    return text.getvalue()
