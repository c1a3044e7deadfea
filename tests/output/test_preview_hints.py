"""`ptm validate` finds planted faults of previews and of their rows."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ptmtools.output import validate_database
from ptmtools.pipeline.build import build_scene

TWO_ROOMS = Path(__file__).parents[2] / "sample_data" / "two_rooms"
Rows = list[dict[str, Any]]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    database = tmp_path_factory.mktemp("previews") / "db"
    build_scene(TWO_ROOMS / "two_rooms.obj", database)
    return database


@pytest.fixture
def database(built: Path, tmp_path: Path) -> Path:
    return shutil.copytree(built, tmp_path / "db")


def messages(database: Path) -> set[str]:
    """The faults but for the hashes, which every change breaks."""
    issues = validate_database(database).issues
    return {f"{i.code} {i.message}" for i in issues if i.code != "PTM-D652"}


def previewed(database: Path) -> Path:
    """The first preview."""
    return min((database / "www/previews").iterdir())


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda rows: rows[0].update(bytes=rows[0]["bytes"] + 1), "does not match its file"),
        (lambda rows: rows[0].update(width=32), "its level is not"),
        (lambda rows: rows[0].update(exact=True), "is exact and differs"),
        (lambda rows: rows.append(rows[0]), "not in ascending order"),
        (lambda rows: rows.insert(0, rows[0] | {"exact": True}), "not in ascending order"),
        (lambda rows: rows[0].update(level=9), "not of one pyramid"),
        (lambda rows: rows[0].update(file="previews/none.webp"), "D671"),
    ],
)
def test_faults_of_rows(database: Path, change: Callable[[Rows], object], expected: str) -> None:
    assert messages(database) == set()
    file = database / "www/hints.json"
    index = json.loads(file.read_text())
    row = next(row for row in index["textures"] if "previews" in row)
    change(row["previews"])
    file.write_text(json.dumps(index))
    assert any(expected in message for message in messages(database))


@pytest.mark.parametrize("damage", [lambda data: data[:40], lambda data: b"GIF89a" + data])
def test_damaged_previews(database: Path, damage: Callable[[bytes], bytes]) -> None:
    file = previewed(database)
    file.write_bytes(damage(file.read_bytes()))
    assert any(message.startswith("PTM-D710") for message in messages(database))
