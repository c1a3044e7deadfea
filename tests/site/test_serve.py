"""`ptm serve`, run as a user would."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from ptmtools.cli.main import main
from ptmtools.site import lookup
from ptmtools.site.content import SiteOptions
from ptmtools.site.entry import SiteEntry
from ptmtools.site.lookup import Lookup
from ptmtools.site.responses import open_entry
from ptmtools.site.serving import url_of
from ptmtools.store.manifest import SCHEMA, Manifest, StageRecord
from tests.site.client import NOISE, PAGE, client_of

TWO_ROOMS = Path(__file__).parents[2] / "sample_data/two_rooms/two_rooms.obj"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """As `ptm publish` writes it."""
    made = tmp_path / "site"
    made.mkdir()
    (made / "index.html").write_bytes(PAGE)
    (made / "data").mkdir()
    (made / "data/noise-0123456789.ptm").write_bytes(NOISE)
    return made


@contextmanager
def serve(*arguments: object, **environment: str) -> Iterator[subprocess.Popen[str]]:
    """The command; killed at last, if it still runs."""
    process = subprocess.Popen(
        [sys.executable, "-m", "ptmtools", "serve", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
        # What is started in the background may have been told to ignore Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def line(process: subprocess.Popen[str]) -> str:
    assert process.stdout
    return process.stdout.readline().rstrip("\n")


def interrupted(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """Its status, and what else it printed, after a Ctrl-C."""
    process.send_signal(signal.SIGINT)
    printed, complained = process.communicate(timeout=20)
    return process.returncode, printed, complained


def test_serves_a_published_folder_until_ctrl_c(folder: Path) -> None:
    with serve(folder, "--bandwidth", "64k", "--latency", "10ms") as process:
        url = line(process)
        with client_of(url) as ask:
            assert ask("/").body == PAGE
            part = ask("/data/noise-0123456789.ptm", Range="bytes=5-9")
            assert part.body == NOISE[5:10]
            assert "immutable" in part.headers["cache-control"]
        where = urlsplit(url)
        assert where.hostname == "127.0.0.1"
        address = (where.hostname, where.port)
        with (
            socket.create_connection(address, timeout=20),
            socket.create_connection(address, timeout=20) as reading,
        ):
            reading.sendall(b"GET /data/noise-0123456789.ptm HTTP/1.1\r\nHost: x\r\n\r\n")
            assert reading.recv(100)  # of what takes 90 s
            assert interrupted(process) == (0, "", "")


def test_opens_the_page(folder: Path, tmp_path: Path) -> None:
    browser, seen = tmp_path / "browser", tmp_path / "seen"
    browser.write_text(f'#!/bin/sh\necho "$1" > {seen}.part && mv {seen}.part {seen}\n')
    browser.chmod(0o755)
    with serve(folder, "--open", BROWSER=f"{browser} %s") as process:
        url = line(process)
        with client_of(url) as ask:
            assert ask("/").status == 200
        while not seen.exists():
            assert process.poll() is None
            time.sleep(0.01)
        assert seen.read_text().strip() == url
        assert interrupted(process)[::2] == (0, "")


def test_serves_all_the_same_where_no_browser_opens(folder: Path) -> None:
    with serve(folder, "--open", BROWSER="false %s") as process:
        assert process.stderr
        url = line(process)
        assert process.stderr.readline().startswith("ptm: note: no browser could be started")
        with client_of(url) as ask:
            assert ask("/").status == 200
        assert interrupted(process)[0] == 0


def test_warns_where_others_can_reach_it(folder: Path) -> None:
    with serve(folder, "--host", "0.0.0.0", "--cors") as process:
        assert process.stderr
        url = line(process)
        assert "warning: listening on 0.0.0.0" in process.stderr.readline()
        with client_of(url) as ask:
            assert ask("/").headers["access-control-allow-origin"] == "*"
        assert interrupted(process)[0] == 0


def failing(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    """The status and the line of a command that ends by itself."""
    status = main(["serve", *map(str, arguments)])
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return status, err


def test_a_taken_port(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = urlsplit(url_of(other)).port
        status, printed = failing(capsys, folder, "--port", port)
    assert status == 3
    assert f"127.0.0.1:{port}: the port is taken by another program; use another" in printed
    assert "[PTM-I920]" in printed


@pytest.mark.parametrize(
    "options",
    [("--port", "65536"), ("--port", "-1"), ("--host", "192.0.2.1"), ("--host", "a..b"), ()],
)
def test_addresses_that_cannot_be(
    folder: Path, capsys: pytest.CaptureFixture[str], options: tuple[str, ...]
) -> None:
    status, printed = failing(capsys, folder, *(options or ("--host", "a" * 70)))
    assert status == 3
    assert "[PTM-I920]" in printed


@pytest.mark.parametrize(
    ("options", "status", "code"),
    [
        (("--bandwidth", "0"), 3, "PTM-I111"),
        (("--bandwidth", "fast"), 3, "PTM-I111"),
        (("--latency", "-1"), 3, "PTM-I111"),
        (("--port", "x"), 2, "PTM-U001"),
        (("--cors", "museum.db"), 2, "PTM-U001"),
        (("--cors", "https://a\r\nSet-Cookie: b"), 2, "PTM-U001"),
    ],
)
def test_options_that_cannot_be(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, ...],
    status: int,
    code: str,
) -> None:
    actual, printed = failing(capsys, folder, *options)
    assert (actual, code in printed) == (status, True)


def database(folder: Path, stages: Mapping[str, StageRecord], schema: int = SCHEMA) -> Path:
    folder.mkdir()
    text = Manifest("rooms.obj", stages).to_bytes()
    text = text.replace(f'"schema": {SCHEMA}'.encode(), f'"schema": {schema}'.encode())
    (folder / "manifest.json").write_bytes(text)
    return folder


RECORD = StageRecord(1, {}, {}, {})


def test_what_is_no_database_to_serve(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    for path, code, words in (
        (tmp_path / "nowhere", "PTM-D001", "there is no such database"),
        (empty, "PTM-D001", "neither a database, nor a folder that `ptm publish`"),
        (database(tmp_path / "unfinished", {"scene": RECORD}), "PTM-D004", "run `ptm build-scene"),
        (database(tmp_path / "old", {"scene": RECORD}, 1), "PTM-D003", "anew with --force"),
    ):
        status, printed = failing(capsys, path)
        assert status == 5
        assert code in printed
        assert words in printed
        assert str(path) in printed


@dataclass(frozen=True)
class Site:
    """What a database is made into."""

    entries: Mapping[str, SiteEntry]


def site_of(path: Path, options: SiteOptions) -> Site:
    assert (path / "manifest.json").exists()
    return Site({"index.html": SiteEntry("index.html", PAGE, "text/html")})


def test_a_site_goes_before_the_files_of_its_database(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ptmtools.site.lookup.site_of", site_of)
    made = database(tmp_path / "db", {"emit": RECORD})
    (made / "www").mkdir()
    (made / "www/index.html").write_bytes(b"not this")
    (made / "www/root.wrl").write_bytes(b"#VRML V2.0 utf8\n")
    find = lookup.files_of(made)
    for name, content in (("index.html", PAGE), ("root.wrl", b"#VRML V2.0 utf8\n")):
        entry = find(name)
        assert entry
        assert entry.read() == content
    assert find("manifest.json") is None


def test_a_database_that_is_built_again(tmp_path: Path) -> None:
    """Its page is the new one; no old name stands for new bytes."""
    made = tmp_path / "two_rooms.db"
    build = ["-q", "build-scene", str(TWO_ROOMS), "-o", str(made), "-j", "1"]
    assert main(build) == 0
    find = lookup.files_of(made)
    before = data_of(find)
    assert main([*build, "--max-level", "-2"]) == 0
    for name in textures_in(before):
        entry = find(name)
        assert entry
        with pytest.raises((BlockingIOError, FileNotFoundError)):
            open_entry(entry)
    after = data_of(find)
    assert textures_in(after).isdisjoint(textures_in(before))
    shutil.rmtree(made)
    assert main(["-q", "cells", str(TWO_ROOMS), "-o", str(made)]) == 0
    with pytest.raises(BlockingIOError, match="being built"):
        find("index.html")
    assert main(build) == 0
    assert data_of(find) == before


def textures_in(data: Mapping[str, bytes]) -> set[str]:
    return {name for name in data if name.endswith(".ptm")}


def data_of(find: Lookup) -> dict[str, bytes]:
    """Records, geometry and textures, as who opens the page finds them."""

    def read(name: str) -> bytes:
        entry = find(name)
        assert entry, name
        return entry.read()

    reported = re.search(
        rb'<script type="application/json" id="site">(.*?)</script>', read("index.html")
    )
    assert reported
    index = json.loads(read(json.loads(reported[1])["index"]))
    names = [cell[key] for cell in index["cells"] for key in ("record", "geometry")]
    names += [row["file"] for row in index["textures"]]
    return {f"data/{name}": read(f"data/{name}") for name in names}
