"""What stops a reader of emitted files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ptmtools import schemas


class FileError(Exception):
    """The first thing in a file that is wrong: a code of `validation`, where, and what."""

    def __init__(self, code: str, place: str, message: str) -> None:
        self.code, self.place, self.message = code, place, message
        super().__init__(f"{place}: {message}")


@contextmanager
def shaped(code: str, place: str = "") -> Iterator[None]:
    """What is not as its schema says becomes a FileError of this code; ``place`` is that of a
    fault of the whole document."""
    try:
        yield
    except schemas.ShapeError as fault:
        raise FileError(code, fault.place or place, fault.message) from None
