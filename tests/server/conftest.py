"""A server in a thread, and a client that says what it got."""

from __future__ import annotations

import http.client
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from random import Random
from urllib.parse import urlsplit

import pytest

from ptmtools.server.lookup import Lookup, among, below
from ptmtools.server.running import serving
from ptmtools.server.visits import Visits
from ptmtools.site.content import Entry

PAGE = b"<!DOCTYPE html><p>hello</p>" * 20
TEXTS = b'{"cells": [1, 2, 3]}' * 500
NOISE = Random(1).randbytes(700_000)


@dataclass(frozen=True)
class Answer:
    """A response: status, headers by their names in small letters, body."""

    status: int
    headers: dict[str, str]
    body: bytes


class Client:
    """A connection that is kept."""

    def __init__(self, url: str) -> None:
        self.connection = http.client.HTTPConnection(urlsplit(url).netloc, timeout=20)

    def __call__(self, path: str, method: str = "GET", **headers: str) -> Answer:
        """Headers are named with _ for -."""
        given = {name.replace("_", "-"): value for name, value in headers.items()}
        self.connection.request(method, path, headers=given)
        response = self.connection.getresponse()
        found = {name.lower(): value for name, value in response.getheaders()}
        return Answer(response.status, found, response.read())


@contextmanager
def client_of(url: str) -> Iterator[Client]:
    client = Client(url)
    try:
        yield client
    finally:
        client.connection.close()


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Lookup:
    """Entries in memory and in files, and a folder with files and traps beside it."""
    root = tmp_path_factory.mktemp("database")
    www = root / "www"
    (www / "cells").mkdir(parents=True)
    (www / "root.wrl").write_bytes(b"#VRML V2.0 utf8\n" * 100)
    (www / "noise.ptm").write_bytes(NOISE)
    (www / "ein Bild ü.png").write_bytes(b"png")
    (www / "index.html").write_bytes(b"the folder's")
    (www / "cells/c0000.wrl").write_bytes(b"#VRML V2.0 utf8\n")
    (www / "inside.wrl").symlink_to("root.wrl")
    (www / "outside.wrl").symlink_to(root / "manifest.json")
    (www / "folder-outside").symlink_to(root)
    (www / "null").symlink_to("/dev/null")
    (www / "circle").symlink_to("circle")
    (root / "manifest.json").write_bytes(b"private")
    (root / "wwwsecret").write_bytes(b"private")
    entries = [
        Entry("index.html", PAGE, "text/html; charset=utf-8", compressed=True),
        Entry("data/index-0123456789.json", TEXTS, "application/json", True, True),
        Entry("data/a%20%C3%BC-0123456789.ptm", NOISE, "application/octet-stream", True),
        Entry("data/file.ptm", www / "noise.ptm", "application/octet-stream"),
        Entry("data/gone.ptm", www / "gone.ptm", "application/octet-stream"),
        Entry("data/small.json", b"{}", "application/json", compressed=True),
        Entry("data/empty.ptm", b"", "application/octet-stream"),
    ]
    own, others = among({entry.name: entry for entry in entries}), below(www)
    return lambda name: own(name) or others(name)


@pytest.fixture(scope="session")
def visits() -> Visits:
    return Visits()


@pytest.fixture(scope="session")
def served(site: Lookup, visits: Visits) -> Iterator[str]:
    with serving(site, visits=visits) as url:
        yield url


@pytest.fixture
def ask(served: str) -> Iterator[Client]:
    with client_of(served) as client:
        yield client
