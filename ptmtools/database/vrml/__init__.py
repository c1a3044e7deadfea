"""Artifacts → VRML97: `root.wrl` and a file for every cell; and back: the strict reader of both.

docs/database.md says what is in them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.database.vrml.cell import CellText, CellWriter
    from ptmtools.database.vrml.hull import convex_hull
    from ptmtools.database.vrml.reader import Document, Node, WrlError, parse
    from ptmtools.database.vrml.root import PATTERN, root_text

__all__ = [
    "PATTERN",
    "CellText",
    "CellWriter",
    "Document",
    "Node",
    "WrlError",
    "convex_hull",
    "parse",
    "root_text",
]

__getattr__ = names(
    __name__,
    {
        "PATTERN": "root",
        "CellText": "cell",
        "CellWriter": "cell",
        "Document": "reader",
        "Node": "reader",
        "WrlError": "reader",
        "convex_hull": "hull",
        "parse": "reader",
        "root_text": "root",
    },
)
