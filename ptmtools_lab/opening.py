"""The opening of a site, as the simulated client receives it (`ptmtools.site.opening`).

A walk that begins at the first viewpoint gets its opening: the parts arrive one after the other in
one response, which is requested together with the index.
"""

from __future__ import annotations

import numpy as np

from ptmtools.arrays import Floats
from ptmtools.output.served import Served
from ptmtools.site.opening import NeedFinder, contents_of, ordered_steps
from ptmtools_lab.catalogue import Catalogue

#: Kind, number and end of each part, in order.
Parts = tuple[tuple[str, int, int], ...]
#: How far a walk may begin from the viewpoint, metres, and the cosine of the angle between them.
NEAR, ALIKE = 0.5, np.cos(np.radians(10.0))


def opening_of(served: Served, catalogue: Catalogue, eye: Floats, direction: Floats) -> Parts:
    """The parts for a walk that begins with a view; none if it begins elsewhere, or without Embree.

    Parameters
    ----------
    catalogue: has the bytes of records and geometry on the link.
    eye, direction: (3,)
    """
    views = served.index["viewpoints"]
    # Databases of earlier releases have no site.
    if not views or any("differences" not in row for row in served.index["textures"]):
        return ()
    view = views[0]
    away = np.linalg.norm(eye - np.array(view["position"]))
    aside = direction @ np.array(view["direction"]) / np.linalg.norm(direction)
    if away > NEAR or aside < ALIKE:
        return ()
    try:
        needs = NeedFinder(served).needs(view)
    except ImportError:
        return ()
    sizes = {
        (name, cell): int(size)
        for name, bytes_ in (
            ("record", catalogue.record_bytes), ("geometry", catalogue.geometry_bytes),
        )
        for cell, size in enumerate(bytes_)
    }  # fmt: skip
    parts, _ = contents_of(ordered_steps(served.index, needs, view["cell"], sizes))
    return tuple((part.kind, part.number, part.end) for part in parts)
