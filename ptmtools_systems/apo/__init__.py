"""Appearance-preserving octree textures (Lacoste et al.): a simplified mesh, and an octree of the
normals of the original, which is both a GPU data structure and a stream.

`make_apo` makes both from a mesh, `files_of` the files of a folder; `read_octree` and `read_mesh`
read them back, `read_octree` also the first levels alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports

if TYPE_CHECKING:
    from ptmtools_systems.apo.files import (
        files_of as files_of,
        read_mesh as read_mesh,
        read_octree as read_octree,
    )
    from ptmtools_systems.apo.making import ApoTexture as ApoTexture, make_apo as make_apo
    from ptmtools_systems.apo.model import ApoOptions as ApoOptions, Octree as Octree

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools_systems.apo.files": "files_of read_mesh read_octree",
        "ptmtools_systems.apo.making": "ApoTexture make_apo",
        "ptmtools_systems.apo.model": "ApoOptions Octree",
    },
)
