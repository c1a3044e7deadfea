"""Textures as `.ptm`s: ranges of one file, each a level."""

from __future__ import annotations

from ptmtools.walkthrough.memory import Columns, columns_of
from ptmtools.walkthrough.served import Served


def columns(served: Served, paper: bool) -> Columns:
    """See `Form.columns`."""
    return columns_of(served.index["textures"], paper=paper)
