"""Sites in a real browser: headless Chromium, driven by playwright, with WebGL2 by software."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import pytest

from ptmtools.cli.main import main
from ptmtools.site import responses
from ptmtools.site.content import Site, SiteOptions, site_of

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(ROOT / "benchmarks")]
from browser import Visitor, new_page, visiting, visiting_in  # noqa: E402
from engines import Engine, launched, missing  # noqa: E402
from samples import campus, pictures, statue  # noqa: E402

from tests.builds import once  # noqa: E402
from tests.e2e.conftest import make_museum  # noqa: E402
from tests.lab.conftest import Ptm, ptm, two_rooms  # noqa: E402
from tests.systems.apo.statues import write_rooms  # noqa: E402

__all__ = ["Ptm", "campus", "pictures", "ptm", "statue", "two_rooms"]

#: Each file by itself, to be damaged, left out and counted; `test_opening_page.py` has openings.
PLAIN = SiteOptions(pictures=False, opening=False)
Visiting = Callable[..., AbstractContextManager[Visitor]]


@pytest.fixture(scope="session", autouse=True)
def _compressed_once() -> Iterator[None]:
    """A server compresses each file at its first request, and each visit has its own server."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(responses, "compress", lru_cache(512)(responses.compress))
        yield


@pytest.fixture(scope="session")
def window(chromium: Any) -> Iterator[Any]:
    """The page of visits that prepare nothing."""
    page = new_page(chromium)
    yield page
    page.context.close()


@pytest.fixture
def visit(chromium: Any, window: Any) -> Visiting:
    """``with visit(site, query="?memory=4") as visitor:`` see `browser.visiting`. Where nothing of
    the page or its context is prepared, it is one that others have been to, which starts faster."""

    def of(
        site: Site, *, width: int = 640, height: int = 480, **options: Any
    ) -> AbstractContextManager[Visitor]:
        if options.keys() <= {"query", "throttle"} and window.url == "about:blank":
            window.set_viewport_size({"width": width, "height": height})
            return visiting_in(window, site.entries, **options)
        return visiting(chromium, site.entries, width=width, height=height, **options)

    return of


@pytest.fixture(scope="session")
def engines(require: Callable[[str, str], None]) -> Iterator[Callable[[str], Engine]]:
    """``engines("firefox")``: that browser, which is started once."""
    with ExitStack() as running:

        @cache
        def of(name: str) -> Engine:
            if packages := missing(name):
                require(name, f"apt install {packages}")
            return running.enter_context(launched(name))

        yield of


def build(model: Path, database: Path, *more: str) -> Path:
    """A database with cells as glTF alone, without light; ``more`` options."""
    options = ["--format", "gltf", "--no-fallback", "--light", "none", "-j", "1", *more]
    assert main(["-q", "build-scene", str(model), "-o", str(database), *options]) == 0
    return database


@pytest.fixture(scope="session")
def museum_db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A museum of four rooms and stairs, with twelve small textures."""

    def of(folder: Path) -> None:
        model = make_museum(folder / "model", rooms=4, textures=12, size=256)
        build(model, folder / "museum.db")

    return once(tmp_path_factory, "museum", of) / "museum.db"


@pytest.fixture(scope="session")
def hospital_db(tmp_path_factory: pytest.TempPathFactory, shared: Path) -> Path:
    """A floor of a hospital."""
    model = shared / "scenes" / "hospital" / "hospital.obj"
    folder = once(tmp_path_factory, "hospital", lambda f: build(model, f / "hospital.db"))
    return folder / "hospital.db"


@pytest.fixture(scope="session")
def museum(museum_db: Path) -> Site:
    """The site of the museum."""
    return site_of(museum_db, PLAIN)


@pytest.fixture(scope="session")
def hospital(hospital_db: Path) -> Site:
    """The site of the hospital."""
    return site_of(hospital_db, PLAIN)


#: How objects get octrees.
OCTREES = ("--apo", "statue*", "--apo-faces", "500", "--apo-error", "0.02", "--backend", "embree")


@pytest.fixture(scope="session")
def statues_db(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two rooms with a statue each, of which the second has no texture."""
    folder = once(
        tmp_path_factory,
        "statues",
        lambda f: build(write_rooms(f / "model", 5), f / "statues.db", *OCTREES),
    )
    return folder / "statues.db"


@pytest.fixture(scope="session")
def statues(statues_db: Path) -> Site:
    """The site of the rooms with statues."""
    return site_of(statues_db, PLAIN)
