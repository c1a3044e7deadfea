"""The documentation and the program have the same codes, options and tables; links resolve."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import re
import sys
from pathlib import Path

import click
import pytest

from ptmtools.cli.main import ptm
from ptmtools.diagnostics import CODES, FOLDER_CODES

ROOT = Path(__file__).resolve().parents[2]
DOCS = sorted(ROOT.glob("docs/**/*.md"))
PAGES = [
    *DOCS,
    *(
        page
        for folder in ("", "benchmarks/", "sample_data/", "web/*/")
        for page in sorted(ROOT.glob(f"{folder}*.md"))
    ),
]
FENCED = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
#: `[text](target)` and `![text](target)`, also over a line's end.
LINK = re.compile(r"\]\(([^()\s]+)\)")
#: A page or a picture that a file of the code names.
NAMED_PAGE = re.compile(r"\b(docs/[\w/-]+\.(?:md|png|jpg))(#[\w-]+)?")
#: A file or a folder of the project.
TOPS = (
    "ptmtools",
    "ptmtools_lab",
    "ptmtools_systems",
    "web",
    "tests",
    "benchmarks",
    "release",
    "sample_data",
)
NAMED_FILE = re.compile(rf"(?<![\w/.])((?:{'|'.join(TOPS)})/[\w./-]*[\w/])")
SOURCES = {".py", ".js", ".mjs", ".c", ".h", ".json", ".md"}
#: Code in a line, and a line of code.
CODE = re.compile(r"`([^`\n]+)`|^ {4,}(\S.*)$", re.MULTILINE)
OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*")
#: "PTM-L104", and what may follow: ", L102", " and I255", " to N213".
FIRST = re.compile(r"PTM-([A-Z])(\d{3})\b")
NEXT = re.compile(r"(,? and |, | to )(?:PTM-)?([A-Z]?)(\d{3})\b")


def documented() -> tuple[set[str], set[str]]:
    """Codes that are named, and those that stand between two of them."""
    named, between = set(), set()
    for file in (*DOCS, ROOT / "README.md"):
        text = file.read_text("utf-8")
        for first in FIRST.finditer(text):
            letter, last = first[1], int(first[2])
            named.add(f"PTM-{letter}{last:03}")
            at = first.end()
            while following := NEXT.match(text, at):
                number = int(following[3])
                named.add(f"PTM-{following[2] or letter}{following[3]}")
                if following[1] == " to ":
                    between |= {f"PTM-{letter}{n:03}" for n in range(last, number)}
                last, at = number, following.end()
    return named, between


def all_codes() -> set[str]:
    """Codes that the program can give."""
    return {
        f"PTM-{letter}{number}"
        for file in (*ROOT.glob("ptmtools*/**/*.py"), *ROOT.glob("web/**/*.js"))
        for letter, number in FIRST.findall(file.read_text("utf-8"))
    }


def test_every_code_is_documented() -> None:
    named, between = documented()
    assert sorted(all_codes() - named - between) == []


def test_every_documented_code_exists() -> None:
    named, _ = documented()
    strict = {code.replace("-N", "-I") for code in all_codes()}
    assert sorted(named - all_codes() - strict) == []


def test_retired_codes_are_not_used() -> None:
    text = (ROOT / "docs/formats/codes.md").read_text("utf-8")
    rows = re.findall(
        r"^\| (PTM-[A-Z]\d{3}) \| (.*) \|$", text.partition("## Retired codes")[2], re.M
    )
    kept = [code for code, _ in rows]
    retired = [f"PTM-{code}" for _, codes in rows for code in codes.split(", ")]
    assert len({*kept, *retired}) == len(kept) + len(retired) > 200
    assert sorted(all_codes() & {*retired}) == []
    assert sorted({*kept} - all_codes()) == []


def test_findings_are_documented() -> None:
    text = (ROOT / "docs/formats/codes.md").read_text("utf-8")
    rows = re.findall(r"^\| (PTM-D\d+) \| (\w+) \| (.*) \|$", text, re.M)
    tables = CODES, FOLDER_CODES
    assert rows == [(code, *table[code]) for table in tables for code in sorted(table)]
    assert all(CODES[code] == FOLDER_CODES[code] for code in CODES.keys() & FOLDER_CODES.keys())


def anchors(page: Path) -> set[str]:
    """What a link may name in a page: its headings, as GitHub calls them, and explicit ids."""
    text = FENCED.sub("", page.read_text("utf-8"))
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    named = re.findall(r'<a id="([^"]+)">', text)
    return {re.sub(r"[^\w\- ]", "", h).strip().lower().replace(" ", "-") for h in headings} | {
        *named
    }


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_resolve(page: Path) -> None:
    for target in LINK.findall(FENCED.sub("", page.read_text("utf-8"))):
        if "://" in target:
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        assert file.is_file(), target
        assert not anchor or anchor in anchors(file), target


def test_pages_that_the_code_names_exist() -> None:
    files = [f for top in TOPS for f in (ROOT / top).rglob("*") if f.suffix in SOURCES]
    missing = []
    for file in [*files, ROOT / "Makefile"]:
        if "node_modules" in file.parts:
            continue
        for name, anchor in NAMED_PAGE.findall(file.read_text("utf-8")):
            page = ROOT / name
            if not page.is_file() or (anchor and anchor[1:] not in anchors(page)):
                missing.append((str(file.relative_to(ROOT)), name + anchor))
    assert missing == []


def test_files_that_the_pages_name_exist() -> None:
    pages = [*DOCS, ROOT / "README.md"]
    named = {(p.name, n) for p in pages for n in NAMED_FILE.findall(p.read_text("utf-8"))}
    assert sorted((page, name) for page, name in named if not (ROOT / name).exists()) == []


def options_of_scripts() -> set[str]:
    """The options of everything that is no `ptm` command: benchmarks and sample data."""
    scripts = [*ROOT.glob("benchmarks/**/*.py"), *ROOT.glob("sample_data/**/*.py")]
    return {o for s in scripts for o in re.findall(r'"(--[a-z-]+)"', s.read_text("utf-8"))}


def options_of(command: click.Command) -> set[str]:
    """The options of a command, and of those within a group."""
    context = click.Context(command)
    names = command.list_commands(context) if isinstance(command, click.Group) else []
    inner = [command.get_command(context, name) for name in names]  # type: ignore[attr-defined]
    return {o for p in command.params for o in (*p.opts, *p.secondary_opts)}.union(
        *(options_of(child) for child in inner if child)
    )


def options_of_commands() -> dict[str, set[str]]:
    """The options of each `ptm` command, and of `ptm` itself under "--help"."""
    context = click.Context(ptm)
    commands = {name: ptm.get_command(context, name) for name in ptm.list_commands(context)}
    known = {name: options_of(command) for name, command in commands.items() if command}
    ptm_options = {o for p in ptm.params for o in (*p.opts, *p.secondary_opts)}
    return {
        name: {"--help"} | options for name, options in [*known.items(), ("--help", ptm_options)]
    }


#: Others speak of commands that were, or that somebody may add.
@pytest.mark.parametrize(
    "page",
    [p for p in PAGES if p.parent != ROOT or p.stem == "README"],
    ids=lambda page: str(page.relative_to(ROOT)),
)
def test_options_exist(page: Path) -> None:
    commands, scripts = options_of_commands(), options_of_scripts()
    every = scripts.union(*commands.values())
    unknown = []
    for inline, line in CODE.findall(FENCED.sub("", page.read_text("utf-8"))):
        words = (inline or line).split()
        if words[0] == "ptm" and words[1:] and re.match("[a-z]", words[1]):
            known = commands[words[1]]  # KeyError: there is no such command
        elif words[0] == "ptm" or (inline and words[0].startswith("-")):
            known = every
        else:  # of another program, or none
            continue
        unknown += [(o, " ".join(words)) for o in OPTION.findall(" ".join(words)) if o not in known]
    assert unknown == []


def test_tables_are_known_and_made_by_scripts_that_exist() -> None:
    sys.path.insert(0, str(ROOT / "benchmarks"))
    tables = importlib.import_module("docs_tables")
    standing = [name for page in PAGES for name in tables.tables_of(page)]
    assert sorted(standing) == sorted(tables.TABLES)
    for table in tables.TABLES.values():
        assert (ROOT / table.command.split()[0]).is_file()


def test_messages_are_those_of_the_program() -> None:
    """Runs of six words or more, in the notes and errors that pages show, stand in the source."""
    printed = "\n".join(
        node.value
        for file in ROOT.glob("ptmtools*/**/*.py")
        for node in ast.walk(ast.parse(file.read_text("utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )
    unknown = []
    for page in PAGES:
        for note in re.findall(r"^ {4}(?:note|ptm): (.*)", page.read_text("utf-8"), re.MULTILINE):
            runs = re.findall(r"[a-z]+(?: [a-z]+){5,}", note)
            unknown += [(page.name, run) for run in runs if run not in printed]
    assert unknown == []


def test_names_that_examples_import_exist() -> None:
    missing = []
    for page in PAGES:
        for block in re.findall(r"^```python\n(.*?)^```", page.read_text("utf-8"), re.M | re.S):
            if "from ptmtools" not in block:  # a row of a table
                continue
            for node in ast.parse(block).body:
                if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("ptmtools"):
                    module = importlib.import_module(str(node.module))
                    for name in (alias.name for alias in node.names):
                        if not (hasattr(module, name) or _is_module(f"{node.module}.{name}")):
                            missing.append((page.name, f"{node.module}.{name}"))
    assert missing == []


def _is_module(name: str) -> bool:
    return importlib.util.find_spec(name) is not None
