"""Options for replacing objects; see `ptmtools_systems.apo.replacing`."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, ClassVar, Literal

from ptmtools.options import option, option_name, require, require_ranges

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


def check_ranges(options: Any, prefix: str = "") -> None:
    """Raises InputError PTM-I111 for a value out of range, of the fields with this prefix."""
    ranges = {
        prefix + name: range for name, range in RANGES.items() if hasattr(options, prefix + name)
    }
    require_ranges(
        options, ranges, "--{name} {value:g} is not possible", "use {least:g} to {most:g}"
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
        check_ranges(self, "apo_")
        for field in fields(self):
            require(
                (
                    bool(self.apo) or getattr(self, field.name) == field.default,
                    f"--{option_name(field)} does nothing without --apo",
                    "specify the objects with --apo",
                )
            )
