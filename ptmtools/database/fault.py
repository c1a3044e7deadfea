"""What stops a reader of emitted files."""

from __future__ import annotations


class FileError(Exception):
    """The first thing in a file that is wrong: a code of `validation`, where, and what."""

    def __init__(self, code: str, place: str, message: str) -> None:
        self.code, self.place, self.message = code, place, message
        super().__init__(f"{place}: {message}")
