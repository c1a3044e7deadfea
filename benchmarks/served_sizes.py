"""How many bytes databases have for clients to fetch: ``python benchmarks/served_sizes.py DB…``

First the hints: what is fetched before the first step (the index), at every new cell (a record),
and never (the statistics), and the first-look bundles, which no server compresses; then the cells
in both forms. In parentheses with ``gzip -9`` of each file.
"""

from __future__ import annotations

import gzip
import json
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

Size = tuple[int, int]


def main() -> None:
    databases = [Path(name) for name in sys.argv[1:]]
    hints = "model|cells|index|record, mean|record, largest|all records|statistics"
    hints += "|bundle, mean|all bundles"
    _print(hints, (_hints(database) for database in databases))
    print()
    _print("model|cells|triangles|VRML|GLB", (_cells(database) for database in databases))


def _print(head: str, rows: Iterable[Sequence[str]]) -> None:
    print("| " + head.replace("|", " | ") + " |")
    print("|---" * (head.count("|") + 1) + "|")
    for row in rows:
        print("| " + " | ".join(row) + " |", flush=True)


def _hints(database: Path) -> list[str]:
    www = database / "www"
    records = [_size(path) for path in sorted(www.glob("hints/c*.json"))]
    every = _sum(records)
    mean = every[0] // len(records), every[1] // len(records)
    statistics = _size(www / "hints" / "statistics.json")
    sizes = (_size(www / "hints.json"), mean, max(records), every, statistics)
    bundles = [path.stat().st_size for path in www.glob("hints/c*.bin")]
    looks = [f"{sum(bundles) // max(len(bundles), 1):,}", f"{sum(bundles):,}"]
    return [database.stem, f"{len(records)}", *map(_told, sizes), *looks]


def _cells(database: Path) -> list[str]:
    manifest = json.loads((database / "manifest.json").read_text())
    triangles = manifest["stages"]["emit"]["counts"]["triangles"]
    vrml, glb = (
        [_size(path) for path in (database / "www").glob(pattern)]
        for pattern in ("cells/*.wrl", "gltf/*.glb")
    )
    return [database.stem, f"{len(vrml)}", f"{triangles:,}", _told(_sum(vrml)), _told(_sum(glb))]


def _size(path: Path) -> Size:
    """Bytes of a file, and gzipped."""
    data = path.read_bytes()
    return len(data), len(gzip.compress(data, 9))


def _sum(sizes: Sequence[Size]) -> Size:
    return sum(plain for plain, _ in sizes), sum(small for _, small in sizes)


def _told(size: Size) -> str:
    return f"{size[0]:,} ({size[1]:,})"


if __name__ == "__main__":
    main()
