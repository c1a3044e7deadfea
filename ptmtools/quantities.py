"""Formats and parses numbers with units: bytes, bandwidths, times."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from ptmtools.errors import InputError

_BYTES = {"": 1, "B": 1}
_BYTES |= {f"{prefix}B": 1000**n for n, prefix in enumerate(("k", "M", "G"), 1)}
_BYTES |= {f"{prefix}iB": 1024**n for n, prefix in enumerate(("K", "M", "G"), 1)}
_BITS = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}
_SECONDS: dict[str, int | Fraction] = {"": 1, "s": 1, "ms": Fraction(1, 1000)}
#: A number of more digits is a mistake.
_DIGITS = 18
_QUANTITY = re.compile(rf"(\d{{1,{_DIGITS}}}(?:\.\d{{0,{_DIGITS}}})?) *([a-zA-Z]*|%)", re.ASCII)


def size(count: int) -> str:
    """A number of bytes: ``97.5 MB`` (MB = 10⁶ B)."""
    for power, unit in ((9, "GB"), (6, "MB"), (3, "kB")):
        if count >= 10**power:
            return f"{count / 10**power:.1f} {unit}"
    return f"{count} B"


def count(number: int, singular: str, plural: str | None = None) -> str:
    """``1 portal``, ``2 portals``."""
    return f"{number:,} {singular if number == 1 else plural or singular + 's'}"


def parse_bandwidth(text: str) -> int | None:
    """bit/s in ``56k``, ``4M``, ``9600`` (powers of ten); None for ``inf``, no limit.

    Raises InputError PTM-I111 for anything else, and for less than 1 bit/s.
    """
    if text.strip() == "inf":
        return None
    bits = _quantity(text, _BITS)
    if bits is None or bits < 1:
        raise _quantity_error(text, "bandwidth", "bit/s, such as 56k, 4M or inf")
    return round(bits)


def parse_duration(text: str) -> float:
    """Seconds in ``100ms``, ``0.1s``, ``0.1``; InputError PTM-I111 for anything else."""
    seconds = _quantity(text, _SECONDS)
    if seconds is None:
        raise _quantity_error(text, "duration", "seconds or milliseconds, such as 0.1 or 100ms")
    return float(seconds)


@dataclass(frozen=True)
class MemorySize:
    """An amount of memory: bytes, a share of the whole, or, if both are None, no limit; ``text`` as
    given."""

    text: str
    bytes: int | None = None
    share: Fraction | None = None

    def limit_of(self, whole: int) -> int | None:
        """Bytes, rounded down, of ``whole`` bytes; None for no limit."""
        return self.bytes if self.share is None else math.floor(self.share * whole)

    def __str__(self) -> str:
        return self.text


def parse_memory(text: str) -> MemorySize:
    """Parses ``4MiB`` (2²² B), ``4MB`` (4·10⁶ B), ``4096``, ``10%`` or ``inf``.

    Raises InputError PTM-I111 for anything else, also for 0.
    """
    text = text.strip()
    if text == "inf":
        return MemorySize(text)
    if share := _quantity(text, {"%": Fraction(1, 100)}):
        return MemorySize(text, share=share)
    amount = math.floor(_quantity(text, _BYTES) or 0)
    if not amount:
        raise _quantity_error(
            text, "amount of memory", "bytes or a share, such as 4MiB, 4MB, 10% or inf"
        )
    return MemorySize(text, amount)


def _quantity(text: str, units: Mapping[str, int | Fraction]) -> Fraction | None:
    """The exact value of a number with one of some units; None if ``text`` is not one."""
    match = _QUANTITY.fullmatch(text.strip())
    if not match or match[2] not in units:
        return None
    return Fraction(match[1]) * units[match[2]]


def _quantity_error(text: str, what: str, remedy: str) -> InputError:
    return InputError("PTM-I111", f"{text[:40]!r} is no {what}", remedy=f"use {remedy}")
