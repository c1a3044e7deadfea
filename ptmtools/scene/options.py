"""Options of ingest, and the errors for models beyond its limits."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

from ptmtools.errors import InputError, LimitError
from ptmtools.options import option, require

#: `Scene.triangles` is int32: more vertices cannot be numbered.
MAX_VERTICES = 2**31 - 1


@dataclass(frozen=True)
class IngestOptions:
    """Options of `ptmtools.scene.ingest`.

    Raises InputError: PTM-I111 an unknown unit or up axis, or a limit below 1.
    """

    heading: ClassVar[str] = "Model"

    unit: str | float | None = option(
        None,
        "Unit of the model: m, cm, mm, in, ft, or its length in metres. Default: the unit "
        "that the file records or its format prescribes (glTF: m); otherwise guessed from the size "
        "of the model and its rooms.",
        metavar="UNIT",
        basic=True,
    )
    up: Literal["y", "z"] | None = option(
        None,
        "Up axis of the model. Default: the axis that the file records or its format prescribes "
        "(glTF: y); otherwise guessed from floors and walls.",
        basic=True,
    )
    normal_maps: Literal["draw", "none"] = option(
        "draw",
        "Normal maps and bump maps of glTF and OBJ materials: draw (they are stored, and clients "
        "fetch them after the textures) or none.",
    )
    two_sided: bool = option(False, "Draw both sides of every face.")
    strict: bool = option(
        False,
        "Fail on missing files, unknown materials, unreadable images and dropped faces, and if "
        "more than a tenth of the walkable floor or of the triangles is left out.",
        basic=True,
    )
    allow_outside: bool = option(False, "Also read files outside the model's folder.")
    # Limits either end a build or have no effect, so a changed limit does not invalidate a stage.
    limit: int = option(1024, "Maximum decoded size of an image.", metavar="MIB", compare=False)
    max_triangles: int = option(
        20_000_000, "Maximum number of triangles of the model.", compare=False
    )

    def __post_init__(self) -> None:
        require(
            (self.up in (None, "y", "z"), f"unknown up axis {self.up!r}", "use y or z"),
            (
                self.limit >= 1 and self.max_triangles >= 1,
                "a limit is below 1",
                "use --limit and --max-triangles of 1 or more",
            ),
        )
        if self.unit is not None:
            from ptmtools.scene.orientation.space import parse_unit

            parse_unit(self.unit)


def damage(model: Path, reason: str) -> InputError:
    """The error for a file that is damaged, PTM-I254."""
    return InputError("PTM-I254", f"damaged ({reason})", file=model, remedy="export it again")


def too_many_triangles(limit: int, file: Path) -> LimitError:
    """The error for a model of more triangles than the limit, PTM-L203."""
    return LimitError(
        "PTM-L203",
        f"has more than {limit:,} triangles",
        file=file,
        remedy="raise the limit (--max-triangles), or split the model",
    )


#: Exceptions of malformed documents, which can be malformed in any place.
FAULTS = (
    ArithmeticError,
    AttributeError,
    InputError,
    LookupError,
    RecursionError,
    TypeError,
    ValueError,
)


def fault_of(error: Exception) -> str:
    """One line on one of `FAULTS`."""
    if isinstance(error, InputError):
        return error.message
    text = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
    return text.splitlines()[0] if text else type(error).__name__
