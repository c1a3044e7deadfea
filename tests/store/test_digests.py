"""Digests that are remembered; `tests/e2e/test_updates.py` has what builds make of them."""

from __future__ import annotations

import hashlib
import os
import time
from pathlib import Path

import pytest

from ptmtools.store.digests import KEPT_DAYS, TICK, Digests


def test_a_path_back_out_of_a_linked_folder(tmp_path: Path) -> None:
    """Without the link it would be another file's, or none's."""
    (tmp_path / "real" / "inner").mkdir(parents=True)
    (tmp_path / "link").symlink_to("real/inner")
    (tmp_path / "real" / "file").write_bytes(b"right")
    path = tmp_path / "link" / ".." / "file"
    for there in (False, True):
        if there:
            (tmp_path / "file").write_bytes(b"wrong")
        assert Digests(tmp_path).digest(path) == hashlib.sha256(b"right").hexdigest()


def test_caches_of_databases_that_were_not_built_for_long_are_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "cache/ptmtools/digests"
    folder.mkdir(parents=True)
    for name, days in (("old", KEPT_DAYS + 1), ("young", KEPT_DAYS - 1)):
        (folder / f"{name}.json").write_text("{}")
        os.utime(folder / f"{name}.json", (time.time() - days * 86_400,) * 2)
    (tmp_path / "file").write_bytes(b"")
    time.sleep(2 * TICK / 1e9)  # else its digest is not kept
    digests = Digests(tmp_path / "db")
    digests.digest(tmp_path / "file")
    digests.save()
    names = {file.name for file in folder.iterdir()}
    assert len(names) == 2
    assert "young.json" in names
