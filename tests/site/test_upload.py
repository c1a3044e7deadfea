"""`ptm publish` to object stores: a real S3 server gets, holds and sends the site."""

from __future__ import annotations

import json
import sys
from base64 import b64encode
from collections.abc import Callable, Iterator
from dataclasses import replace
from hashlib import md5
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest

from ptmtools.errors import InputError, MissingComponentError, OutputError
from ptmtools.site import uploading
from ptmtools.site.about import MANIFEST
from ptmtools.site.content import Site, SiteOptions, site_of
from ptmtools.site.published import HEADERS, LIST, PublishOptions
from ptmtools.site.publishing import publish
from ptmtools.site.serving import serving
from ptmtools.store import objects
from tests.conftest import files_below
from tests.e2e.conftest import Ptm
from tests.site.client import Answer, client_of
from tests.stores import CREDENTIALS, Store, gs_store, s3_store

INSTALL = "pip install -e '.[dev]'"
FOREVER = "public, max-age=31536000, immutable"
_number = count()


@pytest.fixture(scope="module")
def running(require: Callable[[str, str], None]) -> Iterator[Store]:
    for module in ("s3fs", "moto", "flask"):
        if not find_spec(module):
            require(module, INSTALL)
    with s3_store() as store:
        yield store


@pytest.fixture
def store(running: Store, monkeypatch: pytest.MonkeyPatch) -> Store:
    for name, value in CREDENTIALS.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("AWS_ENDPOINT_URL", running.url)
    running.requests.clear()
    monkeypatch.setattr(running, "refuse", lambda request: False)
    return running


@pytest.fixture
def bucket(store: Store) -> str:
    """A new bucket."""
    name = f"bucket-{next(_number)}"
    store.make_bucket(name)
    return name


@pytest.fixture(scope="module")
def site(two_rooms: Path) -> Site:
    return site_of(two_rooms, SiteOptions(pictures=False))


@pytest.fixture(scope="module")
def other(two_rooms: Path) -> Site:
    """A later version: another page, and one texture less in favour of another file."""
    made = site_of(two_rooms, SiteOptions("another title", pictures=False))
    entries = dict(made.entries)
    entry = entries.pop(min(name for name in entries if name.endswith(".ptm")))
    new = type(entry)("data/new-0123456789.json", b"{}" * 99, "application/json", True, True)
    return Site(entries | {new.name: new}, made.index)


def sent_by(store: Store, bucket: str, prefix: str = "") -> dict[str, Answer]:
    """What a browser gets for each object below a prefix."""
    pages = store.client().get_paginator("list_objects_v2").paginate(Bucket=bucket, Prefix=prefix)
    keys = [row["Key"] for page in pages for row in page.get("Contents", ())]
    with client_of(store.url) as get:
        return {
            key.removeprefix(prefix): get(f"/{bucket}/{key}", Accept_Encoding="gzip")
            for key in keys
        }


def sent_by_ptm_serve(site: Site) -> dict[str, Answer]:
    """What a browser gets from the site's own server."""
    with serving(site.entries) as url, client_of(url) as get:
        root = urlsplit(url).path
        return {unquote(name): get(root + name, Accept_Encoding="gzip") for name in site.entries}


def assert_serves(store: Store, bucket: str, prefix: str, site: Site) -> None:
    """The objects, without the list, are sent as `ptm serve` sends the files of the site."""
    actual, expected = sent_by(store, bucket, prefix), sent_by_ptm_serve(site)
    assert actual.keys() - {LIST} == expected.keys()
    for name, answer in expected.items():
        assert actual[name].status == 200
        assert actual[name].body == answer.body, name
        for header in ("content-type", "cache-control", "content-encoding"):
            assert actual[name].headers.get(header) == answer.headers.get(header), (name, header)


def test_objects_are_sent_as_by_ptm_serve(site: Site, store: Store, bucket: str) -> None:
    done = publish(site, f"s3://{bucket}/a/site/")
    assert set(done.written) == {unquote(name) for name in site.entries}
    assert_serves(store, bucket, "a/site/", site)
    answers = sent_by(store, bucket, "a/site/")
    encoded = {n.rpartition(".")[2] for n, a in answers.items() if "content-encoding" in a.headers}
    assert encoded == {"html", "js", "json", "wasm", "glb"}
    assert answers["index.html"].headers["cache-control"] == "no-cache"
    texture = next(name for name in answers if name.endswith(".ptm"))
    assert answers[texture].headers["cache-control"] == FOREVER
    with client_of(store.url) as get:
        part = get(f"/{bucket}/a/site/{texture}", Range="bytes=5-24")
    assert (part.status, part.body) == (206, answers[texture].body[5:25])


def test_the_page_is_sent_last_between_two_lists(site: Site, store: Store, bucket: str) -> None:
    publish(site, f"s3://{bucket}")
    names = store.written(bucket)
    assert (names[0], names[-2:]) == (LIST, ["index.html", LIST])
    assert sorted(names[1:-1]) == sorted(map(unquote, site.entries))
    # What replaces a former object comes after all that it may name.
    kept = [site.entries[name].forever for name in names[1:-1]]
    assert kept == sorted(kept, reverse=True)


def test_again_only_what_changed(site: Site, other: Site, store: Store, bucket: str) -> None:
    url = f"s3://{bucket}/site"
    publish(site, url)
    store.requests.clear()
    done = publish(site, url)
    assert (done.written, done.removed) == ((), ())
    assert len(done.unchanged) == len(site.entries)
    assert {request.method for request in store.requests} <= {"GET", "HEAD"}
    done = publish(other, url)
    new = {"index.html", "data/new-0123456789.json", "manifest.webmanifest"}
    assert set(done.written) == new
    assert set(done.removed) == site.entries.keys() - other.entries.keys()
    first, *files, last = store.written(bucket)
    assert first == last == f"site/{LIST}"
    assert {*files} == {f"site/{name}" for name in new}
    assert files[-1] == "site/index.html"
    assert_serves(store, bucket, "site/", other)


def test_a_store_that_gives_no_md5(
    site: Site, store: Store, bucket: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of objects sent in parts or encrypted: the version alone tells that they are unchanged."""
    without = replace(objects.KINDS["s3"], md5=lambda row: "")
    monkeypatch.setitem(objects.KINDS, "s3", without)
    publish(site, f"s3://{bucket}/site")
    assert publish(site, f"s3://{bucket}/site").written == ()
    overwrite(store, bucket, "site/index.html", b"mine")
    assert publish(site, f"s3://{bucket}/site").written == ("index.html",)


def overwrite(store: Store, bucket: str, key: str, data: bytes) -> None:
    store.client().put_object(Bucket=bucket, Key=key, Body=data)


def test_damaged_and_lost_objects_are_mended(site: Site, store: Store, bucket: str) -> None:
    publish(site, f"s3://{bucket}/site")
    names = [min(n for n in site.entries if n.endswith(s)) for s in (".ptm", ".glb")]
    overwrite(store, bucket, f"site/{names[0]}", b"x")
    store.client().delete_object(Bucket=bucket, Key=f"site/{names[1]}")
    assert sorted(publish(site, f"s3://{bucket}/site").written) == sorted(names)
    assert_serves(store, bucket, "site/", site)


@pytest.mark.parametrize("allowed", [0, 1, 2, 3])
def test_an_interrupted_upload_leaves_the_former_page(
    site: Site,
    other: Site,
    store: Store,
    bucket: str,
    monkeypatch: pytest.MonkeyPatch,
    allowed: int,
) -> None:
    url = f"s3://{bucket}/site"
    publish(site, url)
    former = sent_by(store, bucket, "site/")
    store.requests.clear()
    left = [allowed]

    def refuse(request: Any) -> bool:
        left[0] -= request.method == "PUT"
        return request.method in ("PUT", "DELETE", "POST") and left[0] < 0

    monkeypatch.setattr(store, "refuse", refuse)
    with pytest.raises(OutputError) as raised:
        publish(other, url)
    assert raised.value.code == "PTM-O012"
    now = sent_by(store, bucket, "site/")
    changed = {name for name in former if now[name].body != former[name].body}
    assert changed - {LIST} == ({MANIFEST} if allowed == 3 else set())
    monkeypatch.setattr(store, "refuse", lambda request: False)
    store.requests.clear()
    done = publish(other, url)
    # The list and one object were complete after two.
    assert ("data/new-0123456789.json" in done.unchanged) == (allowed >= 2)
    assert_serves(store, bucket, "site/", other)


def test_an_interrupted_first_upload_goes_on(
    site: Site, store: Store, bucket: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = [5]

    def refuse(request: Any) -> bool:
        left[0] -= request.method == "PUT"
        return left[0] < 0

    monkeypatch.setattr(store, "refuse", refuse)
    with pytest.raises(OutputError):
        publish(site, f"s3://{bucket}/site")
    monkeypatch.setattr(store, "refuse", lambda request: False)
    there = sent_by(store, bucket, "site/")
    assert "index.html" not in there
    assert len(there) == 5
    assert set(publish(site, f"s3://{bucket}/site").unchanged) == there.keys() - {LIST}
    assert_serves(store, bucket, "site/", site)


def test_what_is_not_ours_stays(site: Site, other: Site, store: Store, bucket: str) -> None:
    overwrite(store, bucket, "site/CNAME", b"museum.example")
    overwrite(store, bucket, "site2/index.html", b"a neighbour")
    with pytest.raises(OutputError) as raised:
        publish(site, f"s3://{bucket}/site")
    assert raised.value.code == "PTM-O010"
    publish(site, f"s3://{bucket}/site", force=True)
    gone = min(site.entries.keys() - other.entries.keys())
    overwrite(store, bucket, f"site/{gone}", b"mine")
    overwrite(store, bucket, "site/data/new-0123456789.json", b"mine, too")
    with pytest.raises(OutputError) as raised:
        publish(other, f"s3://{bucket}/site")
    assert raised.value.code == "PTM-O001"
    assert publish(other, f"s3://{bucket}/site", force=True).removed == ()
    actual = {name: answer.body for name, answer in sent_by(store, bucket).items()}
    assert actual["site/CNAME"] == b"museum.example"
    assert actual["site2/index.html"] == b"a neighbour"
    assert actual[f"site/{gone}"] == b"mine"
    assert actual["site/data/new-0123456789.json"] != b"mine, too"


def test_what_visitors_of_the_old_page_need(
    site: Site, other: Site, store: Store, bucket: str
) -> None:
    url = f"s3://{bucket}/site"
    publish(site, url)
    publish(other, url, PublishOptions(keep=True))
    assert site.entries.keys() <= sent_by(store, bucket, "site/").keys()
    done = publish(other, url)
    assert set(done.removed) == site.entries.keys() - other.entries.keys()
    assert_serves(store, bucket, "site/", other)


def test_a_list_that_is_damaged(site: Site, store: Store, bucket: str) -> None:
    document = {"format": uploading.FORMAT, "schema": uploading.SCHEMA, "files": {"a": 7}}
    for damage in (b"", b"[]", b"[" * 10_000, json.dumps(document).encode()):
        overwrite(store, bucket, LIST, damage)
        with pytest.raises(OutputError) as raised:
            publish(site, f"s3://{bucket}")
        assert raised.value.code == "PTM-O010"


def test_a_visitor_walks(museum: Site, store: Store, bucket: str, chromium: Any) -> None:
    """The page works from the store alone."""
    publish(museum, f"s3://{bucket}/museum")
    context = chromium.new_context(viewport={"width": 320, "height": 240}, bypass_csp=True)
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda fault: faults.append(str(fault)))
    store.requests.clear()
    page.goto(f"{store.url}/{bucket}/museum/index.html")
    page.wait_for_function("window.ptm?.state().complete", timeout=120_000)
    context.close()
    assert not faults
    fetched = {request.path.rpartition(".")[2] for request in store.requests}
    assert {"html", "js", "wasm", "json", "glb", "ptm"} <= fetched


def test_googles_store(
    site: Site, monkeypatch: pytest.MonkeyPatch, require: Callable[[str, str], None]
) -> None:
    for module in ("gcsfs", "gcp_storage_emulator"):
        if not find_spec(module):
            require(module, INSTALL)
    with gs_store("bucket") as url, client_of(url) as get:
        monkeypatch.setenv("STORAGE_EMULATOR_HOST", url)
        names = set(publish(site, "gs://bucket/a/site").written)
        assert publish(site, "gs://bucket/a/site").written == ()
        listed = json.loads(get("/storage/v1/b/bucket/o?prefix=a/site/").body)["items"]
        rows = {row["name"].removeprefix("a/site/"): row for row in listed}
    assert rows.keys() - {LIST} == names
    for name, answer in sent_by_ptm_serve(site).items():
        assert rows[name]["size"] == str(len(answer.body))
        assert rows[name]["md5Hash"] == b64encode(md5(answer.body).digest()).decode()
        assert rows[name]["cacheControl"] == answer.headers["cache-control"]
        assert rows[name].get("contentEncoding") == answer.headers.get("content-encoding")
        # The emulator drops parameters of the type.
        assert rows[name]["contentType"] == answer.headers["content-type"].partition(";")[0]


@pytest.mark.parametrize(
    ("url", "code"),
    [
        ("s3://no-such-bucket/site", "PTM-O012"),
        ("s3://", "PTM-I111"),
        ("nothing://bucket/site", "PTM-I111"),
    ],
)
def test_urls_that_name_no_store(site: Site, store: Store, url: str, code: str) -> None:
    with pytest.raises((OutputError, InputError)) as raised:
        publish(site, url)
    assert raised.value.code == code
    assert raised.value.file == url


def test_a_store_that_does_not_answer(
    site: Site, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    with pytest.raises(OutputError) as raised:
        publish(site, "s3://bucket/site")
    assert raised.value.code == "PTM-O012"


@pytest.mark.parametrize("module", ["fsspec", "s3fs"])
def test_without_the_extra(site: Site, monkeypatch: pytest.MonkeyPatch, module: str) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    if module == "s3fs":
        pytest.importorskip("fsspec")
        monkeypatch.delitem(sys.modules["fsspec.registry"]._registry, "s3", raising=False)
    with pytest.raises(MissingComponentError) as raised:
        publish(site, "s3://bucket/site")
    assert raised.value.code == "PTM-M100"
    assert "pip install 'ptmtools[cloud]'" in str(raised.value)


def test_urls_of_files_are_folders(site: Site, tmp_path: Path) -> None:
    publish(site, tmp_path / "a site")
    publish(site, f"file://{tmp_path}/another%20site")
    assert files_below(tmp_path / "another site") == files_below(tmp_path / "a site")


def test_a_store_without_headers(site: Site, other: Site, tmp_path: Path) -> None:
    """It gets the files of a folder."""
    fsspec = pytest.importorskip("fsspec")
    url = f"memory://stores/site-{next(_number)}"
    options = PublishOptions(gzip=True)
    publish(site, url, options)
    assert publish(site, url, options).written == ()
    publish(other, url, options)
    publish(other, tmp_path / "site", options)
    memory = fsspec.filesystem("memory")
    begin = url.removeprefix("memory:/") + "/"
    actual = {name.removeprefix(begin): memory.cat_file(name) for name in memory.find(url)}
    expected = files_below(tmp_path / "site")
    assert HEADERS in expected
    assert {n: d for n, d in actual.items() if n != LIST} == {
        n: d for n, d in expected.items() if n != LIST
    }


def test_the_command(ptm: Ptm, two_rooms: Path, store: Store, bucket: str) -> None:
    url = f"s3://{bucket}/site"
    done = ptm("publish", two_rooms, url, "--no-pictures")
    assert (done.status, done.err) == (0, "")
    assert done.out.startswith(f"{url}: ")
    done = ptm("publish", two_rooms, "-o", url, "--no-pictures", "--json")
    assert json.loads(done.out)["written"] == []
    for words in ((), (url, "-o", url), ("folder",)):
        assert ptm("publish", two_rooms, *words).status == 2
    done = ptm("publish", two_rooms, "s3://no-such-bucket/site", "--no-pictures")
    assert (done.status, "PTM-O012" in done.err, done.err.count("\n")) == (4, True, 1)
