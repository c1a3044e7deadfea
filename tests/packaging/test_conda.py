"""The recipe of the conda package says what pyproject.toml says."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from ptmtools.version import __version__

ROOT = Path(__file__).resolve().parents[2]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))


@pytest.fixture(scope="module")
def recipe() -> dict[str, Any]:
    loaded: dict[str, Any] = yaml.safe_load((ROOT / "release/conda/recipe.yaml").read_text("utf-8"))
    return loaded


def conda(requirements: list[str]) -> set[str]:
    """Requirements of pip as conda writes them; names are in lower case there."""
    return {re.sub(r"^([\w.-]+)(?=[<>=])", r"\1 ", each).lower() for each in requirements}


def test_version_and_description(recipe: dict[str, Any]) -> None:
    project = PROJECT["project"]
    assert recipe["context"]["version"] == __version__
    assert recipe["package"] == {"name": project["name"], "version": "${{ version }}"}
    assert recipe["about"]["summary"] == project["description"]
    assert recipe["about"]["license"] == project["license"]
    assert (ROOT / recipe["about"]["license_file"]).is_file()
    assert (ROOT / "release/conda" / recipe["source"]["path"]).resolve() == ROOT


def test_commands_and_requirements(recipe: dict[str, Any]) -> None:
    project = PROJECT["project"]
    python = f"python {project['requires-python']}"
    scripts = [f"{name} = {place}" for name, place in project["scripts"].items()]
    assert recipe["build"]["python"]["entry_points"] == scripts
    # One with a marker is left out where it has no wheel: xatlas, without which there is no light.
    everywhere = [each for each in project["dependencies"] if ";" not in each]
    assert {*recipe["requirements"]["run"]} == {python, *conda(everywhere)}
    build = conda(PROJECT["build-system"]["requires"])
    assert {*recipe["requirements"]["host"]} == {python, "pip", *build}


def test_the_citation_has_the_version_and_the_licence() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == __version__
    assert citation["license"] == "MIT"
    assert citation["cff-version"] == "1.2.0"
    assert [name["family-names"] for name in citation["references"][0]["authors"]] == [
        "Marvie",
        "Bouatouch",
    ]
