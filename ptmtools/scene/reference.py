"""Finds the files that a model names: libraries of materials, textures, buffers.

What a model says and what lies on the disk differ in known ways: backslashes, drive letters and
leading slashes of the author's machine, upper and lower case, composed and decomposed umlauts.
All of these are tried, inside the model's folder. Reads outside of that folder, also by way of a
symbolic link, are refused unless asked for. What is no file, such as a named pipe or a device, is
never opened. A name is looked for in a bounded number of places, however it is made.
"""

from __future__ import annotations

import os
import re
import unicodedata
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

Outcome = Literal["found", "elsewhere", "outside", "missing"]

#: Longer names no system has, in characters.
_LONGEST = 4096
#: So many folders of a name's end are looked for under another folder than it says.
_DEEPEST = 32


def _fold(name: str) -> str:
    return unicodedata.normalize("NFC", name).casefold()


@dataclass(frozen=True)
class Reference:
    """The result of a search: a path unless it is "outside" or "missing"; "elsewhere" means that
    only the end of the name was found, under another folder than the model says."""

    outcome: Outcome
    path: Path | None = None


class Folder:
    """The folder of a model, searched without regard to case where nothing else is found.

    Attributes
    ----------
    sought: the files found, relative to the root, and the names of those not found, as keys in
        the order in which they were asked for.
    """

    def __init__(self, root: Path, allow_outside: bool = False) -> None:
        self.root = root
        self.allow_outside = allow_outside
        self.sought: dict[str, None] = {}
        self._roots = [root]
        self._real = [root.resolve()]
        self._listing: dict[Path, dict[str, str]] = {}
        self._known: dict[tuple[str, Path], Reference] = {}

    def admit(self, folder: Path) -> None:
        """Another folder may be read, too, for files made on the way."""
        self._roots.append(folder)
        self._real.append(folder.resolve())

    def find(self, reference: str, base: Path | None = None) -> Reference:
        """Find the file called ``reference`` in a file that lies in ``base`` (default: root).

        Tried in this order: the name as it stands; the name below ``base`` and below the root;
        with ``allow_outside`` an absolute name; then ever shorter ends of the name, which serves
        absolute paths of another machine.
        """
        base = self.root if base is None else base
        if (reference, base) not in self._known:
            self._known[reference, base] = self._find(reference, base)
        return self._known[reference, base]

    def _find(self, reference: str, base: Path) -> Reference:
        halves = any("\ud800" <= letter <= "\udfff" for letter in reference)  # of UTF-16, in JSON
        if len(reference) > _LONGEST or halves:
            return Reference("missing")
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
        if "\\" in name:  # an archive unpacked where a backslash is a letter like any other
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
                return Reference(outcome, path)
            outside = True
        if absolute and not self.allow_outside and not outside:
            outside = self._walk(Path("/"), parts) is not None
        if outside:
            return Reference("outside")
        if ".." not in parts:
            self.sought["/".join(parts)] = None
        return Reference("missing")

    def label(self, path: Path) -> str:
        """The path as notes show it: below the model's folder, or else the bare name."""
        return str(path.relative_to(self.root)) if path.is_relative_to(self.root) else path.name

    def _walk(self, start: Path, steps: list[str]) -> Path | None:
        here = start
        try:
            for step in steps:
                if step == "..":
                    here = here / step
                    continue
                exact = here / step
                if not exact.exists():
                    listing = self._list(here)
                    if _fold(step) not in listing:
                        return None
                    exact = here / listing[_fold(step)]
                here = exact
            return here if steps and here.is_file() else None
        except (OSError, ValueError):  # a name too long, or with a NUL byte
            return None

    def _list(self, folder: Path) -> dict[str, str]:
        if folder not in self._listing:
            names = sorted((entry.name for entry in folder.iterdir()), reverse=True)
            self._listing[folder] = {_fold(name): name for name in names}
        return self._listing[folder]
