"""The lines of the guide for servers: they send a published folder as `ptm serve` sends it."""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from samples import write_tour

from benchmarks.web_rivals.nginx import free_port, program_of, running
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.entry import FRESH
from ptmtools.site.lookup import files_of, folder_lookup
from ptmtools.site.program import ELEMENT
from ptmtools.site.published import PublishOptions
from ptmtools.site.publishing import publish
from ptmtools.site.serving import serving
from ptmtools.texture.previews import FORMATS
from ptmtools.tour.reading import CAPTIONS, SOUNDS
from tests.site.client import Answer, Client, client_of

DOCS = Path(__file__).resolve().parents[2] / "docs"
#: Names with ten digits that are no hash.
OTHERS = ("walk-1732806393/index.html", "textures/photo-1612345678.png", "photo-1612345678.png")


@pytest.fixture(scope="module")
def site(two_rooms: Path, tmp_path_factory: pytest.TempPathFactory) -> Site:
    """A site with files of all kinds."""
    options = SiteOptions(pictures=False, offline=True, clients="vrml")
    return site_of(two_rooms, replace(options, tour=write_tour(tmp_path_factory.mktemp("tour"))))


@pytest.fixture(scope="module")
def folder(site: Site, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The published site, beside files that are not its own and have a date in their names."""
    folder = tmp_path_factory.mktemp("host") / "site"
    publish(site, folder, PublishOptions(gzip=True))
    for name in OTHERS:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(b"x")
    return folder


@pytest.fixture(scope="module")
def nginx(folder: Path, require: Callable[[str, str], None]) -> Iterator[Client]:
    if program_of("nginx") is None:
        require("nginx", "apt install nginx-light")
    port = free_port()
    server, element = lines_of("guide/publish.md"), lines_of("formats/embedding.md")
    text = server.rstrip().removesuffix("}") + element + "}"
    changes = {"listen 80": f"listen 127.0.0.1:{port}", "/srv/site": str(folder)}
    for before, after in changes.items():
        assert text.count(before) == 1
        text = text.replace(before, after)
    with running(text, port, folder.parent), client_of(f"http://127.0.0.1:{port}") as get:
        yield get


def lines_of(page: str, server: str = "nginx") -> str:
    """The lines for a server of a page of the documentation."""
    (text,) = re.findall(rf"```{server}\n(.*?)```", (DOCS / page).read_text(), re.DOTALL)
    return str(text)


def test_all_files_are_sent_as_by_ptm_serve(site: Site, folder: Path, nginx: Client) -> None:
    with serving(files_of(folder)) as url, client_of(url) as ptm_serve:
        root = urlsplit(url).path
        for name in [*site.entries, *OTHERS]:
            expected = ptm_serve(root + name, Accept_Encoding="gzip")
            answer = nginx(f"/{name}", Accept_Encoding="gzip")
            headers, wanted = answer.headers, expected.headers
            assert (answer.status, expected.status) == (200, 200)
            media, wanted_media = headers["content-type"], wanted["content-type"]
            assert media.partition(";")[0] == wanted_media.partition(";")[0], name
            assert headers["cache-control"] == wanted["cache-control"], name
            assert headers.get("content-encoding") == wanted.get("content-encoding"), name
            assert plain(answer) == plain(expected)
            shared = "*" if name == ELEMENT else None
            assert headers.get("access-control-allow-origin") == shared, name
            if entry := site.entries.get(name):
                # So is the site itself.
                fields = (wanted_media, wanted["cache-control"], plain(expected))
                assert fields == (entry.media, entry.caching, entry.read()), name
                assert ("content-encoding" in wanted) == entry.compressed, name
            else:
                assert wanted["cache-control"] == FRESH


def plain(answer: Answer) -> bytes:
    return gzip.decompress(answer.body) if "content-encoding" in answer.headers else answer.body


def test_media_types_of_all_files_that_a_site_can_have(folder: Path) -> None:
    """Also of those that this site lacks: sounds, and previews of other formats."""
    wanted = SOUNDS | CAPTIONS | {row.suffix: row.media for row in FORMATS.values()}
    lines = re.findall(r"^ +(\w+/[\w+-]+) +([\w ]+);$", lines_of("guide/publish.md"), re.M)
    types = {f".{suffix}": media for media, suffixes in lines for suffix in suffixes.split()}
    assert types.items() >= {(suffix, media.partition(";")[0]) for suffix, media in wanted.items()}
    find = folder_lookup(folder)
    for suffix, media in wanted.items():
        (folder / f"other{suffix}").write_bytes(b"x")
        entry = find(f"other{suffix}")
        assert entry is not None
        assert entry.media == media
    lines = re.findall(r"AddType (\S+) ([\w ]+)$", lines_of("guide/publish.md", "apache"), re.M)
    added = {f".{suffix}": media for media, suffixes in lines for suffix in suffixes.split()}
    # Debian's list of types has the others.
    assert added.keys() >= {".avif", ".vtt", ".webmanifest"}
    assert added.items() <= types.items()


def test_the_lines_for_apache_keep_the_same_files(site: Site) -> None:
    (pattern,) = re.findall(r"m#(.*)#", lines_of("guide/publish.md", "apache"))
    assert f'location ~ "{pattern}"' in lines_of("guide/publish.md")
    matching = {name for name in [*site.entries, *OTHERS] if re.search(pattern, f"/walk/{name}")}
    assert matching == {name for name, entry in site.entries.items() if entry.forever}


def test_textures_come_in_ranges(site: Site, nginx: Client) -> None:
    name = next(name for name in site.entries if name.endswith(".ptm"))
    answer = nginx(f"/{name}", Range="bytes=5-24", Accept_Encoding="gzip")
    assert (answer.status, answer.body) == (206, site.entries[name].read()[5:25])
    assert "content-encoding" not in answer.headers


def test_an_unchanged_page_is_not_sent_again(nginx: Client) -> None:
    first = nginx("/", Accept_Encoding="gzip")
    tag = first.headers["etag"]
    assert nginx("/", Accept_Encoding="gzip", If_None_Match=tag).status == 304
