"""A model as a campus of objects with levels of detail (notes, section 4; the paper's II and III).

`make_campus` writes a folder of meshes, textures by size and channel, lightmaps and one index,
`campus.json`; docs/formats/campus.md describes it. `read_campus` reads the index back.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools_systems.campus.building import Made as Made, make_campus as make_campus
    from ptmtools_systems.campus.model import Campus as Campus, distances as distances
    from ptmtools_systems.campus.options import CampusOptions as CampusOptions
    from ptmtools_systems.campus.reading import read_campus as read_campus

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools_systems.campus.building": "Made make_campus",
        "ptmtools_systems.campus.model": "Campus distances",
        "ptmtools_systems.campus.options": "CampusOptions",
        "ptmtools_systems.campus.reading": "read_campus",
    },
)
