"""A walk through a campus with the client of its paper (notes, section 4; the paper's III and IV).

A campus (`ptm campus`) is not a database: it has no cells, and no file with all levels of a
texture. Meshes and textures are files that a client loads whole, so its client is not a `Client` of
`ptmtools.lab.policies`. Link, camera, walk and the error of the picture are the same.
`prepare_campus` compares with the full picture of a database of the same model, if one is given.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools.lab.campus.client import CampusClient as CampusClient
    from ptmtools.lab.campus.options import CampusWalkOptions as CampusWalkOptions
    from ptmtools.lab.campus.simulation import (
        CampusRun as CampusRun,
        simulate_campus as simulate_campus,
        walk_campus as walk_campus,
    )
    from ptmtools.lab.campus.stock import Stock as Stock, read_stock as read_stock
    from ptmtools.lab.campus.world import (
        CampusWorld as CampusWorld,
        prepare_campus as prepare_campus,
    )

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.lab.campus.client": "CampusClient",
        "ptmtools.lab.campus.options": "CampusWalkOptions",
        "ptmtools.lab.campus.simulation": "CampusRun simulate_campus walk_campus",
        "ptmtools.lab.campus.stock": "Stock read_stock",
        "ptmtools.lab.campus.world": "CampusWorld prepare_campus",
    },
)
