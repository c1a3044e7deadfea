"""Fronts, rates and the cheapest setting, on made-up experiments."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import pytest
from hypothesis import given, strategies as st

from ptmtools_lab.tradeoff.experiment import (
    Deadline,
    Experiment,
    Measurement,
    Setting,
    Trial,
    pareto,
    rates,
    run,
)
from ptmtools_lab.tradeoff.report import as_csv, table


def measure(setting):
    steps = setting.knobs["steps"]
    seconds = steps * setting.knobs.get("times", 1)
    return Measurement(seconds, steps, steps**-0.5, 2 * steps**-0.5)


SETTINGS = [
    *(Setting(f"--steps {n}", {"steps": n}, "steps") for n in (400, 100, 4, 1600)),
    Setting("--waste", {"steps": 4, "times": 1000}),
    Setting("--guess", {"steps": 10**6, "times": 0}, sound=False),
]
#: Errors that fall as work^-0.5, one dear and bad setting, and one that is not sound.
MADE = Experiment("steps", "distance", SETTINGS, measure, 0.01)


def test_an_experiment():
    calls = []
    trade = run("made", MADE, lambda *call: calls.append(call))
    assert [t.setting.name for t in trade.trials if t.best] == [
        "--steps 4",
        "--steps 100",
        "--steps 400",
        "--steps 1600",
    ]
    assert calls == [(i, 6, "trying made") for i in range(1, 7)]
    assert trade.rates == {"steps": pytest.approx(-0.5)}
    assert trade.cheapest(0.1).setting.name == "--steps 100"
    assert trade.cheapest(0.099).setting.name == "--steps 400"
    assert trade.cheapest(0.001) is None


def test_the_cost_may_be_the_work():
    trade = run("made", replace(MADE, by_work=True))
    costs = [t.measured.work for t in trade.trials]
    assert costs == sorted(costs)
    # It takes a thousand times the seconds of the other setting of four steps, and no more work.
    assert trade.trials[0].measured.work == trade.trials[1].measured.work == 4
    assert trade.cheapest(0.1).setting.name == "--steps 100"
    swift = Trial(Setting("swift", {}), Measurement(1, 9, 0.1, 0.1))
    small = Trial(Setting("small", {}), Measurement(9, 1, 0.2, 0.2))
    assert [t.setting.name for t in pareto([swift, small]) if t.best] == ["swift"]
    both = [t.setting.name for t in pareto([swift, small], by_work=True) if t.best]
    assert both == ["small", "swift"]


def test_after_the_deadline_no_further_setting_is_tried():
    trade = run("made", MADE, deadline=Deadline(1e-9))
    assert [t.setting.name for t in trade.trials] == ["--steps 400"]
    assert trade.untried == tuple(setting.name for setting in SETTINGS[1:])
    assert table(trade)[-1].startswith("  Not tested within the time limit (--minutes): --steps 1")
    assert run("made", MADE, deadline=Deadline(10.0)).untried == ()


def test_errors_below_twice_that_of_the_reference_fit_no_rate():
    blurred = replace(MADE, reference_error=0.06)  # 100, 400 and 1600 steps are below twice that
    assert run("made", blurred).rates == {}


@given(
    points=st.lists(
        st.tuples(st.integers(0, 9), st.integers(0, 9), st.booleans()), min_size=1, max_size=30
    )
)
def test_the_front_is_what_no_other_sound_trial_beats(points):
    trials = [
        Trial(Setting(str(i), {}, sound=sound), Measurement(cost, 1, error, error))
        for i, (cost, error, sound) in enumerate(points)
    ]
    actual = pareto(trials)
    assert [t.measured.seconds for t in actual] == sorted(cost for cost, _, _ in points)
    sound = [(cost, error) for cost, error, good in points if good]
    expected = {
        (c, e)
        for c, e in sound
        if not any((a, b) != (c, e) and a <= c and b <= e for a, b in sound)
    }
    assert {(t.measured.seconds, t.measured.error) for t in actual if t.best} == expected
    assert all(t.setting.sound for t in actual if t.best)


def test_two_trials_of_a_family_have_no_rate():
    trials = [Trial(Setting(str(n), {}, "f"), Measurement(n, n, 1 / n, 1 / n)) for n in (1, 2)]
    assert rates(trials, 0) == {}


def test_the_table_names_the_best_and_the_cheapest():
    lines = table(run("made", MADE), 0.06)
    assert [line[:13].strip() for line in lines if line.startswith("*")] == [
        "* --steps 4",
        "* --steps 100",
        "* --steps 400",
        "* --steps 160",
    ]
    assert "  standard error of the reference: 0.0100" in lines
    assert "  steps: error ∝ work^-0.50" in lines
    assert lines[-1] == "  cheapest with an error of at most 0.06: --steps 400"
    assert "none of these" in table(run("made", MADE), 1e-9)[-1]


def test_figures_have_units():
    """Bytes, errors and further figures; counts have none."""

    def weighed(setting):
        more = {"memory": 12_300_000.0, "PSNR": 41.25, "cells": 1234.0, "first": 1.5, "lost": 0.0}
        return replace(measure(setting), more=more)

    units = {"work": "B", "error": "m", "memory": "B", "PSNR": "dB", "first": "s"}
    made = replace(MADE, measure=weighed, units=units, settings=[Setting("--one", {"steps": 4})])
    trade = run("made", made)
    _, _, line, reference = table(trade)
    assert " ".join(line.split()) == (
        "* --one 4.00 s 4 B 0.5000 m 1.0000 m memory 12.3 MB PSNR 41.2 dB cells 1,234 first 1.5 s"
    )
    assert reference.endswith(": 0.0100 m")
    (row,) = csv.DictReader(io.StringIO(as_csv([trade])))
    assert row["more"] == "memory[B]=1.23e+07 PSNR[dB]=41.25 cells=1234 first[s]=1.5 lost=0"


def test_the_csv_has_every_trial():
    rows = list(csv.DictReader(io.StringIO(as_csv([run("made", MADE), run("made", MADE)]))))
    assert len(rows) == 12
    assert rows[1]["setting"] == "--steps 4"
    assert float(rows[1]["error"]) == 0.5
    assert rows[0]["setting"] == "--guess"
    assert [row["best"] for row in rows[:3]] == ["0", "1", "1"]
