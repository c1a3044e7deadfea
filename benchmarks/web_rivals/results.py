"""Timelines kept below ``build/bench/rivals``, so that a long run can be stopped and continued.

The key of a kept timeline is everything that it depends on: the files that the page sends, the
link, the protocol, and the number of its repetition. A changed page is measured anew.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.web_rivals.entrants import Entrant
from benchmarks.web_rivals.images import KEPT
from benchmarks.web_rivals.timeline import HEIGHT, WIDTH, Timeline
from ptmtools.site.throttle import Throttle

RESULTS = KEPT / "timelines"
#: To be raised when the same conditions are measured in another way.
_EDITION = 1


@dataclass(frozen=True)
class Conditions:
    """Of a run: ``repetition`` counts from 0, ``patience``: s."""

    link: Throttle
    http: str
    repetition: int
    patience: float

    def __str__(self) -> str:
        bandwidth = self.link.bandwidth
        speed = "no limit" if bandwidth is None else f"{bandwidth / 1e6:g} Mbit/s"
        way = f"{1000 * self.link.latency:.0f} ms"
        return f"{speed}, {way}, HTTP/{self.http}, run {self.repetition + 1}"

    def key(self, entrant: Entrant) -> str:
        """The name of its file."""
        facts = [_EDITION, WIDTH, HEIGHT, entrant.name, entrant.digest]
        facts += [self.link.bandwidth, self.link.latency, self.http, self.repetition, self.patience]
        return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:24]


def kept(entrant: Entrant, conditions: Conditions, measure: Callable[[], Timeline]) -> Timeline:
    """The timeline of these conditions: the one on the disk, or else a new one."""
    file = RESULTS / f"{conditions.key(entrant)}.npz"
    if not file.is_file():
        run = measure()
        RESULTS.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(".part")
        with part.open("wb") as out:
            np.savez_compressed(
                out,
                time=run.time,
                sent=run.sent,
                **{f"picture{k}": picture for k, picture in enumerate(run.pictures)},
                numbers=np.array([run.done, run.everything, run.requests, run.connections]),
                messages=np.array(run.messages, dtype=np.str_),
            )
        part.replace(file)
    with np.load(file) as data:
        done, everything, requests, connections = data["numbers"].tolist()
        return Timeline(
            time=data["time"],
            sent=data["sent"],
            pictures=tuple(data[f"picture{k}"] for k in range(len(data["time"]))),
            done=done,
            everything=everything,
            requests=int(requests),
            connections=int(connections),
            messages=tuple(data["messages"].tolist()),
        )
