"""Size and speed of the profiles beside other lossless formats, on three sets of images in one run.

    python benchmarks/codec/sizes.py [FOLDER …] [--repeat 2] [--profiles fast,small] [--only-png]

For every image, bytes of the whole pyramid in each profile over those of Pillow's PNG (default
settings) of the finest level alone. For every set, all formats: bytes of the finest level and of
all levels (a file each, where the format has but one), over PNG's finest, and MB/s to encode and
decode, one thread, counted in bytes of the finest level; `.ptm` encodes and decodes all levels in
that time. Times are the best of the repetitions: only their ratios within one run mean something.
Every image is decoded and compared (`ptm compare` does the same for images of your own).

Then the goals of the profiles: totals, and the files that exceed the bound of a single file.

``--bytes raw fast …`` prints only the bytes of the Kodak images and textures, as Markdown. The
encoders are deterministic, so those figures are the same on every machine.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from images import image_files, sample, sets
from numpy.typing import NDArray

from ptmtools.texture import EncodeOptions, decode, encode, read_image
from ptmtools_lab.codecs import Codec, CodecFigures, codecs, measure, total

#: Largest total of `fast` over PNG, and of `small` over JPEG XL effort 7, by set.
FAST_GOALS = {"Kodak": 0.76, "textures": 0.88, "scenes": 0.90}
SMALL_GOAL = 0.95


def ratio(part: CodecFigures, whole: CodecFigures) -> float:
    """All levels of one over the finest of the other."""
    return part.all_bytes / (whole.finest_bytes or part.all_bytes)


def table(measured: Sequence[CodecFigures]) -> None:
    """A line for each codec."""
    png = next(one for one in measured if one.codec == "PNG")
    assert png.finest_bytes
    print(
        f"  {'':22} {'finest':>12} {'/ PNG':>7} {'all levels':>12} {'/ PNG':>7} {'MB/s e / d':>15}"
    )
    for one in measured:
        if one.problem:
            print(f"  {one.codec:22} {one.problem}")
            continue
        finest = f"{one.finest_bytes:12,} {one.finest_bytes / png.finest_bytes:7.3f}" if (
            one.finest_bytes
        ) else " " * 20  # fmt: skip
        speed = [one.raw_bytes / t / 1e6 for t in (one.encode_seconds, one.decode_seconds)]
        every = f"{one.all_bytes:12,} {one.all_bytes / png.finest_bytes:7.3f}"
        print(f"  {one.codec:22} {finest} {every} {speed[0]:6.1f} / {speed[1]:6.1f}")


def verdicts(name: str, files: list[Path], found: list[list[CodecFigures]]) -> None:
    """What is asked, and what was found."""
    sums = {one.codec: one for one in total(found)}
    png = sums["PNG"]
    if fast := sums.get("ptm fast"):
        goal = FAST_GOALS.get(name)
        asked = f" (asked: {goal:.2f})" if goal else ""
        print(f"  fast: {ratio(fast, png):.3f} × PNG{asked}; encode", end=" ")
        print(f"{png.encode_seconds / fast.encode_seconds:.2f} ×, decode", end=" ")
        print(f"{png.decode_seconds / fast.decode_seconds:.2f} × as fast as PNG (4, 1.5)")
    jxl = sums.get("JPEG XL effort 7")
    small = sums.get("ptm small")
    if small and jxl and not jxl.problem:
        print(f"  small: {ratio(small, jxl):.3f} × JPEG XL effort 7 (asked: {SMALL_GOAL})")
    for ours, other, factor, more in (
        ("ptm fast", "PNG", 1.05, 512),
        ("ptm small", "WebP lossless", 1.02, 256),
    ):
        over = []
        for file, row in zip(files, found, strict=True):
            by_name = {one.codec: one for one in row}
            a, b = by_name.get(ours), by_name.get(other)
            if a and b and b.finest_bytes and a.all_bytes > factor * b.finest_bytes + more:
                over.append(f"{file.name} {a.all_bytes:,} ({other} {b.finest_bytes:,})")
        if ours in sums and other in sums:
            print(f"  {ours} above {factor} × {other} + {more}: {', '.join(over) or 'none'}")


def noise(profiles: list[str]) -> None:
    """What cannot be compressed."""
    rng = np.random.default_rng(1)
    for dtype in (np.uint8, np.uint16):
        image: NDArray[np.integer] = rng.integers(0, np.iinfo(dtype).max + 1, (512, 512, 3), dtype)
        for profile in profiles:
            data = encode(image, EncodeOptions(profile))
            print(f"  noise, {np.dtype(dtype)}, {profile}: {len(data) / image.nbytes:.4f} × raw")


def threads(profiles: list[str]) -> None:
    """Two threads against one, on one image without tiles and on one with."""
    photo = sample()
    wide = np.tile(photo, (3, 3, 1))[:1536, :2048]
    for profile in profiles:
        options = EncodeOptions(profile)
        for label, image in (("768 x 512, no tiles", photo), ("2048 x 1536, tiles", wide)):
            seconds = []
            for n in (1, 2):
                start = time.perf_counter()
                data = encode(image, options, threads=n)
                middle = time.perf_counter()
                decode(data, threads=n)
                seconds.append((middle - start, time.perf_counter() - middle))
            (e1, d1), (e2, d2) = seconds
            print(f"  {profile}, {label}: encode {e1 / e2:.2f} ×, decode {d1 / d2:.2f} ×")


def exact_bytes(profiles: Sequence[str]) -> None:
    """Prints bytes of all levels and their share of the raw finest level; no timings."""
    by_name = sets()
    groups = [[read_image(file) for file in by_name[name]] for name in ("Kodak", "textures")]
    print(f"| profile | {len(groups[0])} Kodak images | | {len(groups[1])} textures | |")
    print("|---|---|---|---|---|")
    for profile in profiles:
        shown = []
        for group in groups:
            coded = sum(len(encode(image, EncodeOptions(profile=profile))) for image in group)
            raw = sum(image.nbytes for image in group)
            shown.append(f"{coded:,} | {coded / raw:.1%}")
        print(f"| `{profile}` | {' | '.join(shown)} |", flush=True)


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description="The codec beside other lossless formats.")
    parser.add_argument("folders", nargs="*", type=Path, help="instead of the three sets")
    parser.add_argument("--repeat", type=int, default=2)
    parser.add_argument("--profiles", default="raw,paper,fast,small")
    parser.add_argument("--only-png", action="store_true", help="no other format than PNG")
    parser.add_argument("--bytes", nargs="+", metavar="PROFILE", help="exact bytes alone")
    given = parser.parse_args()
    if given.bytes:
        exact_bytes(given.bytes)
        return
    profiles = given.profiles.split(",")
    contenders: list[Codec] = codecs(profiles)
    if given.only_png:
        contenders = [one for one in contenders if one.pyramid or one.name == "PNG"]
    chosen = {str(folder): image_files(folder) for folder in given.folders} or sets()
    for name, files in chosen.items():
        print(f"{name}: {len(files)} images, whole pyramid over PNG of the finest level")
        actual = []
        for file in files:
            actual.append(measure(read_image(file), contenders, given.repeat))
            by_name = {one.codec: one for one in actual[-1]}
            png = by_name["PNG"]
            shares = "".join(
                f"  {profile} {ratio(by_name[f'ptm {profile}'], png):7.3f}" for profile in profiles
            )
            print(f"  {file.name[:30]:30} {png.finest_bytes:10,}{shares}", flush=True)
        table(total(actual))
        verdicts(name, files, actual)
    print("the extremes")
    noise([profile for profile in profiles if profile != "paper"])
    print("two threads against one")
    threads([profile for profile in profiles if profile in ("fast", "small")])


if __name__ == "__main__":
    main()
