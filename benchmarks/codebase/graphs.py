"""Circles and orders in the graph of imports."""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterable, Mapping, Set

from benchmarks.codebase.sources import Imports, PythonFile

Graph = Mapping[str, Set[str]]


def child_of(module: str) -> str:
    """The folder or file directly below its package in which a module stands."""
    return ".".join(module.split(".")[:2])


def graph_of_children(files: Iterable[PythonFile], imports: Mapping[str, Imports]) -> Graph:
    """The folders and single files of one package, and those that each imports."""
    graph: dict[str, set[str]] = defaultdict(set)
    for file in files:
        inside = {t for t in imports[file.name].any if t.startswith(f"{file.package}.")}
        child = child_of(file.name)
        graph[child] |= {child_of(target) for target in inside} - {child}
    return dict(graph)


def circles(graph: Graph) -> list[list[str]]:
    """Groups of names that import each other, in however many steps (Tarjan 1972)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    rings: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for target in sorted(graph[name] & graph.keys()):
            if target not in index:
                visit(target)
                low[name] = min(low[name], low[target])
            elif target in stack:
                low[name] = min(low[name], index[target])
        if low[name] == index[name]:
            start = stack.index(name)
            ring = sorted(stack[start:])
            del stack[start:]
            if len(ring) > 1:
                rings.append(ring)

    sys.setrecursionlimit(10_000)
    for name in graph:
        if name not in index:
            visit(name)
    return rings


def crumbs(files: Iterable[PythonFile], imports: Mapping[str, Imports], lines: int) -> list[str]:
    """Modules of fewer than ``lines`` lines that one file alone imports."""
    importers: dict[str, int] = defaultdict(int)
    for module in imports.values():
        for target in module.any:
            importers[target] += 1
    return sorted(
        file.name
        for file in files
        if file.lines < lines
        and importers[file.name] == 1
        and file.path.name not in ("__init__.py", "__main__.py")
    )
