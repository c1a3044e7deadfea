"""USD: damaged files, a missing library, and a database of a package."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from ptmtools.errors import InputError, MissingComponentError, PtmError
from ptmtools.scene import ingest
from tests.scene.conftest import Put, noise, png

if find_spec("pxr") is not None:
    from tests.scene.usd import usd_models as made


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.usda", b'#usda 1.0\ndef Xform "W" { nonsense }\n'),
        ("a.usda", b"nothing of the kind"),
        ("a.usdc", b"PXR-USDC" + bytes(200)),
        ("a.usdc", b"nothing of the kind"),
        ("a.usd", b"nothing of the kind"),
        ("a.usdz", b"PK\3\4" + bytes(200)),
        ("a.usdz", b"nothing of the kind"),
    ],
)
def test_files_that_are_none(put: Put, name: str, data: bytes) -> None:
    with pytest.raises(InputError, match=rf"{name}: .*PTM-I254") as caught:
        ingest(put(name, data))
    assert "\n" not in str(caught.value)
    assert "pxrInternal" not in str(caught.value)


@pytest.mark.parametrize("suffix", ["usdc", "usdz"])
def test_damaged_files(put: Put, tmp_path: Path, suffix: str) -> None:
    """Cut short and with other bytes in between: a model, or an error of one line."""
    put("maps/brick.png", png(noise(1)))
    made.two_rooms(tmp_path / "a.usda").Export(str(tmp_path / "a.usdc"))
    made.package(tmp_path / "a.usdc", tmp_path / "a.usdz")
    whole = (tmp_path / f"a.{suffix}").read_bytes()
    random = np.random.default_rng(7)
    outcomes: list[bool] = []
    messages: list[str] = []
    for n in range(16):
        data = bytearray(whole)
        if n % 2:
            data = data[: int(random.integers(1, len(whole)))]
        else:
            for at in random.integers(0, len(whole), 1 + n):
                data[at] = random.integers(0, 256)
        path = put(f"damaged_{n}.{suffix}", bytes(data))
        try:
            outcomes.append(len(ingest(path).triangles) > 0)
        except PtmError as error:
            outcomes.append(False)
            messages.append(str(error))
    assert messages
    assert not any("\n" in message for message in messages)


def test_without_the_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    on = made.stage(tmp_path / "a.usda")
    made.mesh(on)
    on.GetRootLayer().Save()
    monkeypatch.setitem(sys.modules, "pxr", None)
    with pytest.raises(MissingComponentError, match=r"pip install 'ptmtools\[usd\]'.*PTM-M100"):
        ingest(tmp_path / "a.usda")


def test_a_package_becomes_a_database(put: Put, tmp_path: Path) -> None:
    from ptmtools.cli.main import main

    put("maps/brick.png", png(noise(1, 64)))
    made.two_rooms(tmp_path / "a.usda")
    made.package(tmp_path / "a.usda", tmp_path / "rooms.usdz")
    (tmp_path / "maps/brick.png").unlink()
    db = tmp_path / "rooms.db"
    model = str(tmp_path / "rooms.usdz")
    options = ["-j", "1", "--two-sided", "--light", "none"]
    assert main(["-q", "build-scene", model, "-o", str(db), *options]) == 0
    assert [file.name for file in (db / "www/textures").glob("*.ptm")] == ["brick.ptm"]
    assert main(["-q", "validate", str(db)]) == 0
