"""Loops compiled by numba, and where their machine code is kept between runs.

A cached kernel is stale when *any* kernel it calls has changed. Numba looks at a function's own
file only, so the folder is named after the contents of all of them: kernels may be spread over
files and share helpers without ever meeting the machine code of yesterday's helper.

The folder lies in the package's ``__pycache__`` where that can be written, else in the user's
cache folder; ``NUMBA_CACHE_DIR`` overrides both.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar, cast

from ptmtools.progress import announce

# As it loads, numba asks for SciPy's BLAS, for products of matrices, of which no kernel has any.
# Where SciPy happens to be installed that takes longer than everything else that `ptm encode` of a
# small image imports but numba itself (0.2 s), and where little memory is left OpenBLAS tries for
# ever to get some.
_SCIPY = "scipy.linalg"
_hidden = _SCIPY not in sys.modules
if _hidden:
    sys.modules[_SCIPY] = None  # type: ignore[assignment]
try:
    import llvmlite.ir  # type: ignore[import-untyped]
    import numba
    import numba.core.event
    import numba.extending
    import numba.np.arraymath
finally:
    if _hidden:
        del sys.modules[_SCIPY]

Function = TypeVar("Function", bound=Callable[..., Any])

_PACKAGE = Path(__file__).parent
#: Files of this name, and this one, make up the machine code.
_KERNELS = "kernels.py"


def kernel(function: Function) -> Function:
    """``function``, compiled when first called with arguments of these types, without the
    interpreter's lock, kept for later runs if there is a place to keep it.

    Floating point is strict: no operation is reordered or fused with another, so that results are
    the same on every machine with IEEE arithmetic.
    """
    return _compiled(function)


def plain_kernel(function: Function) -> Function:
    """As `kernel`, for functions that allocate nothing: no references to arrays are counted.

    Where small kernels hand arrays to each other in an inner loop, counting (an atomic operation
    for every array that is passed, unpacked or viewed) takes several times as long as the work.
    """
    return _compiled(function, _nrt=False)


def inlined_kernel(function: Function) -> Function:
    """As `plain_kernel`, for a kernel that one other calls, in one place: it becomes part of that.

    A call hands over seven words for every array, those of tuples included.
    """
    return _compiled(function, _nrt=False, forceinline=True)


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


#: The folder is a setting of the whole process, and kernels may be imported by several threads.
_setting = Lock()


def _compiled(function: Function, **options: bool) -> Function:
    settings: Any = numba.config
    with _setting:
        before = settings.CACHE_DIR
        settings.CACHE_DIR = before or _folder()
        try:
            compile_: Any = numba.njit
            compiled: Any = compile_(
                cache=bool(settings.CACHE_DIR), nogil=True, fastmath=False, **options
            )(function)
        finally:
            settings.CACHE_DIR = before
    return cast("Function", compiled)


class _FirstCompilation(numba.core.event.Listener):
    """Announces, once, that machine code is being made and not merely loaded."""

    _announced = False

    def on_start(self, event: Any) -> None:
        if not self._announced:
            self._announced = True
            announce("compiling for this machine, as on every first run; up to a minute")

    def on_end(self, event: Any) -> None:
        pass


numba.core.event.register("numba:compile", _FirstCompilation())  # type: ignore[no-untyped-call]


@cache
def _folder() -> str:
    digest = sha256()
    for file in [Path(__file__), *_kernel_files()]:
        digest.update(file.read_bytes())
    name = f"kernels-{digest.hexdigest()[:12]}"
    # Not Path.expanduser, which raises for a user without a home.
    caches = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    for parent in (_PACKAGE / "__pycache__", caches / "ptmtools"):
        try:
            (parent / name).mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=parent / name):
                return str(parent / name)
        except OSError:
            continue
    return ""


def _kernel_files() -> list[Path]:
    """All of them, in order. Not by `Path.rglob`, which looks into the folders of machine code."""
    found = []
    for folder, folders, files in os.walk(_PACKAGE):
        folders[:] = [name for name in folders if name != "__pycache__"]
        found += [Path(folder) / name for name in files if name == _KERNELS]
    return sorted(found)
