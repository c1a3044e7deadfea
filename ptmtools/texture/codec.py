"""A whole `.ptm` in one call: `decode`, `check` and `examine`, around `PtmReader`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ptmtools.errors import InputError, LimitError
from ptmtools.texture import reader
from ptmtools.texture.container import whole_levels
from ptmtools.texture.model import Limits
from ptmtools.texture.sources import Source

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from ptmtools.texture.detail import Detail

_LIMITS = Limits()


def decode(
    source: Source, level: int | None = None, limits: Limits = _LIMITS, *, threads: int = 1
) -> NDArray[Any]:
    """Level ``level`` of a `.ptm`: (h, w, c) of its kind, rows from the top.

    ``level`` None is the finest level that is whole: of a complete file the finest, of a file cut
    short the finest before the cut. Damage is never passed over: a group whose checksum is wrong
    is an error, also where coarser levels could be had by naming them.

    Raises InputError and LimitError: those of `ptmtools.texture.open` and `PtmReader.level`.
    """
    with reader.open(source, limits=limits, threads=threads) as ptm:
        return ptm.level(level)


def decode_levels(
    source: Source, limits: Limits = _LIMITS, *, threads: int = 1
) -> Iterator[NDArray[Any]]:
    """All whole levels of a `.ptm`, coarsest first, each decoded once: as `decode` of each.

    Stops where the file is cut. Raises as `decode`, when the level in question comes up; the
    limit is that of the finest whole level.
    """
    with reader.open(source, limits=limits, threads=threads) as ptm:
        yield from ptm.levels()


def check(data: bytes, limits: Limits = _LIMITS) -> list[str]:
    """What is wrong with a `.ptm`, one line each; nothing if all of it is as it should be.

    Also decodes every level, so that a group is found whose checksum is right and contents wrong.
    """
    try:
        return examine(data, limits)[0]
    except LimitError as error:
        return [str(error)]


def examine(
    data: bytes, limits: Limits = _LIMITS
) -> tuple[list[str], tuple[Detail, NDArray[Any]] | None]:
    """As `check`, and what its levels show, and the finest of them; None if something is wrong.

    Raises LimitError, those of `ptmtools.texture.open` and `PtmReader.level`: nothing is wrong as
    far as the checksums tell.
    """
    from ptmtools.texture.detail import detail_of_levels

    problems: list[str] = []
    try:
        with reader.open(data, limits=limits) as ptm:
            header = ptm.header
            whole = whole_levels(header, len(data))
            if whole < len(header.levels):
                what = f"the last whole level is {whole - 1}" if whole else "no level is complete"
                problems.append(f"cut after {len(data)} of {header.file_size} bytes: {what}")
            if len(data) > header.file_size:
                problems.append(f"{len(data) - header.file_size} bytes behind the last group")
            problems += ptm.wrong_checksums()
            if not problems:
                ptm.description()
                return [], detail_of_levels(ptm.levels())
    except LimitError:
        raise
    except InputError as error:
        problems.append(str(error))
    return problems, None
