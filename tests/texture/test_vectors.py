"""Files written by earlier versions decode to what they held, for ever."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from ptmtools.texture import check, decode, decode_levels, read_header, read_ptm

VECTORS = Path(__file__).resolve().parent / "vectors"
DIGESTS: dict[str, list[str]] = json.loads((VECTORS / "digests.json").read_text())


def test_every_file_has_its_digests() -> None:
    assert {file.stem for file in VECTORS.glob("*.ptm")} == set(DIGESTS)


@pytest.mark.parametrize("name", sorted(DIGESTS))
def test_frozen_file_decodes(name: str) -> None:
    data = read_ptm(VECTORS / f"{name}.ptm")
    found = [hashlib.sha256(level.tobytes()).hexdigest() for level in decode_levels(data)]
    assert found == DIGESTS[name]
    assert check(data) == []
    for n, digest in enumerate(DIGESTS[name]):
        assert hashlib.sha256(decode(data, n).tobytes()).hexdigest() == digest


def test_between_them_the_files_use_every_coder() -> None:
    first_bytes = set()
    for name in DIGESTS:
        data = read_ptm(VECTORS / f"{name}.ptm")
        header = read_header(data)
        if header.profile == "fast":
            first_bytes |= {data[level.offset] for level in header.levels}
    assert first_bytes == {0, 1, 2, 3}
