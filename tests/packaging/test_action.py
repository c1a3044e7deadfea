"""The action that builds and publishes a walk, by its own shell steps."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import yaml

from tests.conftest import ROOT

ACTION = ROOT / ".github/actions/publish-walk/action.yml"


def test_it_writes_a_site(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "sample_data/two_rooms", tmp_path / "model")
    action = yaml.safe_load(ACTION.read_text("utf-8"))
    inputs = {name: str(row.get("default", "")) for name, row in action["inputs"].items()}
    inputs |= {"model": "model/two_rooms.obj", "title": "A & B", "install": "false"}
    inputs["options"] = "--samples 1 --light none -j 1"
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    steps = [step for step in action["runs"]["steps"] if "if" not in step]
    assert steps
    for step in steps:
        own = {
            name: re.sub(r"\$\{\{ inputs\.(\w+) \}\}", lambda match: inputs[match[1]], value)
            for name, value in step.get("env", {}).items()
        }
        assert "${{" not in step["run"], "texts of users reach the shell as variables only"
        command = ["bash", "-e", "-o", "pipefail", "-c", step["run"]]
        env = {**os.environ, **own, "PATH": path}
        subprocess.run(command, cwd=tmp_path, env=env, check=True, capture_output=True)
    assert "<title>A &amp; B</title>" in (tmp_path / "site/index.html").read_text("utf-8")
