"""Loops compiled by numba, and where their machine code is kept between runs.

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
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from threading import Lock
from typing import IO, Any, TypeVar, cast

import llvmlite.ir  # type: ignore[import-untyped]
import numba
import numba.core.event
import numba.extending

from ptmtools.ahead import start_ahead
from ptmtools.progress import announce

Function = TypeVar("Function", bound=Callable[..., Any])

_PACKAGE = Path(__file__).parent
#: An import of the package's, wherever it stands: a module, and the names taken from it.
_IMPORT = re.compile(
    rf"^ *(?:from +({_PACKAGE.name}[\w.]*) +import +(\([^)]*\)|[^\n]*)"
    rf"|import +({_PACKAGE.name}[\w.]*))",
    re.MULTILINE,
)


def kernel(function: Function) -> Function:
    """``function``, compiled when first called with arguments of these types, without the
    interpreter's lock, kept for later runs if there is a place to keep it.

    Floating point is strict: no operation is reordered or fused with another, so that results are
    the same on every machine with IEEE arithmetic.
    """
    return cast("Function", _Kernel(function))


def plain_kernel(function: Function) -> Function:
    """As `kernel`, for functions that allocate nothing: no references to arrays are counted.

    Where small kernels hand arrays to each other in an inner loop, counting (an atomic operation
    for every array that is passed, unpacked or viewed) takes several times as long as the work.
    """
    return cast("Function", _Kernel(function, _nrt=False))


def inlined_kernel(function: Function) -> Function:
    """As `plain_kernel`, for a kernel that one other calls, in one place: it becomes part of that.

    A call hands over seven words for every array, those of tuples included.
    """
    return cast("Function", _Kernel(function, _nrt=False, forceinline=True))


def _prefetch(_: Any, array: Any, index: Any) -> Any:
    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        ir: Any = llvmlite.ir
        data = context.make_array(array)(context, builder, arguments[0]).data
        byte, word = ir.IntType(8).as_pointer(), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [byte, word, word, word])
        function = builder.module.declare_intrinsic("llvm.prefetch", [byte], kind)
        place = builder.bitcast(builder.gep(data, [arguments[1]]), byte)
        builder.call(function, [place, word(0), word(3), word(1)])
        return context.get_dummy_value()

    return numba.types.void(array, index), build


#: ``prefetch(array, index)`` in a kernel: the line of the cache with ``array[index]`` (of one
#: dimension, an int64 within it) will be wanted soon. Does not wait, and changes nothing.
prefetch: Any = numba.extending.intrinsic(_prefetch)


class _Kernel:
    """A function that is compiled in two forms, either of them when it is first needed.

    Called from Python, it takes and returns Python's objects, and its machine code is kept. Called
    from another kernel it becomes a part of that, and has nothing to do with either: compiling it
    takes half of the time.
    """

    def __init__(self, function: Callable[..., Any], **options: bool) -> None:
        self.py_func = function
        self._options = {"nogil": True, "fastmath": False, "no_cfunc_wrapper": True, **options}
        update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Any:
        return self._entry(*arguments)

    @cached_property
    def _entry(self) -> Any:
        settings: Any = numba.config
        with _setting:
            before = settings.CACHE_DIR
            folder = _folder(before, self.py_func.__code__.co_filename)
            settings.CACHE_DIR = folder
            try:
                entry = self._compiler(cache=bool(folder))
            finally:
                settings.CACHE_DIR = before
        if folder and hasattr(entry, "_cache"):
            code = self.py_func.__code__
            lock = Path(folder, f"{Path(code.co_filename).stem}-{code.co_firstlineno}.lock")
            entry._cache = _Kept(entry._cache, lock, allocates=self._options.get("_nrt", True))
        return entry

    @cached_property
    def _part(self) -> Any:
        return self._compiler(no_cpython_wrapper=True)

    @property
    def _numba_type_(self) -> Any:
        return numba.typeof(self._part)  # type: ignore[no-untyped-call]

    def _compiler(self, **options: bool) -> Any:
        compile_: Any = numba.njit
        return compile_(**self._options, **options)(self.py_func)


class _Kept:
    """The machine code of a function that is kept, in place of numba's object for it.

    What one process finds missing, and so compiles, the others wait for. That two of them make the
    same is a waste; and two that keep code for different arguments at a time could keep one's under
    the other's name, as numba lists a function's machine code in a file that it reads and writes.
    """

    def __init__(self, numbas: Any, lock: Path, *, allocates: bool) -> None:
        self._numbas = numbas
        self._place = lock
        self._lock: IO[bytes] | None = None
        self._load = numbas.load_overload
        if not allocates:
            # To load such machine code takes nothing that numba would set up before, the functions
            # that allocate and all types and functions that a compiler must know: a quarter of a
            # second run of `ptm encode`. Where something is to be compiled after all, they are set
            # up then. A numba that has no such function sets them up.
            self._load = getattr(numbas, "_load_overload", self._load)

    def load_overload(self, *arguments: Any) -> Any:
        found = self._load(*arguments)
        if found is None and self._lock is None:
            self._lock = _locked(self._place)
            found = self._lock and self._load(*arguments)
            if found is not None:
                self._release()
        return found

    def save_overload(self, *arguments: Any) -> None:
        try:
            self._numbas.save_overload(*arguments)
        finally:
            self._release()

    def _release(self) -> None:
        if self._lock:
            self._lock.close()
            self._lock = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._numbas, name)


def _locked(place: Path) -> IO[bytes] | None:
    """That file, locked until it is closed or this process ends; None where there are no locks."""
    try:
        import fcntl
    except ImportError:
        return None
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        file = place.open("wb")
    except OSError:
        return None
    try:
        fcntl.flock(file, fcntl.LOCK_EX)
    except OSError:
        file.close()
        return None
    return file


#: The folder is a setting of the whole process, and kernels may be called by several threads.
_setting = Lock()


def _load_without_scipy() -> None:
    """Loads the part of numba that asks for SciPy's BLAS, for products of matrices, of which no
    kernel has any.

    Where SciPy happens to be installed that takes 0.2 s, and where little memory is left OpenBLAS
    tries for ever to get some.
    """
    hidden = "scipy.linalg" not in sys.modules
    if hidden:
        sys.modules["scipy.linalg"] = None  # type: ignore[assignment]
    try:
        import_module("numba.np.arraymath")
    finally:
        if hidden:
            del sys.modules["scipy.linalg"]


class _FirstCompilation(numba.core.event.Listener):
    """Announces, once, that machine code is being made and not merely loaded."""

    _announced = False

    def on_start(self, event: Any) -> None:
        if not self._announced:
            self._announced = True
            start_ahead()
            _load_without_scipy()
            announce("compiling for this machine (first run only, up to a minute)")

    def on_end(self, event: Any) -> None:
        pass


numba.core.event.register("numba:compile", _FirstCompilation())  # type: ignore[no-untyped-call]


def _folder(chosen: str, file: str) -> str:
    """Where machine code of functions in that file is kept; "" if there is no place."""
    place = chosen or _place()
    return place and os.path.join(place, _digest(Path(file)))


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
