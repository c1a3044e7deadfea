"""Generates an atrium: one open hall with two storeys of arcades around a court.

    python sample_data/make_atrium.py -o build/atrium

The target scene of tools for single dense models: about 250,000 triangles in one room, most of them
in columns, capitals, drapes, vases and balustrades, and 25 textures of 1024 × 1024 texels. Metres,
Y up; closed. The same options give the same bytes on every machine (for the same numpy and Pillow).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from arguments import between
from atrium_parts.building import arcades, shell
from atrium_parts.furnishing import balustrades, drapes, frescoes, reliefs, runners, vases
from atrium_parts.sheets import Sheet, obj_text
from atrium_parts.textures import TEXTURES
from PIL import Image
from ptmtools_samples.files import File, png, write
from ptmtools_samples.museum import generator
from ptmtools_samples.noise import bytes_of
from ptmtools_samples.paintings import PAINTINGS

from ptmtools.errors import PtmError

HEAD = "# ptmtools sample atrium"
#: Paintings of the walls, of different styles.
FRESCOES = 8


@dataclass(frozen=True)
class AtriumOptions:
    """Options of `make_atrium`; ``size`` is the side of the square textures, texels."""

    size: int = 1024
    seed: int = 1


def sheets_of(options: AtriumOptions) -> list[Sheet]:
    """All surfaces; those of an object follow one another."""
    names = [f"fresco_{k + 1}" for k in range(FRESCOES)]
    return [
        *shell(),
        *arcades(),
        *balustrades(),
        *drapes(generator(options.seed, 10)),
        *vases(),
        *reliefs(),
        *frescoes(names),
        *runners(),
    ]


def make_atrium(options: AtriumOptions) -> Iterator[File]:
    """Returns the files of the atrium: relative path and a function that returns the bytes; the OBJ
    comes last."""
    sheets = sheets_of(options)
    triangles = sum(sheet.triangle_count for sheet in sheets)

    def surface(k: int, name: str) -> Callable[[], bytes]:
        def load() -> bytes:
            field = TEXTURES[name](generator(options.seed, 11, k), options.size)
            return png(Image.fromarray(bytes_of(field)))

        return load

    def fresco(k: int) -> Callable[[], bytes]:
        paint = PAINTINGS[k][1]
        return lambda: png(paint(generator(options.seed, 12, k), options.size))

    images = {name: surface(k, name) for k, name in enumerate(TEXTURES)}
    images |= {f"fresco_{k + 1}": fresco(k) for k in range(FRESCOES)}
    blocks = [f"newmtl {name}\nKd 1 1 1\nillum 1\nmap_Kd textures/{name}.png\n" for name in images]
    materials = "\n".join([f"{HEAD}: materials\n", *blocks]).encode()
    head = [f"{HEAD}: {triangles:,} triangles, seed {options.seed}", "# metres, Y up"]
    for name, load in images.items():
        yield f"textures/{name}.png", load
    yield "atrium.mtl", lambda: materials
    yield "atrium.obj", lambda: obj_text(sheets, head, "atrium.mtl").encode()


def main(arguments: list[str] | None = None) -> int:
    default = AtriumOptions()
    parser = argparse.ArgumentParser(
        description="Make the sample atrium: OBJ, MTL and PNG files.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add("-o", "--output", type=Path, required=True, metavar="DIR", help="folder to write")
    add("--size", type=between(4, 8192), default=default.size, help="side of an image, texels")
    add("--seed", type=between(0, 2**63), default=default.seed, help="seed of the random numbers")
    add("--force", action="store_true", help="write into a folder that holds other files")
    given = parser.parse_args(arguments)
    try:
        files = list(make_atrium(AtriumOptions(given.size, given.seed)))
        write(given.output, files, force=given.force)
    except PtmError as error:
        parser.exit(1, f"make_atrium: {error}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
