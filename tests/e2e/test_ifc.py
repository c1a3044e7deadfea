"""From an IFC file to a database, as a user goes."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from ptmtools.cells import Cells
from ptmtools.store.archive import unpack_arrays
from tests.e2e.conftest import Ptm
from tests.scene.ifc.ifc_house import STOREY, THICK, WIDE, Ifc, house

#: In world metres: Y up, the middle of the building's floor at the origin, the lowest floor 0.2 m
#: above.
EYE = THICK + 1.6
DARK = ("--light", "none")
WEST, EAST = -(WIDE + THICK) / 2, (WIDE + THICK) / 2


@pytest.fixture
def ifc(require: Callable[[str, str], None], tmp_path: Path) -> Path:
    if find_spec("ifcopenshell") is None:
        require("ifcopenshell", "pip install 'ptmtools[ifc]'")
    return house(Ifc()).write(tmp_path / "house.ifc")


def read_cells(db: Path) -> Cells:
    file = db / "stages" / "cells.npz"
    return Cells.from_arrays(unpack_arrays(file.read_bytes(), file=file))


def sees(db: Path, one: int, other: int) -> bool:
    file = db / "stages" / "pvs.npz"
    pvs = unpack_arrays(file.read_bytes(), file=file)
    return bool(np.isin(other, pvs["cell"][pvs["start"][one] : pvs["start"][one + 1]]))


def test_a_house(ptm: Ptm, ifc: Path, tmp_path: Path) -> None:
    """Two rooms on each storey, named by their spaces, and a door between them that hides."""
    db = tmp_path / "house.db"
    done = ptm("build-scene", ifc, "-o", db, "--json")
    assert (done.status, done.err) == (0, "")
    cells = read_cells(db)
    for up in (0.0, STOREY):
        rooms = cells.locate(np.array([[WEST, EYE + up, 0], [EAST, EYE + up, 0]])).tolist()
        assert min(rooms) >= 0
        assert len(set(rooms)) == 2
        ends = np.sort(cells.portal_cell, axis=1)
        (portal,) = np.flatnonzero((ends == sorted(rooms)).all(axis=1))
        points = cells.portal(int(portal))
        assert np.allclose(np.ptp(points, axis=0), [0, 2.1, 0.9], atol=1e-6)
        assert abs(points[:, 0]).max() <= THICK / 2 + 1e-6
        assert cells.portal_passage[portal]
        assert not sees(db, *rooms)
    below, above = cells.locate(np.array([[WEST, EYE, 0], [WEST, EYE + STOREY, 0]])).tolist()
    assert not sees(db, below, above)
    hints = json.loads((db / "www" / "hints.json").read_text("utf-8"))
    assert sorted(view["description"] for view in hints["viewpoints"]) == [
        "Ground floor, East",
        "Ground floor, West",
        "Upper floor, East",
        "Upper floor, West",
    ]
    assert ptm("validate", db).status == 0


def test_open_doors(ptm: Ptm, ifc: Path, tmp_path: Path) -> None:
    db = tmp_path / "house.db"
    assert ptm("build-scene", ifc, "-o", db, "--doors", "open", *DARK).status == 0
    rooms = read_cells(db).locate(np.array([[WEST, EYE, 0], [EAST, EYE, 0]])).tolist()
    assert sees(db, *rooms)


def test_closed_doors(ptm: Ptm, ifc: Path, tmp_path: Path) -> None:
    db = tmp_path / "house.db"
    assert ptm("build-scene", ifc, "-o", db, "--doors", "closed", *DARK).status == 0
    rooms = read_cells(db).locate(np.array([[WEST, EYE, 0], [EAST, EYE, 0]])).tolist()
    assert min(rooms) >= 0
    assert not sees(db, *rooms)


def test_patterns(ptm: Ptm, ifc: Path, tmp_path: Path) -> None:
    """Classes and the file's own names; a pattern that fits nothing is a mistake."""
    for pattern in ("IfcDoor*", "IfcWall Inner", "*D1", "Brick"):
        done = ptm("cells", ifc, "-o", tmp_path / "house.db", "--structural", pattern)
        assert done.status == 0, done.err
    done = ptm("cells", ifc, "-o", tmp_path / "house.db", "--structural", "Inner")
    assert (done.status, "PTM-I302" in done.err) == (3, True)


def test_the_same_bytes(ptm: Ptm, ifc: Path, tmp_path: Path) -> None:
    for db in ("a.db", "b.db"):
        assert ptm("cells", ifc, "-o", tmp_path / db, "--json").status == 0
    for stage in ("scene.npz", "cells.npz"):
        a, b = ((tmp_path / db / "stages" / stage).read_bytes() for db in ("a.db", "b.db"))
        assert a == b


def test_a_fault_is_one_line(ptm: Ptm, ifc: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.ifc"
    cut.write_bytes(ifc.read_bytes()[:5000])
    done = ptm("cells", cut, "-o", tmp_path / "cut.db")
    assert done.status == 3
    assert done.err.count("\n") == 1
    assert "PTM-I266" in done.err
