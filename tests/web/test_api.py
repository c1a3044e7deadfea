"""The API of a page: levels from ranges, workers, aborting; types and bytes are right."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchmarks.npm import TYPESCRIPT
from ptmtools.texture import EncodeOptions, decode_levels, encode, read_header
from tests.texture.coding import textured
from tests.web import checked_types
from tests.web.node import HERE, PACKAGE, missing, run

BUILD = PACKAGE / "build.py"
#: Of all that a page downloads, gzipped, bytes.
LARGEST_MODULE = 29_000


@pytest.fixture(scope="module", autouse=True)
def _node(require: Callable[[str, str], None]) -> None:
    if remedy := missing():
        require("node", remedy)


@pytest.fixture(scope="module")
def file() -> bytes:
    return encode(textured(190, 211, 3), EncodeOptions(tile=64))


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory, file: bytes) -> dict[str, Any]:
    path = tmp_path_factory.mktemp("api") / "image.ptm"
    path.write_bytes(file)
    actual: dict[str, Any] = json.loads(run(HERE / "api.mjs", path))
    return actual


@pytest.fixture(scope="module")
def levels(file: bytes) -> list[str]:
    return [hashlib.sha256(level.tobytes()).hexdigest() for level in decode_levels(file)]


def test_without_a_decoder(told: dict[str, Any]) -> None:
    """A damaged module, and a browser without SIMD, are refused."""
    assert told["refusals"] == ["CompileError", "PTM-M103"]


def test_levels_from_ranges(told: dict[str, Any], file: bytes, levels: list[str]) -> None:
    header = read_header(file)
    assert told["rangesOf"] == [[level.offset, level.length] for level in header.levels]
    assert told["levels"] == levels
    assert told["one"] == levels[3]
    assert told["noLevel"] == "PTM-I111"


def test_no_byte_is_asked_for_twice(told: dict[str, Any], file: bytes) -> None:
    at = 0
    for offset, length in told["asked"]:
        assert offset == at
        at += length
    assert at == len(file)


def test_a_cut_file_ends_with_its_last_whole_level(told: dict[str, Any], levels: list[str]) -> None:
    assert told["cut"] == levels[:5]
    assert told["cutLevel"] == "PTM-I103"


def test_workers_give_the_same(told: dict[str, Any], levels: list[str]) -> None:
    assert told["workers"] == [levels, levels[:5]]
    assert told["halved"] == [levels, levels]


def test_bytes_can_be_given_again(told: dict[str, Any], levels: list[str]) -> None:
    assert told["damaged"] == "PTM-I108"
    assert told["first"] == levels[0]
    assert told["kept"] > 0
    assert told["several"] == levels[:4]
    assert told["refused"] == ["PTM-I108", 2, "PTM-I105", 0]


def test_what_is_aborted_is_not_lost(told: dict[str, Any], levels: list[str]) -> None:
    assert told["aborted"] == told["before"] == told["openAborted"] == "AbortError"
    assert told["again"] == levels[1]
    assert told["closing"] == "Error"


def test_the_source_gives_the_module(require: Callable[[str, str], None], tmp_path: Path) -> None:
    """Byte for byte, with the compiler that the build names."""
    sys.path.insert(0, str(PACKAGE))
    try:
        import build  # type: ignore[import-not-found,unused-ignore]
    finally:
        sys.path.remove(str(PACKAGE))
    if build.compiler() != build.ZIG:
        require(f"zig {build.ZIG}", f"pip install ziglang=={build.ZIG}")
    build.build(tmp_path / "decoder.wasm")
    made = (tmp_path / "decoder.wasm").read_bytes()
    assert made == (PACKAGE / "src" / "decoder.wasm").read_bytes()
    assert len(made) <= LARGEST_MODULE


def test_the_compiler_is_the_one_that_dev_installs() -> None:
    project = (PACKAGE.parents[1] / "pyproject.toml").read_text()
    zig = next(line for line in BUILD.read_text().splitlines() if line.startswith("ZIG = "))
    assert f'"ziglang=={zig.split(chr(34))[1]}"' in project


def test_types(require: Callable[[str, str], None]) -> None:
    """`tsc --checkJs`, strict."""
    if remedy := TYPESCRIPT.remedy():
        require("tsc", remedy)
    assert checked_types.complaints() == ""


def test_a_wrong_type_is_a_complaint(require: Callable[[str, str], None], tmp_path: Path) -> None:
    if remedy := TYPESCRIPT.remedy():
        require("tsc", remedy)
    shutil.copytree(PACKAGE / "src", tmp_path / "src")
    shutil.copy(PACKAGE / "tsconfig.json", tmp_path)
    with (tmp_path / "src" / "crc32.js").open("a") as source:
        source.write('crc32("text");\n')
    assert "crc32.js" in checked_types.complaints(tmp_path, tmp_path)
    assert (tmp_path / f"{tmp_path.name}.tsbuildinfo").is_file()
    assert "crc32.js" in checked_types.complaints(tmp_path, tmp_path), "a known one, again"


def test_a_compiler_that_breaks_off_is_a_complaint(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    node = tmp_path / "node"
    node.write_text("#!/bin/sh\necho out of memory >&2\nexit 134\n")
    node.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    assert "134\nout of memory" in checked_types.complaints(tmp_path, tmp_path)


def test_without_a_compiler_the_build_says_what_to_install(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-I", "-S", str(BUILD), str(tmp_path / "none.wasm")],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": ""},
    )
    assert done.returncode != 0
    assert "pip install ziglang==" in done.stderr
