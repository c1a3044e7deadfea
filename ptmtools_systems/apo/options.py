"""Options for replacing objects; see `ptmtools_systems.apo.replacing`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from ptmtools.errors import InputError
from ptmtools.options import option

#: Greatest depth: Morton codes of three times as many bits fit into 63.
DEEPEST = 20
#: Option → (least, most).
RANGES: dict[str, tuple[float, float]] = {
    "faces": (4, 10_000_000),
    "error": (0.0, 2.0),
    "depth": (1, DEEPEST),
    "density": (0.01, 1000.0),
    "color_error": (0.0, 2.0),
}


def check_range(name: str, value: float, prefix: str = "") -> None:
    """Raises InputError PTM-I111 for a value out of range; the option on the command line is
    ``prefix`` and its name."""
    least, most = RANGES[name]
    if not least <= value <= most:
        raise InputError(
            "PTM-I111",
            f"--{prefix}{name.replace('_', '-')} {value:g} is not possible",
            remedy=f"use {least:g} to {most:g}",
        )


@dataclass(frozen=True)
class ReplaceOptions:
    """Objects to replace by a simplified mesh with their relief, and its accuracy.

    Raises InputError PTM-I111 for values out of range, or without an object.
    """

    heading: ClassVar[str] = "Relief"

    apo: tuple[str, ...] = option(
        (),
        "Names of objects, such as scanned statues, to replace with a simplified mesh and their "
        "relief; * and ? are wildcards. Repeatable.",
        metavar="NAME",
    )
    relief: Literal["octree", "normal-map"] = option(
        "octree",
        "Form of the relief: octree (of normals) or normal-map (fewer bytes; other viewers show "
        "it too).",
    )
    apo_faces: int = option(
        2_000,
        "Maximum number of faces of a simplified mesh. Objects with fewer triangles stay "
        "unchanged.",
    )
    apo_error: float = option(
        0.05,
        "Maximum deviation of the normals in a leaf of the octree from their mean, or of a normal "
        "map from the object, as a root mean square from 0 to 2. Leaves that exceed it are "
        "divided, and maps enlarged.",
    )
    apo_depth: int = option(
        11,
        "Maximum depth of the octree. A leaf at depth 11 has 1/2048 of the width of the "
        "object's bounding cube. A normal map has at most 2048 texels a side then.",
    )
    apo_density: float = option(
        8.0,
        "Samples of an octree per triangle of an object, on average, or most texels of a normal "
        "map.",
    )

    def __post_init__(self) -> None:
        for name in ("faces", "error", "depth", "density"):
            check_range(name, getattr(self, f"apo_{name}"), "apo-")
            if not self.apo and getattr(self, f"apo_{name}") != getattr(type(self), f"apo_{name}"):
                raise InputError(
                    "PTM-I111",
                    f"--apo-{name} does nothing without --apo",
                    remedy="specify the objects with --apo",
                )
        if not self.apo and self.relief != type(self).relief:
            raise InputError(
                "PTM-I111",
                "--relief does nothing without --apo",
                remedy="specify the objects with --apo",
            )
