"""Finds the files that a model refers to: material libraries, textures, buffers.

References differ from the files on the disk in known ways: backslashes, drive letters and leading
slashes of the author's machine, upper and lower case, composed and decomposed umlauts. The search
tries all of these inside the model's folder, in a bounded number of places. It refuses files
outside the folder, also through a symbolic link, unless the user allows them, and returns regular
files only, never a named pipe or a device.
"""

from __future__ import annotations

import os
import re
import unicodedata
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Outcome = Literal["found", "elsewhere", "outside", "missing"]

#: Longest name that a system supports, in characters.
_LONGEST = 4096
#: Largest number of parts at the end of a name that are searched below another folder.
_DEEPEST = 32


def _fold(name: str) -> str:
    return unicodedata.normalize("NFC", name).casefold()


@dataclass(frozen=True)
class SearchResult:
    """A path unless the outcome is "outside" or "missing"; "elsewhere" means that only the end of
    the name was found, below another folder than the reference states."""

    outcome: Outcome
    path: Path | None = None


class ModelFolder:
    """The folder of a model, searched regardless of case if the exact name does not exist.

    Attributes
    ----------
    sought: the files found, relative to the root, and the missing names, as keys in the order of
        the searches.
    """

    def __init__(self, root: Path, allow_outside: bool = False) -> None:
        self.root = root
        self.allow_outside = allow_outside
        self.sought: dict[str, None] = {}
        self._roots = [root]
        self._real = [root.resolve()]
        self._listing: dict[Path, dict[str, str]] = {}
        self._results: dict[tuple[str, Path], SearchResult] = {}

    def admit(self, folder: Path) -> None:
        """Allows another folder, for temporary files."""
        self._roots.append(folder)
        self._real.append(folder.resolve())

    def find(self, reference: str, base: Path | None = None) -> SearchResult:
        """Finds the file for a ``reference`` in a file in the folder ``base`` (default: root).

        The order of the search: the unchanged name; the name below ``base`` and below the root;
        with ``allow_outside`` an absolute name; then ever shorter ends of the name, for absolute
        paths of another machine.
        """
        base = self.root if base is None else base
        if (reference, base) not in self._results:
            self._results[reference, base] = self._find(reference, base)
        return self._results[reference, base]

    def _find(self, reference: str, base: Path) -> SearchResult:
        surrogate = any("\ud800" <= letter <= "\udfff" for letter in reference)  # from JSON
        if len(reference) > _LONGEST or surrogate:
            return SearchResult("missing")
        bases = [base, *(folder for folder in self._roots if folder != base)]
        name = reference.strip(" \t\r\n")
        if len(name) > 1 and name[0] == name[-1] and name[0] in "\"'":
            name = name[1:-1]
        slashed = re.sub(r"^file://", "", name, flags=re.IGNORECASE).replace("\\", "/")
        local = re.sub(r"^[A-Za-z]:", "", slashed)
        absolute = local.startswith("/") or local != slashed
        parts = [part for part in local.split("/") if part not in ("", ".")]
        outside = False

        tries: list[tuple[Path, list[str], Outcome]] = []
        if "\\" in name:  # an archive unpacked on a system that allows backslashes in names
            tries += [(b, [name], "found") for b in bases]
        if not absolute:
            tries += [(b, parts, "found") for b in bases]
        elif self.allow_outside:
            tries.append((Path("/"), parts, "found"))
        for first in range(max(0 if absolute else 1, len(parts) - _DEEPEST), len(parts)):
            if ".." not in parts[first:]:
                tries += [(b, parts[first:], "elsewhere") for b in bases]
        for start, steps, outcome in tries:
            path = self._walk(start, steps)
            if path is None:
                continue
            real = path.resolve()
            if self.allow_outside or any(real.is_relative_to(folder) for folder in self._real):
                if not any(path.is_relative_to(folder) for folder in self._roots[1:]):
                    self.sought[Path(os.path.relpath(path, self.root)).as_posix()] = None
                return SearchResult(outcome, path)
            outside = True
        if absolute and not self.allow_outside and not outside:
            outside = self._walk(Path("/"), parts) is not None
        if outside:
            return SearchResult("outside")
        if ".." not in parts:
            self.sought["/".join(parts)] = None
        return SearchResult("missing")

    def label(self, path: Path) -> str:
        """The path in notes: relative to the model's folder, or the file name outside it."""
        return str(path.relative_to(self.root)) if path.is_relative_to(self.root) else path.name

    def _walk(self, start: Path, steps: list[str]) -> Path | None:
        path = start
        try:
            for step in steps:
                if step == "..":
                    path = path / step
                    continue
                exact = path / step
                if not exact.exists():
                    listing = self._list(path)
                    if _fold(step) not in listing:
                        return None
                    exact = path / listing[_fold(step)]
                path = exact
            return path if steps and path.is_file() else None
        except (OSError, ValueError):  # a name that is too long or contains a NUL byte
            return None

    def _list(self, folder: Path) -> dict[str, str]:
        if folder not in self._listing:
            names = sorted((entry.name for entry in folder.iterdir()), reverse=True)
            self._listing[folder] = {_fold(name): name for name in names}
        return self._listing[folder]
