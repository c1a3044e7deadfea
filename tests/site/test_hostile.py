"""Hostile files on the pages, in each engine: a message or a picture, and no crash.

Each engine stays the same process throughout, and a page of Chromium is the same for all sites of a
form, so that one that ends or hangs fails the tests after.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
from browser import HURRY, Visitor, hurried, new_page, visiting_in
from engines import PACKAGES, visiting_by

from ptmtools.folder_kinds import folder_kinds
from ptmtools.site.content import Site
from ptmtools.site.forms import form_site

from .hostile import hostile

#: Sites of each form in Chromium; campuses, and sites in other engines. PTM_HOSTILE: of all.
COUNT, FEWER = 20, 8
#: Of each form: what follows the address of its page.
PLACES = {"walk": "", "apo.json": "#40,20,0.55", "interlace.json": "?all", "campus.json": ""}
#: When a sound one is there; of a campus, in low detail.
THERE = dict.fromkeys(PLACES, "s.complete") | {"campus.json": "s.begun"}
#: Whether the page says something: a message, a notice, or an error of a walk.
SAYS = """
!document.querySelector("#error").hidden || document.querySelector("#notices p") ||
window.ptm?.errors?.length > 0
"""
#: The codes of the message and of errors of a walk; a notice has none.
ANSWER = """
[document.querySelector("#error-code").textContent,
  ...(window.ptm?.errors ?? []).map(({ code }) => code),
  document.querySelector("#notices p") && "notice"].filter(Boolean)
"""


@pytest.fixture(scope="module")
def sites(statue: Path, pictures: dict[str, Path], campus: Path, statues: Site) -> dict[str, Site]:
    """A sound one of each form."""
    folders = {"apo.json": statue, "interlace.json": pictures["rgb-png"], "campus.json": campus}
    return {"walk": statues} | {
        name: form_site(f, folder_kinds()[name]) for name, f in folders.items()
    }


@pytest.mark.parametrize("form", PLACES)
@pytest.mark.parametrize("engine", ["chromium", *PACKAGES])
def test_a_message_or_a_picture(
    request: pytest.FixtureRequest, sites: dict[str, Site], engine: str, form: str
) -> None:
    opened = opening(request, engine)
    answers = []
    many = engine == "chromium" and form != "campus.json"
    count = int(os.environ.get("PTM_HOSTILE") or (COUNT if many else FEWER))
    with opened(sites[form].entries, PLACES[form]) as visitor:
        visitor.until(f"{SAYS.strip()} || {THERE[form]}")
        assert visitor.page.evaluate(ANSWER) == []
    for seed in range(count):
        with opened(hostile(sites[form], seed), PLACES[form]) as visitor:
            visitor.until(f"{SAYS.strip()} || {THERE[form]}")
            answers.append(visitor.page.evaluate(ANSWER))
        assert set(answers[-1]) <= {"PTM-V103", "PTM-V105", "PTM-V107", "notice"}, seed
        own = [said for said in visitor.messages if "Failed to load resource" not in said]
        assert not [said for said in own if said.startswith("error: ")], seed
    # Each of eight sites may be damaged where it shows, not each of twenty.
    assert count // 4 < sum(map(bool, answers))
    assert count <= FEWER or not all(answers)


def opening(
    request: pytest.FixtureRequest, engine: str
) -> Callable[..., AbstractContextManager[Visitor]]:
    """What opens a site in an engine."""
    if engine == "chromium":
        own = new_page(request.getfixturevalue("chromium"), 160, 120, hurried)
        request.addfinalizer(own.context.close)
        return lambda entries, query: visiting_in(own, entries, query=query)
    page, sizes = request.getfixturevalue("engines")(engine), {"width": 512, "height": 384}
    return lambda entries, query: visiting_by(page, entries, query=query, prepare=HURRY, **sizes)
