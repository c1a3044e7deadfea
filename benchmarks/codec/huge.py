"""An image of 16,384² texels: time and peak memory of each way in and out.

    python benchmarks/codec/huge.py [--side 16384] [--profile fast] [--threads 2]

Every row is a process of its own. Its peak is the largest resident size that the kernel saw, less
what the same process had with nothing but the modules imported, over the raw size of the image.
"Array": the image is in memory, and counted. "Strips": rows are read from a file as they are asked
for. "Pillow": the command, on a file that Pillow loads.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from images import sample
from numpy.typing import NDArray

import ptmtools.texture as texture
from ptmtools.texture import EncodeOptions, Limits
from ptmtools.texture.coders import haar_kernels as kernels  # noqa: F401  so that the baseline has them

PLENTY = Limits(decoded_bytes=1 << 40)


class FileRows:
    """Rows of a raw file, read when asked for."""

    dtype = np.dtype(np.uint8)

    def __init__(self, path: Path, side: int) -> None:
        self.shape = (side, side, 3)
        self._path = path

    def __getitem__(self, rows: slice) -> NDArray[Any]:
        row = self.shape[1] * 3
        part = np.fromfile(
            self._path, np.uint8, (rows.stop - rows.start) * row, offset=rows.start * row
        )
        return part.reshape(-1, *self.shape[1:])


def write_image(path: Path, side: int) -> None:
    """A photograph, repeated and shaded so that no two repetitions are the same, as a PPM."""
    photo = sample()[:512, :512]
    with path.open("wb") as file:
        file.write(b"P6\n%d %d\n255\n" % (side, side))
        for top in range(0, side, 512):
            rows = []
            for left in range(0, side, 512):
                shade = (top // 512 * 37 + left // 512 * 11) % 64
                rows.append(np.maximum(photo, shade) - np.minimum(photo, shade) // 2)
            file.write(np.concatenate(rows, axis=1).tobytes())


def header_length(side: int) -> int:
    """Of the PPM."""
    return len(b"P6\n%d %d\n255\n" % (side, side))


def peak() -> int:
    """Largest resident size of this process so far, bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def one(task: str, folder: Path, side: int, profile: str, threads: int) -> None:
    """Does one task and prints what it took, as JSON."""
    options = EncodeOptions(profile)
    ptm = folder / "a.ptm"
    warm = np.ascontiguousarray(sample()[:64, :64])
    texture.decode(texture.encode(warm, options))
    extra: dict[str, Any] = {}
    baseline = peak()
    start = time.perf_counter()
    if task == "encode, array":
        image = np.fromfile(folder / "a.raw", np.uint8).reshape(side, side, 3)
        start = time.perf_counter()
        with ptm.open("wb") as file:
            texture.encode_to(file, image, options, threads=threads)
    elif task == "encode, strips":
        with ptm.open("wb") as file:
            texture.encode_to(file, FileRows(folder / "a.raw", side), options, threads=threads)
    elif task == "decode, all":
        texture.decode(ptm, limits=PLENTY, threads=threads)
    elif task == "decode, level 9":
        read: list[tuple[int, int]] = []
        with ptm.open("rb") as file:

            def ranges(offset: int, length: int) -> bytes:
                read.append((offset, length))
                file.seek(offset)
                return file.read(length)

            with texture.open(ranges) as reader:
                level = reader.level(9)
                extra = {"size": level.shape[:2], "bytes": sum(n for _, n in read)}
    elif task == "decode, a window of 512²":
        with texture.open(ptm) as reader:
            reader.window(len(reader.header.levels) - 1, side // 2 + 100, side // 2 + 100, 512, 512)
    seconds = time.perf_counter() - start
    print(json.dumps({"seconds": seconds, "peak": peak() - baseline, **extra}))


def run(label: str, command: list[str], raw: int) -> None:
    """One row of the table."""
    result = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    extra = ""
    if "bytes" in result:
        extra = f"  {result['size']} texels, {result['bytes']:,} bytes read"
    rate = raw / result["seconds"] / 1e6
    print(
        f"{label:36} {result['seconds']:8.2f} {rate:9.1f} {result['peak'] / 1e6:9.0f} "
        f"{result['peak'] / raw:7.2f}{extra}",
        flush=True,
    )


def through_pillow(folder: Path, profile: str, raw: int) -> None:
    """The command, as a user calls it."""
    command = [sys.executable, "-m", "ptmtools", "encode", str(folder / "a.ppm"), "--force"]
    command += ["-o", str(folder / "b.ptm"), "--profile", profile]
    measure: Callable[[list[str]], str] = lambda command: subprocess.run(  # noqa: E731
        [sys.executable, "-c", MEASURED, *command], check=True, capture_output=True, text=True
    ).stdout.splitlines()[-1]
    result = json.loads(measure(command))
    print(
        f"{'ptm encode, through Pillow':36} {result['seconds']:8.2f} "
        f"{raw / result['seconds'] / 1e6:9.1f} {result['peak'] / 1e6:9.0f} "
        f"{result['peak'] / raw:7.2f}  (of the whole process)",
        flush=True,
    )


MEASURED = """
import json, resource, subprocess, sys, time
start = time.perf_counter()
subprocess.run(sys.argv[1:], check=True)
peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
print(json.dumps({"seconds": time.perf_counter() - start, "peak": peak}))
"""


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="An image of 16,384² texels.")
    parser.add_argument("--side", type=int, default=16384)
    parser.add_argument("--profile", default="fast")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--task", help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.task:
        one(given.task, given.folder, given.side, given.profile, given.threads)
        return
    raw = given.side**2 * 3
    with tempfile.TemporaryDirectory(dir=given.folder) as name:
        folder = Path(name)
        write_image(folder / "a.ppm", given.side)
        with (folder / "a.ppm").open("rb") as source, (folder / "a.raw").open("wb") as target:
            source.seek(header_length(given.side))
            while piece := source.read(1 << 24):
                target.write(piece)
        print(f"{given.side}² RGB, {raw:,} bytes, {given.profile}, {given.threads} threads")
        print(f"{'':36} {'s':>8} {'MB/s':>9} {'peak MB':>9} {'× raw':>7}")
        for task in (
            "encode, array",
            "encode, strips",
            "decode, all",
            "decode, level 9",
            "decode, a window of 512²",
        ):
            command = [sys.executable, __file__, "--task", task, "--folder", str(folder)]
            command += ["--side", str(given.side), "--profile", given.profile]
            run(task, [*command, "--threads", str(given.threads)], raw)
        (folder / "a.raw").unlink()
        through_pillow(folder, given.profile, raw)
        print(f"file: {(folder / 'b.ptm').stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
