"""The software bill of materials."""

from __future__ import annotations

import json
import tomllib
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from release.bill import bill_of, installed, requirements
from tests.conftest import ROOT


@pytest.fixture(scope="module")
def text() -> str:
    return bill_of(installed("ptmtools"))


@pytest.fixture(scope="module")
def bill(text: str) -> Any:
    return json.loads(text)


def test_it_has_the_form_of_the_standard(text: str) -> None:
    from cyclonedx.schema import SchemaVersion
    from cyclonedx.validation.json import JsonStrictValidator

    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(text) is None


def test_it_lists_every_requirement_with_its_version(bill: Any) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    wanted = {
        canonicalize_name(one.name)
        for one in map(Requirement, project["dependencies"])
        if one.marker is None or one.marker.evaluate()
    }
    listed = {row["name"]: row for row in bill["components"]}
    assert wanted <= listed.keys()
    assert "pytest" not in listed, "an extra"
    for name, row in listed.items():
        assert row["purl"] == f"pkg:pypi/{name}@{row['version']}"


def test_its_graph_is_that_of_the_requirements(bill: Any) -> None:
    graph = {
        row["ref"].partition("==")[0]: row.get("dependsOn", []) for row in bill["dependencies"]
    }
    assert graph.keys() == {"ptmtools", *(row["name"] for row in bill["components"])}
    assert {ref.partition("==")[0] for ref in graph["uvicorn"]} == {"click", "h11"}
    libraries = installed("ptmtools")
    assert {*requirements(libraries["ptmtools"])} == {
        ref.partition("==")[0] for ref in graph["ptmtools"]
    }


def test_licences_are_named(bill: Any) -> None:
    licences = {row["name"]: row["licenses"] for row in bill["components"] if "licenses" in row}
    assert licences["numpy"][0]["expression"].startswith("BSD-3-Clause")
    assert licences["click"] == [{"license": {"id": "BSD-3-Clause"}}]
