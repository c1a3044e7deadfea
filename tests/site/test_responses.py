"""Responses of the server, over real connections."""

from __future__ import annotations

import gzip
import os
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from ptmtools.site.entry import SiteEntry
from ptmtools.site.lookup import Lookup, entry_lookup, folder_lookup
from ptmtools.site.responses import app_of
from ptmtools.site.serving import running, serving
from ptmtools.site.throttle import Paced, Throttle, Visits
from tests.site.client import NOISE, PAGE, TEXTS, Client, client_of


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> Lookup:
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
        SiteEntry("index.html", PAGE, "text/html; charset=utf-8", compressed=True),
        SiteEntry("data/index-0123456789.json", TEXTS, "application/json", True, True),
        SiteEntry("data/a%20%C3%BC-0123456789.ptm", NOISE, "application/octet-stream", True),
        SiteEntry("data/file.ptm", www / "noise.ptm", "application/octet-stream"),
        SiteEntry("data/gone.ptm", www / "gone.ptm", "application/octet-stream"),
        SiteEntry("data/small.json", b"{}", "application/json", compressed=True),
        SiteEntry("data/empty.ptm", b"", "application/octet-stream"),
    ]
    own, others = entry_lookup({entry.name: entry for entry in entries}), folder_lookup(www)
    return lambda name: own(name) or others(name)


@pytest.fixture(scope="session")
def visits() -> Visits:
    return Visits()


@pytest.fixture(scope="session")
def served(files: Lookup, visits: Visits) -> Iterator[str]:
    with serving(files, visits=visits) as url:
        yield url


@pytest.fixture
def ask(served: str) -> Iterator[Client]:
    with client_of(served) as client:
        yield client


FILES = ["/data/a%20%C3%BC-0123456789.ptm", "/data/file.ptm", "/noise.ptm"]
JSON = "/data/index-0123456789.json"


def test_a_page_and_a_file(ask: Client) -> None:
    page = ask("/")
    assert (page.status, page.body) == (200, PAGE)
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    assert page.headers["cache-control"] == "no-cache"
    assert page.headers["x-content-type-options"] == "nosniff"
    assert ask("/index.html").body == PAGE
    assert ask("/?anything").body == PAGE
    for file in FILES:
        answer = ask(file)
        assert (answer.status, answer.body) == (200, NOISE)
        assert answer.headers["accept-ranges"] == "bytes"
        assert "content-encoding" not in answer.headers
    assert ask(FILES[0]).headers["cache-control"] == "public, max-age=31536000, immutable"
    assert ask(FILES[1]).headers["cache-control"] == "no-cache"
    assert ask("/root.wrl").headers["content-type"] == "model/vrml"
    assert ask("/ein%20Bild%20%C3%BC.png").body == b"png"
    assert "access-control-allow-origin" not in page.headers


EDGE = st.integers(0, len(NOISE) + 10)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(file=st.sampled_from(FILES), first=EDGE | st.none(), last=EDGE | st.none())
def test_any_range_is_the_slice(
    ask: Client, file: str, first: int | None, last: int | None
) -> None:
    text = f"{'' if first is None else first}-{'' if last is None else last}"
    answer = ask(file, Range=f"bytes={text}")
    if (first is None and last is None) or (None not in (first, last) and last < first):
        assert (answer.status, answer.body) == (200, NOISE)
        return
    begin = max(0, len(NOISE) - last) if first is None else first
    end = len(NOISE) if first is None or last is None else min(last + 1, len(NOISE))
    if begin >= end:
        assert (answer.status, answer.body) == (416, b"")
        assert answer.headers["content-range"] == f"bytes */{len(NOISE)}"
        return
    assert (answer.status, answer.body) == (206, NOISE[begin:end])
    assert answer.headers["content-range"] == f"bytes {begin}-{end - 1}/{len(NOISE)}"
    assert answer.headers["content-length"] == str(end - begin)


def test_gzip_for_who_takes_it(ask: Client) -> None:
    packed, plain = ask(JSON, Accept_Encoding="br, gzip"), ask(JSON)
    assert gzip.decompress(packed.body) == plain.body == TEXTS
    assert packed.headers["content-encoding"] == "gzip"
    assert len(packed.body) == int(packed.headers["content-length"]) < len(TEXTS) / 10
    assert packed.headers["vary"] == plain.headers["vary"] == "Accept-Encoding"
    assert packed.headers["etag"] != plain.headers["etag"]
    assert "accept-ranges" not in packed.headers
    assert plain.headers["accept-ranges"] == "bytes"
    assert ask(JSON, Accept_Encoding="gzip").body == packed.body
    assert "content-encoding" not in ask(JSON, Accept_Encoding="gzip;q=0").headers
    # What would only grow is sent as it is.
    small = ask("/data/small.json", Accept_Encoding="gzip")
    assert (small.body, small.headers.get("content-encoding")) == (b"{}", None)
    wrl = ask("/root.wrl", Accept_Encoding="gzip")
    assert gzip.decompress(wrl.body) == ask("/root.wrl").body


def test_a_range_is_never_one_of_compressed_bytes(ask: Client) -> None:
    part = ask(JSON, Accept_Encoding="gzip", Range="bytes=5-24")
    assert (part.status, part.body) == (206, TEXTS[5:25])
    assert "content-encoding" not in part.headers
    assert part.headers["vary"] == "Accept-Encoding"
    packed = ask(JSON, Accept_Encoding="gzip")
    # Of the compressed representation there are no parts: all of it.
    again = ask(JSON, Accept_Encoding="gzip", Range="bytes=5-24", If_Range=packed.headers["etag"])
    assert (again.status, again.body) == (200, packed.body)


def test_parts_only_of_the_bytes_that_the_client_has(ask: Client) -> None:
    tag = ask(FILES[1]).headers["etag"]
    assert ask(FILES[1], Range="bytes=1-2", If_Range=tag).status == 206
    assert ask(FILES[1], Range="bytes=1-2", If_Range='"other"').body == NOISE
    for condition in (f"W/{tag}", "Mon, 23 Nov 2026 03:29:48 GMT"):
        assert ask(FILES[1], Range="bytes=1-2", If_Range=condition).status == 200


@pytest.mark.parametrize("path", ["/", JSON, FILES[0], FILES[1], "/root.wrl"])
@pytest.mark.parametrize("coding", ["gzip", "identity"])
def test_what_the_client_has_is_not_sent_again(ask: Client, path: str, coding: str) -> None:
    first = ask(path, Accept_Encoding=coding)
    tag = first.headers["etag"]
    for condition in (tag, f'"x", W/{tag}', "*"):
        again = ask(path, Accept_Encoding=coding, If_None_Match=condition)
        assert (again.status, again.body) == (304, b"")
        for name in ("etag", "cache-control", "vary"):
            assert again.headers.get(name) == first.headers.get(name)
    assert ask(path, Accept_Encoding=coding, If_None_Match='"x"').body == first.body


def test_head_is_a_get_without_the_body(ask: Client) -> None:
    for path, coding in (("/", "gzip"), (JSON, "identity"), (FILES[1], "gzip")):
        get, head = ask(path, Accept_Encoding=coding), ask(path, "HEAD", Accept_Encoding=coding)
        assert (head.status, head.body) == (200, b"")
        assert head.headers | {"date": ""} == get.headers | {"date": ""}
    # RFC 9110: ranges are defined for GET.
    assert ask(FILES[0], "HEAD", Range="bytes=1-2").status == 200
    assert ask("/nothing", "HEAD").status == 404


def test_other_methods_are_refused(ask: Client) -> None:
    for method in ("POST", "PUT", "DELETE", "OPTIONS", "PATCH"):
        answer = ask("/", method)
        assert answer.status == 405
        assert set(answer.headers["allow"].split(", ")) == {"GET", "HEAD"}


HOSTILE = [
    "/nothing",
    "/../manifest.json",
    "/..%2fmanifest.json",
    "/%2e%2e/manifest.json",
    "/cells/../../manifest.json",
    "/cells/..%2f..%2fmanifest.json",
    "/cells%2fc0000.wrl",
    "/cells/../root.wrl",
    "/./root.wrl",
    "//root.wrl",
    "/cells//c0000.wrl",
    "/root.wrl/",
    "/..\\manifest.json",
    "/..%5cmanifest.json",
    "/root.wrl%00",
    "/root.wrl%00.png",
    "/%ff",
    "/%",
    "/cells",
    "/cells/",
    "/outside.wrl",
    "/folder-outside/manifest.json",
    "/folder-outside/www/root.wrl/../../manifest.json",
    "/null",
    "/circle",
    "/etc/passwd",
    "//etc/passwd",
    "/%2fetc%2fpasswd",
    "/C:/root.wrl",
    "/root.wrl:stream",
    "/wwwsecret",
    "/../wwwsecret",
    "/%252e%252e/manifest.json",
    "/data/gone.ptm",
    "/a/" * 100,
    "/" + "a" * 3000,
    "/" + "a/" * 3000,
]


@pytest.mark.parametrize("path", HOSTILE, ids=lambda path: path[:40])
def test_nothing_else_is_served(ask: Client, path: str) -> None:
    answer = ask(path)
    assert (answer.status, answer.body) == (404, b"not found\n")


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=200)
@given(
    st.lists(st.sampled_from(["..", ".", "%2e", "%2f", "/", "//", "\\", "manifest.json", "cells"]))
)
def test_no_path_leads_to_what_is_private(ask: Client, parts: list[str]) -> None:
    assert b"private" not in ask("/" + "".join(parts)).body


def test_a_link_that_stays_inside_is_followed(ask: Client) -> None:
    assert ask("/inside.wrl").body == ask("/root.wrl").body != b""


def test_what_is_not_http_or_not_ours_gets_no_file(served: str) -> None:
    where = urlsplit(served)
    for request, status in (
        (b"GET manifest.json HTTP/1.1\r\nHost: x\r\n\r\n", b"404"),
        (b"GET http://x/manifest.json HTTP/1.1\r\nHost: x\r\n\r\n", b"404"),
        (b"\x16\x03\x01\x02\r\n\r\n", b"400"),
    ):
        with socket.create_connection((where.hostname, where.port), timeout=20) as connection:
            connection.sendall(request)
            assert connection.recv(100).split()[1] == status


def test_an_empty_file(ask: Client) -> None:
    assert (ask("/data/empty.ptm").status, ask("/data/empty.ptm").body) == (200, b"")
    assert ask("/data/empty.ptm", Range="bytes=0-").status == 416


def test_a_file_that_changes_gets_another_tag(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_bytes(TEXTS)
    with serving(folder_lookup(tmp_path)) as url, client_of(url) as ask:
        first = ask("/a.json", Accept_Encoding="gzip")
        file.write_bytes(TEXTS[::-1])
        os.utime(file, ns=(1, 1))
        second = ask("/a.json", Accept_Encoding="gzip")
        assert gzip.decompress(second.body) == TEXTS[::-1]
        assert first.headers["etag"] != second.headers["etag"]
        assert ask("/a.json", If_None_Match=first.headers["etag"]).status == 200


def test_names_with_a_hash_may_be_kept_of_a_published_folder(tmp_path: Path) -> None:
    names = [
        "viewer-0123456789/viewer.js",
        "data/c0-abcdef0123.glb",
        "data/opening-0123456789-0.bin",
        "data/sets/sets-0123456789.json",
        "data-0123456789/objects/a.glb",
    ]
    # Others have a date in their name, or fewer or more digits.
    others = [
        "walk-1732806393/index.html",
        "textures/photo-1612345678.png",
        "photo-1612345678.png",
        "data/walk-1732806393/index.html",
        "data/c0-abcdef012.glb",
        "data/c0-abcdef01234.glb",
    ]
    for name in (*names, *others):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"x")
    with serving(folder_lookup(tmp_path, hashed=True)) as url, client_of(url) as ask:
        sent = {name: ask(f"/{name}").headers["cache-control"] for name in (*names, *others)}
    assert {name for name, caching in sent.items() if "immutable" in caching} == {*names}


@pytest.mark.parametrize("origin", ["*", "https://example.org"])
def test_pages_of_others_may_read_on_request(origin: str) -> None:
    with serving({"a": SiteEntry("a", NOISE, "x/y")}, origin=origin) as url, client_of(url) as ask:
        part = ask("/a", Origin="https://example.org", Range="bytes=1-2")
        assert part.headers["access-control-allow-origin"] == origin
        assert "Content-Range" in part.headers["access-control-expose-headers"]
        before = ask("/a", "OPTIONS", Access_Control_Request_Headers="range")
        assert before.status == 204
        assert before.headers["access-control-allow-origin"] == origin
        assert "Range" in before.headers["access-control-allow-headers"]
        assert ask("/b").headers["access-control-allow-origin"] == origin


def test_six_connections_are_kept_open(served: str) -> None:
    clients = [Client(served) for _ in range(6)]
    for _ in range(3):
        for client in clients:
            assert client("/").status == 200
    sockets = {client.connection.sock for client in clients}
    assert None not in sockets  # which is what http.client makes of a closed one
    assert len(sockets) == 6
    for client in clients:
        client.connection.close()


def test_a_small_body_does_not_wait_for_the_acknowledgement_of_its_head(ask: Client) -> None:
    seconds = []
    for _ in range(50):
        begun = time.perf_counter()
        assert ask("/data/small.json").body == b"{}"
        seconds.append(time.perf_counter() - begun)
    # Systems acknowledge the first packets of a connection at once, later ones after 40 ms.
    assert min(seconds[30:]) < 0.02


def test_every_request_is_recorded() -> None:
    visits = Visits()
    files = {"a": SiteEntry("a", NOISE, "x/y")}
    with serving(files, visits=visits) as url, client_of(url) as ask:
        ask("/a?b", Range="bytes=10-19")
        ask("/c%20d")
        ask("/a", "HEAD")
    part, missing, head = visits
    assert (part.method, part.path, part.range) == ("GET", "/a", "bytes=10-19")
    assert (part.status, part.bytes, part.whole) == (206, 10, True)
    assert part.first_byte is not None
    assert part.ended is not None
    assert part.begun <= part.first_byte <= part.ended <= missing.begun
    assert (missing.path, missing.status) == ("/c%20d", 404)
    assert (head.method, head.bytes, head.length) == ("HEAD", 0, len(NOISE))
    assert visits.bytes == sum(v.header_bytes for v in visits) + 10 + len(b"not found\n")
    visits.clear()
    assert len(visits) == 0


def test_header_bytes_are_those_on_the_link(served: str, visits: Visits) -> None:
    where = urlsplit(served)
    with socket.create_connection((where.hostname, where.port), timeout=20) as connection:
        connection.sendall(b"GET /noise.ptm HTTP/1.1\r\nHost: x\r\nRange: bytes=0-9\r\n\r\n")
        received = b""
        while len(received.partition(b"\r\n\r\n")[2]) < 10:
            received += connection.recv(1000)
    assert list(visits)[-1].header_bytes == len(received) - 10


def test_who_goes_away_is_recorded_and_leaves_the_link() -> None:
    visits = Visits()
    files = {"a": SiteEntry("a", NOISE, "x/y")}
    app = app_of(entry_lookup(files), throttle=Throttle(1e6), visits=visits)
    assert isinstance(app, Paced)
    with running(app) as url:
        where = urlsplit(url)
        with socket.create_connection((where.hostname, where.port), timeout=20) as connection:
            connection.sendall(b"GET /a HTTP/1.1\r\nHost: x\r\n\r\n")
            connection.recv(1000)
        (visit,) = visits
        end = time.monotonic() + 20
        while visit.ended is None:
            assert time.monotonic() < end, "waited in vain"
            time.sleep(0.005)
    assert app.link.flow_count == 0
    assert not visit.whole
    assert visit.bytes < len(NOISE)


def test_concurrent_responses_of_a_thin_link_are_whole_and_no_faster_than_it() -> None:
    visits = Visits()
    parts = {f"{i}": NOISE[i * 1000 :][:20_000] for i in range(6)}
    files = {name: SiteEntry(name, data, "x/y") for name, data in parts.items()}
    actual = {}

    def fetch(url: str, name: str) -> None:
        with client_of(url) as ask:
            actual[name] = ask(f"/{name}").body

    with serving(files, throttle=Throttle(4e6, 0.05), visits=visits) as url:
        threads = [threading.Thread(target=fetch, args=(url, name)) for name in parts]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert actual == parts
    # No sooner than the link can.
    begun = [visit.begun for visit in visits]
    first = [visit.first_byte or 0.0 for visit in visits]
    ended = [visit.ended or 0.0 for visit in visits]
    assert max(ended) - min(begun) >= 0.05 + visits.bytes * 8 / 4e6
    assert all(f - b >= 0.05 for f, b in zip(first, begun, strict=True))


def test_the_end_does_not_wait_for_clients() -> None:
    files = {"a": SiteEntry("a", NOISE, "x/y")}

    with serving(files, throttle=Throttle(8_000)) as url:  # 700 s for all of it
        where = urlsplit(url)
        idle = socket.create_connection((where.hostname, where.port), timeout=20)
        reading = socket.create_connection((where.hostname, where.port), timeout=20)
        reading.sendall(b"GET /a HTTP/1.1\r\nHost: x\r\n\r\n")
        assert reading.recv(100)
    for connection in (idle, reading):  # both are closed: what was sent, then the end
        while connection.recv(1000):
            pass
        connection.close()
    with pytest.raises(OSError, match="refused"):
        socket.create_connection((where.hostname, where.port), timeout=20)
