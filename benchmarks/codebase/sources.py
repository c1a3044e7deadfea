"""Reads the Python files of a checkout: their sizes, their syntax trees, what they import.

An import counts in any position: at the top of a file, inside a function, under
``if TYPE_CHECKING``, or as text in a table (``"package.module:function"``).
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Set
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

#: The packages of the distribution, and the folder in which each may stand.
PACKAGES = {
    "ptmtools": "",
    "ptmtools_systems": "",
    "ptmtools_lab": "",
    "ptmtools_samples": "sample_data",
}
#: What npm installs and what a build writes is not measured.
SKIPPED = {"node_modules", "build", "dist", ".venv", "__pycache__"}
#: A module, or a module and a name in it, as text.
PLACE = re.compile(r"ptmtools(_\w+)?(\.\w+)+(:\w+)?")

FunctionNode = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class PythonFile:
    """One file: its path in the checkout, its dotted name, its text and its syntax tree."""

    path: Path
    name: str
    text: str
    tree: ast.Module

    @property
    def lines(self) -> int:
        return self.text.count("\n")

    @cached_property
    def nodes(self) -> list[ast.AST]:
        return list(ast.walk(self.tree))

    @cached_property
    def docstrings(self) -> set[int]:
        """The ids of the statements that are docstrings."""
        return {id(doc) for node in self.nodes if (doc := docstring(node)) is not None}

    @cached_property
    def statements(self) -> int:
        """Logical lines, without docstrings."""
        return sum(
            isinstance(node, ast.stmt) and id(node) not in self.docstrings for node in self.nodes
        )

    @cached_property
    def functions(self) -> list[FunctionNode]:
        return [node for node in self.nodes if isinstance(node, FunctionNode)]

    @cached_property
    def bindings(self) -> dict[str, str]:
        """Names that imports bind, anywhere, and the dotted names that they stand for."""
        result: dict[str, str] = {}
        for node in self.nodes:
            if isinstance(node, ast.ImportFrom):
                base = absolute_base(node, self)
                result |= {(a.asname or a.name): f"{base}.{a.name}" for a in node.names}
            elif isinstance(node, ast.Import):
                result |= {a.asname: a.name for a in node.names if a.asname}
        return result

    @property
    def package(self) -> str:
        """The package of the distribution, or the first folder."""
        return self.name.split(".")[0]

    @property
    def folder(self) -> str:
        """The folder below the package: ``ptmtools/cells``, or ``ptmtools/*.py`` for its files."""
        parts = self.name.split(".")
        inside = len(parts) > 2 or (len(parts) == 2 and self.path.name == "__init__.py")
        return f"{parts[0]}/{parts[1]}" if inside else f"{parts[0]}/*.py"


@dataclass(frozen=True)
class Imports:
    """The modules of the distribution that one file imports."""

    run: frozenset[str]
    """By a statement, at the top of the file or in a function."""
    declared: frozenset[str]
    """For types only, or as text that is imported when first used."""

    @property
    def any(self) -> frozenset[str]:
        return self.run | self.declared


def docstring(node: ast.AST) -> ast.stmt | None:
    """The statement that is the docstring of a module, class or function."""
    if not isinstance(node, ast.Module | ast.ClassDef | FunctionNode):
        return None
    first = node.body[0] if node.body else None
    if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
        return first if isinstance(first.value.value, str) else None
    return None


def list_files(folder: Path, suffixes: Set[str]) -> list[Path]:
    """The files below a folder that are part of the project, sorted."""
    return sorted(
        path
        for path in folder.rglob("*")
        if path.suffix in suffixes
        and not SKIPPED & set(path.relative_to(folder).parts)
        and path.is_file()
    )


def read_packages(root: Path) -> dict[str, list[PythonFile]]:
    """The files of each package that a checkout has."""
    packages = {
        package: read_tree(root / base, package, root)
        for package, base in PACKAGES.items()
        if (root / base / package).is_dir()
    }
    return {package: files for package, files in packages.items() if files}


def read_tree(base: Path, tree: str, root: Path | None = None) -> list[PythonFile]:
    """The Python files of ``base/tree``; names start at ``tree``, paths at the checkout."""
    result = []
    for path in list_files(base / tree, {".py"}):
        parts = path.relative_to(base).with_suffix("").parts
        text = path.read_text("utf-8")
        name = ".".join(parts).removesuffix(".__init__")
        result.append(PythonFile(path.relative_to(root or base), name, text, ast.parse(text)))
    return result


def read_imports(packages: dict[str, list[PythonFile]]) -> dict[str, Imports]:
    """The imports of each module, by its dotted name."""
    known = {file.name for files in packages.values() for file in files}
    return {file.name: find_imports(file, known) for files in packages.values() for file in files}


def find_imports(file: PythonFile, known: Set[str]) -> Imports:
    """What a file imports of the modules ``known``: for types, as text, or at run time."""
    for_types = {
        id(inner)
        for node in file.nodes
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")
        for inner in ast.walk(node)
    }
    run: set[str] = set()
    declared: set[str] = set()
    for node in file.nodes:
        places = list(named_places(node, file))
        modules = {module for place in places if (module := module_of(place, known))}
        # The package itself is no file of the rules: its names are imported when first used.
        modules -= {file.name, file.package}
        statement = isinstance(node, ast.Import | ast.ImportFrom) and id(node) not in for_types
        (run if statement else declared).update(modules)
    return Imports(frozenset(run), frozenset(declared - run))


def named_places(node: ast.AST, file: PythonFile) -> Iterator[str]:
    """The dotted names that an import, or a text, refers to."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        base = absolute_base(node, file)
        yield from (f"{base}.{alias.name}" for alias in node.names)
    elif isinstance(node, ast.Constant | ast.JoinedStr):
        text = source_text(node, file.name)
        if PLACE.fullmatch(text):
            yield text.replace(":", ".")


def absolute_base(node: ast.ImportFrom, file: PythonFile) -> str:
    """The module of ``from … import``; a relative one is resolved."""
    if not node.level:
        return node.module or ""
    parts = file.name.split(".")
    if file.path.name == "__init__.py":
        parts.append("")
    return ".".join([*parts[: -node.level], *(node.module or "").split(".")]).strip(".")


def source_text(node: ast.Constant | ast.JoinedStr, name: str) -> str:
    """A text of the source; in an f-string only ``__name__`` is replaced."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    return "".join(
        str(part.value)
        if isinstance(part, ast.Constant)
        else (name if ast.unparse(part).strip("f'\"{}") == "__name__" else "?")
        for part in node.values
    )


def module_of(place: str, known: Set[str]) -> str | None:
    """The longest part of a dotted name that is a module."""
    parts = place.split(".")
    while parts:
        if ".".join(parts) in known:
            return ".".join(parts)
        parts.pop()
    return None
