"""Completion of the command line: what `ptm` proposes, and that the shells show it."""

from __future__ import annotations

import os
import pty
import re
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from ptmtools.cli.main import ptm

ROOT = Path(__file__).resolve().parents[2]
#: Seconds after which a shell counts as stuck.
STUCK = 60
#: What terminals do not print.
CONTROLS = re.compile(r"\x1b\[[\d;?]*[A-Za-z]|\x00")
#: Shell → its arguments without the user's settings, and the line that docs/guide/cli.md gives.
TERMINALS = {
    "bash": (("--norc", "-i"), 'eval "$(_PTM_COMPLETE=bash_source ptm)"'),
    "zsh": (
        ("-f", "-i"),
        'autoload -Uz compinit; compinit -D; eval "$(_PTM_COMPLETE=zsh_source ptm)"',
    ),
}


def proposed(line: str) -> list[str]:
    """The words that `ptm` proposes for the last one of a line."""
    *words, last = line.split(" ")
    return [item.value for item in ShellComplete(ptm, {}, "ptm", "").get_completions(words, last)]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("build", ["build-scene"]),
        ("warm", []),  # hidden
        ("--ver", ["--version", "--verbose"]),
        ("tour c", ["check"]),
        ("build-scene model.obj --wall-a", ["--wall-area"]),
        ("build-scene --pro", ["--profile"]),
        ("encode --profile s", ["small"]),
        ("emit --format vrml,", ["vrml,gltf", "vrml,interlace"]),
        ("build-scene --up ", ["y", "z"]),
        # Completing a line neither prints nor fetches.
        ("build-scene --help-all --allow", ["--allow-outside"]),
        ("validate --codes --seg", ["--segments"]),
        ("pvs s3://none/none --rep", ["--report"]),
    ],
)
def test_words(line: str, words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert proposed(line) == words
    assert capsys.readouterr().out == ""


def test_names_of_commands_import_none_of_them() -> None:
    code = "import sys, ptmtools.cli.main as m; import click; "
    code += "print(len(m.ptm.shell_complete(click.Context(m.ptm), '')) > 20, "
    code += "'ptmtools.cli.images' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.stdout == "True False\n", done.stderr


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """With this `ptm` in the path, and a home without settings."""
    program = tmp_path / "ptm"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m ptmtools "$@"\n')
    program.chmod(0o755)
    return {
        "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "HOME": str(tmp_path),
        "TERM": "vt100",
        "LANG": "C.UTF-8",
    }


def typed(program: str, shell: str, texts: list[tuple[str, str]], env: dict[str, str]) -> str:
    """What a shell in a terminal prints while texts are typed, each after the one before has
    brought up the expected text."""
    own, other = pty.openpty()
    running = subprocess.Popen(
        [program, *TERMINALS[shell][0]],
        stdin=other,
        stdout=other,
        stderr=other,
        env=env,
        cwd=env["HOME"],
        start_new_session=True,
    )
    os.close(other)
    shown = ""
    try:
        for text, expected in texts:
            os.write(own, text.encode())
            since, until = len(shown), time.monotonic() + STUCK
            while expected not in CONTROLS.sub("", shown[since:]):
                ready, _, _ = select.select([own], [], [], until - time.monotonic())
                assert ready, f"no {expected!r} in {shown[since:]!r}"
                shown += os.read(own, 65536).decode("utf-8", "replace")
    finally:
        running.kill()
        running.wait()
        os.close(own)
    return shown


@pytest.mark.parametrize("shell", TERMINALS)
def test_a_terminal_completes(
    shell: str, environment: dict[str, str], require: Callable[[str, str], None]
) -> None:
    if (program := shutil.which(shell)) is None:
        require(shell, f"apt install {shell}")
    assert program is not None
    start = f"{TERMINALS[shell][1]}; echo rea''dy\n"
    texts = [
        (start, "ready"),
        ("ptm valid\t", "ptm validate"),
        ("\x15ptm build-scene x.obj --wall-a\t", "--wall-area"),
    ]
    typed(program, shell, texts, environment)


def test_fish_completes(
    environment: dict[str, str], tmp_path: Path, require: Callable[[str, str], None]
) -> None:
    if (program := shutil.which("fish")) is None:
        require("fish", "apt install fish")
    assert program is not None
    lines = "_PTM_COMPLETE=fish_source ptm | source; complete -C 'ptm valid'; "
    lines += "complete -C 'ptm build-scene x.obj --wall-a'"
    done = subprocess.run(
        [program, "--no-config", "-c", lines],
        env=environment,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=STUCK,
    )
    assert [line.split("\t")[0] for line in done.stdout.splitlines()] == [
        "validate",
        "--wall-area",
    ], done.stderr


def test_the_guide_has_the_lines() -> None:
    text = (ROOT / "docs/guide/cli.md").read_text("utf-8")
    for shell in ("bash", "zsh", "fish"):
        assert f"_PTM_COMPLETE={shell}_source ptm" in text
