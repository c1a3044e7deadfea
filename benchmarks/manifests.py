"""Measures what the manifest of many textures costs: seconds, bytes and memory of each commit.

    python benchmarks/manifests.py [--most 1000000]

A database of N textures, each with an image and seven files, is committed; one texture is replaced;
another stage is committed. Beside it the same with the whole manifest in one file, as schema 2 had
it, up to 100,000 textures. Only names are measured: the files do not exist. Each row is a process
of its own.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import sys
import tempfile
import time
from pathlib import Path

from ptmtools.store import lists
from ptmtools.store.folder import DatabaseFolder
from ptmtools.store.layout import IMAGES, MANIFEST, sha256
from ptmtools.store.manifest import StageRecord
from ptmtools.store.writer import DatabaseWriter

#: A manifest in one file is measured up to this number of textures.
WHOLE = 100_000
FILES = ("www/textures/{}.ptm", "stages/textures/{}.json", "www/textures/{}.jpg",
         *(f"www/previews/{{}}-{side}.jpg" for side in (64, 128, 256, 512)))  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--most", type=int, default=1_000_000)
    most = parser.parse_args().most
    print("| textures | manifest | first commit, s | MB | one texture, s | MB written | ", end="")
    print("another stage, s | reading all, s | peak, GB |")
    print("|---|---|---|---|---|---|---|---|---|")
    number = 1000
    while number <= most:
        for whole in (True, False) if number <= WHOLE else (False,):
            with multiprocessing.get_context("spawn").Pool(1) as pool:
                print(pool.apply(row, (number, whole)), flush=True)
        number *= 10


def row(number: int, whole: bool) -> str:
    """A row of the table."""
    if whole:
        lists.INLINE = sys.maxsize
    texts = [f"painting_{n:07}" for n in range(number)]
    digests = {name: sha256(name.encode()) for name in texts}
    with tempfile.TemporaryDirectory() as folder:
        db = Path(folder, "db")
        db.mkdir()
        first = commit(db, records(digests))
        before = {file: file.stat().st_size for file in db.rglob("*") if file.is_file()}
        digests[texts[number // 2]] = "ab" * 32
        one = commit(db, records(digests))
        after = {file: file.stat().st_size for file in db.rglob("*") if file.is_file()}
        written = sum(after[file] for file in after.keys() - before.keys() | {db / MANIFEST})
        other = commit(db, {"cells": StageRecord(1, {}, {}, {"stages/cells.npz": "cd" * 32})})
        start = time.perf_counter()
        assert len(DatabaseFolder.open(db).manifest.files()) > 8 * number
        reading = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1 << 20)
    name = "one file" if whole else "lists"
    return (
        f"| {number:,} | {name} | {first:.2f} | {sum(before.values()) / 1e6:.1f} | {one:.2f} "
        f"| {written / 1e6:.2f} | {other:.3f} | {reading:.2f} | {peak:.2f} |"
    )


def records(digests: dict[str, str]) -> dict[str, StageRecord]:
    """Of the stages `scene` and `textures`, for the images of these names."""
    images = {f"{IMAGES}/{digest}": digest for digest in digests.values()}
    sources = {f"{name}.png": digest for name, digest in digests.items()}
    inputs = {f"textures/{name}.ptm": digest for name, digest in digests.items()}
    outputs = {file.format(name): digest for name, digest in digests.items() for file in FILES}
    return {
        "scene": StageRecord(1, {}, sources, images),
        "textures": StageRecord(1, {}, inputs, outputs),
    }


def commit(db: Path, stages: dict[str, StageRecord]) -> float:
    """Seconds to open the database and commit the records of these stages."""
    start = time.perf_counter()
    with DatabaseWriter.open_for_model(db, "museum.obj") as writer:
        writer.begin("all").commit(stages)
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
