"""Walks: their class, their document, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools import schemas, walk as module
from ptmtools.errors import InputError, LimitError
from ptmtools.walk import Walk, parse_walk, read_walk, walk_text

ROWS = [[0, 1, 1.6, -2, 1, 0, 0], [0.5, 1, 1.6, -1, 0, 0, 1], [1.75, 3, 1.7, -1, 0, 0.6, 0.8]]


def document(**changes: object) -> bytes:
    whole = {
        "format": "ptmtools walk",
        "schema": 1,
        "fieldOfView": 1.0,
        "aspect": 1.5,
        "samples": ROWS,
    }
    return json.dumps(whole | changes).encode()


def rows_but(row: int, column: int, value: object) -> list[list[object]]:
    changed: list[list[object]] = [list(row) for row in ROWS]
    changed[row][column] = value
    return changed


def recorded(seed: int, count: int = 400) -> Walk:
    """As a visitor's browser would record it: sixty times a second, with jitter."""
    random = np.random.default_rng(seed)
    time = np.append(0.0, np.cumsum(random.uniform(0.01, 0.024, count - 1)))
    eye = np.cumsum(random.normal(size=(count, 3)), axis=0)
    direction = random.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return Walk(time, eye, direction, 1.1, 16 / 9)


@given(st.integers(0, 2**32))
def test_a_recorded_walk_comes_back(seed: int) -> None:
    walk = recorded(seed)
    text = walk_text(walk)
    back = parse_walk(text.encode())
    for name in ("time", "eye", "direction"):
        np.testing.assert_allclose(getattr(back, name), getattr(walk, name), rtol=0, atol=1e-7)
    assert (back.field_of_view, back.aspect) == (walk.field_of_view, walk.aspect)
    assert walk_text(back) == text, "the same bytes again"


def test_the_document_is_as_the_schema_says() -> None:
    schema = json.loads(schemas.schema_text(schemas.WALK))
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$id"] == f"urn:ptmtools:walk:{schema['properties']['schema']['const']}"
    validator = jsonschema.Draft202012Validator(schema)
    validator.validate(json.loads(walk_text(recorded(1))))
    assert not validator.is_valid(json.loads(document(schema=2)))
    assert not validator.is_valid(json.loads(document(samples=[ROWS[0][:6]])))


def test_between_samples() -> None:
    walk = parse_walk(document())
    eye, direction = walk.at(np.array([-1.0, 0.0, 0.25, 1.75, 9.0]))
    half = 0.5**0.5
    np.testing.assert_allclose(eye[[0, 1, 3, 4]], np.array(ROWS)[[0, 0, 2, 2], 1:4])
    np.testing.assert_allclose(eye[2], [1, 1.6, -1.5])
    np.testing.assert_allclose(direction[2], [half, 0, half])
    np.testing.assert_allclose(direction[4], [0, 0.6, 0.8])
    assert walk.duration == 1.75
    assert walk.length == pytest.approx(1 + np.hypot(2, 0.1))


def test_between_opposite_directions() -> None:
    direction = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
    walk = Walk(np.array([0.0, 1.0]), np.zeros((2, 3)), direction, 1.0, 1.0)
    np.testing.assert_array_equal(walk.at(np.array([0.5]))[1], [[1, 0, 0]])


def test_a_direction_that_is_nearly_a_unit_vector_is_put_right() -> None:
    walk = parse_walk(document(samples=rows_but(0, 4, 1.0009)))
    np.testing.assert_allclose(np.linalg.norm(walk.direction, axis=1), 1, atol=1e-15)


@pytest.mark.parametrize(
    ("data", "code", "place"),
    [
        (b"", "PTM-I801", None),
        (b"[]", "PTM-I801", None),
        (b'{"format": "ptmtools hints"}', "PTM-I801", None),
        (b"\xff", "PTM-I801", None),
        (document(schema=2), "PTM-I801", None),
        (document(schema=None), "PTM-I801", None),
        (document(aspect="wide"), "PTM-I801", "aspect"),
        (document(samples=rows_but(1, 2, "x")), "PTM-I801", "samples[1][2]"),
        (document(samples=[ROWS[0][:6]]), "PTM-I801", "samples[0]"),
        (document(samples=[]), "PTM-I801", None),
        (document(samples=ROWS[:1]), "PTM-I801", None),
        (document(samples=rows_but(0, 0, 0.1)), "PTM-I801", "samples[0]"),
        (document(samples=rows_but(2, 0, 0.5)), "PTM-I801", "samples[2]"),
        (document(samples=rows_but(1, 6, 1.002)), "PTM-I801", "samples[1]"),
        (document(samples=rows_but(1, 6, 0)), "PTM-I801", "samples[1]"),
        (document(fieldOfView=0), "PTM-I801", None),
        (document(fieldOfView=3.15), "PTM-I801", None),
        (document(aspect=-1), "PTM-I801", None),
    ],
)
def test_what_is_refused(data: bytes, code: str, place: str | None, tmp_path: Path) -> None:
    file = tmp_path / "walk.json"
    file.write_bytes(data)
    with pytest.raises(InputError) as fault:
        read_walk(file)
    assert (fault.value.code, fault.value.place) == (code, place)
    assert fault.value.file == str(file)


@pytest.mark.parametrize("name", ["gone.json", ".", "a\0b"])
def test_what_cannot_be_read(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="PTM-I122"):
        read_walk(tmp_path / name)


def test_a_file_that_is_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "walk.json"
    file.write_bytes(document())
    monkeypatch.setattr(module, "MAX_BYTES", len(document()))
    assert read_walk(file).duration == 1.75
    monkeypatch.setattr(module, "MAX_BYTES", len(document()) - 1)
    with pytest.raises(LimitError, match="PTM-L204"):
        read_walk(file)


def test_arrays_that_do_not_fit() -> None:
    with pytest.raises(InputError, match="PTM-I801"):
        Walk(np.zeros(2), np.zeros((3, 3)), np.zeros((2, 3)), 1.0, 1.0)
    with pytest.raises(InputError, match=r"samples\[1\].*PTM-I801"):
        Walk(np.array([0, np.nan]), np.zeros((2, 3)), np.eye(3)[:2], 1.0, 1.0)
