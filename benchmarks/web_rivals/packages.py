"""npm packages of the rivals, in a folder each, since npm removes other content of a folder."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


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
        if (self.folder / "package.json").is_file():
            return None
        return f"in the checkout: {self.command}"

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
#: Those that tests need and others do not install.
INSTALL = ESBUILD.command
INSTALL_GLTF_TRANSFORM, INSTALL_NEEDLE = GLTF_TRANSFORM.command, NEEDLE.command
