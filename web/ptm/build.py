"""Compiles ``c/*.c`` to ``src/decoder.wasm``, which is committed: with the pinned zig the same
bytes come out on any machine.

    python web/ptm/build.py             writes it
    python web/ptm/build.py OTHER.wasm  writes that
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

HERE = Path(__file__).resolve().parent
MODULE = HERE / "src" / "decoder.wasm"
#: The compiler, a wheel on PyPI; the extra `dev` pins it too.
ZIG = "0.15.2"
SOURCES = (
    *("decoder.c", "crc32.c"),
    *("rans.c", "haar.c", "haar_planes.c", "repeats.c", "texel.c"),
    "meshopt.c",
)
FLAGS = (
    *("-target", "wasm32-freestanding", "-mcpu=mvp+simd128+bulk_memory+sign_ext"),
    *("-std=c17", "-Os", "-ffreestanding", "-nostdlib", "-fno-exceptions", "-g0"),
    *("-Wall", "-Wextra", "-Wconversion", "-Wno-sign-conversion", "-Werror"),
    *("-Wl,--no-entry", "-Wl,--strip-all", "-Wl,-z,stack-size=65536"),
)


def compiler() -> str | None:
    """The version of zig that is installed, if any."""
    try:
        return version("ziglang")
    except PackageNotFoundError:
        return None


def build(target: Path) -> None:
    """Writes the module. Raises CalledProcessError with the compiler's words on standard error."""
    with tempfile.TemporaryDirectory() as cache:
        subprocess.run(
            [sys.executable, "-m", "ziglang", "cc", *FLAGS, *SOURCES, "-o", str(target.resolve())],
            cwd=HERE / "c",
            check=True,
            env={**os.environ, "ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache},
        )


def main() -> None:
    """Builds, and says how large it is."""
    if compiler() != ZIG:
        sys.exit(f"needs the compiler: pip install ziglang=={ZIG}")
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else MODULE
    build(target)
    print(f"{target}: {target.stat().st_size} bytes")


if __name__ == "__main__":
    main()
