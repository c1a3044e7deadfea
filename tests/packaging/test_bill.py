"""The software bill of materials."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from ptmtools.version import __version__
from release import bill as bill_module
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


def test_it_never_names_the_version_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["bill.py", "-o", str(tmp_path)])
    bill_module.main()
    (file,) = tmp_path.glob(f"ptmtools-{__version__}.cdx.json")
    root = json.loads(file.read_text("utf-8"))["metadata"]["component"]
    assert root["version"] == __version__
    monkeypatch.setattr(bill_module, "__version__", "999.0")
    with pytest.raises(SystemExit, match=r"is installed, but .* has 999\.0; .*pip install"):
        bill_module.main()
    assert [*tmp_path.iterdir()] == [file]


def test_a_new_version_is_installed_before_the_bill_is_written() -> None:
    # The rule of make, as if the file of the version had just changed and nothing else.
    older = [f"--assume-old={name}" for name in (".venv/.made", "pyproject.toml")]
    command = ["make", "--dry-run", *older, "--what-if=ptmtools/version.py", "dist"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    install, _, bill = done.stdout.partition("release/bill.py")
    assert "pip --disable-pip-version-check --quiet install --editable" in install
    assert bill
