"""Measures the code: files, lines, statements, imports between packages, import cycles.

    python benchmarks/house.py [ROOT …]     tables for each checkout, as Markdown
    python benchmarks/house.py --check      exit 1 if an import goes up, and name it

Logical lines are statements without docstrings. An import counts in any position: at the top of a
file, inside a function, under ``if TYPE_CHECKING``, or as text in a table
(``"package.module:function"``). A *package* is a direct child of ``ptmtools``: a folder or a single
file.

Imports go down if the packages have an order in which each imports only later ones, that is, if the
graph of imports has no cycle. ``ptmtools_lab`` simulates clients and compares settings: only its
own commands may import it, and no package imports the command line.
"""

from __future__ import annotations

import argparse
import ast
import re
import statistics
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass
from pathlib import Path

PRODUCT, TOP, LABORATORY = "ptmtools", "cli", "lab"
#: The commands of the laboratory; those of the product do not import it.
LABORATORY_COMMANDS = {"ptmtools_lab.cli.simulation", "ptmtools_lab.cli.tradeoff"}
TREES = (PRODUCT, "tests", "benchmarks", "sample_data")
#: Neither is ours to measure: what npm installs, what a build writes.
SKIPPED = {"node_modules", "build", "dist", ".venv", "__pycache__"}
WEB = {".js", ".mjs", ".ts", ".css", ".html", ".c", ".h"}
#: A module, or a module and a name in it, as text.
PLACE = re.compile(r"ptmtools(\.\w+)+(:\w+)?")
LONG = 500

Graph = Mapping[str, Set[str]]


@dataclass(frozen=True)
class Module:
    """One Python file: its dotted name, its sizes, and the modules that it imports."""

    path: Path
    name: str
    lines: int
    logical: int
    plain: frozenset[str]
    """At run time, by a statement, at the top of the file or in a function."""
    declared: frozenset[str]
    """For types only, or as text that is imported when first used."""

    @property
    def package(self) -> str:
        return self.name.split(".")[1] if "." in self.name else self.name


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("roots", nargs="*", type=Path, default=[Path()], metavar="ROOT")
    parser.add_argument("--check", action="store_true", help="only check the imports")
    given = parser.parse_args()
    if not given.check:
        for root in given.roots:
            report(root)
        return 0
    wrong = [line for root in given.roots for line in violations(root)]
    print("\n".join(wrong) or "Imports go down only.")
    return int(bool(wrong))


def violations(root: Path) -> list[str]:
    """A line for each import, or circle of packages, that the rules forbid."""
    modules = read_tree(root, PRODUCT)
    wrong = [
        f"{module.path} imports {target}: {rule}"
        for module in modules
        for target in sorted(module.plain | module.declared)
        for package, allowed, rule in (
            (LABORATORY, {LABORATORY}, "only its own commands may import the laboratory"),
            (TOP, {TOP, "__main__"}, "nothing imports the command line"),
        )
        if package_of(target) == package
        and module.package not in allowed
        and not (package == LABORATORY and module.name in LABORATORY_COMMANDS)
    ]
    for circle in circles(between_packages(modules)):
        wrong.append(f"packages in a circle: {', '.join(circle)}")
        wrong += [
            f"    {module.path} imports {target}"
            for module in modules
            for target in sorted(module.plain | module.declared)
            if {module.package, package_of(target)} <= set(circle)
            and module.package != package_of(target)
        ]
    return wrong


def report(root: Path) -> None:
    """Prints the tables of one checkout."""
    print(f"| {root.resolve().name} | files | lines | logical | median | largest |")
    print("|---|---|---|---|---|---|")
    trees = {tree: read_tree(root, tree) for tree in TREES}
    product = trees[PRODUCT]
    folders = sorted({m.package for m in product if len(m.path.parts) > 2})
    for folder in folders:
        size_row(f"{PRODUCT}/{folder}", [m for m in product if m.path.parts[1] == folder])
    size_row(f"{PRODUCT}/*.py", [m for m in product if len(m.path.parts) == 2])
    for tree, modules in trees.items():
        size_row(f"**{tree}**", modules)
    scripts = [path for tree in (PRODUCT, "web") for path in files(root / tree, WEB)]
    web = {path: path.read_text("utf-8").count("\n") for path in scripts}
    sizes = f"{len(web)} | {sum(web.values()):,} | | {middle(web.values())} | {most(web)}"
    print(f"| **web and page** | {sizes} |")
    words = {path: len(path.read_text("utf-8").split()) for path in files(root / "docs", {".md"})}
    print(f"\ndocs: {len(words)} pages, {sum(words.values()):,} words")
    print(f"files of {PRODUCT} over {LONG} lines: {sum(m.lines > LONG for m in product)}")
    plain = {m.name: m.plain for m in product}
    every = {m.name: m.plain | m.declared for m in product}
    for title, graph in (
        ("files, at run time", plain),
        ("files, types and tables included", every),
        ("packages", between_packages(product)),
    ):
        rings = circles(graph)
        print(f"circles between {title}: {len(rings)}")
        for ring in rings:
            print(f"    {len(ring)}: {', '.join(ring)}")
    if not circles(between_packages(product)):
        print(f"packages, each above what it imports: {' '.join(order(between_packages(product)))}")


def size_row(name: str, modules: list[Module]) -> None:
    """Prints the sizes of some modules; an empty ``__init__.py`` is no file of the median."""
    lines = {module.path: module.lines for module in modules}
    print(
        f"| {name} | {len(modules)} | {sum(lines.values()):,} "
        f"| {sum(m.logical for m in modules):,} | {middle(lines.values())} | {most(lines)} |"
    )


def middle(lines: Iterable[int]) -> int:
    """The median of the files that have more than two lines."""
    return round(statistics.median([count for count in lines if count > 2] or [0]))


def most(lines: Mapping[Path, int]) -> str:
    """The largest file and its lines."""
    path = max(lines, key=lambda path: lines[path], default=None)
    return f"{lines[path]:,} {path.name}" if path else ""


def files(folder: Path, suffixes: Set[str]) -> list[Path]:
    """The files below a folder that are part of the project, sorted."""
    return sorted(
        path
        for path in folder.rglob("*")
        if path.suffix in suffixes
        and not SKIPPED & set(path.relative_to(folder).parts)
        and path.is_file()
    )


def read_tree(root: Path, tree: str) -> list[Module]:
    """The Python files of one tree of a checkout, measured."""
    return [read(root, file) for file in files(root / tree, {".py"})]


def read(root: Path, file: Path) -> Module:
    """Measures one file of a checkout."""
    text = file.read_text("utf-8")
    tree = ast.parse(text)
    path = file.relative_to(root)
    docs = {id(doc) for node in ast.walk(tree) if (doc := docstring(node)) is not None}
    logical = sum(isinstance(node, ast.stmt) and id(node) not in docs for node in ast.walk(tree))
    name = ".".join(path.with_suffix("").parts).removesuffix(".__init__")
    plain, declared = imports(root, tree, name, docs)
    return Module(path, name, text.count("\n"), logical, plain - {name}, declared - plain - {name})


def docstring(node: ast.AST) -> ast.stmt | None:
    """The statement that is the docstring of a module, class or function."""
    if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
        return None
    first = node.body[0] if node.body else None
    if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
        return first if isinstance(first.value.value, str) else None
    return None


def imports(
    root: Path, tree: ast.AST, name: str, docs: Set[int]
) -> tuple[frozenset[str], frozenset[str]]:
    """The modules of the product that a file imports: at run time, and for types or as text."""
    for_types = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")
        for inner in ast.walk(node)
    }
    texts = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    plain: set[str] = set()
    declared: set[str] = set()
    for node in ast.walk(tree):
        places: Iterator[str] = iter(())
        if isinstance(node, ast.Import):
            places = (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                base = ".".join([*name.split(".")[: -node.level], *base.split(".")]).strip(".")
            places = (f"{base}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Constant | ast.JoinedStr) and id(node) not in texts:
            text = written(node, name)
            places = iter([text.replace(":", ".")] if PLACE.fullmatch(text) else [])
        kept = {actual for place in places if (actual := module_of(root, place))}
        by_statement = isinstance(node, ast.Import | ast.ImportFrom) and id(node) not in for_types
        (plain if by_statement else declared).update(kept)
    return frozenset(plain), frozenset(declared)


def written(node: ast.Constant | ast.JoinedStr, name: str) -> str:
    """A text of the source; in an f-string only ``__name__`` is replaced."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    parts = [
        str(part.value)
        if isinstance(part, ast.Constant)
        else (name if ast.unparse(part).strip("f'\"{}") == "__name__" else "?")
        for part in node.values
    ]
    return "".join(parts)


def module_of(root: Path, place: str) -> str | None:
    """The longest part of a dotted name that is a file of the product, if there is any."""
    parts = place.split(".")
    while parts[0] == PRODUCT and len(parts) > 1:
        path = root.joinpath(*parts)
        if path.with_suffix(".py").is_file() or (path / "__init__.py").is_file():
            return ".".join(parts)
        parts.pop()
    return None


def package_of(module: str) -> str:
    """The folder or file directly below the product in which a module stands."""
    return module.split(".")[1]


def between_packages(modules: list[Module]) -> dict[str, set[str]]:
    """The packages that each package imports."""
    graph: dict[str, set[str]] = defaultdict(set)
    for module in modules:
        targets = {package_of(target) for target in module.plain | module.declared}
        graph[module.package] |= targets - {module.package}
    return dict(graph)


def order(graph: Graph) -> list[str]:
    """Names, each before those that it imports; the graph has no circle."""
    waiting = Counter(target for targets in graph.values() for target in targets)
    ready = sorted((name for name in graph if not waiting[name]), reverse=True)
    result: list[str] = []
    while ready:
        result.append(ready.pop())
        for target in sorted(graph.get(result[-1], ()), reverse=True):
            waiting[target] -= 1
            if not waiting[target]:
                ready.append(target)
    return result


def circles(graph: Graph) -> list[list[str]]:
    """Groups of names that import each other, in however many steps (Tarjan 1972)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    rings: list[list[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for other in sorted(graph[name] & graph.keys()):
            if other not in index:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], index[other])
        if low[name] == index[name]:
            at = stack.index(name)
            ring = sorted(stack[at:])
            del stack[at:]
            if len(ring) > 1:
                rings.append(ring)

    sys.setrecursionlimit(10_000)
    for name in graph:
        if name not in index:
            visit(name)
    return rings


if __name__ == "__main__":
    sys.exit(main())
