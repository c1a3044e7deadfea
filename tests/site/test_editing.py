"""`ptm serve DB --edit`: what may be written, by whom, and what cannot be."""

from __future__ import annotations

import json
import re
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import urlsplit

import pytest

from ptmtools.cli.main import main
from ptmtools.errors import InputError, OutputError
from ptmtools.site.content import SiteOptions, site_of
from ptmtools.site.edit_requests import Editing
from ptmtools.site.editing import ABSENT, TourEditor
from ptmtools.site.lookup import files_of
from ptmtools.site.serving import ServeOptions, serving
from tests.site.client import Answer, Client, client_of
from tests.site.test_tour import silence

TOUR: dict[str, Any] = {
    "format": "ptmtools tour",
    "schema": 1,
    "model": "museum.obj",
    "languages": ["en"],
    "labels": [{"id": "one", "object": "painting_01", "title": {"en": "One"}}],
    "stops": [],
}


@dataclass
class Page:
    """A server, and requests to it as its page sends them."""

    folder: Path
    url: str
    token: str
    client: Client

    @property
    def file(self) -> Path:
        return self.folder / "tour.json"

    def ask(self, name: str, method: str = "GET", document: Any = None, **headers: str) -> Answer:
        origin = self.url.rstrip("/")
        given = {
            "Authorization": f"Bearer {self.token}",
            "Content_Type": "application/json",
            "Origin": origin,
        }
        body = document if isinstance(document, bytes) else json.dumps(document).encode()
        sent = {name: value for name, value in (given | headers).items() if value}
        return self.client(f"/edit/{name}", method, None if method == "GET" else body, **sent)

    def save(self, document: Any, tag: str, **headers: str) -> Answer:
        return self.ask("tour", "PUT", document, If_Match=tag, **headers)


@pytest.fixture(scope="module")
def server(museum_db: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """Of a database without a tour."""
    folder = tmp_path_factory.mktemp("editing")
    database = folder / "museum.db"
    database.symlink_to(museum_db)
    editing = Editing(TourEditor(database))
    with serving(files_of(database), editing=editing) as url, client_of(url) as client:
        yield Page(folder, url, editing.token, client)


@pytest.fixture
def page(server: Page) -> Iterator[Page]:
    yield server
    for path in server.folder.iterdir():
        if path.is_file():
            path.unlink()


@pytest.fixture
def folder(page: Page) -> Path:
    return page.folder


def message(answer: Answer) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(answer.body)
    return document


def test_a_tour_is_made_saved_and_shown(page: Page) -> None:
    first = json.loads(page.ask("tour").body)
    assert first["tag"] == ABSENT
    assert first["document"]["model"] == "museum.obj"
    saved = page.save(TOUR, ABSENT)
    assert saved.status == 200
    assert json.loads(page.file.read_text()) == TOUR
    shown = message(saved)["shown"]["labels"][0]
    assert (shown["id"], len(shown["marker"]), shown["cell"] >= 0) == ("one", 3, True)
    # The plain page has it at once, and the page that edits gets it from the editor alone.
    plain, editor = page.client("/").body, page.client("/?edit").body
    (name,) = re.findall(rb"data/tour-\w+\.json", plain)
    assert json.loads(page.client(f"/{name.decode()}").body)["labels"] == [shown]
    assert b"editor.js" not in plain
    assert b"data/tour-" not in editor
    (script,) = re.findall(rb"viewer-\w+/editor\.js", editor)
    assert page.client(f"/{script.decode()}").status == 200
    # The page writes the place of the visitor over the token soon after its script has begun.
    assert editor.index(script) < editor.index(b'/viewer.js"></script>')
    again = page.save({**TOUR, "title": "Works"}, message(saved)["tag"])
    assert again.status == 200
    assert page.file.read_text().count("\n") > 10, "in lines, as it was"


def test_only_the_page_of_the_server_may_write(page: Page) -> None:
    port = urlsplit(page.url).port
    for headers, status in (
        ({"Authorization": ""}, 403),
        ({"Authorization": "Bearer x"}, 403),
        ({"Authorization": f"Basic {page.token}"}, 403),
        ({"Origin": ""}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "https://example.org"}, 403),
        ({"Origin": f"http://127.0.0.1:{(port or 0) + 1}"}, 403),
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"Host": "example.org"}, 403),
        ({"Host": f"localhost:{port}"}, 403),
        ({"Content_Type": "text/plain"}, 415),
        ({"If_Match": ""}, 428),
    ):
        answer = page.ask("tour", "PUT", TOUR, **({"If_Match": ABSENT} | headers))
        assert (headers, answer.status) == (headers, status)
        assert message(answer)["message"]
        assert not page.file.exists()
    # A preflight of another page gets no permission.
    allowed = page.client("/edit/tour", "OPTIONS", Origin="https://example.org")
    assert allowed.status == 403
    assert "access-control-allow-origin" not in allowed.headers
    for path in ("/", "/?edit"):
        assert page.client(path, Host="rebound.example").status == 403, "nothing is read either"
    assert page.client("/?edit").headers["x-frame-options"] == "DENY"
    assert page.ask("tour", Authorization="").status == 403
    assert page.save(TOUR, ABSENT).status == 200


def test_nothing_else_can_be_written(page: Page) -> None:
    before = sorted(page.folder.iterdir())
    for name, method, status in (
        ("../museum.db/manifest.json", "PUT", 404),
        ("other.json", "PUT", 404),
        ("tour", "DELETE", 405),
        ("tour", "POST", 405),
        ("media/x", "PUT", 405),
    ):
        assert page.ask(name, method, TOUR, If_Match=ABSENT).status == status, name
    assert page.client("/tour.json", "PUT", b"{}").status == 405
    assert sorted(page.folder.iterdir()) == before


def test_what_is_refused_says_why(page: Page) -> None:
    label = TOUR["labels"][0]
    for change, place, words in (
        ({"labels": [{**label, "object": "paintng_01"}]}, "labels[0].object", "paintng_01"),
        ({"labels": [{**label, "link": "javascript:x"}]}, "labels[0].link", "no address"),
        ({"labels": [label, label]}, "labels[1].id", "earlier label"),
        ({"labels": [{**label, "sound": "../a.mp3"}]}, "labels[0].sound", "outside"),
        ({"labels": [{**label, "title": "x" * 20_001}]}, "labels[0].title", "20000"),
        ({"labels": [{**label, "new": 1}]}, "labels[0].new", "not known"),
        ({"model": "other.obj"}, "model", "other.obj"),
    ):
        for answer in (
            page.save({**TOUR, **change}, ABSENT),
            page.ask("preview", "POST", {**TOUR, **change}),
        ):
            assert answer.status == 422
            assert message(answer)["place"] == place
            assert words in message(answer)["message"]
            assert message(answer)["code"] in ("PTM-I870", "PTM-I302")
    for data in (b"", b"{", b"[]", b"\xff", b"1e999", b'{"format": "ptmtools tour", "schema": 2}'):
        assert page.save(data, ABSENT).status == 422
    surrogate = json.dumps({**TOUR, "title": "\ud800"}).encode()
    assert "half" in message(page.save(surrogate, ABSENT))["message"]
    assert not page.file.exists()


def test_too_much_is_not_read(page: Page) -> None:
    where = urlsplit(page.url)
    head = (
        f"PUT /edit/tour HTTP/1.1\r\nHost: {where.netloc}\r\nOrigin: http://{where.netloc}\r\n"
        f"Authorization: Bearer {page.token}\r\nContent-Type: application/json\r\n"
        f'If-Match: "none"\r\nTransfer-Encoding: chunked\r\n\r\n'
    )
    chunk = b"100000\r\n" + b" " * (1 << 20) + b"\r\n"
    with socket.create_connection((where.hostname, where.port), timeout=20) as connection:
        connection.sendall(head.encode())
        for _ in range(9):
            connection.sendall(chunk)
        assert connection.recv(99).startswith(b"HTTP/1.1 413")
    ray = b'{"eye": [' + b" " * 5000 + b"]}"
    assert page.ask("pick", "POST", ray).status == 413


def test_a_change_by_another_program_is_kept(page: Page) -> None:
    page.file.write_text(json.dumps(TOUR))
    assert page.save(TOUR, ABSENT).status == 412
    tag = json.loads(page.ask("tour").body)["tag"]
    page.file.write_text(json.dumps({**TOUR, "title": "By hand"}))
    answer = page.save({**TOUR, "title": "Here"}, tag)
    assert answer.status == 412
    assert "another program" in message(answer)["message"]
    assert "By hand" in page.file.read_text()
    # The plain page has what was written by hand; of a damaged file, the tour before.
    before = page.client("/").body
    page.file.write_text("{")
    assert page.client("/").body == before
    assert b"data/tour-" in before
    assert page.ask("tour").status == 422


def test_a_ray_names_the_object_before_it(page: Page) -> None:
    page.file.write_text(json.dumps(TOUR))
    label = json.loads(page.ask("tour").body)["shown"]["labels"][0]
    low, high = label["box"][:3], label["box"][3:]
    middle = [(a + b) / 2 for a, b in zip(low, high, strict=True)]
    eye = [a + 1.5 * b for a, b in zip(middle, label["normal"], strict=True)]
    back = [-b for b in label["normal"]]
    (pick,) = message(page.ask("pick", "POST", {"eye": eye, "direction": back}))["picks"]
    assert pick["object"] == "painting_01"
    before = sum((a - b) * c for a, b, c in zip(pick["at"], middle, label["normal"], strict=True))
    assert 0 < before < 0.1
    for ray in ({"eye": eye, "direction": [0, 0, 0]}, {"eye": eye}, {"eye": "abc"}, [1]):
        assert page.ask("pick", "POST", ray).status == 422


def test_sounds_beside_the_tour_are_offered_and_played(page: Page) -> None:
    (page.folder / "sounds").mkdir()
    (page.folder / "sounds/museum.txt").write_text("no sound")
    (page.folder / "sounds/one.wav").write_bytes(silence(1))
    (page.folder / ".hidden.wav").write_bytes(silence(1))
    (page.folder / "one.vtt").write_text("WEBVTT\n")
    offered = json.loads(page.ask("tour").body)
    assert (offered["sounds"], offered["captions"]) == (["sounds/one.wav"], ["one.vtt"])
    label = {**TOUR["labels"][0], "sound": "sounds/one.wav"}
    shown = message(page.ask("preview", "POST", {**TOUR, "labels": [label]}))["shown"]
    answer = page.client(f"/edit/media/{shown['labels'][0]['sound']['']}")
    assert (answer.status, answer.headers["content-type"]) == (200, "audio/wav")
    assert page.client("/edit/media/one.vtt").status == 404


def test_a_folder_that_cannot_be_written(
    page: Page, monkeypatch: pytest.MonkeyPatch, folder: Path
) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise OutputError("PTM-O002", "cannot be written (Read-only file system)", file=page.file)

    with monkeypatch.context() as patch:
        patch.setattr("ptmtools.site.editing.write_bytes", full)
        answer = page.save(TOUR, ABSENT)
    assert answer.status == 500
    assert message(answer)["code"] == "PTM-O002"
    assert "Read-only" in message(answer)["message"]
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(OutputError, match="the folder cannot be written") as raised:
        TourEditor(folder / "museum.db")
    assert "copy the database" in str(raised.value.remedy)


def test_what_cannot_be_edited(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError, match="PTM-I111"):
        ServeOptions(edit=True, host="0.0.0.0")
    assert ServeOptions(edit=True, host="::1").edit
    database = str(folder / "museum.db")
    assert main(["serve", database, "--edit", "--cors"]) == 2
    (folder / "tour.json").write_text(json.dumps({**TOUR, "model": "other.obj"}))
    assert main(["serve", database, "--edit"]) == 3
    assert "is the tour of other.obj, not of museum.obj" in capsys.readouterr().err
    assert main(["serve", str(folder), "--edit"]) == 5


def test_the_command_prints_an_address_with_a_token(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def ask() -> None:
        """In place of the wait for Ctrl-C."""
        url, token = capsys.readouterr().out.strip().split("?edit#token=")
        with client_of(url) as client:
            for given, status in ((token, 200), (token[:-1], 403)):
                answer = client("/edit/tour", Authorization=f"Bearer {given}")
                assert answer.status == status
        raise KeyboardInterrupt

    waiting = SimpleNamespace(Event=lambda: SimpleNamespace(wait=ask))
    monkeypatch.setattr("ptmtools.cli.publish.threading", waiting)
    assert main(["serve", str(folder / "museum.db"), "--edit"]) == 0


def test_a_published_site_has_no_trace_of_it(folder: Path) -> None:
    (folder / "tour.json").write_text(json.dumps(TOUR))
    site = site_of(folder / "museum.db", SiteOptions(pictures=False, opening=False))
    assert not any("edit" in name for name in site.entries)
    assert not any(b"/edit/" in entry.read() for entry in site.entries.values() if entry.compressed)
