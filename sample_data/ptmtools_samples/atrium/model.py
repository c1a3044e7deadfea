"""An atrium: one open hall with two storeys of arcades around a court.

The target scene of tools for single dense models: about 250,000 triangles in one room, most of them
in columns, capitals, drapes, vases and balustrades, and 25 textures of 1024 × 1024 texels. Metres,
Y up; closed. The same options give the same bytes on every machine (for the same numpy and Pillow).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from PIL import Image

from ptmtools_samples.atrium.building import arcades, shell
from ptmtools_samples.atrium.furnishing import (
    balustrades,
    drapes,
    frescoes,
    reliefs,
    runners,
    vases,
)
from ptmtools_samples.atrium.sheets import Sheet, obj_text
from ptmtools_samples.atrium.textures import TEXTURES
from ptmtools_samples.files import HEAD, File, Note, ignore, png
from ptmtools_samples.noise import bytes_of, generator
from ptmtools_samples.options import AtriumOptions
from ptmtools_samples.paintings import PAINTINGS

TITLE = f"# {HEAD} atrium"
#: Paintings of the walls, of different styles.
FRESCOES = 8


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


def make_atrium(options: AtriumOptions, note: Note = ignore) -> Iterator[File]:
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
    materials = "\n".join([f"{TITLE}: materials\n", *blocks]).encode()
    head = [f"{TITLE}: {triangles:,} triangles, seed {options.seed}", "# metres, Y up"]
    for name, load in images.items():
        yield f"textures/{name}.png", load
    yield "atrium.mtl", lambda: materials
    yield "atrium.obj", lambda: obj_text(sheets, head, "atrium.mtl").encode()
