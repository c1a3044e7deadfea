"""Policies of other packages."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import EntryPoint, EntryPoints

import pytest

from ptmtools import plugins
from ptmtools.errors import MissingComponentError
from ptmtools_lab.policies import POLICIES, named_policies

#: What the entry points of the tests name.
OWN = replace(POLICIES["distance"], name="mine", about="nearest first, by another package")
TAKEN = POLICIES["paper"].with_options(POLICIES["paper"].options)  # type: ignore[arg-type]


@pytest.fixture
def declare(monkeypatch: pytest.MonkeyPatch) -> Iterator[object]:
    """Declares a value of this module as the only policy of other packages."""

    def clear() -> None:
        plugins.points.cache_clear()
        plugins.declarations.cache_clear()

    def put(name: str) -> None:
        clear()
        point = EntryPoint("mine", f"{__name__}:{name}", "ptmtools.policies")
        points = EntryPoints([point])
        monkeypatch.setattr(plugins, "installed_points", lambda: points)

    yield put
    monkeypatch.undo()
    clear()


def test_a_policy_of_another_package_is_in_the_table(declare) -> None:
    declare("OWN")
    assert named_policies() == {**POLICIES, "mine": OWN}


def test_a_taken_name_is_refused(declare) -> None:
    declare("TAKEN")
    with pytest.raises(MissingComponentError, match=r"the policy 'paper', which ptmtools has"):
        named_policies()
