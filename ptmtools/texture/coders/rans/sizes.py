"""What compiled loops and those that call them agree on."""

from __future__ import annotations

from typing import Any, NamedTuple

#: Bits of a table and its size: the frequencies of a table in use sum to this.
TABLE_BITS = 11
TABLE_SIZE = 1 << TABLE_BITS
#: Symbols of this number escape to a 16-bit value, but for tables without escape.
ESCAPE = 255
#: What a pass over a group returns: TRUNCATED where its stream ended early, IMPOSSIBLE where no
#: encoder writes it.
OK, TRUNCATED, IMPOSSIBLE = 0, 1, 2


class Sink(NamedTuple):
    """Symbols that a pass collects."""

    symbols: Any  # (n,) uint16
    contexts: Any  # (n,) uint8, the table of each
    counts: Any  # (tables, 256) int64: how often each occurs; all above 254 count as 255
