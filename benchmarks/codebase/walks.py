"""Follows a parameter from function to function: how many files one reads to see its use.

A call is followed if an argument mentions the parameter (``scene``, ``scene.faces[kept]``) and if
the callee is a function of the packages: defined in the same file, imported, an attribute of an
imported module or class, or a method called on ``self``. What is stored in an object, or computed
and passed on, is not followed: with it, the scene of `subdivide` passes half of the package.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from benchmarks.codebase.sources import FunctionNode, PythonFile


@dataclass
class Passage:
    """What a parameter passes: modules, functions, and the return statements of those."""

    start: str
    files: set[str] = field(default_factory=set)
    functions: set[tuple[str, int, str]] = field(default_factory=set)
    returns: int = 0


def follow(files: Mapping[str, PythonFile], function: str, parameter: str) -> Passage | None:
    """Follows a parameter from the first function of that name that has it; None without one."""
    for _, file in sorted(files.items()):
        for node in file.tree.body:
            named = isinstance(node, FunctionNode) and node.name == function
            if named and parameter in parameter_names(node):
                passage = Passage(f"{file.path}:{node.lineno}")
                _enter(files, file, node, parameter, passage)
                return passage
    return None


def _enter(
    files: Mapping[str, PythonFile],
    file: PythonFile,
    node: FunctionNode,
    parameter: str,
    passage: Passage,
) -> None:
    key = file.name, node.lineno, parameter
    if key in passage.functions:
        return
    if not any(key[:2] == passed[:2] for passed in passage.functions):
        passage.returns += sum(isinstance(inner, ast.Return) for inner in ast.walk(node))
    passage.functions.add(key)
    passage.files.add(file.name)
    for call in ast.walk(node):
        if isinstance(call, ast.Call):
            for home, callee in _callees(files, file, call.func):
                for received in _received(call, callee, parameter):
                    _enter(files, home, callee, received, passage)


def parameter_names(node: FunctionNode) -> list[str]:
    """The names of the parameters: those that a call can fill by position, then the others."""
    arguments = node.args
    return [a.arg for a in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)]


def _mentions(value: ast.expr, parameter: str) -> bool:
    return any(isinstance(node, ast.Name) and node.id == parameter for node in ast.walk(value))


def _received(call: ast.Call, callee: FunctionNode, tracked: str) -> Iterator[str]:
    """The parameters of the callee whose arguments mention the tracked parameter."""
    parameters = parameter_names(callee)
    if parameters[:1] in (["self"], ["cls"]):
        parameters = parameters[1:]
    for parameter, value in zip(parameters, call.args, strict=False):
        if _mentions(value, tracked):
            yield parameter
    for keyword in call.keywords:
        if keyword.arg in parameters and _mentions(keyword.value, tracked):
            yield str(keyword.arg)


def _callees(
    files: Mapping[str, PythonFile], file: PythonFile, target: ast.expr
) -> Iterator[tuple[PythonFile, FunctionNode]]:
    if isinstance(target, ast.Name):
        yield from _defined(files, file, target.id)
    elif isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name):
        if target.value.id == "self":
            yield from ((file, node) for node in file.functions if node.name == target.attr)
            return
        place = file.bindings.get(target.value.id, "")
        module = files.get(place) or files.get(place.rpartition(".")[0])
        if module:
            yield from _defined(files, module, target.attr)


def _defined(
    files: Mapping[str, PythonFile], file: PythonFile, name: str, depth: int = 3
) -> Iterator[tuple[PythonFile, FunctionNode]]:
    """The functions that a name means in a file; a name imported from a package is followed."""
    nodes = [node for node in file.functions if node.name == name]
    if nodes:
        yield from ((file, node) for node in nodes)
        return
    module, _, attribute = file.bindings.get(name, "").rpartition(".")
    if depth and module in files:
        yield from _defined(files, files[module], attribute, depth - 1)
