"""The kinds of input, with the share that each has of all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from benchmarks.fuzz.databases import Interrupted, ListText, ManifestText, Npz, Served, Vrml
from benchmarks.fuzz.folders import ApoFolder, CampusFolder, Interlaced
from benchmarks.fuzz.models import Gltf, Mesh, Meshopt, Messages, Mtl, Obj
from benchmarks.fuzz.textures import Images, Ptm


@dataclass(frozen=True)
class Kind:
    """What makes a target, and how many of a hundred inputs are its."""

    make: Callable[..., Any]
    weight: int


KINDS: dict[str, Kind] = {
    "ptm": Kind(Ptm, 20),
    "npz": Kind(Npz, 15),
    "manifest": Kind(ManifestText, 12),
    "list": Kind(ListText, 1),
    "mtl": Kind(Mtl, 12),
    "obj": Kind(Obj, 14),
    "gltf": Kind(Gltf, 8),
    "meshopt": Kind(Meshopt, 8),
    "messages": Kind(Messages, 4),
    "mesh": Kind(Mesh, 3),
    "image": Kind(Images, 10),
    "interlaced": Kind(Interlaced, 4),
    "apo": Kind(ApoFolder, 3),
    "campus": Kind(CampusFolder, 2),
    "vrml": Kind(Vrml, 3),
    "staged": Kind(Interrupted, 2),
    "served": Kind(Served, 1),
}
