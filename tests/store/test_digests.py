"""Digests that are remembered; `tests/e2e/test_updates.py` has what builds make of them."""

from __future__ import annotations

import hashlib
from pathlib import Path

from ptmtools.store.digests import Digests


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
