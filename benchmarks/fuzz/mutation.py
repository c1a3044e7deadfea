"""Damages bytes, texts and JSON; declares what a target of the fuzzer is.

All random choices come from the generator that the caller passes.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, Protocol

#: Numbers at which arithmetic, counters and comparisons turn over.
NUMBERS = (0, 1, 2, 3, 4, 7, 8, 16, 0x7F, 0x80, 0xFF, 0x100, 0x7FFF, 0x8000, 0xFFFF, 0x10000,
           1 << 24, (1 << 31) - 1, 1 << 31, (1 << 32) - 1, 1 << 32, 1 << 40, 1 << 62,
           (1 << 63) - 1, 1 << 63, (1 << 64) - 1)  # fmt: skip
#: The same and worse, as texts have them.
WORDS = (
    *("0", "1", "-1", "-0", "2147483647", "2147483648", "-2147483649", "9223372036854775808"),
    *("1e308", "-1e308", "1e309", "1e-320", "5e-324", "nan", "-inf", "Infinity", "0x10", "1_0"),
    *("9" * 30, "9" * 5000, "1e99999", "+", "-", ".", "1.2.3", "1/2/3/4", "//", "1//", "/1"),
    *(
        "\u0663",
        "\u00b2",
        "\x00",
        "\x1b[2J",
        "\u00e4",
        "\u2028",
        "\ufeff",
        "\u202e",
        "\x85",
        "\x0c",
    ),
    *('"', "'", "\\", "\\\n", "#", "{", "}", "[", "]", "[" * 3000, "%s", "%n", "$HOME", "`id`"),
)
#: Names that lead elsewhere, given what lies beside the folder that is read.
NAMES = (
    *("../outside/secret.png", "..\\outside\\secret.png", "../outside/secret.mtl", "link.png"),
    *("away/secret.png", "away/../secret.png", "%2e%2e/outside/secret.png", "..%2foutside%2f"),
    *("{outside}/secret.png", "file://{outside}/secret.png", "C:{outside}/secret.png"),
    *("/dev/zero", "/dev/stdin", "/proc/self/environ", "/proc/self/mem", "fifo", "fifo.png"),
    *("C:\\secret.png", "\\\\host\\share\\a.png", "//host/share/a.png", "http://host/a.png"),
    *("con", "nul.png", "~/a.png", ".", "..", "/", "", " ", "a\x00b", "A" * 5000, "a/" * 2500),
    *("../" * 500, "-o", "-s 1", "x.ptm", "manifest.json", ".ptm-new/manifest.json"),
)
#: How many things are wrong with an input: with many, what is behind the first is never reached.
OFTEN = (1, 1, 1, 2, 3, 5)
#: About so long may an input become, bytes.
LONGEST = 1 << 18


@dataclass(frozen=True)
class Case:
    """One input, and the facts that its maker needs again when it is read."""

    data: bytes
    facts: Any = None


class Target(Protocol):
    """A reader under test. It is made in the process that uses it.

    Attributes
    ----------
    limit: bytes that a read may take by its own options, whatever the input says.
    """

    limit: int

    def __init__(self, folder: Path, outside: Path) -> None:
        """Only ``folder`` may be written; ``outside`` lies beside it and must stay untouched."""

    def make(self, rng: Random) -> Case:
        """An input; the same for the same state of ``rng``."""

    def read(self, case: Case) -> str:
        """Reads it and returns the outcome in a word or two.

        Raises PtmError if it refuses the input; any other exception is a finding.
        """


def damaged(
    rng: Random, data: bytes, other: bytes = b"", fields: Sequence[tuple[int, int]] = ()
) -> bytes:
    """Bytes with some things wrong. ``fields`` are offsets and sizes of numbers."""
    changed = bytearray(data)
    for _ in range(rng.choice(OFTEN)):
        if not changed:
            break
        at = rng.randrange(len(changed))
        size = min(1 << rng.randrange(10), len(changed))
        match rng.randrange(12):
            case 0:
                changed[at] ^= 1 << rng.randrange(8)
            case 1:
                changed[at] = rng.choice((0, 1, 9, 10, 32, 127, 128, 255))
            case 2:
                del changed[at:]
            case 3 if other:
                start = rng.randrange(len(other))
                changed[at : at + size] = other[start : start + size]
            case 4 | 5:
                width = rng.choice((1, 2, 4, 8))
                if fields:
                    at, width = rng.choice(fields)
                value = rng.choice(NUMBERS) & (1 << 8 * width) - 1
                packed = value.to_bytes(width, rng.choice(("little", "big")))
                changed[at : at + width] = packed[: max(0, len(changed) - at)]
            case 6:
                changed[at:at] = changed[at : at + size]
            case 7:
                del changed[at : at + size]
            case 8:
                changed[at : at + size] = rng.randbytes(size)
            case 9:
                changed[at:at] = changed[at : at + size] * min(
                    rng.choice((2, 16, 256)), LONGEST // size
                )
            case 10:
                changed[at : at + size] = bytes([rng.choice((0, 255))]) * size
            case _:
                end = rng.randrange(len(changed))
                changed = changed[at:] + changed[:end]
    return bytes(changed[:LONGEST])


def garbled(rng: Random, text: str, words: Sequence[str] = ()) -> str:
    """A text of lines of words with some things wrong; ``words`` are the format's own."""
    lines = text.split("\n")
    for _ in range(rng.choice(OFTEN)):
        at = rng.randrange(len(lines))
        parts = lines[at].split(" ")
        spot = rng.randrange(len(parts))
        word = rng.choice(rng.choice((WORDS, NAMES, words or WORDS)))
        match rng.randrange(14):
            case 0:
                del lines[at]
            case 1:
                lines.insert(at, lines[rng.randrange(len(lines))])
            case 2:
                other = rng.randrange(len(lines))
                lines[at], lines[other] = lines[other], lines[at]
            case 3 | 4 | 5:
                parts[spot] = word
                lines[at] = " ".join(parts)
            case 6:
                parts.insert(spot, word)
                lines[at] = " ".join(parts)
            case 7:
                del parts[spot]
                lines[at] = " ".join(parts)
            case 8:
                parts[spot:spot] = [parts[spot]] * rng.choice((2, 50, 3000))
                lines[at] = " ".join(parts)
            case 9:
                often = rng.choice((2, 50, 2000))
                lines[at:at] = [lines[at]] * min(often, 1 + LONGEST // (1 + len(lines[at])))
            case 10:
                lines[at] += rng.choice((" \\", "\\", "\r", "\t", " #", "\x00", ' "'))
            case 11:
                lines[at] = lines[at].replace(" ", rng.choice(("\t", "  ", "\u00a0", "")))
            case 12:
                lines[at] = lines[at][: rng.randrange(1 + len(lines[at]))]
            case _:
                lines.insert(at, f"{rng.choice(words or WORDS)} {word}")
        if not lines:
            return ""
    return "\n".join(lines)[:LONGEST]


def twisted(rng: Random, tree: Any, names: Sequence[str] = NAMES) -> Any:
    """A JSON document with some values of other kinds, sizes or names; a copy."""
    tree = json.loads(json.dumps(tree))
    for _ in range(rng.choice(OFTEN)):
        places = list(_places(tree))
        if not places:
            return tree
        if len(json.dumps(tree)) > LONGEST:
            break
        holder, key = rng.choice(places)
        value = holder[key]
        match rng.randrange(10):
            case 0 | 1 | 2:
                holder[key] = _value(rng, names)
            case 3:
                if isinstance(holder, dict):
                    del holder[key]
                else:
                    holder.pop(key)
            case 4:
                other, name = rng.choice(places)
                if other is not holder:
                    holder[key] = json.loads(json.dumps(other[name]))
            case 5 if isinstance(value, list) and value:
                size = len(json.dumps(value))
                holder[key] = value * min(rng.choice((2, 100, 3000)), 1 + LONGEST // size)
            case 6 if isinstance(value, (int, float)) and not isinstance(value, bool):
                holder[key] = rng.choice((value + 1, value - 1, -value, value * 2, value / 2))
            case 7 if isinstance(value, str):
                holder[key] = rng.choice(names)
            case 8:
                holder[key] = [value]
            case _ if isinstance(holder, dict):
                holder[rng.choice(list(holder)) + rng.choice(("", "x"))] = _value(rng, names)
            case _:
                holder.insert(key, _value(rng, names))
    return tree


def dumped(rng: Random, tree: Any) -> bytes:
    """The text of a document; sometimes with what no serialiser writes."""
    text = json.dumps(tree, ensure_ascii=rng.random() < 0.5)[: 4 * LONGEST]
    match rng.randrange(12):
        case 0:
            text = text.replace("0", rng.choice(("NaN", "1e999", "-Infinity", "9" * 5000)), 1)
        case 1:
            text = text.replace('"', '"\\ud800', rng.randrange(1, 40))
        case 2:
            text = text.replace(":", ":" + "[" * 5000, 1)
        case 3:
            return damaged(rng, text.encode("utf-8", "surrogatepass"))
        case 4:
            return b"\xef\xbb\xbf" + text.encode("utf-8", "surrogatepass")
        case 5:
            return text.encode("utf-16", "surrogatepass")
    return text.encode("utf-8", "surrogatepass")


def _places(tree: Any) -> Any:
    """Every value of a document, as what holds it and its key there."""
    stack = [tree]
    while stack:
        holder = stack.pop()
        keys: Any = holder if isinstance(holder, dict) else range(len(holder))
        for key in list(keys):
            yield holder, key
            if isinstance(holder[key], (dict, list)):
                stack.append(holder[key])


def _value(rng: Random, names: Sequence[str]) -> Any:
    match rng.randrange(8):
        case 0:
            return rng.choice((None, True, False))
        case 1 | 2:
            return rng.choice((1, -1)) * rng.choice(NUMBERS)
        case 3:
            return rng.choice((0.5, -0.0, 1e308, 1e-320, -1e17, 3.0))
        case 4:
            return rng.choice(names)
        case 5:
            return rng.choice(WORDS)
        case 6:
            return rng.choice(([], {}, [[]], [0] * 3000, {"a": {"b": {}}}))
        case _:
            deep: Any = 0
            for _ in range(rng.choice((3, 300))):
                deep = [deep]
            return deep
