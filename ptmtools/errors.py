"""The error tree: every failure that a user can cause, with a stable code and an exit status.

The command prints one line, ``ptm: FILE: PLACE: problem: remedy [CODE]``, and exits with the
status of the error's class. Codes never change their meaning. A code stands for a kind of failure
that programs and the docs distinguish; the message names the case.

========  ======================================================================
status    meaning
========  ======================================================================
0         done
1         an internal error: a bug in ptmtools
2         the command line is wrong (Click's own status)
3         an input cannot be read or is invalid (`InputError`)
4         an output cannot be written (`OutputError`)
5         a database is damaged or of another version (`DatabaseError`)
6         something that is not installed is needed (`MissingComponentError`)
7         an input is beyond a limit (`LimitError`)
8         a check found errors (``ptm validate``)
9         worker processes or machines are unavailable or have ended (`WorkerError`)
130       interrupted
141       the reader of the output has ended
========  ======================================================================

The tree; each class has the letter of its codes and its exit status::

    PtmError
    ├── InputError              I  3
    │   └── LimitError          L  7
    ├── OutputError             O  4
    ├── DatabaseError           D  5
    ├── MissingComponentError   M  6
    ├── CheckError              C  8
    └── WorkerError             W  9

Findings of ``ptm validate`` (D), notes (N) and internal errors (X) are codes, not classes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike, fspath


@dataclass(frozen=True)
class Rebuild:
    """A remedy that is a build of the database: a text with {} in the place of the command."""

    text: str
    command: str = "ptm build-scene"

    def __str__(self) -> str:
        return self.text.format(f"`{self.command}`")


class PtmError(Exception):
    """A failure with a remedy.

    Parameters
    ----------
    code: stable identifier such as ``"PTM-I101"``.
    message: the problem, one line, no trailing full stop.
    file: the file in question, if there is one.
    place: where in the file ("line 12", "level 3", "byte 40"), if known.
    remedy: the user's possible action, if known.
    """

    exit_status = 1
    remedy: str | Rebuild | None

    def __init__(
        self,
        code: str,
        message: str,
        *,
        file: str | PathLike[str] | None = None,
        place: str | None = None,
        remedy: str | Rebuild | None = None,
    ) -> None:
        self.code = code
        self.message = message
        self.file = None if file is None else fspath(file)
        self.place = place
        self.remedy = remedy
        super().__init__(str(self))

    def __str__(self) -> str:
        where = ": ".join(part for part in (self.file, self.place) if part)
        what = f"{where}: {self.message}" if where else self.message
        if self.remedy:
            what += f"; {self.remedy}"
        return f"{what} [{self.code}]".replace("\r", " ").replace("\n", " ")

    def __reduce__(self) -> tuple[object, ...]:
        """Pickles errors of other processes with the attributes that ``args`` lacks."""
        return _restore_error, (type(self), str(self)), vars(self)


def _restore_error(kind: type[PtmError], text: str) -> PtmError:
    return kind.__new__(kind, text)


class InputError(PtmError):
    """An input cannot be read or is invalid. Codes PTM-Ixxx."""

    exit_status = 3


class OutputError(PtmError):
    """An output cannot be written, or would overwrite foreign files. Codes PTM-Oxxx."""

    exit_status = 4


class DatabaseError(PtmError):
    """A database is incomplete, damaged or of another version. Codes PTM-Dxxx."""

    exit_status = 5


class MissingComponentError(PtmError):
    """A component that is not installed is needed. Codes PTM-Mxxx."""

    exit_status = 6


class LimitError(InputError):
    """An input declares or needs more than a limit allows. Codes PTM-Lxxx."""

    exit_status = 7


class CheckError(PtmError):
    """A check that the user asked for found errors. Codes PTM-Cxxx."""

    exit_status = 8


class WorkerError(PtmError):
    """Worker processes or machines are unavailable or have ended. Codes PTM-Wxxx."""

    exit_status = 9


@contextmanager
def naming(file: str | PathLike[str] | None = None, *, place: str | None = None) -> Iterator[None]:
    """Adds the file, and the place in it, to errors raised in the block that lack them."""
    try:
        yield
    except PtmError as error:
        if (file is None or error.file is not None) and (place is None or error.place is not None):
            raise
        raise type(error)(
            error.code,
            error.message,
            file=file if error.file is None else error.file,
            place=place if error.place is None else error.place,
            remedy=error.remedy,
        ) from error.__cause__
