"""Appearance-preserving octree textures (Lacoste et al.): a high-polygon mesh becomes a simplified
one, and an octree of its normals that is a GPU data structure and a stream at once.

`make_apo` makes both of a mesh, `write_apo` writes them into a folder, `read_apo` reads a folder
or the beginning of its stream.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.apo.model import ApoOptions as ApoOptions, Octree as Octree

__getattr__ = names(__name__)
