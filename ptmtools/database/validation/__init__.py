"""The check of what stands on disk: everything that a client may rely on.

`database` checks a whole one: what lies there (`files`), each file by itself (`reading`), then one
against the other. What a kind of file must satisfy stands in a module of its own (`cells`, `root`,
`hints`, `textures`, `gltf`), and so does what several kinds have in common (`lists`, `solids`,
`space`, `urls`) and what the manifest counts of them (`counts`). `findings` has the codes of all
that can be wrong.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.database.validation.database import validate_database, validate_ptm
    from ptmtools.database.validation.findings import CODES, Findings

__all__ = ["CODES", "Findings", "validate_database", "validate_ptm"]

__getattr__ = names(
    __name__,
    {
        "CODES": "findings",
        "Findings": "findings",
        "validate_database": "database",
        "validate_ptm": "database",
    },
)
