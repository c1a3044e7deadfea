"""What is asked for when objects of a building are replaced; see
`ptmtools.neighbours.apo.replacing`."""

from __future__ import annotations

from dataclasses import dataclass

from ptmtools.errors import InputError

#: The greatest depth: Morton codes of three times as many bits stay within 63.
DEEPEST = 20
#: Of each option the least and the most.
RANGES: dict[str, tuple[float, float]] = {
    "faces": (4, 10_000_000),
    "error": (0.0, 2.0),
    "depth": (1, DEEPEST),
    "density": (0.01, 1000.0),
    "color_error": (0.0, 2.0),
}


def check_range(name: str, value: float, prefix: str = "") -> None:
    """Raises InputError PTM-I840 for a value that is out of range; the command line calls the
    option ``prefix`` and its name."""
    least, most = RANGES[name]
    if not least <= value <= most:
        raise InputError(
            "PTM-I840",
            f"--{prefix}{name.replace('_', '-')} {value:g} is not possible",
            remedy=f"give {least:g} to {most:g}",
        )


@dataclass(frozen=True)
class ReplaceOptions:
    """Which objects are replaced by a simplified mesh and an octree texture, and how fine.

    Attributes
    ----------
    apo: replace these objects (names, with * and ?), such as scanned statues, by a mesh of few
        triangles, and write an octree of their normals for clients that can draw one. May be given
        several times.
    apo_faces: of each simplified mesh, at most. Objects with no more triangles stay as they are.
    apo_error: leaves of an octree are divided while the normals in them deviate more than this from
        their mean: the root mean square of the length of the difference, 0 to 2.
    apo_depth: greatest depth of the leaves; one of depth 11 is 1/2048 of the object wide.
    apo_density: samples for each triangle of an object, on average.

    Raises InputError PTM-I840 for what is out of range, or of no object.
    """

    apo: tuple[str, ...] = ()
    apo_faces: int = 2_000
    apo_error: float = 0.05
    apo_depth: int = 11
    apo_density: float = 8.0

    def __post_init__(self) -> None:
        for name in ("faces", "error", "depth", "density"):
            check_range(name, getattr(self, f"apo_{name}"), "apo-")
            if not self.apo and getattr(self, f"apo_{name}") != getattr(type(self), f"apo_{name}"):
                raise InputError(
                    "PTM-I840",
                    f"--apo-{name} does nothing without --apo",
                    remedy="name the objects that it is for with --apo",
                )
