"""A site for link previews, search engines and home screens."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from ptmtools.site.about import MANIFEST, About, description_of
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.publishing import weight_of
from tests.e2e.conftest import Ptm

ADDRESS = "https://example.org/walk"
TITLE, TEXT = 'A "house" & <b>', "Two rooms."


@pytest.fixture(scope="module")
def site(two_rooms: Path, tmp_path_factory: pytest.TempPathFactory) -> Site:
    poster = tmp_path_factory.mktemp("poster") / "poster.png"
    Image.new("RGB", (64, 36)).save(poster)
    options = SiteOptions(TITLE, str(poster), description=TEXT, address=ADDRESS, pictures=False)
    return site_of(two_rooms, options)


def properties(page: str) -> dict[str, str]:
    return dict(re.findall(r'property="og:(\w+)" content="([^"]*)"', page))


def test_links_to_the_page_have_a_title_a_text_and_a_picture(site: Site) -> None:
    page = site.entries["index.html"].read().decode()
    own = properties(page)
    assert own["title"] == "A &quot;house&quot; &amp; &lt;b&gt;"
    assert own["description"] == TEXT
    assert own["url"] == f"{ADDRESS}/"
    assert own["image"].removeprefix(f"{ADDRESS}/") in site.entries
    assert f'<link rel="canonical" href="{ADDRESS}/">' in page
    assert "noindex" not in page


def test_without_an_address_urls_are_relative() -> None:
    lines = "\n".join(About("A", picture="data/poster.jpg").lines())
    assert properties(lines) == {"title": "A", "image": "data/poster.jpg"}
    assert "canonical" not in lines


def test_places_describe_a_site() -> None:
    rows: list[dict[str, Any]] = [{"description": name} for name in ["Hall", "", "Attic", "Hall"]]
    assert description_of(rows) == "Hall, Attic"


def test_the_manifest_names_icons_of_their_sizes(site: Site) -> None:
    page = site.entries["index.html"].read().decode()
    assert f'<link rel="manifest" href="{MANIFEST}">' in page
    assert "manifest-src 'self'" in page
    manifest = json.loads(site.entries[MANIFEST].read())
    assert manifest["name"] == TITLE
    assert manifest["theme_color"] == "#16171b"
    assert [row["sizes"] for row in manifest["icons"]] == ["192x192", "512x512"]
    for row in manifest["icons"]:
        with Image.open(io.BytesIO(site.entries[row["src"]].read())) as image:
            assert "{}x{}".format(*image.size) == row["sizes"]
            assert len(image.getcolors(1 << 18) or ()) > 3, "something is drawn"
    icons = sum(len(site.entries[row["src"]].read()) for row in manifest["icons"])
    entries = {name: e for name, e in site.entries.items() if "/icon-" not in name}
    assert weight_of(site) == weight_of(Site(entries, site.index))
    assert icons < 10_000


def test_an_address_that_is_none(two_rooms: Path, ptm: Ptm, tmp_path: Path) -> None:
    done = ptm("publish", two_rooms, "-o", tmp_path / "site", "--address", "example.org")
    assert done.status == 2
    assert "--address 'example.org' is not the address of a folder" in done.err
