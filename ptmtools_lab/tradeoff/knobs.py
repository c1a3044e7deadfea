"""The knobs whose price a walk measures, with their values, and rebuilding a database with another
option.

The cost of a setting is the time of all stages after the scene: those that depend on the option run
again in a copy, and the others count their time with the database's own options.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ptmtools.errors import InputError
from ptmtools.jit import compilations
from ptmtools.options import option_name
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.build import run_stage
from ptmtools.pipeline.stage import Options, Stage
from ptmtools.pipeline.stages import ACH, CELLS, EMIT, LIGHT, PVS, STAGES, TEXTURES
from ptmtools_lab.tradeoff.experiment import time_work


@dataclass(frozen=True)
class Knob:
    """One option of a stage.

    Attributes
    ----------
    stage, field: the stage, and the field of its options.
    values: to try.
    coarser: only values above the database's own are tried, since pictures are compared with those
        of the database.
    policy: the client's policy, if only some clients use the result; "" for those of the user.
    own: the property of the options with the value in force; by default the field.
    slow: values that take far longer, only tried if the knob is named.
    of_longest: the values are shares of the longest side of a texture.
    """

    stage: Stage[Any]
    field: str
    values: tuple[Any, ...]
    coarser: bool = False
    policy: str = ""
    own: str = ""
    slow: tuple[Any, ...] = ()
    of_longest: bool = False

    @property
    def option(self) -> str:
        """The option as a user gives it, with its dashes."""
        declared = {option.name: option for option in fields(self.stage.options)}
        return f"--{option_name(declared[self.field])}"

    def text(self, value: Any) -> str:
        """A value as a user gives it."""
        if isinstance(value, bool):
            return self.option if value else self.option.replace("--", "--no-", 1)
        return f"{self.option} {value:g}" if isinstance(value, float) else f"{self.option} {value}"


#: Those with the greatest effect on the walks of the benchmarks first
#: (`benchmarks/RESULTS.md`, Settings).
KNOBS = (
    Knob(TEXTURES, "max_side", (1 / 2, 1 / 4), of_longest=True),
    Knob(TEXTURES, "profile", ("raw", "fast"), slow=("small",)),
    Knob(TEXTURES, "preview", (0, 50, 90)),
    Knob(TEXTURES, "exact", ("never", "lossless-sources", "always")),
    Knob(TEXTURES, "max_error", (2, 4), coarser=True),
    Knob(EMIT, "need", (16, 0)),
    Knob(CELLS, "cells", ("leaf", "room")),
    Knob(LIGHT, "light_samples", (16, 256)),
    Knob(CELLS, "wall_area", (1.0, 4.0)),
    Knob(ACH, "samples", (1, 8, 64, 512), policy="ach", own="points"),
    Knob(PVS, "method", ("fast", "sampled", "full")),
    Knob(TEXTURES, "preview_format", ("webp", "jpeg"), slow=("avif",)),
    Knob(TEXTURES, "trim", (True,), coarser=True),
    Knob(CELLS, "wall_thickness", (0.2, 1.0)),
    Knob(CELLS, "gain", (0.0, 0.3)),
    Knob(PVS, "gain", (0.0, 0.1)),
    Knob(CELLS, "max_leaves", (50,)),
)


@dataclass(frozen=True)
class KnobSetting:
    """One knob at another value than the database's own.

    Attributes
    ----------
    own: the database's value, in the form of `Knob.text`.
    options: the options of its stage.
    """

    knob: Knob
    value: Any
    own: str
    options: Options

    @property
    def name(self) -> str:
        """As a user gives it."""
        return self.knob.text(self.value)


def settings(
    recorded: Mapping[Stage[Any], Options],
    longest: int,
    named: Collection[str] = (),
    *,
    quick: bool = False,
) -> Iterator[KnobSetting]:
    """Settings to try beside the ``recorded`` options of a database whose longest texture side is
    ``longest`` texels: of all knobs, or of the ``named`` options, such as "max-side"; with
    ``quick``, one value of each. A stage without ``recorded`` options has no settings."""
    for knob in KNOBS:
        if named and knob.option.removeprefix("--") not in named:
            continue
        if knob.stage not in recorded:
            continue
        options = recorded[knob.stage]
        current = getattr(options, knob.own or knob.field)
        values = (*knob.values, *(knob.slow if named else ()))
        if knob.of_longest:
            values = tuple(int(share * longest) for share in values if share * longest >= 1)
        chosen = [v for v in values if (v > current if knob.coarser else v != current)]
        for value in chosen[:1] if quick else chosen:
            with suppress(InputError):  # if the other options do not allow it
                changed = replace(options, **{knob.field: value})
                yield KnobSetting(knob, value, knob.text(current), changed)


def concerned_stages(stage: Stage[Any], recorded: Mapping[Stage[Any], Options]) -> list[Stage[Any]]:
    """A stage and those that depend on its result, in their order."""
    result = [stage]
    for later in STAGES.values():
        if later not in recorded or later in result:
            continue
        if {*later.read_with(recorded[later]), *later.heeds} & set(result):
            result.append(later)
    return result


#: Seconds of one core for each stage.
Seconds = dict[str, float]
Own = Mapping[Stage[Any], Options]
#: A shorter run of a stage is measured again, and the lesser time counts, s.
BRIEF = 1.0


def own_options(artifacts: Artifacts) -> Own:
    """The options of the last run of each stage, without those of the scene, the first of which
    needs the model. A stage that decided to write nothing is one of them: later stages read that
    decision, which depends on what the stage reads.

    Raises DatabaseError PTM-D004 if one has not run, PTM-D002 for options that no stage has.
    """
    stages = (s for s in STAGES.values() if not s.optional or artifacts.before(s))
    return {stage: artifacts.recorded(stage) for stage in stages if not stage.joined}


@contextmanager
def temporary_copy(db: Path) -> Iterator[Path]:
    """A temporary copy of a database, to be changed."""
    with TemporaryDirectory(prefix="ptmtools-") as folder:
        yield Path(shutil.copytree(db, Path(folder) / "db"))


def build_again(db: Path, options: Own) -> Seconds:
    """Runs the stages whose options are given, current or not, in the order of the options, by one
    worker: nothing is reused. The time to compile kernels does not count."""
    result: Seconds = {}
    for stage, chosen in options.items():
        run = partial(run_stage, db, chosen, workers=1, rebuild=True)
        _, seconds = compiled_and_timed(run)
        result[stage.name] = seconds if seconds >= BRIEF else min(seconds, time_work(run)[1])
    return result


def compiled_and_timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """As `time_work`, of a second call if the first one compiled kernels."""
    compiled = compilations()
    result = time_work(work)
    return result if compilations() == compiled else time_work(work)
