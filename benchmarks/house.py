"""Measures the code of checkouts, and holds it to limits: sizes, imports, names.

    python benchmarks/house.py [ROOT …]      figures of each checkout beside each other, as Markdown
    python benchmarks/house.py --list        where the figures come from: names and their places
    python benchmarks/house.py --check       exit 1 if a limit is passed, and name the place
    python benchmarks/house.py --shrink      drop exceptions that no longer apply, then check

`--check` holds the packages to these rules:

- **Imports** go down only. The product imports none of the packages beside it, other systems do not
  import the laboratory, nothing outside a command line imports one, and the folders of a package
  form no circle. Imports for types, in functions and as text count.
- **Sizes**: a package or folder grows only in a commit that changes its row in `BUDGET`.
- **Class names** mean one thing in all packages.
- **Locals** name a quantity: `BANNED` of `benchmarks/codebase/names.py` do not.
- **Functions** are verbs, or nouns of their results: the number of participles and prepositions
  stays within `NAMES`.

`house_exceptions.txt` lists what broke a rule before the rule was there. It only shrinks: a line
that no longer applies is an error, too.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.codebase.graphs import circles, graph_of_children
from benchmarks.codebase.names import (
    banned_locals,
    function_names,
    is_participle,
    is_preposition,
    repeated_classes,
)
from benchmarks.codebase.report import print_places, print_report
from benchmarks.codebase.sources import PythonFile, read_imports, read_packages

#: Lines and files. Aim: `ptmtools` 58,000 lines in 290 files, all packages 78,000 lines.
BUDGET: dict[str, tuple[int, int]] = {
    "ptmtools": (72_740, 351),
    "ptmtools/*.py": (4_170, 26),
    "ptmtools/cells": (8_975, 29),
    "ptmtools/cli": (3_095, 15),
    "ptmtools/coverage": (2_566, 15),
    "ptmtools/light": (3_445, 15),
    "ptmtools/meshopt": (867, 5),
    "ptmtools/output": (8_130, 39),
    "ptmtools/pipeline": (4_008, 20),
    "ptmtools/portal_flow": (1_675, 8),
    "ptmtools/rendering": (2_047, 13),
    "ptmtools/scene": (11_921, 60),
    "ptmtools/schemas": (340, 1),
    "ptmtools/simplification": (1_950, 9),
    "ptmtools/site": (4_747, 25),
    "ptmtools/store": (2_230, 13),
    "ptmtools/texture": (10_293, 44),
    "ptmtools/tour": (1_340, 8),
    "ptmtools/visibility": (960, 6),
    "ptmtools_lab": (11_662, 51),
    "ptmtools_samples": (8_740, 58),
    "ptmtools_systems": (8_070, 52),
}
#: Functions of a package that are named by a participle, and by a preposition.
NAMES: dict[str, tuple[int, int]] = {
    "ptmtools": (12, 6),
    "ptmtools_systems": (3, 0),
    "ptmtools_lab": (4, 2),
    "ptmtools_samples": (0, 0),
}
#: What each package must not import.
FORBIDDEN: dict[str, set[str]] = {
    "ptmtools": {"ptmtools_systems", "ptmtools_lab", "ptmtools_samples"},
    "ptmtools_systems": {"ptmtools_lab", "ptmtools_samples"},
    "ptmtools_lab": {"ptmtools_samples"},
    "ptmtools_samples": {"ptmtools_systems", "ptmtools_lab"},
}
EXCEPTIONS = "house_exceptions.txt"

Packages = dict[str, list[PythonFile]]


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("roots", nargs="*", type=Path, default=[Path()], metavar="ROOT")
    action = parser.add_mutually_exclusive_group()
    action.add_argument("--list", action="store_true", help="print names and places")
    action.add_argument("--check", action="store_true", help="only check the limits")
    action.add_argument("--shrink", action="store_true", help="drop stale exceptions, then check")
    arguments = parser.parse_args()
    if arguments.list:
        for root in arguments.roots:
            print_places(root)
        return 0
    if not (arguments.check or arguments.shrink):
        print_report(arguments.roots)
        return 0
    (root,) = arguments.roots
    path = root / "benchmarks" / EXCEPTIONS
    exceptions = path.read_text("utf-8").splitlines()
    faults, stale = check(read_packages(root), exceptions)
    if stale and arguments.shrink:
        exceptions = [line for line in exceptions if line not in stale]
        path.write_text("".join(f"{line}\n" for line in exceptions), "utf-8")
        stale = []
    faults += [f"{path}: no longer needed, remove it: {line}" for line in stale]
    print("\n".join(faults) or "Imports, sizes and names are within their limits.")
    return int(bool(faults))


def check(
    packages: Packages,
    exceptions: Iterable[str] = (),
    budget: dict[str, tuple[int, int]] = BUDGET,
    ceilings: dict[str, tuple[int, int]] = NAMES,
) -> tuple[list[str], list[str]]:
    """A line for each broken rule, and the exceptions that no longer apply."""
    breaches: dict[str, str] = {}
    rules = import_faults, circle_faults, name_faults
    for exception, fault in (pair for rule in rules for pair in rule(packages)):
        breaches[exception] = f"{breaches[exception]}\n{fault}" if exception in breaches else fault
    known = {line for line in exceptions if line and not line.startswith("#")}
    faults = [fault for exception, fault in breaches.items() if exception not in known]
    faults += size_faults(packages, budget)
    faults += ceiling_faults(packages, ceilings)
    return faults, sorted(known - breaches.keys())


def import_faults(packages: Packages) -> Iterator[tuple[str, str]]:
    """Forbidden imports: the line that excepts each, and its message."""
    imports = read_imports(packages)
    for package, files in packages.items():
        for file in files:
            for target in sorted(imports[file.name].any):
                goal = target.split(".")[0]
                if goal in FORBIDDEN[package]:
                    rule = f"{package} must not import {goal}"
                elif target.split(".")[1:2] == ["cli"] and not may_import_commands(file, goal):
                    rule = "only commands and entry points import a command line"
                else:
                    continue
                yield f"import {file.path} {goal}", f"{file.path} imports {target}: {rule}"


def may_import_commands(file: PythonFile, package: str) -> bool:
    """Whether a file is a part of a command line, or names the commands of its package."""
    inside = file.name.split(".")[1:2]
    return inside == ["cli"] or (file.package == package and inside in (["__main__"], ["entries"]))


def circle_faults(packages: Packages) -> Iterator[tuple[str, str]]:
    """Circles between the folders and single files of a package."""
    imports = read_imports(packages)
    for files in packages.values():
        for ring in circles(graph_of_children(files, imports)):
            members = " ".join(ring)
            yield f"circle {members}", f"folders that import each other: {members}"


def name_faults(packages: Packages) -> Iterator[tuple[str, str]]:
    """Repeated classes and banned locals: the line that excepts each, and its message."""
    files = [file for members in packages.values() for file in members]
    for name, places in repeated_classes(files).items():
        yield f"class {name}", f"class {name} is defined more than once: {', '.join(places)}"
    for file in files:
        for line, name in banned_locals(file):
            yield f"locals {file.path}", f"{file.path}:{line}: name the quantity, not `{name}`"


def size_faults(packages: Packages, budget: dict[str, tuple[int, int]]) -> list[str]:
    """A message for each package or folder that has no row, or is larger than its row."""
    sizes = measure_sizes(packages)
    faults = [f"{name} has no row in BUDGET" for name in sizes.keys() - budget.keys()]
    faults += [
        f"BUDGET has a row of {name}, which is gone" for name in budget.keys() - sizes.keys()
    ]
    for name in sizes.keys() & budget.keys():
        for amount, limit, unit in zip(sizes[name], budget[name], ("lines", "files"), strict=True):
            if amount > limit:
                faults.append(
                    f"{name} has {amount:,} {unit}, {amount - limit:,} more than its row in BUDGET:"
                    " remove code, or change the row and say why in the commit"
                )
    return sorted(faults)


def measure_sizes(packages: Packages) -> dict[str, tuple[int, int]]:
    """Lines and files of each package, and of the folders of the product."""
    groups: dict[str, list[PythonFile]] = {}
    for package, files in packages.items():
        groups[package] = files
        if package == "ptmtools":
            for file in files:
                groups.setdefault(file.folder, []).append(file)
    return {name: (sum(f.lines for f in files), len(files)) for name, files in groups.items()}


def ceiling_faults(packages: Packages, ceilings: dict[str, tuple[int, int]]) -> list[str]:
    """A message for each package with more participles or prepositions than it may have."""
    faults = []
    for package, counts in count_names(packages).items():
        limits = ceilings.get(package, (0, 0))
        for count, limit, kind in zip(counts, limits, ("participle", "preposition"), strict=True):
            if count > limit:
                faults.append(
                    f"{package}: {count} functions are named by a {kind}, {limit} are allowed;"
                    " name them by a verb or by their result (--list shows all)"
                )
    return faults


def count_names(packages: Packages) -> dict[str, tuple[int, int]]:
    """Functions of each package that are named by a participle, and by a preposition."""
    names = {package: list(function_names(files)) for package, files in packages.items()}
    return {
        package: (sum(map(is_participle, functions)), sum(map(is_preposition, functions)))
        for package, functions in names.items()
    }


if __name__ == "__main__":
    sys.exit(main())
