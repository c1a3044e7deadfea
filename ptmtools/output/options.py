"""Options of `emit`."""

from __future__ import annotations

from dataclasses import dataclass

from ptmtools.options import option
from ptmtools.output.emitters import EMITTERS, chosen_emitters
from ptmtools.output.model import WriterOptions, option_error


@dataclass(frozen=True)
class EmitOptions(WriterOptions):
    """Options of `emit`. Raises InputError PTM-I111 for values out of range."""

    format: str = option(
        "vrml,gltf",
        "Formats to write",
        choices=EMITTERS,
        several=True,
        basic=True,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            emitters = chosen_emitters(self.format)
            if not any(emitter.cell_files for emitter in emitters):
                raise ValueError("none of them is of cells; add vrml or gltf")
        except ValueError as error:
            raise option_error(f"--format: {error}") from None
        chosen = {emitter.name for emitter in emitters}
        names = ",".join(name for name in EMITTERS if name in chosen)
        object.__setattr__(self, "format", names)
