"""ES modules of ours, joined into one script, without comments.

A page of forty modules would be forty requests, one behind the other as imports are found: seconds
on a link with 100 ms of latency. So the modules that an entry needs become one text. Each is a
function that is called when it is first needed and returns what it exports:

    const $0 = once(() => { const { b } = $1(); …; return { a }; });

Their names cannot collide, they are evaluated in the order that modules have, and one that is only
reached by `import("./x.js")` is evaluated when that is called; those may go into a script of their
own, which most visitors never fetch. What is imported from a module that only exports again what
others do is taken from these, so that nothing else of them comes along.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from pathlib import Path

from ptmtools.viewer.modules import Module, read_module
from ptmtools.viewer.scripts import compact, refused

_ONCE = "(f,v)=>()=>v??=f()"


def joined(
    entry: Path, assets: Mapping[Path, str] | None = None, rest: str | None = None
) -> tuple[str, str]:
    """The script of a module and all that it needs; it exports what the module exports.

    Parameters
    ----------
    assets: files that modules find by `new URL("…", import.meta.url)`, with their URLs relative to
        that of the script.
    rest: the URL, relative likewise, of a second script with the modules that are reached by
        `import(…)` only; by default they are in the first.

    Returns the script, and the second, which is empty if there is no need for it.

    Raises InputError: PTM-I900 a module is missing, or not written as `modules` says.
    """
    first = _normal(entry)
    modules = _all_from(first, {_normal(path): url for path, url in (assets or {}).items()})
    order: dict[Path, int] = {}
    _number(first, modules, order, [])
    at_once = len(order) if rest is not None else None
    for path in modules:
        _number(path, modules, order, [])
    words = {token.text for module in modules.values() for token in module.body}
    once = "$"
    while any(word.startswith(once) for word in words):
        once += "$"
    names = {path: f"{once}{number}" for path, number in order.items()}
    here, there = list(order)[:at_once], list(order)[at_once or len(order) :]
    loads = dict.fromkeys(here, "Promise.resolve().then({})")
    loads |= dict.fromkeys(there, f"{once}rest().then(m=>m.{{}}())")
    parts = [f"const {once}={_ONCE};"]
    parts += [_defined(modules[path], names, once, loads) for path in here]
    second = ""
    if there:
        arguments = ",".join([once, *(names[path] for path in here)])
        load = f"import({json.dumps(rest)}).then(m=>m.rest({arguments}))"
        parts.append(f"const {once}rest={once}(()=>{load});")
        loads |= dict.fromkeys(there, loads[first])
        inner = "\n".join(_defined(modules[path], names, once, loads) for path in there)
        ends = ",".join(names[path] for path in there)
        second = f"export const rest=({arguments})=>{{\n{inner}\nreturn{{{ends}}};\n}};\n"
    exported = ",".join(sorted(modules[first].exports))
    call = f"{names[first]}();\n"
    parts.append(f"export const{{{exported}}}={call}" if exported else call)
    return "\n".join(parts), second


def _normal(path: Path) -> Path:
    return Path(os.path.normpath(path))


def _all_from(first: Path, assets: Mapping[Path, str]) -> dict[Path, Module]:
    """All modules that one needs, itself first, each importing from where things truly are."""
    read: dict[Path, Module] = {}

    def module(path: Path) -> Module:
        if path not in read:
            read[path] = read_module(path, assets)
        return read[path]

    def origin(path: Path, name: str, line: int, asking: Path) -> tuple[Path, str]:
        """The module that defines what another exports under a name, and its name there."""
        passed = [asking]
        while True:
            if path in passed:
                raise refused(os.fspath(asking), line, f"imports {name} from itself in the end")
            passed.append(path)
            found = module(path)
            if name not in found.exports:
                raise refused(os.fspath(asking), line, f"{path.name} exports no {name}")
            if found.body or name not in found.again:
                return path, name
            path, name = found.again[name]

    needed: dict[Path, Module] = {}
    waiting = [first]
    while waiting:
        path = waiting.pop()
        if path in needed:
            continue
        needed[path] = found = module(path)
        for one in found.imports:
            where = origin(one.path, one.name, one.line, path)
            one.path, one.name = where
        waiting += [one.path for one in reversed(found.imports)] + found.later
    return needed


def _number(
    path: Path, modules: Mapping[Path, Module], order: dict[Path, int], above: list[Path]
) -> None:
    """Numbers a module after all that it imports."""
    if path in order:
        return
    for one in modules[path].imports:
        if one.path in [*above, path]:
            what = f"{one.path.name} imports this module in turn"
            raise refused(os.fspath(path), one.line, what)
        _number(one.path, modules, order, [*above, path])
    order[path] = len(order)


def _defined(
    module: Module, names: Mapping[Path, str], once: str, loads: Mapping[Path, str]
) -> str:
    """The function of a module; ``loads`` is how each is loaded that is imported as it runs."""
    lines = []
    for path in dict.fromkeys(one.path for one in module.imports):
        taken = _pairs((one.name, one.here) for one in module.imports if one.path == path)
        lines.append(f"const{taken}={names[path]}();")
    later = {path: loads[path].format(names[path]) for path in module.later}
    body = [
        token._replace(text=later[Path(token.text)], kind="word")
        if token.kind == "later"
        else token
        for token in module.body
    ]
    lines.append(compact(body))
    if module.exports:
        lines.append(f"return{_pairs(module.exports.items())};")
    inside = "\n".join(filter(None, lines))
    return f"const {names[module.path]}={once}(()=>{{\n{inside}\n}});"


def _pairs(names: Iterable[tuple[str, str]]) -> str:
    """What an object literal and a pattern have in common."""
    return "{" + ",".join(a if a == b else f"{a}:{b}" for a, b in names) + "}"
