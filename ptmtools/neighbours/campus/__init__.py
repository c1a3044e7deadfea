"""A model as a campus of objects with levels of detail (notes, section 4; the paper's II and III).

`make_campus` writes a folder of meshes, textures by size and channel, lightmaps and one index,
`campus.json`; docs/formats/campus.md describes it. `read_campus` reads the index back.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.neighbours.campus.building import Made as Made, make_campus as make_campus
    from ptmtools.neighbours.campus.model import Campus as Campus, distances as distances
    from ptmtools.neighbours.campus.options import CampusOptions as CampusOptions
    from ptmtools.neighbours.campus.reading import read_campus as read_campus

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.neighbours.campus.building": "Made make_campus",
        "ptmtools.neighbours.campus.model": "Campus distances",
        "ptmtools.neighbours.campus.options": "CampusOptions",
        "ptmtools.neighbours.campus.reading": "read_campus",
    },
)
