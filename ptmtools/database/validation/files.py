"""What lies in the folder of a database: which files, of which kind, and their gzip copies."""

from __future__ import annotations

import os
import stat
import zlib
from collections.abc import Iterable
from pathlib import Path

from ptmtools.findings import Findings, Place
from ptmtools.store.layout import SERVED

#: What zlib calls a stream with the header and the checksum of gzip.
_GZIP = 16 + zlib.MAX_WBITS


def served_files(folder: Path, found: Findings) -> list[str]:
    """The files below the served folder, relative to it, in order.

    A link to a file of the folder counts as a file. All else that is neither a file nor a folder
    is a finding and left out, and no link to a folder is followed.
    """
    top = os.path.realpath(folder)
    if folder.is_symlink():
        found.at(SERVED).add("PTM-D657", f"is a link to {top}")
    files: list[str] = []
    folders = [""]
    while folders:
        below = folders.pop()
        try:
            with os.scandir(folder / below) as entries:
                there = sorted(entries, key=lambda entry: entry.name)
        except FileNotFoundError:
            continue
        except OSError as fault:
            message = f"cannot be read ({fault.strerror or fault})"
            found.at(f"{SERVED}/{below}").add("PTM-D654", message)
            continue
        for entry in there:
            path = f"{below}{entry.name}"
            target = os.path.realpath(entry.path) if entry.is_symlink() else top
            if not Path(target).is_relative_to(top):
                found.at(f"{SERVED}/{path}").add(
                    "PTM-D657", f"is a link to {os.readlink(entry.path)}"
                )
            elif entry.is_dir(follow_symlinks=False):
                folders.append(f"{path}/")
            elif os.path.isfile(entry):
                files.append(path)
            else:
                found.at(f"{SERVED}/{path}").add("PTM-D658", f"is {_kind(entry)}")
    return sorted(files)


def check_names(files: Iterable[str], found: Findings) -> None:
    """Names, folders included, that a file system without regard to case takes for one."""
    known: dict[str, str] = {}
    for file in files:
        parts = file.split("/")
        for depth in range(1, len(parts) + 1):
            path = "/".join(parts[:depth])
            other = known.setdefault(path.casefold(), path)
            if other != path:
                known[path.casefold()] = path
                found.at(f"{SERVED}/{path}").add("PTM-D675", f"there is {other} too")


def check_gzip(copy: bytes, original: bytes | None, at: Place) -> None:
    """A gzip copy beside the bytes of what it is the copy of, None if that is not there. It is
    inflated to one byte more than those at most."""
    if original is None:
        at.add("PTM-D676", "there is no such file without .gz")
        return
    inflater = zlib.decompressobj(_GZIP)
    try:
        plain = inflater.decompress(copy, len(original) + 1)
    except zlib.error as fault:
        at.add("PTM-D676", f"damaged ({fault})")
        return
    if plain != original:
        at.add("PTM-D676", "does not hold what the file without .gz holds")
    elif not inflater.eof:
        at.add("PTM-D676", "is cut short")
    elif inflater.unused_data:
        at.add("PTM-D676", "goes on behind its end")


def _kind(entry: os.DirEntry[str]) -> str:
    try:
        mode = entry.stat().st_mode
    except OSError:
        return "a link to nothing"
    kinds = ((stat.S_ISDIR, "a link to a folder"), (stat.S_ISFIFO, "a pipe"))
    return next((kind for holds, kind in kinds if holds(mode)), "a device")
