"""What the texture files must satisfy: by themselves, beside their PNG twins and the hints."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ptmtools.database.findings import Findings
from ptmtools.errors import PtmError


def check_ptm(data: bytes, file: str, found: Findings) -> None:
    """A `.ptm` by itself, every group of it."""
    from ptmtools.texture import check

    for fault in check(data):
        found.add("PTM-D710", file, "", fault)


def check_twin(data: bytes, twin: Path, file: str, twin_file: str, found: Findings) -> None:
    """A `.ptm` decoded, beside its PNG. A damaged `.ptm` is told by `check_ptm` already."""
    from PIL import Image

    from ptmtools.texture import decode

    try:
        pixels = decode(data)
    except PtmError:
        return
    try:
        with Image.open(twin) as image:
            other = np.asarray(image.convert("RGBA"))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as fault:
        found.add("PTM-D712", twin_file, "", f"cannot be read ({fault})")
        return
    plain = pixels[:, :, 0] if pixels.shape[2] == 1 else pixels
    if not np.array_equal(np.asarray(Image.fromarray(plain).convert("RGBA")), other):
        found.add("PTM-D711", file, "", f"decoded, it differs from {twin_file}")


def check_record(
    record: Mapping[str, Any], digest: str, size: int, file: str, place: str, found: Findings
) -> None:
    """A row of `textures` in `hints.json` beside the bytes of its `.ptm`."""
    levels = record["levels"]
    if record["sha256"] != digest:
        found.add("PTM-D704", file, place, "sha256 is not the file's")
    end = 0
    for n, level in enumerate(levels):
        if level["offset"] < end or level["length"] < 0:
            found.add("PTM-D704", file, place, f"level {n} overlaps the one before")
        end = level["offset"] + level["length"]
    if not levels or end != size:
        found.add("PTM-D704", file, place, f"the levels end at byte {end} of {size}")
    elif (levels[-1]["width"], levels[-1]["height"]) != (record["width"], record["height"]):
        found.add("PTM-D704", file, place, "the finest level has another size")
