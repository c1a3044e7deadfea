"""What the need of textures costs, and how near it comes: ``python benchmarks/need.py DB…``

For several numbers of sample points: processor seconds, and the total variation of each cell's
shares, by texture and level, from those with the most points, mean over cells; then the bytes that
the records of the database have for it, where it was written, with ``gzip -9`` in parentheses.
"""

from __future__ import annotations

import gzip
import json
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.coverage.need import Need, TextureSize, compute_need
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.emission import texture_records
from ptmtools.pipeline.run import Artifacts
from ptmtools.pipeline.stages import APO, CELLS, PVS

POINTS = (16, 64, 256, 1024)


def main() -> None:
    columns = [f"{what}, {n} points" for n in POINTS[:-1] for what in ("s", "off by")]
    print(f"| model | {' | '.join(columns)} | bytes in records |")
    print("|---" * (len(columns) + 2) + "|")
    for name in sys.argv[1:]:
        print(f"| {' | '.join(_row(Path(name)))} |", flush=True)


def _row(database: Path) -> list[str]:
    artifacts = Artifacts(open_database(database))
    given = artifacts[APO], artifacts[CELLS], artifacts[PVS]
    records = texture_records(artifacts)
    sizes = {r.image: TextureSize(r.width, r.height, len(r.levels)) for r in records}
    seconds, found = [], []
    for points in POINTS:
        start = time.process_time()
        found.append(_exactly(compute_need(*given, sizes, points), sizes))
        seconds.append(time.process_time() - start)
    off = [np.abs(each - found[-1]).sum(axis=(1, 2)).mean() / 2 for each in found]
    told = [f"{s:.1f} | {o:.1%}" for s, o in zip(seconds[:-1], off[:-1], strict=True)]
    return [database.stem, *told, _bytes(database)]


def _exactly(need: Need, sizes: dict[int, TextureSize]) -> NDArray[np.float64]:
    """(C, I, L) the share of the view that wants just that level."""
    levels = max(size.levels for size in sizes.values())
    found = np.zeros((len(need.start) - 1, max(sizes) + 1, levels))
    for cell in range(len(found)):
        for entry in range(*need.start[cell : cell + 2].tolist()):
            share = need.share[slice(*need.share_start[entry : entry + 2].tolist())]
            first = int(need.first[entry])
            here = slice(first, first + len(share))
            found[cell, need.image[entry], here] = share - np.append(share[1:], 0)
    return found


def _bytes(database: Path) -> str:
    """By how much the records are longer for it."""
    plain = packed = 0
    for path in sorted((database / "www/hints").glob("c*.json")):
        text = path.read_text()
        without = "".join(line for line in text.splitlines(True) if not line.startswith('"need"'))
        assert "need" not in json.loads(without)
        plain += len(text.encode()) - len(without.encode())
        packed += len(gzip.compress(text.encode(), 9)) - len(gzip.compress(without.encode(), 9))
    return f"{plain:,} ({packed:,})"


if __name__ == "__main__":
    main()
