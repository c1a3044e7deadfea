"""Names that cannot be searched for, or that say nothing: repeated classes, participles, `each`.

Whether a name is a participle is guessed from its letters: a single word in -ed that is not one of
`NOT_PARTICIPLES`, or one of `IRREGULAR`, or either before a preposition (`united_by`).
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator

from benchmarks.codebase.sources import FunctionNode, PythonFile

#: Locals, loop variables and parameters that name no quantity.
BANNED = {"own", "each", "one", "left", "of", "other", "most", "far", "here", "held"}

IRREGULAR = re.compile(
    "begun|bent|bound|bought|broken|brought|built|caught|chosen|drawn|driven|fed|felt|found|given|"
    "gone|grown|heard|held|hidden|kept|known|laid|left|lent|lit|lost|made|meant|met|overtaken|paid|"
    "rewritten|said|seen|sent|shown|shrunk|sold|spent|stuck|sunk|swept|taken|taught|thought|thrown|"
    "told|torn|understood|unknown|woven|won|written"
)
NOT_PARTICIPLES = {"bed", "embed", "exceed", "feed", "need", "proceed", "red", "seed", "speed"}
PREPOSITION = re.compile(
    "about|above|across|after|against|along|amid|among|around|apart|at|before|behind|below|beneath|"
    "beside|between|beyond|by|down|for|from|in|inside|into|near|of|off|on|onto|out|outside|over|"
    "past|through|to|together|towards?|under|until|up|upon|with|within|without"
)


def repeated_classes(files: Iterable[PythonFile]) -> dict[str, list[str]]:
    """Class names that are defined more than once, each with the places of its definitions."""
    places: dict[str, list[str]] = defaultdict(list)
    for file in files:
        for node in file.nodes:
            if isinstance(node, ast.ClassDef):
                places[node.name].append(f"{file.path}:{node.lineno}")
    return {name: uses for name, uses in sorted(places.items()) if len(uses) > 1}


def is_participle(name: str) -> bool:
    """Whether a function's name is a bare participle, or one and a preposition."""
    words = name.strip("_").split("_")
    if len(words) == 2 and PREPOSITION.fullmatch(words[1]):
        words.pop()
    if len(words) != 1:
        return False
    word = words[0]
    return bool(IRREGULAR.fullmatch(word)) or (word.endswith("ed") and word not in NOT_PARTICIPLES)


def is_preposition(name: str) -> bool:
    """Whether a function's name is a preposition, or several (`up_to`)."""
    return all(PREPOSITION.fullmatch(word) for word in name.strip("_").split("_"))


def function_names(files: Iterable[PythonFile]) -> Iterator[str]:
    """The names of all functions and methods, without those of the language."""
    for file in files:
        yield from (node.name for node in file.functions if not node.name.startswith("__"))


def banned_locals(file: PythonFile) -> list[tuple[int, str]]:
    """Lines and names of banned locals, loop variables and parameters of a file."""
    assigned = [
        (line, name)
        for node in file.nodes
        for line, name in assigned_names(node)
        if name.strip("_") in BANNED
    ]
    fields = {
        (statement.lineno, target.id)
        for node in file.nodes
        if isinstance(node, ast.ClassDef)
        for statement in node.body
        if isinstance(statement, ast.AnnAssign | ast.Assign)
        for target in ast.walk(statement)
        if isinstance(target, ast.Name)
    }
    return sorted(set(assigned) - fields)


def assigned_names(node: ast.AST) -> Iterator[tuple[int, str]]:
    """The names that one node of a syntax tree binds, without functions, classes and imports."""
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
        yield node.lineno, node.id
    elif isinstance(node, ast.arg):
        yield node.lineno, node.arg
    elif isinstance(node, ast.ExceptHandler | ast.MatchAs | ast.MatchStar) and node.name:
        yield node.lineno, node.name


def parameter_count(node: FunctionNode) -> int:
    """Parameters of a function without ``self`` and ``cls``; ``*rest`` counts as one."""
    arguments = node.args
    named = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    count = sum(argument.arg not in ("self", "cls") for argument in named)
    return count + bool(arguments.vararg) + bool(arguments.kwarg)


def function_length(node: FunctionNode) -> int:
    """Lines from ``def`` to the end, docstring included, decorators not."""
    return (node.end_lineno or node.lineno) - node.lineno + 1


def kernels(file: PythonFile) -> set[int]:
    """The ids of the functions of a file that are compiled, functions within them included."""
    compiled = {"kernel", "plain_kernel", "inlined_kernel", "njit", "jit"}
    return {
        id(inner)
        for node in file.functions
        for decorator in node.decorator_list
        if ast.unparse(decorator).split("(")[0].split(".")[-1] in compiled
        for inner in ast.walk(node)
    }
