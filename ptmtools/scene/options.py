"""The knobs of ingest."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from ptmtools.errors import InputError

#: Of the files that are read: by readers of our own, through trimesh, pymeshlab,
#: IfcOpenShell and usd-core.
OWN = (".obj", ".glb", ".gltf")
TRIMESH = (".ply", ".stl", ".off")
MESHLAB = (".3ds", ".3mf", ".ctm", ".dae", ".wrl", ".x3d")
IFC = (".ifc", ".ifczip")
USD = (".usd", ".usda", ".usdc", ".usdz")
SUFFIXES = (*OWN, *TRIMESH, *MESHLAB, *IFC, *USD)


@dataclass(frozen=True)
class IngestOptions:
    """How a model is read.

    Attributes
    ----------
    unit: the model's unit: m, cm, mm, in, ft, or its length in metres. By default it is guessed
        from the size of the model and of its rooms.
    up: the model's up axis, "y" or "z". By default it is what the format says (glTF: y), or guessed
        from the rooms, walls and floors.
    two_sided: draw every face from both sides, whatever the model says.
    strict: stop the build at missing files, unknown materials, unreadable images and dropped faces,
        and if more than a tenth of where one could stand is left out.
    allow_outside: also read files outside the model's folder that the model refers to.
    limit: refuse an image that takes more memory than this once decoded, in MiB.
    max_triangles: refuse a model with more triangles than this.
    """

    unit: str | float | None = None
    up: Literal["y", "z"] | None = None
    two_sided: bool = False
    strict: bool = False
    allow_outside: bool = False
    # Limits end a build or change nothing in it, so they do not decide whether a stage is current.
    limit: int = field(default=1024, compare=False)
    max_triangles: int = field(default=20_000_000, compare=False)

    def __post_init__(self) -> None:
        if self.up not in (None, "y", "z"):
            raise InputError("PTM-I251", f"up axis {self.up!r} is not known", remedy="give y or z")
        if self.limit < 1 or self.max_triangles < 1:
            raise InputError(
                "PTM-I257",
                "a limit is below 1",
                remedy="give --limit and --max-triangles of 1 or more",
            )
        if self.unit is not None:
            from ptmtools.scene.space import parse_unit

            parse_unit(self.unit)
