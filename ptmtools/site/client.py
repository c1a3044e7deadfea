"""Constants of the client of docs/formats/client.md.

``client.json`` has them with their meanings, for every implementation: the policies of the page
(``web/page/build.py`` writes ``web/page/policy/constants.js`` from it), the openings of a site, and
the simulator. They are not constants of compiled loops, whose cache does not know the file.
"""

from __future__ import annotations

import json
from pathlib import Path

#: Name → value and meaning.
CONSTANTS: dict[str, tuple[float, str]] = json.loads(
    Path(__file__).with_name("client.json").read_text(encoding="utf-8")
)


def _value(name: str) -> float:
    return float(CONSTANTS[name][0])


NOTHING = _value("NOTHING")
NEAREST = _value("NEAREST")
BEHIND = _value("BEHIND")
BEYOND = _value("BEYOND")
LEAST_DIFFERENCE = _value("LEAST_DIFFERENCE")
AVERAGING = _value("AVERAGING")
NORMALS = _value("NORMALS")
SEEN = _value("SEEN")
GROSS = _value("GROSS")
SURROUNDINGS = _value("SURROUNDINGS")
HELD = _value("HELD")
HELD_ON = _value("HELD_ON")
HELD_SECONDS = _value("HELD_SECONDS")
RECORD_SHARE = _value("RECORD_SHARE")
RANGE_SECONDS = _value("RANGE_SECONDS")
RANGE_BYTES = int(_value("RANGE_BYTES"))
OVERHEAD = int(_value("OVERHEAD"))
LONGEST_WAIT = int(_value("LONGEST_WAIT"))
CONNECTIONS = int(_value("CONNECTIONS"))
STREAMS = int(_value("STREAMS"))
PRIOR_BANDWIDTH = _value("PRIOR_BANDWIDTH")
PRIOR_LATENCY = _value("PRIOR_LATENCY")
HALF_LIFE = _value("HALF_LIFE")
ENOUGH_BYTES = int(_value("ENOUGH_BYTES"))
ENOUGH_SECONDS = _value("ENOUGH_SECONDS")
LATENCIES = int(_value("LATENCIES"))
LOOK_SECONDS = _value("LOOK_SECONDS")
ITEM_PIXELS = int(_value("ITEM_PIXELS"))
STILL_SECONDS = _value("STILL_SECONDS")
STILL_METRES = _value("STILL_METRES")
STILL_DEGREES = _value("STILL_DEGREES")
PATIENCE = _value("PATIENCE")
PATIENCE_STILL = _value("PATIENCE_STILL")
BEFORE = _value("BEFORE")
AHEAD = _value("AHEAD")
RING = _value("RING")
CAMPUS_NEAREST = int(_value("CAMPUS_NEAREST"))
CAMPUS_THREADS = int(_value("CAMPUS_THREADS"))
CAMPUS_MOVE = _value("CAMPUS_MOVE")
