"""Prints the figures of checkouts as one table of Markdown, and the places behind them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from benchmarks.codebase.graphs import circles, crumbs, graph_of_children
from benchmarks.codebase.names import (
    banned_locals,
    function_length,
    is_participle,
    is_preposition,
    kernels,
    parameter_count,
    repeated_classes,
)
from benchmarks.codebase.sources import (
    PACKAGES,
    PythonFile,
    list_files,
    read_imports,
    read_packages,
    read_tree,
)
from benchmarks.codebase.walks import follow

LONG_FUNCTION, LONG_FILE, CRUMB, MANY_PARAMETERS = 60, 500, 100, 8
WEB = {".js", ".mjs", ".ts", ".css", ".html", ".c", ".h"}
#: Functions, and the parameter of each whose way is followed.
WALKS = (("subdivide", "scene"), ("ingest", "options"), ("emit", "scene"), ("publish", "options"))

Packages = dict[str, list[PythonFile]]


def print_report(roots: Sequence[Path]) -> None:
    """Prints a table with a column for each checkout; rows in the order of the last one."""
    columns = [measure(root) for root in roots]
    names = list(dict.fromkeys(name for column in reversed(columns) for name in column))
    print("| |", " | ".join(root.resolve().name for root in roots), "|")
    print("|---" * (len(roots) + 1) + "|")
    for name in names:
        print(f"| {name} |", " | ".join(column.get(name, "–") for column in columns), "|")


def print_places(root: Path) -> None:
    """Prints what the figures of one checkout count."""
    for title, places in find_places(read_packages(root)).items():
        print(f"\n{title}: {len(places)}")
        for place in places:
            print(f"    {place}")


def measure(root: Path) -> dict[str, str]:
    """The figures of one checkout, by name."""
    packages = read_packages(root)
    everything = [file for files in packages.values() for file in files]
    result = {"**files, lines, statements**": ""}
    for package, files in packages.items():
        folders: dict[str, list[PythonFile]] = {}
        for file in files:
            folders.setdefault(file.folder, []).append(file)
        result |= {name: sizes(group) for name, group in sorted(folders.items())}
        result[f"**{package}**"] = sizes(files)
    result["**all packages**"] = sizes(everything)
    for tree in ("tests", "benchmarks", "sample_data"):
        files = [
            file for file in read_tree(root, tree) if not PACKAGES.keys() & set(file.path.parts)
        ]
        result[tree] = sizes(files)
    scripts = [path for tree in ("ptmtools", "web") for path in list_files(root / tree, WEB)]
    lines = sum(path.read_text("utf-8").count("\n") for path in scripts)
    result["web, and the page in the product"] = f"{len(scripts)} / {lines:,}"
    result["**names, functions, circles**"] = ""
    result |= {title: f"{len(places)}" for title, places in find_places(packages).items()}
    pages = list_files(root / "docs", {".md"})
    words = sum(len(path.read_text("utf-8").split()) for path in pages)
    result["words of docs"] = f"{words:,} in {len(pages)} pages"
    result["**files and returns that a parameter passes**"] = ""
    modules = {file.name: file for file in everything}
    for function, parameter in WALKS:
        if passage := follow(modules, function, parameter):
            text = f"{len(passage.files)} files, {passage.returns} returns"
            result[f"`{function}`: `{parameter}`"] = text
    return result


def sizes(files: Iterable[PythonFile]) -> str:
    """Files, lines and statements."""
    files = list(files)
    lines, statements = sum(f.lines for f in files), sum(f.statements for f in files)
    return f"{len(files)} / {lines:,} / {statements:,}"


def find_places(packages: Packages) -> dict[str, list[str]]:
    """The names and places that each figure counts."""
    files = [file for members in packages.values() for file in members]
    imports = read_imports(packages)
    functions = [
        (file, node, id(node) in compiled)
        for file, compiled in ((file, kernels(file)) for file in files)
        for node in file.functions
    ]
    titled = [(f"{f.path}:{node.lineno} {node.name}", node, k) for f, node, k in functions]
    every = {f.name: imports[f.name].any for f in files}
    return {
        "class names used more than once": [
            f"{name}: {', '.join(places)}" for name, places in repeated_classes(files).items()
        ],
        "functions": [place for place, _, _ in titled],
        "functions named by a participle": [p for p, n, _ in titled if is_participle(n.name)],
        "functions named by a preposition": [p for p, n, _ in titled if is_preposition(n.name)],
        "banned locals": [
            f"{file.path}:{line} {name}" for file in files for line, name in banned_locals(file)
        ],
        "files with banned locals": [str(file.path) for file in files if banned_locals(file)],
        f"functions over {LONG_FUNCTION} lines": [
            f"{function_length(n)} {place}"
            for place, n, kernel in titled
            if function_length(n) > LONG_FUNCTION and not kernel
        ],
        f"kernels over {LONG_FUNCTION} lines": [
            f"{function_length(n)} {place}"
            for place, n, kernel in titled
            if function_length(n) > LONG_FUNCTION and kernel
        ],
        f"functions of more than {MANY_PARAMETERS} parameters": [
            f"{parameter_count(n)} {place}"
            for place, n, kernel in titled
            if parameter_count(n) > MANY_PARAMETERS and not kernel
        ],
        f"files over {LONG_FILE} lines": [
            f"{file.lines} {file.path}" for file in files if file.lines > LONG_FILE
        ],
        f"files under {CRUMB} lines with one importer": crumbs(files, imports, CRUMB),
        "circles of files, at run time": [
            ", ".join(ring) for ring in circles({f.name: imports[f.name].run for f in files})
        ],
        "circles of files, types and text included": [", ".join(ring) for ring in circles(every)],
        "circles of folders": [
            ", ".join(ring)
            for members in packages.values()
            for ring in circles(graph_of_children(members, imports))
        ],
    }
