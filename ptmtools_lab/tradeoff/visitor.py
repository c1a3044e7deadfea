"""The experiment of the client of Marvie & Bouatouch: δt and the static boost, on a walk.

The error is that of the pictures of a walk through the database beside its full ones, which no
option of the client changes.
"""

from __future__ import annotations

from ptmtools.output.served import read_served
from ptmtools_lab.comparing import SimulateOptions, play, require_hints
from ptmtools_lab.path.making import path_through
from ptmtools_lab.path.options import PathOptions
from ptmtools_lab.policies.paper import PaperOptions
from ptmtools_lab.tradeoff.experiment import Experiment, Measurement, Setting, Subject, timed
from ptmtools_lab.world import World, prepare

#: Duration of the walk, s; link, and texture memory while the visitor moves.
DURATION, BANDWIDTH, MEMORY = 60.0, "512k", "10%"


def prepare_client(subject: Subject) -> Experiment:
    """See `EXPERIMENTS`.

    Raises as `read_served` and `require_hints`.
    """
    served = read_served(subject.artifacts.db.path)
    require_hints(served, SimulateOptions(policy="paper").policies)
    walk = path_through(subject.artifacts, PathOptions(duration=DURATION)).walk
    return client_experiment(prepare(served, walk))


def client_experiment(world: World) -> Experiment:
    """The experiment on a walk."""
    options = SimulateOptions(policy="paper", bandwidth=BANDWIDTH, memory=MEMORY)

    def measure(setting: Setting) -> Measurement:
        paper = PaperOptions(**setting.knobs)
        (played,), seconds = timed(lambda: play({"": world}, options, paper=paper))
        measures = played.measures
        return Measurement(
            seconds=seconds,
            work=float(measures.bytes),
            error=measures.e.mean,
            worst=measures.e.p95,
            more={"memory": float(played.run.memory.max())},
        )

    play({"": world.standing(1.0)}, options)  # compiles it
    settings = [
        Setting(f"--{name.replace('_', '-')} {value}", {name: value})
        for name, values in (
            ("delta_t", (0.1, 0.25, 0.5, 1.0, 2.0, 5.0)),
            ("delta_t_static", (1.0, 5.0, 80.0)),
            ("static_memory", ("5%", "40%", "inf")),
        )
        for value in values
    ]
    error = f"e, of 255, of a walk of {world.time[-1]:.0f} s at {BANDWIDTH}bit/s, memory {MEMORY}"
    units = {"work": "B", "memory": "B"}
    return Experiment("bytes received", error, settings, measure, by_work=True, units=units)
