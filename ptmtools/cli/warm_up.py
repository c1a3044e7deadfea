"""``ptm warm-up``."""

from __future__ import annotations

import time
from collections.abc import Callable

import click

from ptmtools.cli.common import voiced
from ptmtools.cli.output import Voice
from ptmtools.lazy import Lazy
from ptmtools.machine_code import is_kept

#: What calls the kernels of a build, and a module of some of them.
WARM_UP: tuple[Lazy[Callable[[], object]], str] = (
    Lazy("ptmtools.pipeline.warm_up:warm_up"),
    "ptmtools.visibility.flow_kernels",
)


@click.command("warm-up")
@voiced
def warm_up(voice: Voice) -> None:
    """Compile for this machine what the first build or encoding would compile.

    That takes half a minute, once for each release. A first build does it too, beside its work:
    this command is for images of containers, and for whoever has time before.
    """
    task, kernels = WARM_UP
    if is_kept(kernels):
        voice.say("nothing to compile")
        return
    start = time.perf_counter()
    with voice.progress():
        task.load()()
    voice.say(f"compiled in {time.perf_counter() - start:.1f} s")
