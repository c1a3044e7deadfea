"""Compares interlaced images with `.ptm`, Adam7 and a chain of mip files.

Also measures previews and checks the claims of the paper row by row.

    python benchmarks/interlace.py [--quick] [--only bytes previews claims]

Runs on the images of `../shared/textures`: the central 512 × 512 texels of the photographs, so
that no image is scaled, and the textures of 1024 × 1024. Prints the tables of
docs/formats/interlace.md.

- Adam7: a PNG written by this script, one deflate stream, filters and settings of Pillow; Pillow
  reads it back. Bytes until a resolution: those from which zlib returns the last row of the pass.
- mip chain: a PNG of each box-filtered level from 128² on, fetched in order.
- FLIP (flip-evaluator): at 67 pixels per degree, one texel per pixel, both pictures of equal size.
"""

from __future__ import annotations

import argparse
import io
import json
import struct
import sys
import time
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scenes import SHARED

from ptmtools.texture import (
    Picture,
    decode_levels,
    encode,
    read_header,
    read_image,
)
from ptmtools.texture.images import png_bytes
from ptmtools_systems.interlace import InterlaceOptions, interlace, join, split
from ptmtools_systems.interlace.model import axes_of
from ptmtools_systems.interlace.steps import stride

Texels = NDArray[Any]
#: First column, first row, and every how many-th of them a pass of Adam7 has.
PASSES = (
    (0, 0, 8, 8),
    (4, 0, 8, 8),
    (0, 4, 4, 8),
    (2, 0, 4, 4),
    (0, 2, 2, 4),
    (1, 0, 2, 2),
    (0, 1, 1, 2),
)
#: Pass that completes a half, a quarter … of the image, by the number of halvings.
COMPLETES = {0: 7, 1: 5, 2: 3, 3: 1}
#: Sides that a client waits for.
SIDES = (128, 256, 512, 1024)
PER_DEGREE = 67.0
#: Images of a set with --quick.
QUICK = 2


def sets(quick: bool) -> dict[str, list[Texels]]:
    """The images, by the name of their set."""
    files = sorted((SHARED / "textures").glob("*.png"))
    photographs = [f for f in files if f.name.startswith("kodim")]
    textures = [f for f in files if not f.name.startswith("kodim")]
    if quick:
        photographs, textures = photographs[:QUICK], textures[:QUICK]
    return {
        "photographs, 512²": [middle(read_image(file), 512) for file in photographs],
        "textures, 1024²": [middle(read_image(file), 1024) for file in textures],
    }


def middle(image: Texels, side: int) -> Texels:
    y, x = (image.shape[0] - side) // 2, (image.shape[1] - side) // 2
    return np.ascontiguousarray(image[y : y + side, x : x + side])


def box(image: Texels, rows: int, columns: int) -> Texels:
    """Means of blocks of ``rows`` × ``columns`` texels, rounded to the nearest."""
    height, width, components = image.shape
    blocks = image.reshape(height // rows, rows, width // columns, columns, components)
    total = blocks.sum(axis=(1, 3), dtype=np.int64)
    return ((total + rows * columns // 2) // (rows * columns)).astype(np.uint8)


# Bytes until a side is complete, by side; the whole is under the side of the image.


def by_files(format: str) -> Callable[[Texels], dict[int, int]]:
    def ends(image: Texels) -> dict[int, int]:
        parts = interlace(Picture(image), InterlaceOptions(format=format)).interlaced.parts
        total = np.cumsum([part.bytes for part in parts]).tolist()
        return {p.joined[0]: end for p, end in zip(parts, total, strict=True)}

    return ends


def by_ptm(image: Texels) -> dict[int, int]:
    return {level.width: level.end for level in read_header(encode(image)).levels}


def by_chain(single: Callable[[Texels], bytes]) -> Callable[[Texels], dict[int, int]]:
    def ends(image: Texels) -> dict[int, int]:
        sides = [side for side in SIDES if side <= len(image)]
        levels = [box(image, len(image) // side, len(image) // side) for side in sides]
        total = np.cumsum([len(single(level)) for level in levels]).tolist()
        return dict(zip(sides, total, strict=True))

    return ends


def by_one(image: Texels) -> dict[int, int]:
    return {len(image): len(png_bytes(image))}


def by_adam7(image: Texels) -> dict[int, int]:
    data, ends = adam7(image)
    assert (np.asarray(Image.open(io.BytesIO(data))).reshape(image.shape) == image).all()
    return {len(image) >> halvings: ends[number - 1] for halvings, number in COMPLETES.items()}


def adam7(image: Texels) -> tuple[bytes, list[int]]:
    """An interlaced PNG, and how many of its bytes give each pass."""
    passes = [filtered(image[y::dy, x::dx]) for x, y, dx, dy in PASSES]
    return packed(image, passes, 1)


def packed(image: Texels, passes: list[bytes], interlaced: int) -> tuple[bytes, list[int]]:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    # As Pillow: level 6, memory level 9, the strategy for filtered data.
    packer = zlib.compressobj(6, zlib.DEFLATED, 15, 9, zlib.Z_FILTERED)
    stream = packer.compress(b"".join(passes)) + packer.flush()
    height, width, components = image.shape
    colour = {1: 0, 2: 4, 3: 2, 4: 6}[components]
    head = struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, interlaced)
    before = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head)
    data = before + chunk(b"IDAT", stream) + chunk(b"IEND", b"")
    unpacker, given = zlib.decompressobj(), 0
    ends: list[int] = []
    wanted = np.cumsum([len(part) for part in passes]).tolist()
    for at in range(0, len(stream), 16):
        given += len(unpacker.decompress(stream[at : at + 16]))
        while len(ends) < len(wanted) and given >= wanted[len(ends)]:
            ends.append(len(before) + 8 + min(at + 16, len(stream)))
    ends[-1] = len(data)
    return data, ends


def filtered(image: Texels) -> bytes:
    """Rows of a PNG or a pass, each by the filter of the least sum of magnitudes."""
    height, width, texel = image.shape
    padded = np.zeros((height + 1, (width + 1) * texel), np.int16)
    padded[1:, texel:] = image.reshape(height, -1)
    here, left = padded[1:, texel:], padded[1:, :-texel]
    above, corner = padded[:-1, texel:], padded[:-1, :-texel]
    a, b, c = abs(above - corner), abs(left - corner), abs(left + above - 2 * corner)
    paeth = np.where((a <= b) & (a <= c), left, np.where(b <= c, above, corner))
    guesses = (0 * here, left, above, (left + above) >> 1, paeth)
    rows = np.stack([(here - guess).astype(np.uint8) for guess in guesses])
    best = abs(rows.view(np.int8).astype(np.int16)).sum(axis=2).argmin(axis=0)
    out = np.empty((height, 1 + width * texel), np.uint8)
    out[:, 0], out[:, 1:] = best, rows[best, np.arange(height)]
    return out.tobytes()


def webp(image: Texels) -> bytes:
    return by_pillow(image, "WEBP", lossless=True, method=4)


def by_pillow(image: Texels, format: str, **settings: Any) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image[:, :, 0] if image.shape[2] == 1 else image).save(
        buffer, format, **settings
    )
    return buffer.getvalue()


WAYS: dict[str, Callable[[Texels], dict[int, int]]] = {
    "interlaced PNG": by_files("png"),
    "interlaced WebP": by_files("webp"),
    "`.ptm`, profile `fast`": by_ptm,
    "PNG, Adam7": by_adam7,
    "mip chain of PNGs": by_chain(png_bytes),
    "mip chain of WebPs": by_chain(webp),
    "one PNG": by_one,
}


def table_of_bytes(images: dict[str, list[Texels]]) -> Iterator[str]:
    """Bytes until each side, and over one PNG."""
    for name, these in images.items():
        sides = [side for side in SIDES if side <= len(these[0])]
        plain = sum(len(png_bytes(image)) for image in these)
        yield f"Bytes of {len(these)} {name}, in brackets as a share of one PNG each:\n"
        yield "| | " + " | ".join(f"until {side}²" for side in sides) + " |"
        yield "|---|" + "---:|" * len(sides)
        for way, ends_of in WAYS.items():
            ends = [ends_of(image) for image in these]
            cells = []
            for side in sides:
                known = all(side in end for end in ends)
                total = sum(end[side] for end in ends) if known else 0
                cells.append(f"{total:,} ({total / plain:.1%})" if known else "–")
            yield f"| {way} | " + " | ".join(cells) + " |"
        yield ""
    ours = [
        len(packed(i, [filtered(i)], 0)[0]) / len(png_bytes(i)) for i in next(iter(images.values()))
    ]
    share = f"{np.mean(ours):.2%}"
    yield f"(Check: our own writer makes a PNG that is not interlaced {share} of Pillow's.)\n"


def psnr(first: Texels, second: Texels) -> float:
    error = ((first.astype(float) - second) ** 2).mean()
    return float("inf") if error == 0 else float(10 * np.log10(255**2 / error))


def flip(first: Texels, second: Texels) -> float:
    import flip_evaluator

    def real(image: Texels) -> Texels:
        return np.broadcast_to(image / np.float32(255), (*image.shape[:2], 3)).astype(np.float32)

    settings = {"ppd": PER_DEGREE}
    return float(
        flip_evaluator.evaluate(
            real(first), real(second), "LDR", applyMagma=False, parameters=settings
        )[1]
    )


def table_of_previews(images: dict[str, list[Texels]], quick: bool) -> Iterator[str]:
    """What a step shows, against the box-filtered level of the same size."""
    for name, these in images.items():
        side = len(these[0])
        axes = axes_of(side, side, 128)
        yield f"Previews of {len(these)} {name}, against box-filtered images of the same size:\n"
        yield "| files | size | PSNR, dB: mean (least to most) | FLIP | the `.ptm` level |"
        yield "|---:|---:|---:|---:|---:|"
        pyramids = [decode_levels(encode(image)) for image in these]
        for step in range(1, len(axes) + 1):
            rows, columns = stride(axes, step)
            shown = [image[::rows, ::columns] for image in these]
            means = [box(image, rows, columns) for image in these]
            actual = [psnr(*pair) for pair in zip(means, shown, strict=True)]
            looks = theirs = "–"
            if rows == columns:
                levels = [next(x for x in p if len(x) == len(means[0])) for p in pyramids]
                own = np.mean([psnr(*pair) for pair in zip(means, levels, strict=True)])
                theirs = f"{own:.1f} dB"
                if not quick:
                    looks = f"{np.mean([flip(*p) for p in zip(means, shown, strict=True)]):.3f}"
                    own = np.mean([flip(*p) for p in zip(means, levels, strict=True)])
                    theirs += f", {own:.3f}"
            yield (
                f"| {step} | {side // columns} × {side // rows} | {np.mean(actual):.1f} "
                f"({min(actual):.1f} to {max(actual):.1f}) | {looks} | {theirs} |"
            )
        yield ""


def table_of_claims(images: dict[str, list[Texels]]) -> Iterator[str]:
    """What the paper claims, by numbers."""
    counts = ", ".join(
        f"{side}² → {len(axes_of(side, side, 128)) + 1}" for side in (512, 1024, 2048, 4096)
    )
    yield f"Files by size: {counts}\n"
    for name, these in images.items():
        yield f"{len(these)} {name}:\n"
        yield "| container | over one file | without the last saves: mean (least to most) |"
        yield "|---|---:|---:|"
        singles: dict[str, Callable[[Texels], bytes]] = {
            "png": png_bytes,
            "webp": webp,
            "jpg": lambda image: by_pillow(image, "JPEG", quality=90),
        }
        for format, single in singles.items():
            made = [interlace(Picture(i), InterlaceOptions(format=format)) for i in these]
            whole = sum(one.interlaced.bytes for one in made) / sum(len(single(i)) for i in these)
            last = [one.interlaced.parts[-1].bytes / one.interlaced.bytes for one in made]
            spread = f"{min(last):.1%} to {max(last):.1%}"
            yield f"| {format} | {whole:.3f} × | {np.mean(last):.1%} ({spread}) |"
        yield ""
        lossy = [jpeg_quality(image) for image in these]
        one, joined = np.mean(lossy, axis=0)
        yield f"JPEG of quality 90: PSNR {one:.1f} dB as one file, {joined:.1f} dB joined\n"
        yield from saved_by_view(these)
    yield from scaling_cost()
    yield from first_previews(images["textures, 1024²"])
    yield from decoding(images["textures, 1024²"])


def scaling_cost() -> Iterator[str]:
    """What it costs that sides become powers of two."""
    files = sorted((SHARED / "textures").glob("kodim*.png"))
    made = [interlace(Picture(read_image(file))).interlaced for file in files]
    plain = sum(len(png_bytes(read_image(file))) for file in files)
    texels = sum(one.width * one.height for one in made)
    were = sum(one.original[0] * one.original[1] for one in made)
    documents = [len(json.dumps(one.document(), indent=1)) + 1 for one in made]
    yield (
        f"{len(files)} photographs of 768 × 512, whole: once scaled {texels / were:.2f} × the "
        f"texels, {sum(one.bytes for one in made) / plain:.2f} × the bytes of one PNG each; "
        f"interlace.json has {min(documents):,} to {max(documents):,} bytes\n"
    )


def jpeg_quality(image: Texels) -> tuple[float, float]:
    """PSNR of a JPEG, and of the files joined."""
    axes = axes_of(len(image), len(image), 128)
    parts = [decoded(by_pillow(part, "JPEG", quality=90), image) for part in split(image, axes)]
    joined = parts[0]
    for part, axis in zip(parts[1:], axes, strict=True):
        joined = join(joined, part, axis)
    return psnr(image, decoded(by_pillow(image, "JPEG", quality=90), image)), psnr(image, joined)


def decoded(data: bytes, like: Texels) -> Texels:
    texels = np.asarray(Image.open(io.BytesIO(data)))
    return texels.reshape(*texels.shape[:2], like.shape[2])


def saved_by_view(these: list[Texels]) -> Iterator[str]:
    """Bytes that are not needed where an image is shown smaller than it is."""
    side = len(these[0])
    files, levels = [by_files("png")(i) for i in these], [by_ptm(i) for i in these]
    plain = sum(len(png_bytes(i)) for i in these)
    parts = []
    for shown in (s for s in SIDES if s < side):
        saved = [1 - sum(end[shown] for end in ends) / plain for ends in (files, levels)]
        parts.append(f"at {shown}² {saved[0]:.1%} (`.ptm` {saved[1]:.1%})")
    yield f"Saved over one PNG each where {side}² is shown smaller: {'; '.join(parts)}\n"
    many = [
        f"at {shown}² {plain / sum(end[shown] for end in files):.1f} (`.ptm` "
        f"{plain / sum(end[shown] for end in levels):.1f})"
        for shown in (s for s in SIDES if s < side)
    ]
    yield f"Images shown smaller in the bytes of one whole PNG: {'; '.join(many)}\n"


def first_previews(these: list[Texels]) -> Iterator[str]:
    """The first preview of the same pictures from sources of several sizes."""
    yield f"The first preview of {len(these)} textures from sources of several sizes, mean bytes:\n"
    yield "| source | interlaced PNG, 1.png | Adam7, first pass | `.ptm`, up to 128² |"
    yield "|---|---:|---:|---:|"
    for side in (256, 512, 1024, 2048):
        if side > len(these[0]):  # four textures beside each other
            pairs = [np.concatenate([one, one[:, ::-1]], axis=1) for one in these]
            sources = [np.concatenate([one, one[::-1]], axis=0) for one in pairs]
        else:
            sources = [box(one, len(one) // side, len(one) // side) for one in these]
        first = np.mean([by_files("png")(image)[128] for image in sources])
        coarse = np.mean([adam7(image)[1][0] for image in sources])
        level = np.mean([by_ptm(image)[128] for image in sources])
        mirrored = ", mirrored" if side > len(these[0]) else ""
        yield f"| {side}²{mirrored} | {first:,.0f} | {coarse:,.0f} ({side // 8}²) | {level:,.0f} |"
    yield ""


def decoding(these: list[Texels]) -> Iterator[str]:
    """How long joining takes beside decoding the files, by numpy."""
    image = these[0]
    axes = axes_of(len(image), len(image), 128)
    files = [png_bytes(np.ascontiguousarray(part)) for part in split(image, axes)]
    whole = png_bytes(image)
    unpacking = joining = one = float("inf")
    for _ in range(5):
        start = time.perf_counter()
        parts = [decoded(data, image) for data in files]
        middle_of = time.perf_counter()
        joined = parts[0]
        for part, axis in zip(parts[1:], axes, strict=True):
            joined = join(joined, part, axis)
        end = time.perf_counter()
        decoded(whole, image)
        unpacking, joining = min(unpacking, middle_of - start), min(joining, end - middle_of)
        one = min(one, time.perf_counter() - end)
    assert (joined == image).all()
    yield (
        f"Time of one texture, ms: {one * 1e3:.0f} one PNG by Pillow; {unpacking * 1e3:.0f} the "
        f"files, and {joining * 1e3:.0f} all steps by numpy\n"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="two images of each set, without FLIP")
    parser.add_argument("--only", nargs="+", default=["bytes", "previews", "claims"])
    given = parser.parse_args()
    if not (SHARED / "textures").is_dir():
        sys.exit(
            f"there are no images in {SHARED / 'textures'}; name the folder above in PTM_SHARED"
        )
    images = sets(given.quick)
    tables: dict[str, Callable[[], Iterator[str]]] = {
        "bytes": lambda: table_of_bytes(images),
        "previews": lambda: table_of_previews(images, given.quick),
        "claims": lambda: table_of_claims(images),
    }
    for name in given.only:
        for line in tables[name]():
            print(line, flush=True)


if __name__ == "__main__":
    main()
