"""The table of profiles: a new one is a declaration and a module, and all else works with it.

This module is the plug-in that has the profile `toy`, which stores texels with all bits flipped.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ptmtools import plugins
from ptmtools.cli.main import main
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.texture import EncodeOptions, check, decode, encode, load_image, write_image
from ptmtools.texture.coder import Tile
from ptmtools.texture.coders.group import GroupReader
from ptmtools.texture.profiles import PROFILES, Profile

TOY = Profile("toy", 200, "for tests", module=__name__)
#: What the entry points of the tests name.
PLUGINS = SimpleNamespace()
TEXELS = np.random.default_rng(3).integers(0, 256, (40, 70, 3), np.uint8)
DOCS = Path(__file__).parents[2] / "docs"


def encode_base(level: NDArray[Any]) -> bytes:
    return bytes(byte ^ 255 for byte in level.tobytes())


def decode_base(data: bytes, shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
    reader = GroupReader(data)
    flipped = reader.numbers("u1", int(np.prod(shape)) * dtype.itemsize)
    reader.end()
    return (flipped ^ 255).view(dtype).reshape(shape)


def encode_tile(level: NDArray[Any], below: NDArray[Any], *rest: Any) -> Tile:
    return Tile(encode_base(level), level)


def decode_tile(data: bytes, below: NDArray[Any], shape: tuple[int, ...], *rest: Any) -> Tile:
    return Tile(b"", decode_base(data, shape, below.dtype))


Install = Callable[..., None]


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Replaces the installed profiles by others, each under its own name or another."""

    groups = [f"ptmtools.{kind}" for kind in plugins.KINDS if kind != "profiles"]
    installed = plugins.installed_points()
    others = [point for group in groups for point in installed.select(group=group)]

    def forget() -> None:
        plugins.points.cache_clear()
        plugins.declarations.cache_clear()

    def declare(**profiles: Profile) -> None:
        names = [
            EntryPoint(name, f"{__name__}:PLUGINS.{name}", "ptmtools.profiles") for name in profiles
        ]
        for name, profile in profiles.items():
            monkeypatch.setattr(PLUGINS, name, profile, raising=False)
        points = EntryPoints([*others, *names])
        monkeypatch.setattr(plugins, "installed_points", lambda: points)
        forget()

    yield declare
    monkeypatch.undo()
    forget()


@pytest.fixture
def toy(install: Install) -> None:
    install(toy=TOY)


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


def test_without_its_package_a_profile_is_unknown(toy: None, install: Install) -> None:
    data = encode(TEXELS, EncodeOptions("toy"))
    install()
    with pytest.raises(
        InputError, match=r"profile 200 .*install the package that has this profile, .*PTM-I104"
    ):
        decode(data)
    with pytest.raises(InputError, match=r"no profile 'toy'; use one of fast, .*PTM-I111"):
        encode(TEXELS, EncodeOptions("toy"))
    assert main(["encode", "a.png", "--profile", "toy"]) == 2


@pytest.mark.parametrize(
    ("profiles", "fault"),
    [
        ({"toy": replace(TOY, number=1)}, "the number 1 of the profile 'fast'"),
        ({"game": replace(TOY, name="game"), "toy": TOY}, "the number 200 of the profile 'game'"),
        ({"raw": replace(TOY, name="raw")}, "the name of a profile of ptmtools"),
        ({"toy": replace(TOY, name="game")}, "declares the profile 'game'"),
        ({"toy": replace(TOY, number=256)}, "the number 256; 0 to 255 are possible"),
        ({"toy": "no profile"}, "is not of the class Profile"),
    ],
)
def test_a_plugin_that_clashes_is_an_error(
    install: Install,
    profiles: dict[str, Profile],
    fault: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    install(**profiles)
    with pytest.raises(MissingComponentError, match=rf"{fault}.*uninstall.*PTM-M110"):
        list(PROFILES)
    with pytest.raises(MissingComponentError, match="PTM-M110"):
        encode(TEXELS, EncodeOptions("other"))
    # What ptmtools has works on.
    assert PROFILES["fast"].number == 1
    np.testing.assert_array_equal(decode(encode(TEXELS)), TEXELS)


def test_a_coder_that_cannot_be_imported_is_an_error(install: Install) -> None:
    install(toy=replace(TOY, module="absent_package"))
    with pytest.raises(MissingComponentError, match=r"coder of the .* 'toy' .*PTM-M110"):
        encode(TEXELS, EncodeOptions("toy"))


def test_entry_points_are_read_when_needed(
    install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not to encode and decode with a profile of ptmtools, and not by an import."""
    install()
    monkeypatch.setattr(plugins, "installed_points", None)
    np.testing.assert_array_equal(decode(encode(TEXELS, EncodeOptions("raw"))), TEXELS)
    with pytest.raises(TypeError):
        PROFILES["toy"]
    program = (
        "from ptmtools import plugins\n"
        "plugins.installed_points = None\n"
        "import ptmtools, ptmtools.texture\n"
        "assert ptmtools.texture.EncodeOptions().profile == 'fast'\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_the_table_is_what_the_pages_say(capsys: pytest.CaptureFixture[str], toy: None) -> None:
    documented = PROFILES.built_in
    numbers = re.search(r"\| profile: (.*?) \|", (DOCS / "formats/ptm.md").read_text("utf-8"))
    assert numbers
    assert dict(re.findall(r"(\d+) `(\w+)`", numbers[1])) == {
        str(profile.number): name for name, profile in documented.items()
    }
    rows = re.findall(
        r"^\| `(\w+)` \| ", (DOCS / "design/codec.md").read_text("utf-8"), re.MULTILINE
    )
    assert rows[: len(documented)] == list(documented)
    assert list(PROFILES) == [*documented, "toy"]
    assert len(PROFILES) == len({profile.number for profile in PROFILES.values()})
    main(["encode", "--help"])
    text = " ".join(capsys.readouterr().out.split())
    for name, profile in documented.items():
        assert f"{name} ({profile.about})" in text
