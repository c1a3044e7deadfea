"""A database built again with another option, in a folder of its own.

What a setting costs is what all stages after the scene then take: those that the option concerns
run again, and the others took what they take with the database's own options.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ptmtools.pipeline import Artifacts
from ptmtools.pipeline.build import run_stage
from ptmtools.pipeline.stage import Options, Stage
from ptmtools.pipeline.stages import STAGES
from ptmtools.progress import Progress, silent
from ptmtools.tradeoff.experiment import timed

#: Seconds of one core that each stage took.
Seconds = dict[str, float]
Own = Mapping[Stage[Any], Options]


def own_options(artifacts: Artifacts) -> Own:
    """Those that the stages last ran with, but for those that make the scene, of which the first
    needs the model.

    Raises DatabaseError PTM-D004 if one has not run, PTM-D002 for options that no stage has.
    """
    return {stage: artifacts.recorded(stage) for stage in STAGES.values() if not stage.hidden}


@contextmanager
def copied(db: Path) -> Iterator[Path]:
    """A copy of a database, to be changed, for a while."""
    with TemporaryDirectory(prefix="ptmtools-") as folder:
        yield Path(shutil.copytree(db, Path(folder) / "db"))


def build_again(db: Path, options: Own, progress: Progress = silent) -> Seconds:
    """Runs the stages whose options are given, whether or not they are current, in the order of
    the options, by one worker: nothing is kept that would have been cheap to keep."""
    found: Seconds = {}
    for stage, chosen in options.items():
        run = partial(run_stage, db, chosen, workers=1, rebuild=True, progress=progress)
        _, found[stage.name] = timed(run)
    return found
