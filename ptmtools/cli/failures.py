"""What becomes of a failure: one line on stderr, ``ptm: … [CODE]``, and an exit status."""

from __future__ import annotations

import errno
import sys

import click

from ptmtools.cli.output import printable
from ptmtools.errors import PtmError

#: Exit statuses beside those of the error classes; see `ptmtools.errors`.
INTERNAL, USAGE, INTERRUPTED, BROKEN_PIPE = 1, 2, 130, 141

_MEMORY = (
    "not enough memory; use smaller images, fewer cells (--max-leaves) or fewer workers (-j 1) "
    "[PTM-L099]"
)


def report(fault: BaseException, verbose: bool) -> int:
    """Says what went wrong, with ``verbose`` where; returns the exit status."""
    status, line = describe(fault)
    if line:
        print(f"ptm: {printable(line)}", file=sys.stderr)
    if verbose and not isinstance(fault, click.ClickException | SystemExit):
        import traceback

        traceback.print_exception(fault)
    return status


def describe(fault: BaseException) -> tuple[int, str]:
    """(exit status, one line) for whatever ended a command; an empty line says nothing."""
    match fault:
        case PtmError():
            return fault.exit_status, str(fault)
        case click.exceptions.NoArgsIsHelpError():
            return USAGE, fault.format_message()
        case click.UsageError():
            path = fault.ctx.command_path if fault.ctx else "ptm"
            message = " ".join(fault.format_message().split()).rstrip(".")
            return USAGE, f"{message}; see `{path} --help` [PTM-U001]"
        case click.exceptions.Exit():
            return fault.exit_code, ""
        case KeyboardInterrupt() | click.Abort():
            return INTERRUPTED, "interrupted; run the same command again to resume [PTM-X130]"
        case BrokenPipeError():
            return BROKEN_PIPE, ""
        case MemoryError():
            return 7, _MEMORY
        case ImportError() if "failed to map segment" in str(fault):  # no room for a library
            return 7, _MEMORY
        case OSError(errno=errno.ENOSPC | errno.EDQUOT):
            return 4, f"{_file_of(fault)}the disk is full; free some space and run again [PTM-O003]"
        case OSError(errno=int()):
            return (
                3,
                f"{_file_of(fault)}{fault.strerror}; check the path and its permissions [PTM-I099]",
            )
        case SystemExit():
            return fault.code if isinstance(fault.code, int) else INTERNAL, ""
    message = " ".join(str(fault).split())
    return INTERNAL, (
        f"internal error, {type(fault).__name__}: {message}; please report it, "
        "run with -v for the traceback [PTM-X001]"
    )


def _file_of(fault: OSError) -> str:
    return f"{fault.filename}: " if fault.filename else ""
