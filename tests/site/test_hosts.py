"""The lines of the guide for nginx: it sends a published folder as `ptm serve` sends the site."""

from __future__ import annotations

import gzip
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from samples import write_tour

from benchmarks.web_rivals.nginx import free_port, program_of, running
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.program import ELEMENT
from ptmtools.site.published import PublishOptions
from ptmtools.site.publishing import publish
from tests.site.client import Client, client_of

DOCS = Path(__file__).resolve().parents[2] / "docs"
#: Suffixes of the files that are sent compressed.
COMPRESSED = {"html", "js", "json", "wasm", "glb", "wrl"}


@pytest.fixture(scope="module")
def site(two_rooms: Path, tmp_path_factory: pytest.TempPathFactory) -> Site:
    """A site with files of all kinds."""
    options = SiteOptions(pictures=False, offline=True, clients="vrml")
    return site_of(two_rooms, replace(options, tour=write_tour(tmp_path_factory.mktemp("tour"))))


@pytest.fixture(scope="module")
def nginx(
    site: Site, require: Callable[[str, str], None], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Client]:
    if program_of("nginx") is None:
        require("nginx", "apt install nginx-light")
    folder, port = tmp_path_factory.mktemp("nginx"), free_port()
    publish(site, folder / "site", PublishOptions(gzip=True))
    server, element = lines_of("guide/publish.md"), lines_of("formats/embedding.md")
    text = server.rstrip().removesuffix("}") + element + "}"
    changes = {"listen 80": f"listen 127.0.0.1:{port}", "/srv/site": str(folder / "site")}
    for before, after in changes.items():
        assert text.count(before) == 1
        text = text.replace(before, after)
    with running(text, port, folder), client_of(f"http://127.0.0.1:{port}") as get:
        yield get


def lines_of(page: str) -> str:
    """The lines for nginx of a page of the documentation."""
    (text,) = re.findall(r"```nginx\n(.*?)```", (DOCS / page).read_text(), re.DOTALL)
    return str(text)


def test_all_files_are_sent_as_by_ptm_serve(site: Site, nginx: Client) -> None:
    for name, entry in site.entries.items():
        answer = nginx(f"/{name}", Accept_Encoding="gzip")
        sent, encoding = answer.headers, answer.headers.get("content-encoding")
        assert answer.status == 200
        assert sent["content-type"].partition(";")[0] == entry.media.partition(";")[0], name
        assert sent["cache-control"] == entry.caching, name
        assert (encoding == "gzip") == (name.rpartition(".")[2] in COMPRESSED), name
        assert (gzip.decompress(answer.body) if encoding else answer.body) == entry.read()
        shared = "*" if name == ELEMENT else None
        assert sent.get("access-control-allow-origin") == shared, name


def test_textures_come_in_ranges(site: Site, nginx: Client) -> None:
    name = next(name for name in site.entries if name.endswith(".ptm"))
    answer = nginx(f"/{name}", Range="bytes=5-24", Accept_Encoding="gzip")
    assert (answer.status, answer.body) == (206, site.entries[name].read()[5:25])
    assert "content-encoding" not in answer.headers


def test_an_unchanged_page_is_not_sent_again(nginx: Client) -> None:
    first = nginx("/", Accept_Encoding="gzip")
    tag = first.headers["etag"]
    assert nginx("/", Accept_Encoding="gzip", If_None_Match=tag).status == 304
