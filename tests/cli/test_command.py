"""The command line: generated from the options classes, quick to start, quiet where asked."""

from __future__ import annotations

import ast
import json
import math
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import click
import pytest
from click.testing import CliRunner

import ptmtools
from ptmtools.cli.console import Console
from ptmtools.cli.main import main, ptm
from ptmtools.cli.parameters import Command, options_of, take
from ptmtools.options import arguments, option
from ptmtools.quantities import count, size


@dataclass(frozen=True)
class Base:
    heading: ClassVar[str] = "Shape"

    depth: float = option(1.5, "Depth of it.", metavar="METRES")


@dataclass(frozen=True)
class Options(Base):
    kind: Literal["a", "b"] = option("a", "Kind of it.", basic=True)
    names: tuple[str, ...] = option((), "Names.")
    places: tuple[tuple[float, float, float], ...] = ()
    eye: tuple[float, ...] | None = option(None, "Eye.", numbers=(3, 4))
    angle: float = option(1.0472, "Angle of it.", metavar="DEGREES", degrees=True)
    quick: bool = option(False, "Hurry.")
    tidy: bool = option(True, "Clean up.")
    seed: int | None = None


@pytest.mark.parametrize(
    ("arguments", "wanted"),
    [
        ([], Options()),
        (["--kind", "b", "--depth", "2", "--quick"], Options(2.0, "b", quick=True)),
        (["--names", "x", "--names", "y", "--seed", "7"], Options(names=("x", "y"), seed=7)),
        (["--names", "x", "--no-tidy"], Options(names=("x",), tidy=False)),
        (["--places", "1,2,-3.5"], Options(places=((1.0, 2.0, -3.5),))),
        (["--eye", "1,2,3,90"], Options(eye=(1.0, 2.0, 3.0, 90.0))),
        (["--angle", "90"], Options(angle=math.pi / 2)),
        (["--eye", "1,2"], None),
        (["--angle", "wide"], None),
        (["--kind", "c"], None),
        (["--places", "1,2"], None),
        (["--places", "1,2,x"], None),
    ],
)
def test_options_come_from_the_class(arguments: list[str], wanted: Options | None) -> None:
    actual = []

    @click.command()
    @options_of(Options)
    def command(**values: object) -> None:
        actual.append(take(Options, values))

    result = CliRunner().invoke(command, arguments)
    assert (result.exit_code, actual) == ((0, [wanted]) if wanted else (2, []))


def test_arguments_give_the_same_options_again() -> None:
    given = Options(2.0, "b", ("x", "y"), ((1, 2, 3),), (1, 2, 3, 90), 1.1, True, False, 7)
    taken = []

    @click.command()
    @options_of(Options)
    def command(**values: object) -> None:
        taken.append(take(Options, values))

    assert arguments([Options()]) == []
    words = arguments([given])
    assert CliRunner().invoke(command, words).exit_code == 0
    assert taken == [given]
    for degrees in (1, 33.3, 60, 63, 179):
        angle = math.radians(degrees)
        assert arguments([Options(angle=angle)]) == ["--angle", f"{degrees:g}"]


def test_radians_are_still_read_with_a_note() -> None:
    @click.command()
    @options_of(Options)
    def command(**values: object) -> None:
        click.echo(take(Options, values).angle)

    result = CliRunner().invoke(command, ["--angle", "1.1"])
    assert result.stdout == "1.1\n"
    assert "--angle is in degrees now; 1.1 is read as radians" in result.stderr


def test_help_has_headings_and_levels() -> None:
    @click.command(cls=Command, context_settings={"terminal_width": 90})
    @options_of(Options, layered=True)
    def command(**values: object) -> None: ...

    short = CliRunner().invoke(command, ["--help"]).output
    assert [line for line in short.splitlines() if line.endswith(":")] == ["Shape:", "General:"]
    assert "--kind [a|b]  Kind of it.  [default: a]" in re.sub("  +", "  ", short)
    assert "--depth" not in short
    assert "--help-all shows 8 more options." in short
    whole = re.sub("  +", "  ", CliRunner().invoke(command, ["--help-all"]).output)
    for line in (
        "--depth METRES  Depth of it.  [default: 1.5]",
        "--angle DEGREES  Angle of it.  [default: 60]",
        "--quick  Hurry.",
        "--tidy / --no-tidy  Clean up.",
    ):
        assert line in whole
    assert "--titles" not in whole


def commands(group: click.Group, words: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """The words of every command, those of groups within groups included."""
    for name in group.list_commands(click.Context(group)):
        command = group.get_command(click.Context(group), name)
        if isinstance(command, click.Group):
            yield from commands(command, (*words, name))
        else:
            yield (*words, name)


@pytest.mark.parametrize("words", [*commands(ptm)], ids=" ".join)
def test_every_option_of_every_command_is_explained(words: tuple[str, ...]) -> None:
    command: click.Command | None = ptm
    for word in words:
        assert isinstance(command, click.Group)
        command = command.get_command(click.Context(command), word)
    assert command is not None
    assert command.help
    options = [p for p in command.params if isinstance(p, click.Option)]
    assert options
    assert [o.name for o in options if not o.help] == []
    names = [name for o in options for name in (*o.opts, *o.secondary_opts)]
    assert len(names) == len(set(names))
    assert CliRunner().invoke(ptm, [*words, "--help"], obj=Console()).exit_code == 0


def test_version_and_help_load_nothing_heavy() -> None:
    code = (
        "import sys; from ptmtools.cli.main import main; main(sys.argv[1:]);"
        "print(*{'numpy', 'numba', 'rich', 'PIL', 'trimesh', 'shapely'} & set(sys.modules))"
    )
    for argument in ("--version", "--help"):
        done = subprocess.run(
            [sys.executable, "-c", code, argument], capture_output=True, text=True
        )
        assert done.stdout.splitlines()[0].startswith(("ptm 0.", "Usage: ptm"))
        assert done.stdout.splitlines()[-1] == ""


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, ptmtools; print('numpy' in sys.modules, 'click' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "False False\n"


def test_the_public_names_are_there() -> None:
    for name in ptmtools.__all__:
        assert getattr(ptmtools, name) is not None
    with pytest.raises(AttributeError, match="frobnicate"):
        ptmtools.frobnicate  # noqa: B018


def test_packages_name_the_same_for_type_checkers_and_at_run_time() -> None:
    """The table of `lazy_exports` has the imports ``if TYPE_CHECKING``."""
    root = Path(ptmtools.__file__).parents[1]
    tops = ("ptmtools", "ptmtools_lab", "ptmtools_systems")
    packages = [file for top in tops for file in (root / top).rglob("__init__.py")]
    count = 0
    for package in packages:
        tree = ast.parse(package.read_text("utf-8"))
        tables = [
            ast.literal_eval(node.args[1])
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "lazy_exports"
        ]
        count += len(tables)
        if tables:
            (checked,) = [node for node in tree.body if isinstance(node, ast.If)]
            imports = [node for node in checked.body if isinstance(node, ast.ImportFrom)]
            assert tables[0] == {n.module: " ".join(a.name for a in n.names) for n in imports}
    assert count >= 10


def test_numbers_for_people() -> None:
    assert [size(n) for n in (0, 999, 1000, 97_517_568, 2_000_000_000)] == [
        "0 B",
        "999 B",
        "1.0 kB",
        "97.5 MB",
        "2.0 GB",
    ]
    assert [count(1, "storey"), count(2, "storey"), count(1234, "cell")] == [
        "1 storey",
        "2 storeys",
        "1,234 cells",
    ]


def test_quiet_says_nothing_and_json_is_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from PIL import Image

    Image.new("RGB", (5, 3), (1, 2, 3)).save(tmp_path / "a.png")
    assert main(["-q", "encode", str(tmp_path / "a.png")]) == 0
    assert capsys.readouterr() == ("", "")
    assert main(["encode", str(tmp_path / "a.png"), "--force", "--json"]) == 0
    (report,) = json.loads(capsys.readouterr().out)
    assert (report["raw_bytes"], report["levels"]) == (45, 2)
    assert main(["info", str(tmp_path / "a.ptm"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["width"], report["height"], report["whole_levels"]) == (5, 3, 2)
