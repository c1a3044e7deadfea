"""Where a walk begins, and the places by which one comes from room to room (paper §6).

`placement` says which they are. It finds the floor below an eye (`ground`), places to stand in the
rooms (`rooms`), where to look from them (`outlook`), and in which order to walk through (`tour`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.database.viewpoints.placement import place_viewpoints

__all__ = ["place_viewpoints"]

__getattr__ = names(__name__, {"place_viewpoints": "placement"})
