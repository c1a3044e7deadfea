"""Sizes of tables of frequencies, for compiled loops and for what calls them."""

from __future__ import annotations

#: Bits of a table and its size: the frequencies of a table in use sum to this.
TABLE_BITS = 11
TABLE_SIZE = 1 << TABLE_BITS
#: Symbols of this number escape to a 16-bit value, but for tables without escape.
ESCAPE = 255
