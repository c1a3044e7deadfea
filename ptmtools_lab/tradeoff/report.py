"""Reports experiments as a table of text, as CSV and as plots, and the price of knobs on a walk in
sentences.

A plot shows error against cost, a panel for every stage; it needs matplotlib (extra ``plot``).
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import groupby
from typing import Any

from ptmtools.quantities import size
from ptmtools_lab.figures import COLORS, plot
from ptmtools_lab.report import rate_text
from ptmtools_lab.tradeoff.experiment import Measurement, Setting, Trade, Trial, pareto
from ptmtools_lab.tradeoff.walk import FIRST, Case, WalkOutcome, WalkTrade, WalkTrial

#: Columns of the CSV.
COLUMNS = (
    *("stage", "setting", "cpu_s", "work", "work_unit"),
    *("error", "worst", "error_of", "best", "more"),
)


def table(trade: Trade, wanted: float | None = None) -> list[str]:
    """Lines of text: every trial by cost, with a star where no cheaper one is as good; the rates;
    and the cheapest setting for the wanted error."""
    names = [t.setting.name for t in trade.trials]
    wide = max(map(len, [*names, "setting"]))
    lines = [
        f"{trade.stage}: error is the {trade.error}; work counts {trade.work}; seconds of one core",
        f"  {'setting':<{wide}}  {'seconds':>9} {'work':>11} {'error':>8} {'worst':>8}",
    ]
    units = trade.units
    for trial in trade.trials:
        m = trial.measured
        star = "*" if trial.best else " "
        more = "".join(f"  {k} {amount(v, units.get(k, ''))}" for k, v in m.more.items() if v)
        work = amount(round(m.work), units.get("work", ""))
        error, worst = (_error(value, trade) for value in (m.error, m.worst))
        lines.append(
            f"{star} {trial.setting.name:<{wide}}  {m.seconds:7.2f} s {work:>11} {error:>8} "
            f"{worst:>8}{more}  {m.note}".rstrip()
        )
    if trade.reference_error:
        lines.append(f"  standard error of the reference: {_error(trade.reference_error, trade)}")
    for family, rate in trade.rates.items():
        lines.append(f"  {family}: error ∝ work^{rate:.2f}")
    if wanted is not None:
        cheapest = trade.cheapest(wanted)
        answer = (
            cheapest.setting.name
            if cheapest
            else "none of these; the last one with a star comes closest"
        )
        lines.append(f"  cheapest with an error of at most {wanted:g}: {answer}")
    if trade.untried:
        lines.append(f"  {_untried_text(trade.untried)}")
    return lines


def amount(value: float, unit: str) -> str:
    """A figure with its unit: ``12.3 MB``, ``41.2 dB``; whole numbers in full."""
    if unit == "B":
        return size(round(value))
    number = f"{value:,.0f}" if float(value).is_integer() else f"{value:.3g}"
    return _quantity(number, unit)


def _quantity(number: str, unit: str) -> str:
    return f"{number}{unit}" if unit in ("", "°") else f"{number} {unit}"


def _error(value: float, trade: Trade) -> str:
    return _quantity(f"{value:.4f}", trade.units.get("error", ""))


def as_csv(trades: Sequence[Trade]) -> str:
    """All trials of all stages as CSV: the fields of `Measurement`, further figures as
    ``name=value``, or ``name[unit]=value``."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(COLUMNS)
    for trade in trades:
        for trial in trade.trials:
            m = trial.measured
            more = " ".join([*_pairs_of(m, trade.units), m.note]).strip()
            cost = [f"{m.seconds:.4f}", f"{m.work:.6g}", trade.work]
            error = [f"{m.error:.6g}", f"{m.worst:.6g}", trade.error]
            rows.writerow([trade.stage, trial.setting.name, *cost, *error, int(trial.best), more])
    return text.getvalue()


def _pairs_of(measured: Measurement, units: Mapping[str, str]) -> Iterator[str]:
    for name, value in measured.more.items():
        unit = f"[{units[name]}]" if name in units else ""
        yield f"{name}{unit}={value:.6g}"


def picture(trades: Sequence[Trade]) -> bytes:
    """A PNG: every trial, families joined, with the names of the best settings.

    Raises `MissingComponentError` PTM-M100 without matplotlib.
    """
    return plot((8, 5), [partial(_draw, trade) for trade in trades])


def _draw(trade: Trade, axes: Any) -> None:
    families = list(dict.fromkeys(t.setting.family for t in trade.trials))
    least = min((t.measured.error for t in trade.trials if t.measured.error > 0), default=1.0)
    for number, family in enumerate(families):
        members = [t for t in trade.trials if t.setting.family == family]
        members.sort(key=lambda t: t.measured.work)
        x = [t.measured.seconds for t in members]
        y = [max(t.measured.error, least / 3) for t in members]
        rate = f", error ∝ work^{trade.rates[family]:.2f}" if family in trade.rates else ""
        style = {"color": COLORS[number % len(COLORS)], "label": (family or "others") + rate}
        axes.plot(x, y, "o-" if family else "D", markersize=4, linewidth=1, **style)
    for t in trade.trials:
        if t.best:
            at = (t.measured.seconds, max(t.measured.error, least / 3))
            name = t.setting.name.replace("--", "")
            axes.annotate(name, at, (4, 4), textcoords="offset points", fontsize=6)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="CPU seconds of one core, whole database",
        ylabel=trade.error,
        title=trade.stage,
    )
    if trade.reference_error:
        axes.axhline(trade.reference_error, color="#999", linestyle=":", linewidth=1)
    axes.grid(True, which="both", color="#eee")
    axes.legend(fontsize=7)


#: Name of the unchanged database.
_AS_IS = "unchanged"
#: Least visible change of e, as a share of it and in steps of 8-bit colour.
_SHARE, _STEPS = 0.005, 0.01
#: Least relevant share of bytes; of seconds, and least seconds, which are no more exact.
_BYTES, _SECONDS, _BRIEF = 0.005, 0.1, 0.2


def sentences(trade: WalkTrade) -> list[str]:
    """A sentence for each knob, on the setting chosen by `representative`, by `_price`."""
    chosen = [
        representative(list(some), trade.own)
        for _, some in groupby(trade.trials, lambda tried: tried.option)
    ]
    return [
        sentence(tried, trade) for tried in sorted(chosen, key=partial(_price, unchanged=trade.own))
    ]


def _price(tried: WalkTrial, unchanged: WalkTrial) -> tuple[int, float]:
    """The rank of a setting: it only saves bytes or seconds or improves the picture, has gains and
    losses, changes nothing, only loses, or could not be tested; and within a rank the sum of the
    losses less that of the gains, as shares."""
    if tried.problem:
        return 4, 0.0
    longer = _longer(tried, unchanged) / max(unchanged.build, _BRIEF)
    changes = [_more_bytes(tried, unchanged), longer]
    if any(_is_noticeable(*pair) for pair in _pairs(tried, unchanged)):
        changes.append(_change(tried, unchanged))
    gains, losses = any(c < 0 for c in changes), any(c > 0 for c in changes)
    rank = (1 if losses else 0) if gains else (3 if losses else 2)
    return rank, sum(changes)


def representative(some: Sequence[WalkTrial], unchanged: WalkTrial) -> WalkTrial:
    """The setting of a knob to report: the best picture, if that is better than the database's own;
    else, of those without a visible difference, the one that saves most bytes, then seconds; else
    the one that loses least."""
    valid = [tried for tried in some if not tried.problem]
    if not valid:
        return some[0]
    least = min(valid, key=lambda tried: _change(tried, unchanged))
    if any(_is_noticeable(*pair) for pair in _pairs(least, unchanged)):
        return least
    alike = [t for t in valid if not any(_is_noticeable(*pair) for pair in _pairs(t, unchanged))]
    return min(alike, key=lambda tried: (tried.served, tried.build))


def sentence(tried: WalkTrial, trade: WalkTrade) -> str:
    """The savings of a setting, and its visible effect."""
    if tried.problem:
        return f"{tried.name} cannot be tested: {tried.problem}."
    unchanged = trade.own
    saved = _saving_text(tried, unchanged)
    pairs = _pairs(tried, unchanged)
    cases = [seen.case for _, seen in pairs]
    noticed = [pair for pair in pairs if _is_noticeable(*pair)]
    changes = []
    for way, some in groupby(noticed, lambda pair: "worse" if pair[1].e > pair[0].e else "better"):
        parts = [
            f"{_change_text(was, now)}{_where(now.case, cases)} (e {was.e:.2f} → {now.e:.2f})"
            for was, now in some
        ]
        changes.append(f"{way} {_and(parts)}")
    policies = {seen.policy for _, seen in pairs} - {seen.policy for seen in unchanged.seen[:1]}
    client = f" for the client {policies.pop()}" if len(policies) == 1 else ""
    if not changes:
        seen = f"no visible difference{client}"
    else:
        seen = f"the image{client} is {_and(changes)}"
        if len(noticed) < len(pairs):
            seen += ", and the same otherwise"
    return f"{tried.name} instead of {tried.own} {saved}; {seen}."


def _saving_text(tried: WalkTrial, unchanged: WalkTrial) -> str:
    parts = []
    if more := _more_bytes(tried, unchanged):
        parts.append(
            f"increases the total size by {_percent(more)}" if more > 0 else
            f"reduces the total size by {_percent(-more)}"
        )  # fmt: skip
    if longer := _longer(tried, unchanged):
        parts.append(f"builds {abs(longer):.1f} s {'slower' if longer > 0 else 'faster'}")
    return _and(parts) if parts else "costs the same"


def _more_bytes(tried: WalkTrial, unchanged: WalkTrial) -> float:
    """The change of the bytes served, as a share; 0 if it is not relevant."""
    more = tried.served / max(unchanged.served, 1) - 1
    return more if abs(more) >= _BYTES else 0.0


def _longer(tried: WalkTrial, unchanged: WalkTrial) -> float:
    """The change of the seconds to build; 0 if it is not relevant."""
    longer = tried.build - unchanged.build
    return longer if abs(longer) >= max(_SECONDS * unchanged.build, _BRIEF) else 0.0


def _and(parts: Sequence[str]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if parts[1:] else parts)


def _percent(share: float) -> str:
    return f"{100 * share:,.{0 if share >= 0.0995 else 1}f} %"


def _change_text(was: WalkOutcome, now: WalkOutcome) -> str:
    return f"by {_percent(abs(now.e / was.e - 1))} " if was.e else ""


def _where(case: Case, cases: Sequence[Case]) -> str:
    """A case, by the parts that differ from other cases."""
    policy, bandwidth, memory = case
    text = f"at {rate_text(bandwidth)}"
    if len({c[2] for c in cases}) > 1:
        text += f" with {memory} of texture memory"
    return f"{text} by {policy}" if len({c[0] for c in cases}) > 1 else text


def _pairs(tried: WalkTrial, unchanged: WalkTrial) -> list[tuple[WalkOutcome, WalkOutcome]]:
    """The outcomes of the database's own options and of the setting, case by case."""
    return [(was, now) for now in tried.seen if (was := unchanged.outcome(now.case))]


def _change(tried: WalkTrial, unchanged: WalkTrial) -> float:
    """Mean change of e over the cases, as a share."""
    pairs = _pairs(tried, unchanged)
    return sum((now.e - was.e) / max(was.e, _STEPS) for was, now in pairs) / max(len(pairs), 1)


def _is_noticeable(was: WalkOutcome, now: WalkOutcome) -> bool:
    return abs(now.e - was.e) >= max(_SHARE * was.e, _STEPS)


def settings_table(trade: WalkTrade, wanted: float | None = None) -> list[str]:
    """Lines of text: the sentences, then all settings, a block for each walker."""
    lines = [*sentences(trade), ""]
    lines += [
        "e is the difference from the fully loaded image of the unchanged database, 0 to 255: the",
        "mean over pixels and frames, and (95%) the 95th percentile over frames. build: seconds of",
        "one core, all stages after the scene. served: total size of the files that clients of the",
        f"hints can fetch. fetched: downloaded on the walk of {trade.seconds:.0f} s. first: time "
        f"until {FIRST:.0%} of the first image is loaded.",
    ]
    wide = max(map(len, [_AS_IS, *(tried.name for tried in trade.trials)]))
    head = f"  {'setting':<{wide}} {'build':>8} {'served':>9} {'e':>7} {'change':>7} {'95%':>7} "
    head += f"{'fetched':>9} {'first':>7}"
    for case in trade.cases:
        policy, bandwidth, memory = case
        lines += ["", f"{policy}, {rate_text(bandwidth)}, texture memory {memory}", head]
        lines += [f"  {row}" for row in _rows(trade, case, wide)]
        if wanted is not None:
            cheapest = _trade(trade, case).cheapest(wanted)
            name = cheapest.setting.name if cheapest else "none of these"
            lines.append(f"  cheapest with an error of at most {wanted:g}: {name}")
    if trade.untried:
        lines += ["", _untried_text(trade.untried)]
    return lines


def _untried_text(names: Sequence[str]) -> str:
    return f"Not tested within the time limit (--minutes): {', '.join(names)}."


def _rows(trade: WalkTrade, case: Case, wide: int) -> Iterator[str]:
    was = trade.own.outcome(case)
    for tried in (trade.own, *trade.trials):
        seen = tried.outcome(case)
        if not seen or not was:
            continue
        change = f"{(seen.e - was.e) / was.e:+.1%}" if seen is not was and was.e else "–"
        first = "–" if seen.first is None else f"{seen.first:.1f} s"
        yield (
            f"{tried.name or _AS_IS:<{wide}} {tried.build:6.1f} s {size(tried.served):>9} "
            f"{seen.e:7.3f} {change:>7} {seen.p95:7.3f} {size(seen.fetched):>9} {first:>7}"
        )


def trades(trade: WalkTrade) -> list[Trade]:
    """The trade of each walker in the form of other experiments: e against seconds of building."""
    return [_trade(trade, case) for case in trade.cases]


def _trade(trade: WalkTrade, case: Case) -> Trade:
    policy, bandwidth, memory = case
    where = f"{policy}, {rate_text(bandwidth)}, texture memory {memory}"
    trials = []
    for tried in (trade.own, *trade.trials):
        if seen := tried.outcome(case):
            more = {"fetched": float(seen.fetched)}
            if seen.first is not None:
                more["first"] = seen.first
            setting = Setting(tried.name or _AS_IS, {})
            measured = Measurement(tried.build, tried.served, seen.e, seen.p95, more)
            trials.append(Trial(setting, measured))
    units = {"work": "B", "fetched": "B", "first": "s"}
    return Trade("walk", "bytes served", f"e ({where})", 0.0, pareto(trials), {}, units)
