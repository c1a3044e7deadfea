"""``ptm warm-up``."""

from __future__ import annotations

import time

import click

from ptmtools.ahead import compile_now
from ptmtools.cli.common import voiced
from ptmtools.cli.output import Voice
from ptmtools.pipeline.build import WARM_UP


@click.command("warm-up")
@voiced
def warm_up(voice: Voice) -> None:
    """Compile for this machine what the first build or encoding would compile.

    That takes half a minute, once for each release and user. A first build does it too, beside its
    work: this command is for images of containers, and for whoever has time before.
    """
    start = time.perf_counter()
    compiled = compile_now(WARM_UP)
    seconds = time.perf_counter() - start
    voice.say(f"compiled in {seconds:.1f} s" if compiled else "nothing to compile")
