"""Bytes until a level can be shown, beside other ways of sending coarse before fine.

    python benchmarks/codec/progressive.py [--images 6] [-o build/bench/progressive.png]

For every k: the bytes that must have arrived before the level k halvings below the finest is whole,
summed over images of both sets of textures, over the bytes of Pillow's PNG of the finest alone.

- `.ptm`: the end of the level's group.
- PNG mip chain, WebP mip chain: a file for each level, coarsest first.
- Adam7: passes 1, 3, 5 and 7 complete a half, with an aliased picture: texels picked, not averaged.
  Each pass is counted as Pillow compresses it alone, without its head, as no available encoder
  interlaces; coarser levels than an eighth do not exist.
- JPEG 2000: the end of the last packet of the resolution, in resolution-major order; as many
  resolutions as the format's default, six.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from images import OUTPUT, sets
from numpy.typing import NDArray
from PIL import Image

from ptmtools.texture import EncodeOptions, build_pyramid, encode, read_header, read_image
from ptmtools.texture.images import png_bytes

#: A PNG without any texel.
PNG_OVERHEAD = 57
RESOLUTIONS = 6
#: Markers of JPEG 2000: SOD, PLT, EOC.
START_OF_DATA, PACKET_LENGTHS, END_OF_CODESTREAM = b"\xff\x93", b"\xff\x58", b"\xff\xd9"


def by_ptm(profile: str) -> Callable[[NDArray[Any]], list[int]]:
    """Bytes until each level, finest first."""

    def sizes(image: NDArray[Any]) -> list[int]:
        header = read_header(encode(image, EncodeOptions(profile)))
        return [level.end for level in header.levels[::-1]]

    return sizes


def chain(single: Callable[[NDArray[Any]], bytes]) -> Callable[[NDArray[Any]], list[int]]:
    """The same for a file per level."""

    def sizes(image: NDArray[Any]) -> list[int]:
        return [int(n) for n in np.cumsum([len(single(i)) for i in build_pyramid(image)])[::-1]]

    return sizes


def webp(image: NDArray[Any]) -> bytes:
    """Lossless WebP."""
    buffer = io.BytesIO()
    texels = np.repeat(image, 3, axis=2) if image.shape[2] == 1 else image
    Image.fromarray(texels).save(buffer, "WEBP", lossless=True, method=4, exact=True)
    return buffer.getvalue()


def by_adam7(image: NDArray[Any]) -> list[int]:
    """Bytes until passes 7, 5, 3 and 1."""
    passes = [
        (slice(0, None, 8), slice(0, None, 8)),
        (slice(0, None, 8), slice(4, None, 8)),
        (slice(4, None, 8), slice(0, None, 4)),
        (slice(0, None, 4), slice(2, None, 4)),
        (slice(2, None, 4), slice(0, None, 2)),
        (slice(0, None, 2), slice(1, None, 2)),
        (slice(1, None, 2), slice(0, None, 1)),
    ]
    sizes = [len(png_bytes(np.ascontiguousarray(image[p]))) - PNG_OVERHEAD for p in passes]
    until = PNG_OVERHEAD + np.cumsum(sizes)
    return [int(until[n - 1]) for n in (7, 5, 3, 1)]


def by_jpeg2000(image: NDArray[Any]) -> list[int]:
    """Bytes until each resolution, finest first."""
    buffer = io.BytesIO()
    texels = image[:, :, 0] if image.shape[2] == 1 else image
    Image.fromarray(texels).save(
        buffer, "JPEG2000", irreversible=False, num_resolutions=RESOLUTIONS, no_jp2=True,
        progression="RLCP", plt=True, mct=int(image.shape[2] > 2),
    )  # fmt: skip
    data = buffer.getvalue()
    lengths = packet_lengths(data)
    # One quality layer and one precinct: a packet for every component of every resolution.
    assert len(lengths) == RESOLUTIONS * image.shape[2]
    start = len(data) - sum(lengths) - len(END_OF_CODESTREAM)
    ends = start + np.cumsum(np.reshape(lengths, (RESOLUTIONS, -1)).sum(axis=1))
    return [int(end) for end in ends[::-1]]


def packet_lengths(data: bytes) -> list[int]:
    """What the markers PLT of the only tile say: numbers of 7 bits a byte, high ones first."""
    lengths, at = [], 2
    while (marker := data[at : at + 2]) != START_OF_DATA:
        size = int.from_bytes(data[at + 2 : at + 4], "big")
        if marker == PACKET_LENGTHS:
            value = 0
            for byte in data[at + 5 : at + 2 + size]:
                value = value << 7 | byte & 127
                if byte < 128:
                    lengths.append(value)
                    value = 0
        at += 2 + size
    return lengths


WAYS: dict[str, Callable[[NDArray[Any]], list[int]]] = {
    "ptm fast": by_ptm("fast"),
    "ptm small": by_ptm("small"),
    "ptm raw": by_ptm("raw"),
    "PNG mip chain": chain(png_bytes),
    "WebP mip chain": chain(webp),
    "Adam7 (aliased)": by_adam7,
    "JPEG 2000": by_jpeg2000,
}


def draw(shares: dict[str, list[float]], output: Path) -> None:
    """The table as a picture."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8, 5))
    for way, actual in shares.items():
        axes.plot(range(len(actual)), actual, marker="o", markersize=4, label=way)
    axes.set(
        xlabel="halvings below the finest level",
        ylabel="bytes until that level, over PNG of the finest",
        yscale="log",
    )
    axes.grid(alpha=0.3)
    axes.legend()
    output.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(output, dpi=120, bbox_inches="tight")


def main() -> None:
    """Prints the table and draws it."""
    parser = argparse.ArgumentParser(description="Bytes until each level.")
    parser.add_argument("--images", type=int, default=6)
    parser.add_argument("-o", "--output", type=Path, default=OUTPUT / "progressive.png")
    given = parser.parse_args()
    actual = sets()
    files = [*actual["Kodak"][: (given.images + 1) // 2], *actual["textures"][: given.images // 2]]
    images = [read_image(file) for file in files]
    png = sum(len(png_bytes(image)) for image in images)
    deepest = min(len(build_pyramid(image)) for image in images)
    print(f"{len(images)} images: {', '.join(file.name for file in files)}")
    print(f"{'halvings below the finest':26}" + "".join(f"{k:9}" for k in range(deepest)))
    shares: dict[str, list[float]] = {}
    for way, sizes in WAYS.items():
        until = [sizes(image) for image in images]
        depth = min(deepest, *(len(one) for one in until))
        shares[way] = [sum(one[k] for one in until) / png for k in range(depth)]
        print(f"{way:26}" + "".join(f"{share:9.5f}" for share in shares[way]), flush=True)
    draw(shares, given.output)
    print(f"drawn in {given.output}")


if __name__ == "__main__":
    main()
