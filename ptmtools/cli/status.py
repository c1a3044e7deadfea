"""`ptm status`, and what `ptm build-scene --dry-run` says."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from ptmtools.cli.common import as_json, database, voiced
from ptmtools.cli.output import Voice
from ptmtools.pipeline.command import build_command
from ptmtools.pipeline.stages import STAGES
from ptmtools.quantities import count, size

if TYPE_CHECKING:
    from ptmtools.pipeline.build import StagePlan

#: Textures that are named without ``-v``.
SHOWN_TEXTURES = 5

_PLANNED = {"current": "unchanged", "run": "would run", "maybe": "may run"}


@click.command("status")
@database
@as_json
@voiced
def status(voice: Voice, db: str, as_json: bool) -> None:
    """Show which stages of DB are done, stale or damaged, and which process is writing it."""
    from ptmtools.pipeline.status import database_status

    found = database_status(db)
    if as_json:
        voice.emit_json({"schema": 1, **asdict(found)})
        return
    model = f"database of {found.model}" if found.model else "nothing has been committed yet"
    voice.say(f"{db}: {model}")
    for stage in found.stages:
        summary = STAGES[stage.stage].summarize(stage.counts) if stage.counts else ""
        files = f"{count(stage.files, 'file')}, {size(stage.bytes)}" if stage.files else ""
        voice.say(f"{stage.stage:<9}{stage.state:>8}   {files:<22} {stage.why or summary}".rstrip())
    if found.writer:
        voice.say(f"being written by {found.writer}")
    if found.interrupted:
        waiting = f"; {count(found.waiting, 'finished texture')} will be kept"
        voice.say(f"a run was interrupted{waiting if found.waiting else ''}")
    if not found.finished and not found.writer:
        voice.say(f"not finished: run `{build_command(db)}`")


def print_plan(voice: Voice, plans: Sequence[StagePlan], as_json: bool) -> None:
    """Says what a build would do."""
    if as_json:
        voice.emit_json({"schema": 1, "stages": [asdict(plan) for plan in plans]})
        return
    for plan in plans:
        reasons = list(plan.reasons)
        if plan.textures and plan.plan == "run":
            shown = plan.textures if voice.verbose else plan.textures[:SHOWN_TEXTURES]
            more = len(plan.textures) - len(shown)
            names = ", ".join(shown) + (f" and {more:,} more" if more else "")
            reasons.append(f"encode {count(len(plan.textures), 'texture')}: {names}")
        first = reasons[0] if reasons else ""
        voice.say(f"{plan.stage:<9}{_PLANNED[plan.plan]:>10}   {first}".rstrip())
        for line in reasons[1:]:
            voice.say(f"{'':<22}{line}")
