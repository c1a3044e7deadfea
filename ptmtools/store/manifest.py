"""The manifest of a database: `manifest.json`, the file that is written last.

::

    {"format": "ptmtools database", "schema": 2,
     "model": "museum.obj",                          the file's name, never its folder
     "stages": {"cells": {
         "recipe": 1,                                the version of the stage's computation
         "parameters": {"wall_area": 1.0, …},        the options that can change the outputs
         "inputs":  {"stages/scene.npz": "9f86…"},   name → SHA-256 of the files read
         "outputs": {"stages/cells.npz": "60b7…"},   path in the database → SHA-256
         "counts":  {"cells": 52, "portals": 61, …}, figures and choices, for reports
         "notes":   ["open above: …"],               one line each
         "warnings": ["open above: …"]               the notes that are warnings
     }, …}}

Stages are sorted by name. It contains no time and no folder of the machine: the same model and
options give the same manifest anywhere. A stage is current if recipe, parameters and inputs would
be the same, and all its outputs exist.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from os import PathLike
from typing import Any

from ptmtools import schemas
from ptmtools.errors import DatabaseError, Rebuild
from ptmtools.files import leads_inside
from ptmtools.store.layout import WRITTEN

FORMAT = "ptmtools database"
SCHEMA = 2

#: Largest depth of nested lists and objects.
_MAX_DEPTH = 16


@dataclass(frozen=True)
class StageRecord:
    """The record of one run of a stage, see the head of the module.

    An input that did not exist has the digest "".
    """

    recipe: int
    parameters: Mapping[str, Any]
    inputs: Mapping[str, str]
    outputs: Mapping[str, str]
    counts: Mapping[str, Any] = field(default_factory=dict)
    notes: Sequence[str] = ()
    warnings: Sequence[str] = field(default_factory=list)


@dataclass(frozen=True)
class Manifest:
    """The contents of `manifest.json`.

    Attributes
    ----------
    model: the file's name.
    stages: by name.
    replaced: the earlier schema of this manifest, or of the one that it replaces; not written.
    """

    model: str
    stages: Mapping[str, StageRecord] = field(default_factory=dict)
    replaced: int | None = field(default=None, compare=False)

    def with_stages(self, records: Mapping[str, StageRecord]) -> Manifest:
        """A copy with these records replaced."""
        return replace(self, stages={**self.stages, **records})

    def outputs(self) -> dict[str, str]:
        """Every file of the database with its SHA-256, except the manifest itself."""
        return {p: h for record in self.stages.values() for p, h in record.outputs.items()}

    def to_bytes(self) -> bytes:
        """The text of `manifest.json`."""
        stages = {name: asdict(self.stages[name]) for name in sorted(self.stages)}
        for record in stages.values():
            for part in ("inputs", "outputs"):
                record[part] = dict(sorted(record[part].items()))
        document = {"format": FORMAT, "schema": SCHEMA, "model": self.model, "stages": stages}
        return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()

    @staticmethod
    def from_bytes(data: bytes, *, file: str | PathLike[str]) -> Manifest:
        """Inverse of `to_bytes`; ``file`` is named in the errors.

        Raises
        ------
        DatabaseError: PTM-D001 if it is no manifest, PTM-D002 if it is damaged,
            PTM-D003 if another version of ptmtools wrote it.
        """
        try:
            document = json.loads(data)
        except (ValueError, RecursionError) as fault:
            raise damaged_manifest(file, f"not JSON ({fault})") from fault
        if _nested(document, _MAX_DEPTH):
            raise damaged_manifest(file, f"nested more than {_MAX_DEPTH} deep")
        if not isinstance(document, dict) or document.get("format") != FORMAT:
            raise DatabaseError(
                "PTM-D001", "not a ptmtools database", file=file, remedy="use a database folder"
            )
        if document.get("schema") != SCHEMA:
            raise DatabaseError(
                "PTM-D003",
                f"schema version {document.get('schema')!r}, this ptmtools reads {SCHEMA}",
                file=file,
                remedy=Rebuild("build it again with {}, or use the ptmtools that wrote it")
                if listed_before(data)
                else "use the ptmtools that wrote it",
            )
        try:
            schemas.check(document, schemas.MANIFEST)
        except schemas.ShapeError as fault:
            raise damaged_manifest(file, str(fault)) from fault
        names = StageRecord.__dataclass_fields__
        return Manifest(
            document["model"],
            {
                stage: StageRecord(**{name: entry[name] for name in names if name in entry})
                for stage, entry in document["stages"].items()
            },
        )


def listed_before(data: bytes) -> Manifest | None:
    """Reads a manifest of an earlier schema, its `replaced`; None if it is no such manifest.

    It tells which files of the folder belong to the database, and how it was built: the records
    have only outputs, without digests, and a recipe and parameters, both unchecked.
    """
    try:
        document = json.loads(data)
        schema, model = document["schema"], document["model"]
        earlier = type(schema) is int and 0 < schema < SCHEMA
        if document["format"] != FORMAT or not earlier or not isinstance(model, str):
            return None
        records = {}
        for name, stage in document["stages"].items():
            outputs = {path: "" for path in stage["outputs"] if _is_output(path)}
            records[name] = StageRecord(stage.get("recipe"), stage.get("parameters"), {}, outputs)
        return Manifest(model, records, schema)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None


def _nested(value: object, deepest: int) -> bool:
    """Whether lists and objects are nested deeper than in any option or count."""
    if not isinstance(value, dict | list):
        return False
    inner = value.values() if isinstance(value, dict) else value
    return deepest == 0 or any(_nested(each, deepest - 1) for each in inner)


def _is_output(path: object) -> bool:
    """Whether a path is one that stages write: in one of their folders, on every system."""
    if not isinstance(path, str):
        return False
    folder, _, name = path.partition("/")
    return folder in WRITTEN and name != "" and leads_inside(path)


def damaged_manifest(file: str | PathLike[str], what: str) -> DatabaseError:
    """The error for a damaged manifest, PTM-D002."""
    return DatabaseError(
        "PTM-D002",
        f"damaged manifest: {what}",
        file=file,
        remedy="restore it, or build the database again with --force",
    )
