"""Loops compiled by numba. Their machine code is kept between runs (`ptmtools.machine_code`)."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cached_property, update_wrapper
from importlib import import_module
from pathlib import Path
from threading import Lock
from typing import IO, Any, TypeVar, cast

import llvmlite.ir  # type: ignore[import-untyped]
import numba
import numba.core.event
import numba.extending

from ptmtools.ahead import begin_waiting
from ptmtools.machine_code import announce_compilation, folder_of

Function = TypeVar("Function", bound=Callable[..., Any])


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
        code = self.py_func.__code__
        folder = folder_of(Path(code.co_filename))
        with _setting:
            before = settings.CACHE_DIR
            settings.CACHE_DIR = folder
            try:
                entry = self._compiler(cache=bool(folder))
            finally:
                settings.CACHE_DIR = before
        if folder and hasattr(entry, "_cache"):
            lock = Path(folder, f"{Path(code.co_filename).stem}-{code.co_firstlineno}.lock")
            entry._cache = _Kept(entry._cache, lock, allocates=self._options.get("_nrt", True))
        return entry

    @cached_property
    def _part(self) -> Any:
        part = self._compiler(no_cpython_wrapper=True)
        # Numba would compile it anew for every number that stands in a call of it.
        general, compile_for = cast(Any, numba.types).unliteral, part.get_call_template
        part.get_call_template = lambda arguments, named: compile_for(
            tuple(map(general, arguments)), {name: general(kind) for name, kind in named.items()}
        )
        return part

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
    """Prepares for making machine code, where it is not merely loaded."""

    _prepared = False

    def on_start(self, event: Any) -> None:
        if not self._prepared:
            self._prepared = True
            _load_without_scipy()
            announce_compilation()
            begin_waiting()

    def on_end(self, event: Any) -> None:
        pass


numba.core.event.register("numba:compile", _FirstCompilation())  # type: ignore[no-untyped-call]
