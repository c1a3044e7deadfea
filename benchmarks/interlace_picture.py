"""Draws docs/pictures/interlace.jpg. ``python benchmarks/interlace_picture.py [-o FILE]``

What a client shows of two paintings of the sample museum (`make sample`) once it has an eighth and
a quarter of the sides: side by side the mean of the texels, which is the level of a `.ptm`, and
the texels that the first interlaced files have, with the bytes until then and the PSNR between the
two. Texels of the smaller ones are drawn as squares.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from at_hand import ROOT
from interlace import box, by_files, by_ptm, psnr
from PIL import Image, ImageDraw, ImageFont

from ptmtools.texture import read_image

PAINTINGS = ("painting_09", "painting_10")
DRAWN, GAP, CAPTION = 256, 8, 22
HALVINGS = (3, 2)


def sheet(folder: Path) -> Image.Image:
    """Rows: paintings; columns: sizes, each as means and as interlaced."""
    columns = 2 * len(HALVINGS)
    size = columns * (DRAWN + GAP) - GAP, len(PAINTINGS) * (DRAWN + CAPTION)
    made = Image.new("RGB", size, "white")
    draw, font = ImageDraw.Draw(made), ImageFont.load_default(12)
    for row, name in enumerate(PAINTINGS):
        image = read_image(folder / f"{name}.png")
        bytes_of = by_ptm(image), by_files("png")(image)
        for place, halvings in enumerate(HALVINGS):
            every = 1 << halvings
            side = len(image) >> halvings
            means, picked = box(image, every, every), image[::every, ::every]
            size_of = f"{side} x {side}"
            texts = (
                f"means, {size_of}: {bytes_of[0][side]:,} B (.ptm)",
                f"interlaced, {size_of}: {bytes_of[1][side]:,} B, {psnr(means, picked):.1f} dB",
            )
            for kind, (texels, text) in enumerate(zip((means, picked), texts, strict=True)):
                x, y = (2 * place + kind) * (DRAWN + GAP), row * (DRAWN + CAPTION)
                shown = Image.fromarray(texels).resize((DRAWN, DRAWN), Image.Resampling.NEAREST)
                made.paste(shown, (x, y))
                draw.text((x, y + DRAWN + 3), text, "black", font)
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", type=Path, default=ROOT / "docs/pictures/interlace.jpg")
    target = parser.parse_args().o
    sheet(ROOT / "build/museum/textures").save(target, quality=80)
    print(f"{target}: {target.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
