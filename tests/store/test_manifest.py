"""The manifest: reads back what it writes, and refuses what it did not."""

from __future__ import annotations

import json
from typing import Any

import pytest

from ptmtools.errors import DatabaseError
from ptmtools.store.manifest import FORMAT, SCHEMA, Manifest, StageRecord

DIGEST = "ab" * 32
RECORD = StageRecord(
    1, {"wall_area": 2.0}, {"b": "", "a": DIGEST}, {"stages/x.npz": DIGEST}, {"cells": 2}, [], []
)


def document() -> dict[str, Any]:
    actual = json.loads(Manifest("m.obj", {"cells": RECORD}).to_bytes())
    assert isinstance(actual, dict)
    return actual


def test_reads_back_what_it_writes() -> None:
    manifest = Manifest("m.obj", {"pvs": RECORD, "cells": RECORD})
    again = Manifest.from_bytes(manifest.to_bytes(), file="manifest.json")
    assert again == manifest
    assert list(again.stages) == ["cells", "pvs"]
    assert again.to_bytes() == Manifest("m.obj", dict(again.stages)).to_bytes()


def test_reads_one_of_an_earlier_release() -> None:
    """Which told no warnings apart."""
    earlier = document()
    del earlier["stages"]["cells"]["warnings"]
    again = Manifest.from_bytes(json.dumps(earlier).encode(), file="manifest.json")
    assert again.stages["cells"].warnings == []


def test_the_order_of_inputs_does_not_show() -> None:
    turned = StageRecord(
        1, RECORD.parameters, {"a": DIGEST, "b": ""}, RECORD.outputs, RECORD.counts, []
    )
    assert (
        Manifest("m.obj", {"cells": turned}).to_bytes()
        == Manifest("m.obj", {"cells": RECORD}).to_bytes()
    )


def broken(change: dict[str, Any]) -> bytes:
    actual = document()
    actual["stages"]["cells"].update(change)
    return json.dumps(actual).encode()


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"", "PTM-D002"),
        (b"\xff\xfe", "PTM-D002"),
        (b"[" * 100_000, "PTM-D002"),
        (b"[]", "PTM-D001"),
        (json.dumps({"format": "other"}).encode(), "PTM-D001"),
        (json.dumps({"format": FORMAT, "schema": SCHEMA + 1}).encode(), "PTM-D003"),
        (json.dumps({"format": FORMAT, "schema": SCHEMA}).encode(), "PTM-D002"),
        (json.dumps({**document(), "stages": {"other": {}}}).encode(), "PTM-D002"),
        (
            json.dumps({**document(), "stages": {"../a": document()["stages"]["cells"]}}).encode(),
            "PTM-D002",
        ),
        (json.dumps({**document(), "stages": {"cells": 5}}).encode(), "PTM-D002"),
        (broken({"recipe": None}), "PTM-D002"),
        (broken({"recipe": True}), "PTM-D002"),
        (broken({"inputs": {"a": 5}}), "PTM-D002"),
        (broken({"notes": [5]}), "PTM-D002"),
        (broken({"warnings": [5]}), "PTM-D002"),
        (broken({"outputs": {"mine.txt": DIGEST}}), "PTM-D002"),
        (broken({"outputs": {"manifest.json": DIGEST}}), "PTM-D002"),
        (broken({"outputs": {"www/../mine.txt": DIGEST}}), "PTM-D002"),
        (broken({"inputs": []}), "PTM-D002"),
        (broken({"outputs": ["zz"]}), "PTM-D002"),
        (broken({"outputs": [["ab" * 32]]}), "PTM-D002"),
        (broken({"notes": None}), "PTM-D002"),
        (broken({"outputs": {"stages/x.npz": "zz"}}), "PTM-D002"),
        (broken({"outputs": {"../x.npz": DIGEST}}), "PTM-D002"),
        (broken({"outputs": {"/etc/x": DIGEST}}), "PTM-D002"),
        (broken({"outputs": {"c:\\x": DIGEST}}), "PTM-D002"),
        # Written again, a line for each element, indented, this would be hundreds of megabytes.
        (broken({"parameters": {"a": json.loads("[" * 300 + "0" + "]" * 300)}}), "PTM-D002"),
        (broken({"counts": {"a": json.loads('{"a":' * 14 + "[[]]" + "}" * 14)}}), "PTM-D002"),
    ],
)
def test_refuses_what_it_did_not_write(data: bytes, code: str) -> None:
    with pytest.raises(DatabaseError, match=code):
        Manifest.from_bytes(data, file="manifest.json")
