"""The whole toolchain as a target: a damaged model becomes a database, which is then checked.

An input is built from scene to served files, validated, and its visible sets are compared with
random segments. Refusals with a documented code count as such. A finding is, besides those of every
target, an error in the database, two cells that see each other outside the visible sets, and a
build that gives other bytes than a build of the same input in another process.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import Any
from unittest import mock

import numpy as np

from benchmarks.fuzz.bases import BASES, ROOT
from benchmarks.fuzz.distortion import distorted
from benchmarks.fuzz.mutation import Case
from benchmarks.fuzz.soup import write_materials
from ptmtools.cells import Cells, SubdivideOptions
from ptmtools.coverage.options import AchOptions
from ptmtools.errors import InputError
from ptmtools.light.options import LightOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.encoding import TextureOptions
from ptmtools.pipeline.validation import shoot_segments, validate
from ptmtools.scene import IngestOptions
from ptmtools.visibility import PvsOptions

#: Random segments per input.
SEGMENTS = 1000
#: Options of the subdivision: most inputs have the defaults, with few leaves, to build many models.
FEW = {"max_leaves": 120}
CELLS: tuple[dict[str, Any], ...] = (
    *((FEW,) * 8),
    {},
    FEW | {"cells": "leaf"},
    FEW | {"gain": 0.0},
    FEW | {"standing": "anywhere"},
    FEW | {"doors": "open"},
    FEW | {"doors": "closed"},
    FEW | {"doors": "hidden"},
    FEW | {"wall_area": 0.05},
    FEW | {"wall_thickness": 0.0},
    {"max_leaves": 20},
    FEW | {"reach": "main"},
    FEW | {"detail_by_shape": False},
)
#: What a user says of the file, or nothing.
FILES: tuple[dict[str, Any], ...] = (
    *(({"up": "y", "unit": "m"},) * 6),
    {"up": "z", "unit": "m"},
    {"up": "y", "unit": "m", "two_sided": True},
    {},
)
#: Words at the beginning of findings.
BLIND, INVALID, OTHER = "false negative", "invalid database", "different bytes"
#: Between the parts of an outcome.
TAB = "\t"


class UnsoundError(Exception):
    """A result is wrong."""


@dataclass(frozen=True)
class Facts:
    """How an input is built."""

    base: str
    distortions: tuple[str, ...]
    cells: dict[str, Any]
    file: dict[str, Any]
    trim: bool


class Building:
    """Models of one base, as `Target`; its outcomes are those of `Outcome`.

    ``fault``: one of `FAULTS`, planted into the toolchain. ``light``: whether light is baked.
    """

    limit = 1 << 29
    warm_ups = 1
    #: Kernels that were compiled earlier are read from their cache.
    allowed = ("pickle.find_class",)

    def __init__(
        self, folder: Path, outside: Path, *, base: str, fault: str = "", light: bool = True
    ) -> None:
        self._folder = folder
        self._light = LightOptions("auto" if light else "none")
        self._base = base
        self._fault = FAULTS[fault] if fault else None
        write_materials(folder)

    def make(self, rng: Random) -> Case:
        """A distorted model, as an OBJ file."""
        numbers = np.random.default_rng(rng.getrandbits(64))
        soup, distortions = distorted(BASES[self._base](numbers), numbers)
        cells, file = CELLS[numbers.integers(len(CELLS))], FILES[numbers.integers(len(FILES))]
        trim = bool(numbers.random() < 0.5)
        return Case(soup.obj(), Facts(self._base, distortions, cells, file, trim))

    def read(self, case: Case) -> str:
        """Builds and checks it."""
        facts: Facts = case.facts
        model, database = self._folder / "model.obj", self._folder / "database"
        model.write_bytes(case.data)
        shutil.rmtree(database, ignore_errors=True)
        with ExitStack() as planted:
            if self._fault:
                self._fault(planted, database)
            try:
                build_scene(model, database, *options(facts), self._light, workers=1)
            except InputError as error:
                if error.code not in documented_codes() or error.code == "PTM-L099":
                    raise
                return str(Outcome(facts.distortions, error.code, name_of(case), ""))
            check(database)
            return str(Outcome(facts.distortions, "", name_of(case), contents(database)))


def options(facts: Facts) -> tuple[Any, ...]:
    """The options of the stages."""
    return (
        IngestOptions(**facts.file),
        SubdivideOptions(**facts.cells),
        PvsOptions(),
        AchOptions(samples=8, backend="embree"),
        TextureOptions(trim=facts.trim),
    )


def check(database: Path) -> None:
    """Raises `UnsoundError` if a database has an error, or cells see each other unawares."""
    report = validate(database, workers=1)
    errors = [str(issue) for issue in report.issues if issue.severity == "error"]
    if errors:
        raise UnsoundError(f"{INVALID}: {errors[0]}")
    shot = shoot_segments(database, SEGMENTS)
    if shot.missed:
        pair = shot.missed[0]
        raise UnsoundError(f"{BLIND}: cells {pair.cells}, {pair.start} to {pair.end}")


@dataclass(frozen=True)
class Outcome:
    """The outcome of an input that is no finding.

    Attributes
    ----------
    code: of the refusal, or "" if it was built.
    input, database: digests; that of the database is "" if the model was refused.
    """

    distortions: tuple[str, ...]
    code: str
    input: str
    database: str

    def __str__(self) -> str:
        return TAB.join((" ".join(self.distortions), self.code, self.input, self.database))

    @staticmethod
    def read(text: str) -> Outcome:
        """Inverse of `str`."""
        distortions, code, name, database = text.split(TAB)
        return Outcome(tuple(distortions.split(" ")), code, name, database)


def documented_codes() -> frozenset[str]:
    """All codes that the docs explain."""
    global _codes
    if not _codes:
        text = (ROOT / "docs/formats/codes.md").read_text()
        _codes = frozenset(re.findall(r"^\| (PTM-\w+) \|", text, re.M))
    return _codes


_codes: frozenset[str] = frozenset()


def name_of(case: Case) -> str:
    """A short name of a model and its options."""
    return digest(case.data + repr(case.facts).encode())


def digest(data: bytes) -> str:
    """A short name of some bytes."""
    return hashlib.sha256(data).hexdigest()[:12]


def contents(folder: Path) -> str:
    """A short name of all files in a folder."""
    digests = [
        f"{path.relative_to(folder)} {digest(path.read_bytes())}"
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    ]
    return digest("\n".join(digests).encode())


Fault = Callable[[ExitStack, Path], None]


def _without_portals(planted: ExitStack, database: Path) -> None:
    """Visible sets of cells whose largest portal is missing."""
    from ptmtools.visibility import pvs

    compute = pvs.compute_pvs

    def blind(cells: Cells, *arguments: Any, **named: Any) -> Any:
        start = cells.portal_start
        last = cells.portal_count - 1
        fewer = replace(
            cells,
            portal_leaf=cells.portal_leaf[:last],
            portal_plane=cells.portal_plane[:last],
            portal_point=cells.portal_point[: start[last]] if last >= 0 else cells.portal_point,
            portal_start=start[: last + 1] if last >= 0 else start,
            portal_area=cells.portal_area[:last],
        )
        return compute(fewer, *arguments, **named)

    planted.enter_context(mock.patch("ptmtools.visibility.pvs.compute_pvs", blind))


def _raising(planted: ExitStack, database: Path) -> None:
    """An exception of a library."""

    def raises(*arguments: Any, **named: Any) -> Any:
        raise RuntimeError("planted")

    planted.enter_context(mock.patch("ptmtools.cells.subdivision.cut_to_leaves", raises))


def _damaging(planted: ExitStack, database: Path) -> None:
    """A database with a damaged file."""

    def damage() -> None:
        file = database / "www/root.wrl"
        if file.exists():
            file.write_bytes(file.read_bytes()[:-9])

    original = build_scene

    def damaged(*arguments: Any, **named: Any) -> Any:
        report = original(*arguments, **named)
        damage()
        return report

    planted.enter_context(mock.patch("benchmarks.fuzz.building.build_scene", damaged))


def _changing(planted: ExitStack, database: Path) -> None:
    """Another database for every process."""

    def contents_here(folder: Path) -> str:
        return digest(str(os.getpid()).encode())

    planted.enter_context(mock.patch("benchmarks.fuzz.building.contents", contents_here))


#: Planted faults by name; the words of the finding are those of `EXPECTED`.
FAULTS: dict[str, Fault] = {
    "portal removed": _without_portals,
    "exception": _raising,
    "damaged file": _damaging,
    "other bytes": _changing,
}
EXPECTED = {
    "portal removed": BLIND,
    "exception": "RuntimeError: planted",
    "damaged file": INVALID,
    "other bytes": OTHER,
}
