"""Damaged and hostile files: nothing but an error of ours or an image may come out.

    python benchmarks/codec/fuzz.py [--mutations 100000] [--seed 1] [--jobs 2]

Small files of every profile and kind of sample are mutated: bits flipped, bytes set, cut, spliced
with another file, fields of the head overwritten with extreme numbers. In half of the mutations
all checksums are then made right again, so that what lies behind them is reached; such a file may
decode to another image, of the size that its head declares. Without that, only the exact image or
an error is right.

A mutation fails if anything but an `InputError` is raised, if a wrong image comes out though the
checksums were left alone, if it takes more than two seconds, or if the process grows by more than
the limit on decoded bytes and a fixed allowance. Workers are processes: one that dies is a failure
too. Exit status 1 if there was any.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
import zlib
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import InputError
from ptmtools.texture import EncodeOptions, Limits, decode, encode, read_header

LIMIT = Limits(decoded_bytes=1 << 24)
#: What a decoder may take besides the levels themselves: tables and scratch rows, bytes.
ALLOWANCE = 1 << 28
SLOW = 2.0
EXTREMES = (0, 1, 16, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 1 << 40, 1 << 63)
#: Fields of the head: offset and bytes, as in docs/format-ptm.md.
FIELDS = ((8, 2), (10, 1), (11, 1), (12, 4), (16, 4), (20, 1), (21, 1), (22, 1), (23, 1), (24, 4),
          (28, 4), (32, 4), (36, 4), (44, 8), (52, 8), (64, 8), (72, 8))  # fmt: skip


@cache
def seeds() -> list[tuple[str, bytes]]:
    """A file of every profile, kind and way of coding."""
    rng = np.random.default_rng(7)
    y, x = np.mgrid[:37, :45]
    smooth = np.stack([x * 3 + y * (c + 1) for c in range(4)], axis=2)
    photo = (smooth + rng.integers(0, 9, smooth.shape)).clip(0, 255)
    flat = np.where((x // 9 + y // 7)[:, :, None] % 3 == 0, smooth * 0 + 200, 30)
    images: list[tuple[str, NDArray[Any]]] = [
        ("photo", photo[:, :, :3].astype(np.uint8)),
        ("flat", flat.astype(np.uint8)),
        ("grey", photo[:, :, :1].astype(np.uint8)),
        ("deep", (photo[:, :, :2] * 211).astype(np.uint16)),
        ("half", (photo[:, :, :3] / 17).astype(np.float16)),
        ("float", np.exp(photo[:, :, :3] / 9 - 12).astype(np.float32)),
    ]
    found = []
    for profile in ("raw", "fast", "small", "paper"):
        for name, image in images:
            errors = (0, 3) if profile in ("fast", "small") and image.dtype.kind == "u" else (0,)
            for max_error in errors:
                for tile in (0, 16):
                    if profile == "paper" and image.dtype.kind == "f":
                        continue
                    options = EncodeOptions(profile, max_error, tile)  # type: ignore[arg-type]
                    found.append((f"{profile} {name} ±{max_error} /{tile}", encode(image, options)))
    return found


def mutate(data: bytes, other: bytes, rng: np.random.Generator) -> bytes:
    """A file with something wrong in it."""
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        if not changed:
            break
        at = int(rng.integers(len(changed)))
        match int(rng.integers(6)):
            case 0:
                changed[at] ^= 1 << int(rng.integers(8))
            case 1:
                changed[at] = int(rng.choice([0, 1, 127, 128, 255]))
            case 2:
                del changed[at:]
            case 3:
                start = int(rng.integers(len(other)))
                length = int(rng.integers(1, 64))
                changed[at : at + length] = other[start : start + length]
            case 4:
                offset, size = FIELDS[int(rng.integers(len(FIELDS)))]
                value = int(rng.choice(len(EXTREMES)))
                packed = (EXTREMES[value] & (1 << 8 * size) - 1).to_bytes(size, "little")
                changed[offset : offset + size] = packed
            case _:
                length = int(rng.integers(1, 32))
                changed[at:at] = changed[at : at + length]
    return bytes(changed)


def sealed(data: bytes, original: bytes) -> bytes:
    """With the checksums of head, tile indices and groups made right, where they can be found."""
    header = read_header(original)
    changed = bytearray(data)
    head = header.description[0]
    if len(changed) < head:
        return data
    for number, level in enumerate(header.levels):
        end = level.end
        if level.tiled:
            end = level.offset + 8 * level.tiles[0] * level.tiles[1]
            at = end
            for entry in range(level.offset, end, 8):
                length = int.from_bytes(changed[entry : entry + 4], "little")
                crc = zlib.crc32(changed[at : at + length])
                changed[entry + 4 : entry + 8] = crc.to_bytes(4, "little")
                at += length
        place = 44 + 20 * number + 16
        crc = zlib.crc32(changed[level.offset : end])
        changed[place : place + 4] = crc.to_bytes(4, "little")
    changed[head - 4 : head] = zlib.crc32(changed[: head - 4]).to_bytes(4, "little")
    return bytes(changed)


def fuzz(seed: int, mutations: int) -> tuple[Counter[str], list[str], float, int]:
    """Outcomes, failures, the longest time and the growth of the process."""
    rng = np.random.default_rng(seed)
    files = seeds()
    exact = [decode(data) for _, data in files]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    outcomes: Counter[str] = Counter()
    failures: list[str] = []
    longest = 0.0
    for number in range(mutations):
        which = int(rng.integers(len(files)))
        name, data = files[which]
        changed = mutate(data, files[int(rng.integers(len(files)))][1], rng)
        mended = bool(rng.integers(2))
        if mended:
            changed = sealed(changed, data)
        start = time.perf_counter()
        try:
            image = decode(changed, limits=LIMIT)
        except InputError as error:
            outcomes[error.code] += 1
        except Exception as error:
            failures.append(f"seed {seed}, mutation {number}, {name}: {error!r}")
        else:
            same = image.shape == exact[which].shape and image.tobytes() == exact[which].tobytes()
            # A file that is cut, or of which only the end is damaged, gives a coarser level.
            header = read_header(changed)
            finest = header.levels[-1]
            whole = image.shape[:2] == (finest.height, finest.width)
            outcomes["exact" if same else "another image" if whole else "a coarser level"] += 1
            if whole and not same and not mended:
                failures.append(f"seed {seed}, mutation {number}, {name}: a wrong image")
        took = time.perf_counter() - start
        longest = max(longest, took)
        if took > SLOW:
            failures.append(f"seed {seed}, mutation {number}, {name}: {took:.1f} s")
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 - before
    if grown > 2 * LIMIT.decoded_bytes + ALLOWANCE:
        failures.append(f"seed {seed}: the process grew by {grown:,} bytes")
    return outcomes, failures, longest, grown


def main() -> None:
    """Prints the outcomes."""
    parser = argparse.ArgumentParser(description="Mutated files.")
    parser.add_argument("--mutations", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    each = 1000
    parts = -(-given.mutations // each)
    outcomes: Counter[str] = Counter()
    failures: list[str] = []
    longest, grown = 0.0, 0
    with ProcessPoolExecutor(given.jobs) as pool:
        for found in pool.map(fuzz, range(given.seed, given.seed + parts), [each] * parts):
            outcomes += found[0]
            failures += found[1]
            longest, grown = max(longest, found[2]), max(grown, found[3])
    print(f"{sum(outcomes.values()) + len(failures):,} mutations of {len(seeds())} files")
    for outcome, count in outcomes.most_common():
        print(f"{count:9,}  {outcome}")
    print(f"longest call {longest:.2f} s; a process grew by at most {grown / 1e6:.0f} MB")
    print(f"failures: {len(failures)}")
    for failure in failures[:20]:
        print(f"  {failure}")
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
