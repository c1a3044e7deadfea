"""`ptm publish` after a run of another version that stopped at any of its steps."""

from __future__ import annotations

import gzip
import hashlib
import os
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from hypothesis import Phase, example, given, settings, strategies as st

from ptmtools.site import publishing, uploading
from ptmtools.site.content import Site
from ptmtools.site.entry import SiteEntry
from ptmtools.site.published import COPY, LIST, PublishOptions, steps_of, steps_of_removal
from ptmtools.site.publishing import publish
from ptmtools.store import objects
from tests.conftest import files_below

NAMED = re.compile(rb"data/[\w.-]+|catalogue\.html")
#: Kinds of targets: a folder; stores with and without headers, of which some give no MD5.
TARGETS = ("folder", "bare", "headers", "no-md5")
_number = count()


@dataclass(frozen=True)
class Version:
    """A version of a small site: its title, and whether it has a tour and gzip copies."""

    title: str
    tour: bool
    gzip: bool

    @property
    def site(self) -> Site:
        """A page that names a file of its own, one of all versions, and the catalogue."""
        names = [self._data("scene"), "data/common-0123456789.json"]
        texts = {name: name for name in names}
        if self.tour:
            work = self._data("work")
            texts |= {work: work, "catalogue.html": f"{self.title} {work}"}
            names.append("catalogue.html")
        texts |= {"index.html": " ".join([self.title, *names]), "offline.js": self.title}
        entries = {
            name: SiteEntry(
                name, f"{text}\n".encode() * 20, "text/x", name.startswith("data/"), True
            )
            for name, text in texts.items()
        }
        return Site(entries, {})

    def _data(self, stem: str) -> str:
        return f"data/{stem}-{hashlib.sha256(self.title.encode()).hexdigest()[:10]}.json"

    def publish(self, target: str, *, keep: bool = False) -> None:
        publish(self.site, target, PublishOptions(gzip=self.gzip, keep=keep))


def files_of(target: str) -> dict[str, bytes]:
    """The files of a target without the list; those of stores without their encoding."""
    if "://" not in target:
        files = files_below(Path(target))
    else:
        import fsspec

        memory = fsspec.filesystem("memory")
        begin = target.removeprefix("memory:/") + "/"
        files = {name.removeprefix(begin): memory.cat_file(name) for name in memory.find(target)}
    plain = {name: data for name, data in files.items() if name != LIST}
    return {name: _decoded(data) for name, data in plain.items()}


def _decoded(data: bytes) -> bytes:
    return gzip.decompress(data) if data.startswith(b"\x1f\x8b") else data


def assert_whole(target: str) -> None:
    """Pages and their copies name only files that are there."""
    files = files_of(target)
    for name, data in files.items():
        if name.removesuffix(COPY).endswith(".html"):
            assert {match.decode() for match in NAMED.findall(data)} <= files.keys(), name


class Stopped(BaseException):
    """A publication stops, as by a signal."""


class Steps:
    """Counts what a publication writes and removes, and stops it before one of these steps."""

    def __init__(self) -> None:
        self.left = -1
        self.target = ""

    def counted(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def step(*arguments: Any, **options: Any) -> Any:
            if self.left == 0:
                raise Stopped
            self.left -= 1
            result = function(*arguments, **options)
            assert_whole(self.target)
            return result

        return step


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> Iterator[Steps]:
    made = Steps()
    monkeypatch.setattr(publishing, "write_bytes", made.counted(publishing.write_bytes))
    monkeypatch.setattr(publishing, "_remove", made.counted(publishing._remove))
    for name in ("write", "remove"):
        method = made.counted(getattr(objects.Objects, name))
        monkeypatch.setattr(objects.Objects, name, method)
    monkeypatch.setattr(uploading, "AT_ONCE", 1)
    # What takes most of the time.
    monkeypatch.setattr(os, "fsync", lambda file: None)
    return made


def _kind(md5: Callable[[Any], str]) -> objects.StoreKind:
    """A store in memory whose objects have headers."""
    return objects.StoreKind(
        lambda headers: {}, lambda row: str(row["created"]), md5, lambda version: {}
    )


def _md5(row: Any) -> str:
    import fsspec

    data = fsspec.filesystem("memory").cat_file(row["name"])
    return hashlib.md5(data, usedforsecurity=False).hexdigest()


KINDS = {"headers": _kind(_md5), "no-md5": _kind(lambda row: "")}


@pytest.mark.parametrize("kind", TARGETS)
def test_any_version_after_an_interrupted_one(
    kind: str, steps: Steps, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exactly its files remain; and at every moment a page names only what is there."""
    if kind != "folder":
        pytest.importorskip("fsspec")
    if kind in KINDS:
        monkeypatch.setitem(objects.KINDS, "memory", KINDS[kind])

    def target() -> str:
        number = next(_number)
        return str(tmp_path / str(number)) if kind == "folder" else f"memory://stops/{number}"

    booleans = st.booleans()
    versions = [st.builds(Version, st.just(title), booleans, booleans) for title in "abc"]
    stops = st.integers(0, 16)
    # The last run comes after one or two others that stopped.
    maybe = st.none() | stops

    tours = Version("a", True, False), Version("b", True, False), Version("c", False, False)

    # Shrinking takes minutes.
    @settings(max_examples=25, derandomize=True, phases=[Phase.explicit, Phase.generate])
    @example(*tours, 3, None, False)  # before the catalogue is replaced
    @example(*tours, 5, None, False)  # after that, before the page
    @example(*tours, 5, 3, True)
    @given(*versions, stops, maybe, booleans)
    def after(a: Version, b: Version, c: Version, stop: int, again: int | None, back: bool) -> None:
        steps.target, steps.left = target(), -1
        a.publish(steps.target)
        # The second stopped run is of the same version, or goes back to the first.
        second = a if back else b
        for version, steps.left in [(b, stop)] + [(second, again)] * (again is not None):
            with suppress(Stopped):
                version.publish(steps.target)
        steps.left = -1
        c.publish(steps.target)
        actual = files_of(steps.target)
        steps.target = target()
        c.publish(steps.target)
        assert actual == files_of(steps.target)

    after()


def test_the_copy_of_the_page_comes_with_it() -> None:
    """After all files that replace others, and before them when it is removed."""
    first = ["data/scene-0123456789.json", "data/scene-0123456789.json.gz"]
    documents = ["_headers", "catalogue.html", "catalogue.html.gz", "offline.js", "ptm-walk.js.gz"]
    page = ["index.html", "index.html.gz"]
    names = sorted([*first, *documents, *page])
    assert steps_of(names) == [first, documents, page]
    assert steps_of_removal(names, (), PublishOptions()) == [page, documents, first]


@pytest.mark.parametrize("kind", ["folder", "bare"])
def test_copies_of_replaced_files_are_not_kept(kind: str, tmp_path: Path) -> None:
    """Servers would send them instead of the new page."""
    target = str(tmp_path) if kind == "folder" else f"memory://stops/{next(_number)}"
    if kind != "folder":
        pytest.importorskip("fsspec")
    Version("a", tour=True, gzip=True).publish(target)
    Version("b", tour=False, gzip=False).publish(target, keep=True)
    copies = {name for name in files_of(target) if name.endswith(COPY)}
    assert {re.sub(r"-\w{10}", "", name) for name in copies} == {
        "catalogue.html.gz",
        "data/scene.json.gz",
        "data/work.json.gz",
    }
    assert_whole(target)
