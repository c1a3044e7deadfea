"""The walk by which benchmarks compare cells, and the table of `benchmarks/pvs_trade.py`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.visibility import Pvs

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))
import pvs_trade
from walk import at_hand, load, passed, standard_walk

#: Three rooms of 4, 2 and 6 m in a row, with doors of 1 m by 2 m in the middle of their walls.
ROW = ((0, 4, 6, 12), (0, 3), (0, 3))
DOORS = {(i, 0, 0, 0): [(0.5, 2.5, 1.0, 2.0)] for i in range(2)}


@pytest.fixture
def row(build_rooms: Callable[..., Any]) -> Any:
    return build_rooms(*ROW, DOORS).cells


def test_the_walk_leads_from_the_largest_room_to_the_nearest_ones(row: Any) -> None:
    walk = standard_walk(row)
    assert walk.corner[:, 0].tolist() == [9, 6, 5, 4, 2]
    assert (walk.reached, walk.stops) == (3, 3)
    way = passed(row, walk.corner)
    assert way.leaf.tolist() == [2, 1, 1, 0]
    assert way.metres.tolist() == pytest.approx([3, 1, 1, 2])


def test_the_walk_passes_no_door_of_less_than_a_square_metre(row: Any) -> None:
    walk = standard_walk(replace(row, portal_area=np.array([0.9, 1.0])))
    assert walk.corner[:, 0].tolist() == [9, 6, 5]
    assert (walk.reached, walk.stops) == (2, 3)


def test_a_walk_is_the_same_line_in_other_cells(build_rooms: Callable[..., Any], row: Any) -> None:
    finer = build_rooms((0, 1, 3, 7, 12), (0, 2, 3), (0, 3), {}).cells
    way = passed(finer, standard_walk(row).corner)
    assert [finer.leaf_points(i)[:, 0].min() for i in way.leaf] == [7, 3, 3, 3, 3, 1]
    assert way.metres.tolist() == pytest.approx([2, 1, 1, 1, 1, 1])


def test_what_lies_outside_is_left_out_of_a_walk(row: Any) -> None:
    way = passed(row, np.array([[-5.0, 1.5, 1.5], [5.0, 1.5, 1.5], [5.0, 9.0, 1.5]]))
    assert way.leaf.tolist() == [0, 1, 1]
    assert way.metres.tolist() == pytest.approx([4, 1, 1.5])
    assert len(passed(row, np.array([[0.0, 4.0, 1.0], [9.0, 4.0, 1.0]])).leaf) == 0


def test_bytes_of_a_walk_by_hand(row: Any) -> None:
    sees = np.array([[1, 1, 0], [1, 1, 1], [0, 1, 1]], dtype=bool)
    pvs, size = Pvs.from_matrix(sees), np.array([1_000_000, 2_000_000, 4_000_000])
    way = passed(row, standard_walk(row).corner)
    walked = load(row, pvs, way, size)
    assert (walked.files, walked.megabytes) == (3, 7.0)
    assert walked.at_hand == pytest.approx((3 * 6 + 2 * 7 + 2 * 3) / 7)
    alone = Pvs.from_matrix(np.eye(3, dtype=bool))
    assert load(row, alone, passed(row, np.array([[1.0, 1, 1], [2, 1, 1]])), size).files == 1
    assert at_hand(row, alone, way, np.ones(3)) == pytest.approx(1)


def rows() -> list[Any]:
    zero = {"str": "", "int": 0, "float": 0.0}
    empty = pvs_trade.Row(**{f.name: zero[str(f.type)] for f in fields(pvs_trade.Row)})
    shares = {"full": 0.5, "fast": 0.75, "sampled": 0.25}
    return [
        replace(empty, model=m, wall_area=a, kind=k, method=s, pvs=shares[s], walk_mb=a / 3)
        for m in ("one", "two")
        for a in (2.0, 0.5)
        for k in pvs_trade.KINDS
        for s in pvs_trade.METHODS
    ]


def test_the_table_is_written_read_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "pvs.csv"
    pvs_trade.write_csv(rows(), path)
    again = pvs_trade.read_csv(path)
    assert [r.walk_mb for r in again[:7:6]] == [0.6667, 0.1667]
    assert [replace(r, walk_mb=0.0) for r in again] == [replace(r, walk_mb=0.0) for r in rows()]
    assert pvs_trade.main(["--only-plot", str(path)]) == 0
    cells, methods = capsys.readouterr().out.split("\n\n")
    assert cells.count("\n") == 2 + 2 * 2 * 2 - 1
    assert methods.strip().split("\n")[2].startswith("| one | 2 | 25.0% | 50.0% | 75.0% |")
    assert methods.strip().split("\n")[3].startswith("|  | 0.5 |")
    assert (tmp_path / "pvs.png").read_bytes().startswith(b"\x89PNG")


def test_a_walk_that_leaves_rooms_out_says_so() -> None:
    assert "walk through" not in pvs_trade.tables(rows())
    short = [replace(r, walk_stops=12, walk_reached=9 + 3 * (r.model == "one")) for r in rows()]
    assert pvs_trade.tables(short).endswith("\n\nThe walk through two reaches 9 of 12 rooms.\n")


def test_a_conservative_set_that_misses_a_pair_is_a_failure(tmp_path: Path) -> None:
    for method, status in (("sampled", 0), ("fast", 1)):
        actual = [replace(r, missed_pairs=int(r.method == method)) for r in rows()]
        pvs_trade.write_csv(actual, tmp_path / "pvs.csv")
        assert pvs_trade.main(["--only-plot", str(tmp_path / "pvs.csv")]) == status


def test_every_column_is_explained() -> None:
    words = (pvs_trade.__doc__ or "").split()
    columns = [f.name for f in fields(pvs_trade.Row)][4:]
    assert [c for c in columns if c not in words and f"{c}," not in words] == []
