"""Files written by earlier versions decode to what they held, for ever."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest

from ptmtools.texture import check, decode, decode_levels, read_header, read_ptm
from ptmtools.texture.samples import KINDS
from tests.texture.vectors.page import PAGE, page

VECTORS = Path(__file__).resolve().parent / "vectors"
DIGESTS: dict[str, list[str]] = {
    f"{folder.name}/{name}": digests
    for folder in sorted(VECTORS.glob("v*"))
    for name, digests in json.loads((folder / "digests.json").read_text()).items()
}


def test_every_file_has_its_digests() -> None:
    files = {str(file.relative_to(VECTORS).with_suffix("")) for file in VECTORS.rglob("*.ptm")}
    assert files == set(DIGESTS)


@pytest.mark.parametrize("name", sorted(DIGESTS))
def test_frozen_file_decodes(name: str) -> None:
    data = read_ptm(VECTORS / f"{name}.ptm")
    assert name.startswith(f"v{read_header(data).version}/")
    actual = [hashlib.sha256(level.tobytes()).hexdigest() for level in decode_levels(data)]
    assert actual == DIGESTS[name]
    assert check(data) == []
    for n, digest in enumerate(DIGESTS[name]):
        assert hashlib.sha256(decode(data, n).tobytes()).hexdigest() == digest


def test_between_them_the_files_use_every_coder() -> None:
    first_bytes = set()
    for name in DIGESTS:
        data = read_ptm(VECTORS / f"{name}.ptm")
        header = read_header(data)
        if header.version == 1 and header.profile == "fast":
            first_bytes |= {data[level.offset] for level in header.levels}
    assert first_bytes == {0, 1, 2, 3}


def test_every_profile_with_every_kind_of_sample() -> None:
    actual = set()
    for name in DIGESTS:
        header = read_header(read_ptm(VECTORS / f"{name}.ptm"))
        if header.version == 2:
            actual.add((header.profile, header.kind, header.max_error > 0))
    wanted = {(profile, kind, False) for profile in ("raw", "fast", "small") for kind in KINDS}
    wanted |= {
        (profile, kind, True) for profile in ("fast", "small") for kind in ("uint8", "uint16")
    }
    assert actual >= wanted


def test_the_page_of_vectors_is_what_the_decoders_do() -> None:
    """`PYTHONPATH=. python tests/texture/vectors/page.py` writes it."""
    assert PAGE.read_text("utf-8") == page()
