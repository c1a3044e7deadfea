"""What lies in the folder of a database: which files, of which kind, and their gzip copies."""

from __future__ import annotations

import os
import stat
import zlib
from collections.abc import Iterable
from pathlib import Path

from ptmtools.database.validation.findings import Findings
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
        found.add("PTM-D657", SERVED, "", f"is a link to {top}")
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
            found.add("PTM-D654", f"{SERVED}/{below}", "", f"cannot be read ({_reason(fault)})")
            continue
        for entry in there:
            path = f"{below}{entry.name}"
            if entry.is_symlink() and not _within(os.path.realpath(entry.path), top):
                found.add("PTM-D657", f"{SERVED}/{path}", "", f"is a link to {_target(entry)}")
            elif entry.is_dir(follow_symlinks=False):
                folders.append(f"{path}/")
            elif _is_file(entry):
                files.append(path)
            else:
                found.add("PTM-D658", f"{SERVED}/{path}", "", f"is {_kind(entry)}")
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
                found.add("PTM-D675", f"{SERVED}/{path}", "", f"there is {other} too")


def check_gzip(copy: bytes, original: bytes | None, file: str, found: Findings) -> None:
    """A gzip copy beside the bytes of what it is the copy of, None if that is not there. It is
    inflated to one byte more than those at most."""
    if original is None:
        found.add("PTM-D676", file, "", "there is no such file without .gz")
        return
    inflater = zlib.decompressobj(_GZIP)
    try:
        plain = inflater.decompress(copy, len(original) + 1)
    except zlib.error as fault:
        found.add("PTM-D676", file, "", f"damaged ({fault})")
        return
    if plain != original:
        found.add("PTM-D676", file, "", "does not hold what the file without .gz holds")
    elif not inflater.eof:
        found.add("PTM-D676", file, "", "is cut short")
    elif inflater.unused_data:
        found.add("PTM-D676", file, "", "goes on behind its end")


def _within(path: str, folder: str) -> bool:
    return path == folder or path.startswith(folder.rstrip(os.sep) + os.sep)


def _is_file(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_file()
    except OSError:  # a link in a circle
        return False


def _kind(entry: os.DirEntry[str]) -> str:
    try:
        mode = entry.stat().st_mode
    except OSError:
        return "a link to nothing"
    kinds = ((stat.S_ISDIR, "a link to a folder"), (stat.S_ISFIFO, "a pipe"))
    return next((kind for holds, kind in kinds if holds(mode)), "a device")


def _target(entry: os.DirEntry[str]) -> str:
    try:
        return os.readlink(entry.path)
    except OSError:
        return "elsewhere"


def _reason(fault: OSError) -> str:
    return fault.strerror or str(fault)
