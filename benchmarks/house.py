"""The shape of the code: sizes, circles between files, and places that name a stage.

    python benchmarks/house.py [ROOT …]

For each checkout a row for every folder, and then what should stay small. Logical lines are
statements, docstrings not counted, however many physical lines they take.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

TREES = ("ptmtools", "tests", "benchmarks")
#: Names of stages that are not also everyday words of the code.
STAGES = {"scene", "cells", "pvs", "ach", "textures", "emit"}
LONG = 400


@dataclass(frozen=True)
class Module:
    """One file: its lines, its statements, what it imports and how often it names a stage."""

    path: Path
    lines: int
    logical: int
    imports: frozenset[str]
    stage_names: int


def main() -> None:
    for root in [Path(argument) for argument in sys.argv[1:]] or [Path()]:
        report(root)


def report(root: Path) -> None:
    """Prints the figures of one checkout."""
    print(f"{'folder':<28}{'files':>7}{'lines':>9}{'logical':>9}")
    package: list[Module] = []
    for tree in TREES:
        modules = [read(root, file) for file in sorted((root / tree).rglob("*.py"))]
        if tree == "ptmtools":
            package = modules
            rooms = Counter(module.path.relative_to(tree).parts[0] for module in modules)
            for room in sorted(room for room in rooms if not room.endswith(".py")):
                row(
                    f"{tree}/{room}/",
                    [m for m in modules if m.path.is_relative_to(f"{tree}/{room}")],
                )
        row(f"{tree}/", modules)
    long = [module for module in package if module.lines > LONG]
    naming = [module for module in package if module.stage_names]
    print(f"files over {LONG} lines: {len(long)}")
    print(f"folders of one module: {len(lonely(package))}")
    found = circles(package)
    print(f"circles between files: {len(found)}")
    for circle in found:
        print(f"    {', '.join(sorted(circle))}")
    print(f"stage names as strings: {sum(m.stage_names for m in naming)} in {len(naming)} files")


def row(name: str, modules: list[Module]) -> None:
    """Prints the sums over modules."""
    lines, logical = sum(m.lines for m in modules), sum(m.logical for m in modules)
    print(f"{name:<28}{len(modules):>7}{lines:>9,}{logical:>9,}")


def read(root: Path, file: Path) -> Module:
    """Measures one file of a checkout."""
    text = file.read_text()
    tree = ast.parse(text)
    docstrings = {id(doc) for node in ast.walk(tree) if (doc := docstring(node)) is not None}
    logical = sum(
        isinstance(node, ast.stmt) and id(node) not in docstrings for node in ast.walk(tree)
    )
    names = sum(
        isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in STAGES
        for node in ast.walk(tree)
    )
    path = file.relative_to(root)
    return Module(path, text.count("\n"), logical, frozenset(imported(tree, root)), names)


def docstring(node: ast.AST) -> ast.stmt | None:
    """The statement that is the docstring of a module, class or function."""
    if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
        return None
    first = node.body[0] if node.body else None
    is_text = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return first if is_text and isinstance(first.value.value, str) else None  # type: ignore[union-attr]


def imported(tree: ast.AST, root: Path) -> Iterator[str]:
    """The modules of ours that a module imports anywhere, but for those that only types need."""
    skipped = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith("ptmtools"))
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("ptmtools"):
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                place = root / inner.replace(".", "/")
                yield (
                    inner
                    if place.with_suffix(".py").exists() or place.is_dir()
                    else str(node.module)
                )


def lonely(modules: list[Module]) -> list[Path]:
    """Folders that hold one module besides an `__init__` of a line or two."""
    folders = Counter(m.path.parent for m in modules if m.path.name != "__init__.py")
    parents = {m.path.parent.parent for m in modules}
    return [folder for folder, count in folders.items() if count == 1 and folder not in parents]


def circles(modules: list[Module]) -> list[list[str]]:
    """Groups of files that import each other, in however many steps (Tarjan)."""
    named = {".".join(m.path.with_suffix("").parts).removesuffix(".__init__"): m for m in modules}
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        order[name] = low[name] = len(order)
        stack.append(name)
        for other in named[name].imports & named.keys() - {name}:
            if other not in order:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], order[other])
        if low[name] == order[name]:
            circle = [stack.pop()]
            while circle[-1] != name:
                circle.append(stack.pop())
            if len(circle) > 1:
                found.append(circle)

    sys.setrecursionlimit(10_000)
    for name in named:
        if name not in order:
            visit(name)
    return found


if __name__ == "__main__":
    main()
