"""Where machine code is kept between runs.

Machine code holds whatever its function could see as it was compiled: the functions that it calls
and the constants of its module, imported ones among them. Numba looks at a function's own file
only. So machine code is kept in a folder named after the contents of the function's module and of
all modules of the package that this one imports, directly or not: a kernel may stand in any file
and use what it likes, and a change elsewhere leaves its machine code in use. What an import brings
is read off the source text (`_imports`), so a kernel's constants must not come from modules that
are found at run time only.

The folder lies in the package's ``__pycache__`` where that can be written, else in the user's
cache folder, or in ``NUMBA_CACHE_DIR``. Imports of what a kernel's module does not need make it
stale more often, so kernels stand in modules of their own or beside code that imports little.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from functools import cache
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path

from ptmtools.progress import announce

_PACKAGE = Path(__file__).parent
#: An import of the package's, wherever it stands: a module, and the names taken from it.
_IMPORT = re.compile(
    rf"^ *(?:from +({_PACKAGE.name}[\w.]*) +import +(\([^)]*\)|[^\n]*)"
    rf"|import +({_PACKAGE.name}[\w.]*))",
    re.MULTILINE,
)


def marker(task: str) -> Path | None:
    """The file that stands once a task has compiled all that it needs, of this very package and by
    this numba; None if there is no place."""
    place = _chosen()
    if not place:
        return None
    digest = sha256(f"{task} {sys.version}".encode())
    numba = find_spec("numba")
    if numba and numba.origin:
        digest.update(f"{numba.origin} {os.stat(numba.origin).st_mtime_ns}".encode())
    for file in sorted(_PACKAGE.rglob("*.py")):
        digest.update(sha256(_source(file)).digest())
    return Path(place, f"{digest.hexdigest()[:12]}.done")


@cache
def announce_compilation() -> None:
    """Says, once, that machine code is being made and not merely loaded."""
    announce("compiling for this machine (first run only, up to a minute)")


def folder_of(file: Path) -> str:
    """Where machine code of the functions in that file is kept; "" if there is no place."""
    place = _chosen()
    return place and os.path.join(place, _digest(file))


def _chosen() -> str:
    return os.environ.get("NUMBA_CACHE_DIR") or _place()


@cache
def _place() -> str:
    # Not Path.expanduser, which raises for a user without a home.
    caches = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    for place in (_PACKAGE / "__pycache__" / "kernels", caches / "ptmtools" / "kernels"):
        try:
            place.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=place):
                return str(place)
        except OSError:
            continue
    return ""


@cache
def _digest(file: Path) -> str:
    """Of a module and all that it imports from the package."""
    files, waiting = {file}, [file]
    while waiting:
        found = _imports(waiting.pop()) - files
        files |= found
        waiting += found
    digest = sha256()
    for one in sorted(files):
        digest.update(sha256(_source(one)).digest())
    return digest.hexdigest()[:12]


@cache
def _source(file: Path) -> bytes:
    return file.read_bytes()


@cache
def _imports(file: Path) -> frozenset[Path]:
    """The modules of the package that are named in this one's imports."""
    found = set()
    for module, names, whole in _IMPORT.findall(_source(file).decode()):
        # A name may be a module in a package, or something within the module.
        for name in re.findall(r"\w+", re.sub(r"#.*| as \w+", "", names)) or [""]:
            found.add(_module(f"{module}.{name}") or _module(module or whole))
    return frozenset(found - {None})  # type: ignore[arg-type]


@cache
def _module(name: str) -> Path | None:
    path = _PACKAGE.parent.joinpath(*name.split("."))
    files = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in files if file.is_file()), None)
