"""The sources of ptmtools and of the packages beside it as this process imported them.

An upgrade or an edit may replace them while a process runs. It then computes with the old modules,
but reads new files. Python keeps no trace of the sources of a module: a finder that never finds
anything reads each of them just before Python does (30 µs a module).

Times decide nothing: files that `rsync -a` or a wheel brings, and those of a renamed folder, may be
older than the process; clocks are set back; and modules are imported late.
"""

from __future__ import annotations

import sys
from importlib.abc import MetaPathFinder
from os.path import isfile
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).parent
#: None: unknown, unreadable or of two states.
_imported: dict[Path, bytes | None] = {}
#: The files of modules that were there when they were first looked for.
_files: dict[str, Path] = {}


class _SourceReader(MetaPathFinder):
    def find_spec(self, name: str, path: Any, target: Any = None) -> None:
        file = module_file(name) if name.startswith(PACKAGE.name) else None
        if file:
            # A module that is imported again leaves the names that others took from the first; and
            # it may only have been looked for, and be imported later.
            text = _read(file)
            if _imported.setdefault(file, text) != text:
                _imported[file] = None


def watch() -> None:
    """Reads the sources of all modules of the package that are imported from now on."""
    if not any(isinstance(finder, _SourceReader) for finder in sys.meta_path):
        sys.meta_path.insert(0, _SourceReader())


def source(file: Path) -> bytes | None:
    """What was imported from a file of the package; what it holds now, if nothing was. None if that
    is not known: the file changed between two imports, or cannot be read (Python may have its
    bytecode)."""
    return _imported[file] if file in _imported else _read(file)


def _read(file: Path) -> bytes | None:
    try:
        return file.read_bytes()
    except OSError:
        return None


def module_file(name: str) -> Path | None:
    """The file of a module of the package, such as "ptmtools.light.model"; None without one."""
    if name not in _files:
        # Most names are no modules, and paths take long to make.
        path = f"{PACKAGE.parent}/{name.replace('.', '/')}"
        found = next((file for file in (f"{path}.py", f"{path}/__init__.py") if isfile(file)), None)
        if found is None:
            return None
        _files[name] = Path(found)
    return _files[name]
