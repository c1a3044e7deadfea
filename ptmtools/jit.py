"""Compiles loops with numba and keeps their machine code between runs.

Numba's cache notices a change of the file of a kernel only, but machine code also contains the
kernels that it calls and the constants of other modules. So each file has a cache folder named by
the digest of its source and of all modules of the package that it imports, directly or not, as
they were when this process imported them (`sources`). They are read off the source text
(`_imports`): constants of a kernel must not come from modules that are imported in another way.
Classes of arguments may (`_classes`); each signature has the folder of its own classes. A digest of
the whole package would be simpler, but any edit would compile everything again: 14 s of processor
time, 50 s on a busy machine.

Called from Python, a kernel is numba's cached dispatcher. Called from another kernel it is an
`overload`, compiled without a wrapper for Python and once for all literals: all kernels together
compile in two thirds of the time that dispatchers calling each other take.

Tried and rejected: a second process that compiles ahead, and locks with which one process waits for
the machine code of another. With them a first `ptm encode` took 9.1 times as long as a second, and
a first build of the museum 3.2 times; without, 8.7 and 3.3 times (`benchmarks/codec/startup.py` on
two busy processors). Processes that start at the same time may both compile a kernel.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator
from functools import cache, update_wrapper
from hashlib import sha256
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar, cast

import llvmlite.ir  # type: ignore[import-untyped]
import numba
import numba.core.caching
import numba.core.event
import numba.extending

from ptmtools.progress import announce
from ptmtools.sources import PACKAGE, module_file, source

Function = TypeVar("Function", bound=Callable[..., Any])

#: An import of the package anywhere in a file: a module, and the names taken from it.
_IMPORT = re.compile(
    rf"^ *(?:from +({PACKAGE.name}[\w.]*) +import +(\([^)]*\)|[^\n]*)"
    rf"|import +({PACKAGE.name}[\w.]*))",
    re.MULTILINE,
)


def kernel(function: Function) -> Function:
    """Compiles ``function`` at the first call with arguments of these types, or loads its machine
    code. It runs without the interpreter's lock.

    Floating point is strict: no operation is reordered or fused with another, so results are the
    same on every machine with IEEE arithmetic.
    """
    return cast("Function", _Kernel(function))


def plain_kernel(function: Function) -> Function:
    """As `kernel`, for functions that allocate nothing: references to arrays are not counted.

    Where small kernels pass arrays to each other in an inner loop, counting (an atomic operation
    for every array that is passed, unpacked or viewed) takes several times as long as the work.
    """
    return cast("Function", _Kernel(function, _nrt=False))


def inlined_kernel(function: Function) -> Function:
    """As `plain_kernel`, for a kernel that one other calls in one place: it becomes part of that.

    A call passes seven words for every array, including those in tuples.
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


#: ``prefetch(array, index)`` in a kernel asks for the cache line of ``array[index]`` (of one
#: dimension, an int64 within it). It does not wait, and changes nothing.
prefetch: Any = numba.extending.intrinsic(_prefetch)


class _Kernel:
    def __init__(self, function: Callable[..., Any], **options: bool) -> None:
        self.py_func = function
        self._options = {"nogil": True, "fastmath": False, "no_cfunc_wrapper": True} | options
        update_wrapper(self, function)
        inner: Any = self._options | {"no_cpython_wrapper": True}
        overload: Any = numba.extending.overload
        overload(self, jit_options=inner, strict=False)(lambda *_: function)

        self._entry: Any = None

    def __call__(self, *arguments: Any) -> Any:
        if self._entry is None:
            self._make_entry()
        return self._entry(*arguments)

    def _make_entry(self) -> None:
        compiled: Any = numba.njit
        with _making:
            if self._entry is None:
                entry = compiled(**self._options)(self.py_func)
                entry._cache = _Cache(self.py_func)
                self._entry = entry


#: Of two threads that call a kernel first, one makes its dispatcher.
_making = Lock()


class _Cache(numba.core.caching.NullCache):
    """The machine code of a kernel on disk.

    Numba asks for it once per signature and process, not at each call, and holds its own lock.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        return self._cache(sig).load_overload(sig, target_context)

    def save_overload(self, sig: Any, cres: Any) -> None:
        # Not the cache that was asked before: a module may have been imported again meanwhile.
        self._cache(sig).save_overload(sig, cres)

    def _cache(self, types: tuple[Any, ...]) -> Any:
        caching: Any = numba.core.caching
        settings: Any = numba.config
        sources = (module_file(kind.__module__) for kind in _classes(types))
        module = Path(self._function.__code__.co_filename)
        folder = cache_folder(module, *(source for source in sources if source))
        before = settings.CACHE_DIR
        settings.CACHE_DIR = folder
        try:
            cache = caching.FunctionCache(self._function) if folder else None
        except RuntimeError:  # Numba cannot write into any folder that it knows.
            cache = None
        finally:
            settings.CACHE_DIR = before
        # Numba's other folders are the same for all sources.
        kept = cache and Path(cache.cache_path).is_relative_to(folder)
        return cache if kept else caching.NullCache()


def _classes(types: Iterable[Any]) -> Iterator[type]:
    """The classes of named tuples in a signature, whose fields machine code knows by number. It is
    kept beside their names, which fail if a class has moved."""
    tuples: Any = numba.types.BaseTuple
    for kind in types:
        if isinstance(kind, tuples):
            yield getattr(kind, "instance_class", tuple)
            yield from _classes(kind)


class _Compilation(numba.core.event.Listener):
    """Announces the first compilation of a process, and counts all."""

    count = 0

    def on_start(self, event: Any) -> None:
        if not self.count:
            announce("compiling for this machine (first run only, up to a minute)")
        self.count += 1

    def on_end(self, event: Any) -> None:
        pass


_compilation = _Compilation()
numba.core.event.register("numba:compile", _compilation)  # type: ignore[no-untyped-call]


def compilations() -> int:
    """Functions that this process has compiled, not loaded, so far."""
    return _compilation.count


def cache_folder(*files: Path) -> str:
    """The folder for machine code that depends on ``files``; "" if none can be written, or if it is
    not known which state of them this process has imported."""
    digest = _digest(files)
    # Not Path.expanduser, which raises for a user without a home.
    caches = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    roots = [PACKAGE / "__pycache__" / "kernels", caches / "ptmtools" / "kernels"]
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        roots.insert(0, Path(chosen))
    return next((str(root / digest) for root in roots if digest and _writable(root / digest)), "")


@cache
def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _digest(files: Iterable[Path]) -> str:
    texts: dict[Path, bytes] = {}
    waiting = set(files)
    while waiting:
        file = waiting.pop()
        text = source(file)
        if text is None:
            return ""
        texts[file] = text
        waiting |= _imports(text) - texts.keys()
    digests = (_sha256(text) for _, text in sorted(texts.items()))
    return sha256(b"".join(digests)).hexdigest()[:12]


@cache
def _sha256(text: bytes) -> bytes:
    return sha256(text).digest()


@cache
def _imports(text: bytes) -> frozenset[Path]:
    """The modules of the package that a module with this source imports."""
    modules = set()
    for module, names, whole in _IMPORT.findall(text.decode()):
        # A name may be a module of a package, or defined in a module.
        for name in re.findall(r"\w+", re.sub(r"#.*| as \w+", "", names)) or [""]:
            modules.add(module_file(f"{module}.{name}") or module_file(module or whole))
    return frozenset(file for file in modules if file)
