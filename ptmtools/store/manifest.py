"""The manifest of a database: `manifest.json`, the file that is written last.

::

    {"format": "ptmtools database", "schema": 3,
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
be the same, and all its outputs exist. Instead of more than a thousand inputs or outputs there are
the SHA-256 of lists of them (`lists`).
"""

from __future__ import annotations

import json
from collections import ChainMap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import Any, cast

from ptmtools import schemas
from ptmtools.errors import DatabaseError
from ptmtools.files import leads_inside
from ptmtools.store.layout import WRITTEN
from ptmtools.store.lists import FileList, ReadList, in_lists, list_file, stored_form

FORMAT = "ptmtools database"
SCHEMA = 3

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

    def list_files(self) -> dict[str, str]:
        """The files of its lists, with their SHA-256."""
        lists = [
            files.lists for files in (self.inputs, self.outputs) if isinstance(files, FileList)
        ]
        return {list_file(digest): digest for part in lists for digest in part}

    def with_lists(self, read: ReadList, write: Callable[[str, bytes], None]) -> StageRecord:
        """A copy with lists instead of many inputs or outputs, see `in_lists`."""
        inputs, outputs = (in_lists(files, read, write) for files in (self.inputs, self.outputs))
        return replace(self, inputs=inputs, outputs=outputs)

    def entry(self) -> dict[str, Any]:
        """Its entry in the manifest."""
        files = {"inputs": stored_form(self.inputs), "outputs": stored_form(self.outputs)}
        return {name: files.get(name, getattr(self, name)) for name in _FIELDS}


_FIELDS = tuple(StageRecord.__dataclass_fields__)


def _no_list(digest: str) -> Mapping[str, str]:
    """Where no lists are known."""
    raise DatabaseError("PTM-D005", "cannot be read (no such file)", file=list_file(digest))


@dataclass(frozen=True)
class Manifest:
    """The contents of `manifest.json`.

    Attributes
    ----------
    model: the file's name.
    stages: by name.
    lost: stages without a record because a list of their files is missing or damaged, with that
        list; not written.
    """

    model: str
    stages: Mapping[str, StageRecord] = field(default_factory=dict)
    lost: Mapping[str, str] = field(default_factory=dict, compare=False)

    def with_stages(self, records: Mapping[str, StageRecord]) -> Manifest:
        """A copy with these records replaced."""
        return replace(self, stages={**self.stages, **records})

    def outputs(self) -> Mapping[str, str]:
        """The outputs of all stages with their SHA-256; looks a name up in lists last."""
        outputs = [record.outputs for record in self.stages.values()]
        outputs.sort(key=lambda files: isinstance(files, FileList))
        return ChainMap(*cast(list[dict[str, str]], outputs))

    def lists(self) -> dict[str, str]:
        """The files of all lists with their SHA-256."""
        return {n: d for record in self.stages.values() for n, d in record.list_files().items()}

    def files(self) -> dict[str, str]:
        """Every file of the database with its SHA-256, except the manifest itself."""
        return {**self.outputs(), **self.lists()}

    def outputs_beyond(self, former: Manifest | None, *, readable: bool = False) -> dict[str, str]:
        """The outputs that are not in a list of the former manifest: all that it lacks or has with
        other digests, and more. With ``readable``, those of the lists that can be read."""
        outputs: dict[str, str] = {}
        for stage, record in self.stages.items():
            files, before = record.outputs, former.stages.get(stage) if former else None
            known = before.outputs if before else None
            if isinstance(files, FileList):
                shared = set(known.lists) if isinstance(known, FileList) else ()
                files = files.files_except(shared, readable=readable)
            outputs |= files
        return outputs

    def without_stages(self, lost: Mapping[str, str]) -> Manifest:
        """A copy without these stages, see `lost`."""
        stages = {name: record for name, record in self.stages.items() if name not in lost}
        return replace(self, stages=stages, lost=lost)

    def to_bytes(self) -> bytes:
        """The text of `manifest.json`."""
        stages = {name: self.stages[name].entry() for name in sorted(self.stages)}
        document = {"format": FORMAT, "schema": SCHEMA, "model": self.model, "stages": stages}
        return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()

    @staticmethod
    def from_bytes(
        data: bytes, *, file: str | PathLike[str], lists: ReadList = _no_list
    ) -> Manifest:
        """Inverse of `to_bytes`; ``file`` is named in the errors, ``lists`` reads the lists when
        they are used.

        Raises
        ------
        DatabaseError: PTM-D001 if it is no manifest, PTM-D002 if it is damaged,
            PTM-D003 if another version of ptmtools wrote it.
        """
        try:
            document = json.loads(data)
        except (ValueError, RecursionError) as fault:
            raise damaged_manifest(file, f"not JSON ({fault})") from fault
        if _is_nested(document, _MAX_DEPTH):
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
                remedy="use the ptmtools that wrote it, or build the database anew with --force",
            )
        try:
            schemas.check(document, schemas.MANIFEST)
        except schemas.ShapeError as fault:
            raise damaged_manifest(file, str(fault)) from fault

        def outputs(digest: str) -> Mapping[str, str]:
            files = lists(digest)
            if not all_outputs(files):
                raise damaged_manifest(file, f"{list_file(digest)} is no list of outputs")
            return files

        def record(entry: dict[str, Any]) -> StageRecord:
            for name, read in (("inputs", lists), ("outputs", outputs)):
                if isinstance(entry[name], list):
                    entry = entry | {name: FileList(entry[name], read)}
            return StageRecord(**{name: entry[name] for name in _FIELDS if name in entry})

        stages = {stage: record(entry) for stage, entry in document["stages"].items()}
        return Manifest(document["model"], stages)


def all_outputs(files: Mapping[str, str]) -> bool:
    """Whether all files are ones that stages write."""
    return all(digest and _is_output(name) for name, digest in files.items())


def _is_nested(value: object, deepest: int) -> bool:
    """Whether lists and objects are nested deeper than in any option or count."""
    if not isinstance(value, dict | list):
        return False
    inner = value.values() if isinstance(value, dict) else value
    return deepest == 0 or any(_is_nested(part, deepest - 1) for part in inner)


def _is_output(path: object) -> bool:
    """Whether a path is one that stages write: in one of their folders, on every system."""
    if not isinstance(path, str):
        return False
    folder, _, name = path.partition("/")
    return folder in WRITTEN and name != "" and leads_inside(path)


def damaged_manifest(
    file: str | PathLike[str], what: str, repair: str = "--force"
) -> DatabaseError:
    """The error for a damaged manifest, PTM-D002; ``repair``: the options of a build that repairs
    it."""
    return DatabaseError(
        "PTM-D002",
        f"damaged manifest: {what}",
        file=file,
        remedy=f"restore it, or build the database again with {repair}",
    )
