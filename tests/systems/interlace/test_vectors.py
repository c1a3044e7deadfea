"""Folders written by earlier versions decode to what they held, for ever."""

from __future__ import annotations

import json

import pytest

from ptmtools_systems.interlace import read_manifest, validate_interlaced
from tests.systems.interlace.vectors.write import VECTORS, digests

DIGESTS: dict[str, list[str]] = json.loads((VECTORS / "digests.json").read_text())


def test_every_folder_has_its_digests() -> None:
    assert {index.parent.name for index in VECTORS.glob("*/interlace.json")} == set(DIGESTS)


@pytest.mark.parametrize("name", sorted(DIGESTS))
def test_frozen_folder_decodes(name: str) -> None:
    assert digests(VECTORS / name) == DIGESTS[name]
    assert validate_interlaced(VECTORS / name).issues == ()


def test_between_them_they_have_everything() -> None:
    actual = [read_manifest(VECTORS / name) for name in DIGESTS]
    assert {one.components for one in actual} == {1, 2, 3, 4}
    assert {(one.container, one.kind) for one in actual} == {
        ("png", "uint8"),
        ("png", "uint16"),
        ("webp", "uint8"),
    }
    assert {len(one.parts) for one in actual} >= {1, 5, 7}
