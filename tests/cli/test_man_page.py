"""The manual page has every command and option, and the programs that show it accept it."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import click
import pytest

from ptmtools.cli.main import ptm
from release.man_page import ManFormatter, man_page


@pytest.fixture(scope="module")
def page() -> str:
    return man_page()


def test_every_command_and_option_is_there(page: str) -> None:
    sections = dict(re.findall(r"^\.SH (ptm .*)\n((?:(?!\.SH).*\n)*)", page, re.MULTILINE))
    context = click.Context(ptm)
    below = set()
    for name in ptm.list_commands(context):
        command = ptm.get_command(context, name)
        assert command is not None
        text = sections.pop(f"ptm {name}".replace("-", r"\-"), "")
        assert bool(text) != (name == "warm-up"), name
        for option in command.params:
            if isinstance(option, click.Option) and not option.hidden and name != "warm-up":
                assert option.opts[0].replace("-", r"\-") in text, (name, option.opts)
        if isinstance(command, click.Group):
            names = command.list_commands(click.Context(command))
            below |= {f"ptm {name} {child}".replace("-", r"\-") for child in names}
    assert {r"ptm tour init", r"ptm tour check", r"ptm sample museum"} <= below
    assert {*sections} == below


def test_texts_are_no_macros() -> None:
    formatter = ManFormatter()
    formatter.write_text(".ptm files, 'x' and a \\ in `a-b`\n\n'x'")
    assert formatter.getvalue() == (
        ".PP\n\\&.ptm files, 'x' and a \\e in \\fBa\\-b\\fR\n.PP\n\\&'x'\n"
    )


def test_man_and_mandoc_read_it(
    page: str, tmp_path: Path, require: Callable[[str, str], None]
) -> None:
    file = tmp_path / "ptm.1"
    file.write_text(page, "utf-8")
    programs = {
        "mandoc": ["mandoc", "-Tlint", "-Werror", str(file)],
        "man": ["man", "--warnings", "--local-file", "--encoding=UTF-8", str(file)],
    }
    for program, words in programs.items():
        if shutil.which(program) is None:
            require(program, f"apt install {'man-db' if program == 'man' else program}")
        done = subprocess.run(words, capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stderr) == (0, ""), program
