"""The artifacts of the stages: whether each can be read and belongs to the others, and whether the
manifest counts it right.

They are read as the stages read them. A file whose hash is wrong is left to the check of the
hashes; here are those that are damaged although the hash is right: a manifest repaired by hand, a
stage taken from another build.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from typing import Any

from ptmtools.database.model import Issue
from ptmtools.database.validation.findings import Findings
from ptmtools.errors import DatabaseError
from ptmtools.pipeline.folder import MANIFEST, DatabaseFolder
from ptmtools.pipeline.run import Artifacts
from ptmtools.pipeline.stages import IMAGE_LIST, IMAGES

#: Stage → what its counts in the manifest are, of what it made.
_COUNTS: dict[str, dict[str, Callable[[Any], object]]] = {
    "scene": {
        "triangles": lambda scene: len(scene.triangles),
        "objects": lambda scene: len(scene.objects),
        "materials": lambda scene: len(scene.materials),
        "images": lambda scene: len(scene.images),
    },
    "cells": {
        "cells": lambda cells: cells.cell_count,
        "leaves": lambda cells: cells.leaf_count,
        "portals": lambda cells: cells.portal_count,
        "pieces": lambda cells: len(cells.triangle),
        "closed": lambda cells: cells.closed,
    },
    "pvs": {
        "average_share": lambda pvs: pvs.average_share,
        "conservative": lambda pvs: pvs.conservative,
    },
    "ach": {
        "backend": lambda ach: ach.backend,
        "samples": lambda ach: int(ach.samples.sum()),
        "rejected": lambda ach: int(ach.rejected.sum()),
    },
}


def check_stages(db: DatabaseFolder, astray: Collection[str] = ()) -> tuple[Issue, ...]:
    """What is wrong with the stages that have run. ``astray`` are files of which that is known,
    relative to the database: what needs them is passed over."""
    found = Findings()
    together = Artifacts(db)
    for stage, counts in _COUNTS.items():
        record = db.manifest.stages.get(stage)
        if record is None:
            continue
        try:
            made = getattr(Artifacts(db), stage)
        except DatabaseError as fault:
            _tell("PTM-D720", fault, db, astray, found)
            continue
        try:
            getattr(together, stage)
        except DatabaseError as fault:
            _tell("PTM-D721", fault, db, astray, found)
        for name, count in counts.items():
            if name in record.counts and record.counts[name] != (true := count(made)):
                told = f"is {record.counts[name]!r}, but the stage has {true!r}"
                found.add("PTM-D659", MANIFEST, f"stages.{stage}.counts.{name}", told)
        if stage == "scene":
            for image in made.images:
                if record.outputs.get(f"{IMAGES}/{image.sha256}") != image.sha256:
                    found.add("PTM-D721", IMAGE_LIST, image.name, "is not in the database")
    return found.issues()


def _tell(
    code: str, fault: DatabaseError, db: DatabaseFolder, astray: Collection[str], found: Findings
) -> None:
    file = os.path.relpath(fault.file or db.path, db.path).replace(os.sep, "/")
    if file not in astray:
        found.add(code, MANIFEST if file == "." else file, "", fault.message)
