"""The wheel and the sdist, without the repository.

The wheel is installed into a virtual environment that sees the libraries of this one, but not the
package: an editable package is named in a `.pth` file, which Python reads in its own environment
only.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import tarfile
import urllib.request
import venv
import zipfile
from pathlib import Path

import pytest

from release.man_page import man_page

ROOT = Path(__file__).resolve().parents[2]
#: Largest size of the wheel, bytes.
LARGEST = 3_000_000


#: Nothing that names the repository. A new place of the package has no compiled kernels, and
#: compiling takes a minute: they run as plain Python.
ENVIRONMENT = {
    **{name: os.environ[name] for name in ("PATH", "HOME", "LANG", "TMPDIR") if name in os.environ},
    "NUMBA_DISABLE_JIT": "1",
}


def run(*words: object, cwd: Path) -> str:
    """What a program prints."""
    done = subprocess.run(
        [str(word) for word in words],
        cwd=cwd,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def fetched(url: str) -> bytes:
    with urllib.request.urlopen(url, timeout=60) as reply:
        data: bytes = reply.read()
    return data


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the sdist, and the wheel that was built from it."""
    folder = tmp_path_factory.mktemp("dist")
    # A copy of the tracked files: building writes into its folder.
    names = run("git", "ls-files", "-z", "--", ":!tests", ":!benchmarks", cwd=ROOT).split("\0")
    source = folder / "source"
    for name in filter(None, names):
        if (ROOT / name).is_file():
            target = source / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes((ROOT / name).read_bytes())
    (source / "release/man").mkdir()
    (source / "release/man/ptm.1").write_text(man_page(), "utf-8")
    run(sys.executable, "-m", "build", "--no-isolation", "-o", folder / "dist", source, cwd=folder)
    return folder / "dist"


@pytest.fixture(scope="module")
def wheel(dist: Path) -> Path:
    (file,) = dist.glob("*.whl")
    return file


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of an environment with the wheel."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder / "venv", with_pip=False)
    python = folder / "venv/bin/python"
    where = "import sysconfig; print(sysconfig.get_path('purelib'))"
    packages = Path(run(python, "-c", where, cwd=folder).strip())
    libraries = {sysconfig.get_path(kind) for kind in ("purelib", "platlib")}
    (packages / "libraries.pth").write_text("\n".join(sorted(libraries)))
    install = ("--python", python, "install", "--no-deps", "--no-index", "--ignore-installed")
    run(sys.executable, "-m", "pip", *install, wheel, cwd=folder)
    return python


def test_the_wheel_is_small_and_holds_the_page_the_decoder_and_the_schemas(wheel: Path) -> None:
    assert wheel.stat().st_size < LARGEST
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    for folder, pattern in (
        ("ptmtools/site/page", "*"),
        ("ptmtools/site/words", "*.json"),
        ("ptmtools/schemas", "*.json"),
        ("ptmtools", "py.typed"),
        ("ptmtools_systems/page", "*"),
    ):
        for file in (ROOT / folder).glob(pattern):
            assert file.relative_to(ROOT).as_posix() in names
    assert "ptmtools/site/page/decoder.wasm" in names
    others = {f"ptmtools_{name}/py.typed" for name in ("lab", "systems", "samples")}
    assert others <= names
    foreign = {
        name for name in names if not re.match(r"ptmtools(_lab|_systems|_samples)?[/-]", name)
    }
    assert not foreign
    assert any(name.endswith(".data/data/share/man/man1/ptm.1") for name in names)


def test_the_sdist_has_the_sources_of_the_page(dist: Path) -> None:
    (file,) = dist.glob("*.tar.gz")
    with tarfile.open(file) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {"web/page/main.js", "web/page/build.py", "docs/index.md", "LICENSE"} <= names
    assert not any(name.startswith("tests/") for name in names)


def test_a_walk_from_nothing_but_the_wheel(python: Path, tmp_path: Path) -> None:
    ptm = python.with_name("ptm")
    where = run(python, "-c", "import ptmtools; print(ptmtools.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(python.parents[1]), "the installed package"
    run(ptm, "sample", "museum", "--rooms", "2", "--textures", "6", "--size", "16", cwd=tmp_path)
    assert "museum.obj: Wavefront OBJ" in run(ptm, "info", "museum/museum.obj", cwd=tmp_path)
    run(ptm, "sample", "two-rooms", cwd=tmp_path)
    model = ("two_rooms/two_rooms.obj", "--profile", "raw", "-j", "1")
    model += ("--light", "bake", "--light-density", "0.5", "--light-samples", "1")
    assert "two_rooms.db" in run(ptm, "build-scene", *model, cwd=tmp_path)
    server = subprocess.Popen(
        [ptm, "serve", "two_rooms/two_rooms.db", "--port", "0"],
        cwd=tmp_path,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert server.stdout is not None
        url = server.stdout.readline().strip()
        page = fetched(url).decode()
        names = set(re.findall(r'(?:src|href)="([^":#]+)"', page))
        assert any("viewer" in name for name in names)
        for name in names:
            assert len(fetched(url + name)) > 100
    finally:
        server.terminate()
        server.communicate(timeout=60)
    run(ptm, "publish", "two_rooms/two_rooms.db", "-o", "site", cwd=tmp_path)
    assert (tmp_path / "site/index.html").is_file()
