"""``ptm warm-up``."""

from __future__ import annotations

import time

import click

from ptmtools.ahead import Task, compile_now
from ptmtools.cli.common import voiced
from ptmtools.cli.output import Voice
from ptmtools.lazy import Lazy
from ptmtools.pipeline.build import WARM_UP

#: What simplified meshes and octree textures need.
OCTREES: Task = Lazy("ptmtools.neighbours.apo.warm_up:warm_up")


@click.command("warm-up")
@voiced
def warm_up(voice: Voice) -> None:
    """Compile for this machine what the first build, encoding or octree texture would compile.

    That takes a minute, once for each release and user. A first build does it too, beside its
    work: this command is for images of containers, and for whoever has time before.
    """
    start = time.perf_counter()
    compiled = [compile_now(task) for task in (WARM_UP, OCTREES)]
    seconds = time.perf_counter() - start
    voice.say(f"compiled in {seconds:.1f} s" if any(compiled) else "nothing to compile")
