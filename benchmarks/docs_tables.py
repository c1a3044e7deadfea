"""Prints tables into benchmarks/RESULTS.md: ``python benchmarks/docs_tables.py [NAME…]``

A table stands between two lines, ``<!-- table: NAME -->`` and ``<!-- /table -->``. `TABLES` holds
the command that prints it; its output, as Markdown, replaces the old table. Without names the
script prints the exact tables, which are the same on every machine; with ``--timed`` the others,
which need a machine without other work.

``--check`` writes nothing. It runs the quick command of each exact table, which prints the rows
that take a few seconds, and fails if a printed row is not in the page (`make lint`). A table whose
data are missing is skipped with a message; with ``CI=true`` that is an error.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "benchmarks/RESULTS.md"
SHARED = Path(os.environ.get("PTM_SHARED", ROOT.parent / "shared"))
MARKED = re.compile(r"(<!-- table: (\S+) -->\n\n?)(.*?)(\n?<!-- /table -->)", re.DOTALL)


@dataclass(frozen=True)
class Table:
    """The commands that print one table.

    Attributes
    ----------
    command: a script of this project and its arguments; prints the whole table.
    quick: the same for some rows; empty for timings, which are not compared.
    needs: the folder of the shared data that the command reads, or "".
    part: number of the table among those that the command prints, from 0.
    """

    command: str
    quick: str = ""
    needs: str = "scenes"
    part: int = 0


ALL = "museum hospital willowgarage gallery office"
BY_AREA = "benchmarks/cells.py {} --wall-area {}"
TABLES = {
    "scenes": Table("benchmarks/cells.py", "benchmarks/cells.py museum hospital gallery"),
    "joined": Table(
        "benchmarks/cells.py --joined", "benchmarks/cells.py --joined hospital gallery"
    ),
    "wall-area": Table(
        BY_AREA.format("museum hospital willowgarage gallery", "8 4 2 1"),
        BY_AREA.format("gallery", "8 4 2"),
    ),
    "ptm-bytes": Table(
        "benchmarks/codec/sizes.py --bytes raw fast small",
        "benchmarks/codec/sizes.py --bytes raw fast",
        "textures",
    ),
    "rooms": Table("benchmarks/rooms.py museum hospital willowgarage"),
    "sizes-of-cells": Table("benchmarks/pvs_trade.py"),
    "methods": Table("benchmarks/pvs_trade.py", part=1),
    "near-ties": Table(f"benchmarks/budget.py {ALL} --budgets", part=1),
    "near-ties-fine": Table(
        "benchmarks/budget.py museum hospital willowgarage gallery --wall-area 0.25 --budgets",
        part=1,
    ),
    "budgets": Table("benchmarks/budget.py museum hospital willowgarage gallery"),
    "budgets-fine": Table("benchmarks/budget.py museum hospital gallery --wall-area 0.25"),
    **{
        f"hints-{part}": Table("benchmarks/ach.py", part=k)
        for k, part in ((0, "presets"), (2, "tolerance"))
    },
    "starting": Table("benchmarks/codec/startup.py --only encode build", needs="textures"),
    "page": Table("benchmarks/page_weight.py", "benchmarks/page_weight.py", needs=""),
}


@cache
def printed(command: str) -> list[list[str]]:
    """The tables that a command prints, as lines."""
    arguments = [sys.executable, *command.split()]
    done = subprocess.run(arguments, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    lines = done.stdout.splitlines()
    return [list(rows) for table, rows in groupby(lines, lambda s: s.startswith("|")) if table]


def tables_of(page: Path) -> dict[str, list[str]]:
    """The tables that stand in a page, by name, as lines."""
    return {name: body.splitlines() for _, name, body, _ in MARKED.findall(page.read_text("utf-8"))}


def changed(name: str) -> list[str]:
    """Rows that the quick command prints and that are not in the page."""
    table, standing = TABLES[name], tables_of(RESULTS)[name]
    return [line for line in printed(table.quick)[table.part] if line not in standing]


def write(name: str) -> None:
    """Replaces a table of the page by the output of its command."""
    lines = "\n".join(printed(TABLES[name].command)[TABLES[name].part])

    def replacement(match: re.Match[str]) -> str:
        if match[2] != name:
            return match[0]
        return f"<!-- table: {name} -->\n\n{lines}\n\n<!-- /table -->"

    RESULTS.write_text(MARKED.sub(replacement, RESULTS.read_text("utf-8")), "utf-8")


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("names", nargs="*", help=f"of {', '.join(TABLES)}")
    parser.add_argument("--timed", action="store_true", help="those that have timings")
    parser.add_argument("--check", action="store_true", help="write nothing; compare exact rows")
    given = parser.parse_args()
    failed = False
    for name in tables_of(RESULTS):
        timed = not TABLES[name].quick
        if name not in given.names if given.names else timed != given.timed:
            continue
        if timed and given.check:
            continue
        data = SHARED / TABLES[name].needs
        if TABLES[name].needs and not data.is_dir():
            print(f"table {name}: skipped, there is no {data}")
            failed |= os.environ.get("CI", "").lower() == "true"
        elif given.check:
            for line in changed(name):
                print(f"table {name}: the command now prints: {line}")
                failed = True
        else:
            print(f"table {name} …", flush=True)
            write(name)
    if failed:
        print("benchmarks/RESULTS.md is out of date; run: make docs-tables")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
