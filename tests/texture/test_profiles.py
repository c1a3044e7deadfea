"""The table of profiles: a new one is a declaration and a module, and all else works with it.

This module is that of the profile `toy`, which stores texels with all bits flipped.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ptmtools.cli.main import main
from ptmtools.errors import InputError
from ptmtools.texture import EncodeOptions, check, decode, encode, load_image, write_image
from ptmtools.texture.coder import Tile
from ptmtools.texture.coders.group import Reader
from ptmtools.texture.profiles import PROFILES, Profile

TOY = Profile("toy", 200, "for tests", module=__name__)
TEXELS = np.random.default_rng(3).integers(0, 256, (40, 70, 3), np.uint8)
DOCS = Path(__file__).parents[2] / "docs"


def encode_base(level: NDArray[Any]) -> bytes:
    return bytes(byte ^ 255 for byte in level.tobytes())


def decode_base(data: bytes, shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
    reader = Reader(data)
    flipped = reader.numbers("u1", int(np.prod(shape)) * dtype.itemsize)
    reader.end()
    return (flipped ^ 255).view(dtype).reshape(shape)


def encode_tile(level: NDArray[Any], below: NDArray[Any], *rest: Any) -> Tile:
    return Tile(encode_base(level), level)


def decode_tile(data: bytes, below: NDArray[Any], shape: tuple[int, ...], *rest: Any) -> Tile:
    return Tile(b"", decode_base(data, shape, below.dtype))


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PROFILES, TOY.name, TOY)


@pytest.mark.usefixtures("toy")
def test_a_toy_profile_works_everywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_image("a.png", TEXELS)
    assert main(["-q", "encode", "a.png", "--profile", "toy", "--tile", "16"]) == 0
    assert main(["info", "a.ptm", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["profile"] == "toy"
    assert main(["-q", "validate", "a.ptm"]) == 0
    assert main(["-q", "decode", "a.ptm", "--force"]) == 0
    np.testing.assert_array_equal(load_image("a.png").array(), TEXELS)
    assert main(["compare", "a.png", "--profiles", "toy"]) == 0
    assert "ptm toy" in capsys.readouterr().out
    data = bytearray(encode(TEXELS, EncodeOptions("toy")))
    np.testing.assert_array_equal(decode(bytes(data), 2), decode(encode(TEXELS), 2))
    data[-1] ^= 1
    assert "PTM-I108" in check(bytes(data))[0]
    with pytest.raises(
        InputError, match="'toy' is always exact; for an allowed error use fast or small"
    ):
        encode(TEXELS, EncodeOptions("toy", max_error=1))


def test_without_its_line_a_profile_is_unknown(toy: None, monkeypatch: pytest.MonkeyPatch) -> None:
    data = encode(TEXELS, EncodeOptions("toy"))
    monkeypatch.delitem(PROFILES, "toy")
    with pytest.raises(InputError, match=r"profile 200 .*PTM-I104"):
        decode(data)
    with pytest.raises(InputError, match=r"no profile 'toy'; use one of fast, .*PTM-I111"):
        encode(TEXELS, EncodeOptions("toy"))
    assert main(["encode", "a.png", "--profile", "toy"]) == 2


def test_the_table_is_what_the_pages_say(capsys: pytest.CaptureFixture[str]) -> None:
    assert len({profile.number for profile in PROFILES.values()}) == len(PROFILES)
    numbers = re.search(r"\| profile: (.*?) \|", (DOCS / "formats/ptm.md").read_text("utf-8"))
    assert numbers
    assert dict(re.findall(r"(\d+) `(\w+)`", numbers[1])) == {
        str(profile.number): name for name, profile in PROFILES.items()
    }
    rows = re.findall(
        r"^\| `(\w+)` \| ", (DOCS / "design/codec.md").read_text("utf-8"), re.MULTILINE
    )
    assert rows[: len(PROFILES)] == list(PROFILES)
    assert main(["encode", "--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for name, profile in PROFILES.items():
        assert f"{name} ({profile.about})" in text
