"""The statistics: how far the coverage can be trusted, and how it differs by point and view."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ptmtools.database.hints.index import SCHEMA
from ptmtools.database.hints.numbers import document_text, significant

if TYPE_CHECKING:
    from ptmtools.database.content import Content

FORMAT = "ptmtools statistics"


def statistics_text(content: Content) -> str:
    """The text of `hints/statistics.json`; raises DatabaseError PTM-D601."""
    ach = content.ach
    head: dict[str, object] = {
        "format": FORMAT,
        "schema": SCHEMA,
        "coverage": {"backend": ach.backend, "renderer": ach.renderer},
    }
    textures = [{"sha256": record.sha256} for record in content.textures]
    cells = [_cell(content, c) for c in range(content.cells.cell_count)]
    return document_text(head, {"textures": textures, "cells": cells})


def _cell(content: Content, cell: int) -> dict[str, Any]:
    ach = content.ach
    rows, own = ach.entries(cell), slice(cell, cell + 1)
    return {
        "samples": int(ach.samples[cell]),
        "rejected": int(ach.rejected[cell]),
        "missed": significant(ach.missed[own])[0],
        "uncertain": significant(ach.uncertain[own])[0],
        "unseenBelow": significant(ach.unseen_below[own])[0],
        "error": significant(ach.error[rows]),
        "p95": significant(ach.p95[rows]),
        "seen": significant(ach.seen[rows]),
        "views": [significant(view) for view in ach.views[rows].T],
    }
