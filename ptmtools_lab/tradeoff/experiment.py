"""Cost against error: the price and the effect of a stage's options on the user's own scene.

An `Experiment` of a stage lists settings of its options, runs each, and measures how far the result
is from a reference that does not depend on the options. The evaluation is the same for all: the
Pareto front of the settings, the fall of the error with the work (a fitted power), and the cheapest
setting for a wanted error.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import linear_regression
from typing import TYPE_CHECKING, Any

from ptmtools.progress import Progress, silent

if TYPE_CHECKING:
    from ptmtools.pipeline.artifacts import Artifacts
    from ptmtools.pipeline.stage import Stage


@dataclass(frozen=True)
class Setting:
    """One choice of a stage's knobs.

    Attributes
    ----------
    name: as a user gives it, unique within a stage ("--samples 64 --face 8").
    knobs: option → value, as the options of the stage have them.
    family: settings of one family differ in one thing, so that a power may be fitted to them;
        empty for those that stand alone.
    sound: False for a setting that only serves for comparison and is never the best.
    """

    name: str
    knobs: Mapping[str, Any]
    family: str = ""
    sound: bool = True


@dataclass(frozen=True)
class Measurement:
    """Measurement of a setting.

    Attributes
    ----------
    seconds: of one process, for the whole database.
    work: in the units that the experiment names; does not depend on the machine.
    error: as the experiment defines it; the mean over the trials.
    worst: the greatest error of the trials, or the 95th percentile of rays, points or frames.
    more: other figures, by name.
    note: the method, where it may differ.
    """

    seconds: float
    work: float
    error: float
    worst: float
    more: Mapping[str, float] = field(default_factory=dict)
    note: str = ""


@dataclass(frozen=True)
class Experiment:
    """A stage's knobs, their cost and their error.

    Attributes
    ----------
    work, error: definitions of work and error, with their units.
    settings: to try, cheap ones first.
    measure: runs the stage with a setting.
    reference_error: the standard error of the reference itself, 0 where it is exact.
    by_work: whether the work is the cost, such as bytes, and not the seconds.
    units: "work", "error" and the names of further figures → their units, if any; counts and
        shares have none.
    """

    work: str
    error: str
    settings: Sequence[Setting]
    measure: Callable[[Setting], Measurement]
    reference_error: float = 0.0
    by_work: bool = False
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Trial:
    """A setting, its measurement, and whether no cheaper setting is as good."""

    setting: Setting
    measured: Measurement
    best: bool = False


@dataclass(frozen=True)
class Trade:
    """A finished experiment.

    Attributes
    ----------
    stage: its name.
    work, error, reference_error, units: as in `Experiment`.
    trials: by cost. untried: names of the settings that the time did not allow.
    rates: family → exponent b of error ∝ work^b, by least squares over the logarithms of trials
        with more than twice the error of the reference.
    """

    stage: str
    work: str
    error: str
    reference_error: float
    trials: tuple[Trial, ...]
    rates: Mapping[str, float]
    units: Mapping[str, str] = field(default_factory=dict)
    untried: tuple[str, ...] = ()

    def cheapest(self, error: float) -> Trial | None:
        """The cheapest trial with at most this error; None if there is none."""
        return next((t for t in self.trials if t.best and t.measured.error <= error), None)


class Deadline:
    """A limit on the time of experiments, from now on."""

    def __init__(self, minutes: float = math.inf) -> None:
        self._end = time.perf_counter() + 60 * minutes

    @property
    def remaining(self) -> float:
        """Remaining seconds, at least 0."""
        return max(0.0, self._end - time.perf_counter())

    def part(self, share: float) -> Deadline:
        """A share of the remaining time."""
        return Deadline(share * self.remaining / 60)


def run(
    stage: str,
    experiment: Experiment,
    progress: Progress = silent,
    deadline: Deadline | None = None,
) -> Trade:
    """Tries the settings of a stage's experiment, the first in any case, the others until the
    deadline."""
    settings = experiment.settings
    trials: list[Trial] = []
    for i, setting in enumerate(settings):
        if trials and deadline and not deadline.remaining:
            break
        trials.append(Trial(setting, experiment.measure(setting)))
        progress(i + 1, len(settings), f"trying {stage}")
    return Trade(
        stage,
        experiment.work,
        experiment.error,
        experiment.reference_error,
        pareto(trials, by_work=experiment.by_work),
        rates(trials, 2 * experiment.reference_error),
        experiment.units,
        tuple(setting.name for setting in settings[len(trials) :]),
    )


def pareto(trials: Sequence[Trial], *, by_work: bool = False) -> tuple[Trial, ...]:
    """The trials by cost, seconds or work; sound ones with a smaller error than all cheaper ones
    are marked."""

    def cost(trial: Trial) -> tuple[float, float]:
        m = trial.measured
        return (m.work if by_work else m.seconds), m.error

    ordered = sorted(trials, key=cost)
    least = math.inf
    marked = []
    for trial in ordered:
        best = trial.setting.sound and trial.measured.error < least
        marked.append(replace(trial, best=best))
        least = trial.measured.error if best else least
    return tuple(marked)


def rates(trials: Sequence[Trial], above: float) -> dict[str, float]:
    """See `Trade.rates`; families of fewer than three trials with errors greater than ``above``
    have none."""
    families: dict[str, tuple[list[float], list[float]]] = {}
    for trial in trials:
        m = trial.measured
        if trial.setting.family and m.error > above and m.work > 0:
            work, error = families.setdefault(trial.setting.family, ([], []))
            work.append(math.log(m.work))
            error.append(math.log(m.error))
    return {
        name: linear_regression(work, error).slope
        for name, (work, error) in families.items()
        if len(set(work)) >= 3
    }


def decibels(error: float) -> float:
    """The peak signal-to-noise ratio of an RMS error, of 255; infinite for 0."""
    return 20 * math.log10(255 / error) if error else math.inf


def time_work(work: Callable[[], Any]) -> tuple[Any, float]:
    """The result of ``work``, and the processor seconds of this process for it."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


@dataclass(frozen=True)
class Subject:
    """The database of experiments, and their effort.

    Attributes
    ----------
    artifacts: those of the database.
    cells_tried, reference_points: as in `CoverageTrade`.
    """

    artifacts: Artifacts
    cells_tried: int
    reference_points: int

    def options(self, stage: Stage[Any]) -> Any:
        """The options of a stage's last run, or its defaults."""
        run = self.artifacts.before(stage)
        return self.artifacts.recorded(stage) if run else stage.options()
