"""Faults of the small database of three rooms, its files, and what validation finds."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from ptmtools.output import validate_database
from ptmtools.texture import EncodeOptions, decode, encode, read_header
from tests.output.damage import (
    Damage,
    all_of,
    hinted,
    rewritten,
)

#: Between the entries of a list.
S = r"[\s,]+"
C0, C1, C2 = "cells/c0000.wrl", "cells/c0001.wrl", "cells/c0002.wrl"
HINTS, ROOT, A = "hints.json", "root.wrl", "textures/a.ptm"
R0, STATISTICS = "hints/c0000.json", "hints/statistics.json"
TRIANGLE = rf"\d+{S}\d+{S}\d+{S}-1{S}"
VISIBLE = r'visibleUrl +\[ ("\w+.wrl"), ("\w+.wrl"), ("\w+.wrl") \]'
#: One shape lacks its points, another has an index too large.
TWO_SHAPES = (r"\n    coord C[^\n]*", ""), (r"(.*coordIndex \[ )\d+", r"\g<1>99")
#: A bomb: a thousand times as long as it is.
LONG = gzip.compress(bytes(1 << 22))


def codes(db: Path) -> set[str]:
    return {issue.code for issue in validate_database(db).issues}


def findings(db: Path) -> list[str]:
    return [str(issue) for issue in validate_database(db).issues]


def coarser(level: int) -> Damage:
    """The fallback image of the first texture holds another level."""

    def damage(db: Path) -> None:
        data = (db / "www/textures/a.ptm").read_bytes()
        level_number = range(len(read_header(data).levels))[level]
        Image.fromarray(decode(data, level_number)).save(db / "www/textures/a.png")

    return damage


def recoded(change: Callable[[np.ndarray], np.ndarray], **options: object) -> Damage:
    """Another `.ptm` for the first texture, of which only sizes and hash are brought up to date."""

    def damage(db: Path) -> None:
        path = db / "www/textures/a.ptm"
        path.write_bytes(encode(change(decode(path.read_bytes())), EncodeOptions(**options)))

    return damage


def cell(number: int, change: Callable[[dict], object]) -> Damage:
    """Changes the record of a cell."""
    return hinted(change, f"hints/c{number:04d}.json")


def counted(number: int, change: Callable[[dict], object]) -> Damage:
    """Changes the statistics of a cell."""
    return hinted(lambda d: change(d["cells"][number]), STATISTICS)


def portal(change: Callable[[dict], object]) -> Damage:
    """Changes the portal between the first two rooms, on both sides."""

    def of(beyond: int) -> Callable[[dict], object]:
        return lambda c: [change(row) for row in c["portals"] if row["neighbour"] == beyond]

    return all_of(cell(0, of(1)), cell(1, of(0)))


def moved(row: dict, corner: int, axis: int, by: float) -> None:
    """Moves the same corner of a polygon, whichever way it runs."""
    ordered = sorted(range(len(row["polygon"])), key=lambda i: row["polygon"][i])
    row["polygon"][ordered[corner]][axis] += by


def shifted(row: dict, by: float) -> None:
    for point in row["polygon"]:
        point[2] += by


def painted(texture: object) -> Damage:
    """Says that this texture alone is what a cell sees."""
    return cell(2, lambda c: c.update(textureShares=[[[texture, share]] for share in c["ach"]]))


def textured(shares: object) -> Damage:
    """Puts something in the place of the shares of textures of a cell that sees three."""
    return cell(2, lambda c: c.update(textureShares=shares))


def needed(rows: object) -> Damage:
    """Says how fine a cell needs textures."""
    return cell(1, lambda c: c.update(need=rows))


def repainted(db: Path) -> None:
    Image.fromarray(np.zeros((16, 24, 3), np.uint8)).save(db / "www/textures/a.png")


flipped = rewritten("textures/a.ptm", lambda data: data[:-3] + bytes([data[-3] ^ 1]) + data[-2:])


def misplaced(db: Path) -> None:
    """The second room where the first one is."""
    first = json.loads((db / "www" / R0).read_text())
    cell(1, lambda c: c.update(leaves=first["leaves"]))(db)


def unused(db: Path) -> None:
    """A texture that all files list, and no cell uses."""
    for number in range(3):
        path = db / f"www/cells/c{number:04d}.wrl"
        text = path.read_text()
        path.write_text(text.replace("textures/b.", "textures/a."))
        cell(number, lambda c: c.update(textures=[[0] if t else [] for t in c["textures"]]))(db)
