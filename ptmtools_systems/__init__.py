"""Neighbouring systems: octree textures, interlaced images, campus levels of detail."""

from pathlib import Path

#: Scripts that attach to the page, of ``web/systems``.
PAGE = Path(__file__).parent / "page"
