"""`ptm publish`: what is written, what is left alone, and in which order."""

from __future__ import annotations

import gzip
import json
import os
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from samples import write_tour

from ptmtools.errors import DatabaseError, OutputError
from ptmtools.site import publishing
from ptmtools.site.about import MANIFEST, MANIFEST_MEDIA
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.program import ELEMENT
from ptmtools.site.published import HEADERS, LIST, PublishOptions
from ptmtools.site.publishing import publish
from tests.conftest import files_below
from tests.e2e.conftest import Ptm

PLAIN = SiteOptions(pictures=False)
OTHER = SiteOptions("another title", pictures=False)


@pytest.fixture(scope="module")
def site(two_rooms: Path) -> Site:
    return site_of(two_rooms, PLAIN)


@pytest.fixture(scope="module")
def other(two_rooms: Path) -> Site:
    """A later version: of its files one of the data is another."""
    made = site_of(two_rooms, OTHER)
    entries = dict(made.entries)
    first = min(name for name in entries if name.endswith(".ptm"))
    entry = entries.pop(first)
    entries["data/new-0123456789.json"] = type(entry)(
        "data/new-0123456789.json", b"{}", "application/json", True, True
    )
    return Site(entries, made.index)


def test_all_of_a_site_and_nothing_else(site: Site, tmp_path: Path) -> None:
    done = publish(site, tmp_path / "a" / "site")
    actual = files_below(tmp_path / "a" / "site")
    wanted = {name: entry.read() for name, entry in site.entries.items()}
    assert {name: actual[name] for name in wanted} == wanted
    assert actual.keys() - wanted.keys() == {LIST, HEADERS}
    assert sorted(done.written) == sorted([*wanted, HEADERS])
    assert not done.unchanged
    assert not done.removed
    publish(site, tmp_path / "b")
    assert files_below(tmp_path / "b") == actual


def fields_of(rules: str, path: str) -> dict[str, str]:
    """What a file of rules adds to the response at a path: as Cloudflare Pages reads it, values of
    a name in several rules are joined."""
    fields: dict[str, str] = {}
    for block in re.split(r"\n(?=/)", rules.strip()):
        pattern, *lines = block.splitlines()
        if re.fullmatch(".*".join(map(re.escape, pattern.split("*"))), path):
            for name, value in (line.strip().split(": ", 1) for line in lines):
                fields[name] = f"{fields[name]}, {value}" if name in fields else value
    return fields


def test_headers_of_hosts_that_read_them_from_a_file(two_rooms: Path, tmp_path: Path) -> None:
    """All files are cached as by `ptm serve`, also at addresses without `.html`; pages of other
    origins may load the element alone."""
    options = replace(PLAIN, tour=write_tour(tmp_path), offline=True, clients="vrml")
    site = site_of(two_rooms, options)
    publish(site, tmp_path / "site")
    rules = (tmp_path / "site" / HEADERS).read_text()
    addresses = {f"/{name}": entry for name, entry in site.entries.items()}
    addresses |= {path[:-5]: entry for path, entry in addresses.items() if path.endswith(".html")}
    addresses["/"] = addresses.pop("/index")
    assert {"/offline.js", "/catalogue", "/catalogue-de.html", "/root.wrl"} <= addresses.keys()
    for path, entry in addresses.items():
        fields = fields_of(rules, path)
        assert fields.pop("Cache-Control", None) == entry.caching, path
        assert fields.pop("Content-Type", entry.media) == entry.media, path
        assert fields == ({"Access-Control-Allow-Origin": "*"} if path == f"/{ELEMENT}" else {})
    assert fields_of(rules, f"/{MANIFEST}")["Content-Type"] == MANIFEST_MEDIA
    glb = next(path for path in addresses if path.endswith(".glb"))
    assert "Content-Type" in fields_of(rules, glb)
    # Cloudflare reads 100 rules.
    assert rules.count("\n/") < 30


def test_again_only_what_changed(site: Site, other: Site, tmp_path: Path) -> None:
    publish(site, tmp_path)
    times = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if file.is_file()}
    done = publish(site, tmp_path)
    assert not done.written
    assert len(done.unchanged) == len(site.entries) + 1
    assert all(file.stat().st_mtime_ns == time for file, time in times.items())
    done = publish(other, tmp_path)
    gone = site.entries.keys() - other.entries.keys()
    assert set(done.written) == {"index.html", MANIFEST, "data/new-0123456789.json"}
    assert set(done.removed) == gone
    assert len(gone) == 1
    assert not any((tmp_path / name).exists() for name in gone)
    fresh = tmp_path.with_name("fresh")
    publish(other, fresh)
    assert files_below(tmp_path) == files_below(fresh)


def test_damaged_files_are_mended(site: Site, tmp_path: Path) -> None:
    publish(site, tmp_path)
    names = [min(n for n in site.entries if n.endswith(s)) for s in (".ptm", ".glb", ".json")]
    data = bytearray((tmp_path / names[0]).read_bytes())
    data[-1] ^= 1
    (tmp_path / names[0]).write_bytes(data)
    (tmp_path / names[1]).write_bytes(b"")
    (tmp_path / names[2]).unlink()
    assert sorted(publish(site, tmp_path).written) == sorted(names)
    assert all((tmp_path / name).read_bytes() == site.entries[name].read() for name in names)


def test_what_visitors_of_the_old_page_need(site: Site, other: Site, tmp_path: Path) -> None:
    publish(site, tmp_path)
    publish(other, tmp_path, PublishOptions(keep=True))
    assert all((tmp_path / name).exists() for name in site.entries)
    # They are still known, and go with the next one that does not keep them.
    done = publish(other, tmp_path)
    assert set(done.removed) == site.entries.keys() - other.entries.keys()


def test_the_page_comes_last(
    site: Site, other: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whenever it stops, all that the page in the folder names is there; and the next run mends."""
    publish(site, tmp_path / "site")
    write = publishing._write
    for stop in range(4):
        folder = tmp_path / f"stopped-{stop}"
        shutil.copytree(tmp_path / "site", folder)
        left = [stop]

        def some(*arguments: Any, left: list[int] = left) -> None:
            if not left[0]:
                raise KeyboardInterrupt
            left[0] -= 1
            write(*arguments)

        monkeypatch.setattr(publishing, "_write", some)
        if stop < 3:
            with pytest.raises(KeyboardInterrupt):
                publish(other, folder)
            now = files_below(folder)
            changed = {name for name, entry in site.entries.items() if now[name] != entry.read()}
            assert changed == ({MANIFEST} if stop == 2 else set())
        monkeypatch.setattr(publishing, "_write", write)
        publish(other, folder)
        publish(other, tmp_path / f"fresh-{stop}")
        assert files_below(folder) == files_below(tmp_path / f"fresh-{stop}")


def test_what_is_not_ours_stays(site: Site, other: Site, tmp_path: Path) -> None:
    (tmp_path / "CNAME").write_text("museum.example")
    with pytest.raises(OutputError) as raised:
        publish(site, tmp_path)
    assert raised.value.code == "PTM-O010"
    assert files_below(tmp_path) == {"CNAME": b"museum.example"}
    publish(site, tmp_path, force=True)
    (tmp_path / "data" / "own.txt").write_text("mine")
    gone = min(site.entries.keys() - other.entries.keys())
    (tmp_path / gone).write_text("mine, too")
    assert publish(other, tmp_path).removed == ()
    assert (tmp_path / "CNAME").read_text() == "museum.example"
    assert (tmp_path / "data" / "own.txt").read_text() == "mine"
    assert (tmp_path / gone).read_text() == "mine, too"


def test_files_in_the_way(site: Site, other: Site, tmp_path: Path) -> None:
    publish(site, tmp_path / "site")
    (tmp_path / "site" / "data" / "new-0123456789.json").write_text("mine")
    with pytest.raises(OutputError) as raised:
        publish(other, tmp_path / "site")
    assert raised.value.code == "PTM-O001"
    assert (tmp_path / "site" / "data" / "new-0123456789.json").read_text() == "mine"
    publish(other, tmp_path / "site", force=True)
    assert (tmp_path / "site" / "data" / "new-0123456789.json").read_text() == "{}"
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError) as raised:
        publish(site, tmp_path / "file")
    assert raised.value.code == "PTM-O001"


def test_links_are_not_followed(site: Site, tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    publish(site, tmp_path / "site")
    shutil.rmtree(tmp_path / "site" / "data")
    os.symlink(outside, tmp_path / "site" / "data")
    with pytest.raises(OutputError) as raised:
        publish(site, tmp_path / "site")
    assert raised.value.code == "PTM-O005"
    assert not any(outside.iterdir())


def test_a_list_that_lies(site: Site, tmp_path: Path) -> None:
    """A list from elsewhere removes nothing outside the folder."""
    victim = tmp_path / "victim"
    victim.write_text("x")
    digest = "2d711642b726b04401627ca9fbac32f5c8530fb1903cc4db02258717921a4881"
    folder = tmp_path / "site"
    folder.mkdir()
    rows = {"../victim": digest, str(victim): digest, "a": 7}
    document = {"format": publishing.FORMAT, "schema": publishing.SCHEMA, "files": rows}
    (folder / LIST).write_text(json.dumps(document))
    publish(site, folder)
    assert victim.exists()
    for damage in (b"", b"[]", b'{"format": 1}', b"[" * 10_000):
        (folder / LIST).write_bytes(damage)
        with pytest.raises(OutputError) as raised:
            publish(site, folder)
        assert raised.value.code == "PTM-O010"


def test_a_texture_that_was_damaged(two_rooms: Path, tmp_path: Path) -> None:
    shutil.copytree(two_rooms, tmp_path / "db")
    texture = next((tmp_path / "db" / "www" / "textures").glob("*.ptm"))
    data = bytearray(texture.read_bytes())
    data[-1] ^= 1
    texture.write_bytes(data)
    with pytest.raises(DatabaseError) as raised:
        publish(site_of(tmp_path / "db", PLAIN), tmp_path / "site")
    assert raised.value.code == "PTM-D006"
    assert raised.value.file == str(texture)


def test_gzip_copies(site: Site, tmp_path: Path) -> None:
    publish(site, tmp_path, PublishOptions(gzip=True))
    copies = list(tmp_path.rglob("*.gz"))
    for copy in copies:
        assert gzip.decompress(copy.read_bytes()) == copy.with_suffix("").read_bytes()
    suffixes = {copy.with_suffix("").suffix for copy in copies}
    assert suffixes == {".html", ".js", ".json", ".glb", ".wasm"}
    assert len(publish(site, tmp_path).removed) == len(copies)


def test_the_command(ptm: Ptm, two_rooms: Path, tmp_path: Path) -> None:
    folder = tmp_path / "site"
    done = ptm("publish", two_rooms, "-o", folder, "--no-pictures", "--title", "Rooms", "--json")
    assert (done.status, done.err) == (0, "")
    reported = json.loads(done.out)
    assert reported["bytes"]["page"] < reported["bytes"]["first_room"] < reported["bytes"]["whole"]
    assert reported["removed"] == []
    assert "<title>Rooms</title>" in (folder / "index.html").read_text()
    done = ptm("publish", two_rooms, "-o", folder, "--no-pictures", "--title", "Rooms")
    assert "0 files written" in done.out
    assert "first room" in done.out
    done = ptm("publish", tmp_path / "gone.db", "-o", folder)
    assert done.status == 5
    assert done.err.count("\n") == 1
    assert "PTM-D001" in done.err
    done = ptm("publish", two_rooms, "-o", two_rooms)
    assert (done.status, "PTM-O010" in done.err) == (4, True)
