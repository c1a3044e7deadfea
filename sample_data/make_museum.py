"""Generates the sample museum, a building to try ptmtools on, as OBJ, MTL and PNG files.

    python sample_data/make_museum.py -o sample_data/museum
    python sample_data/make_museum.py -o big --rooms 200 --textures 120
    python sample_data/make_museum.py -o mine --images ~/Pictures
    python sample_data/make_museum.py --two-rooms -o sample_data/two_rooms

Metres, Y up. Floors of rooms, joined by doorways, corridors and stairwells; walls with thickness;
windows of transparent glass (without them, by ``--no-windows``, the building is closed); pictures,
statues and benches. The same seed gives the same bytes on every machine (for the same numpy and
Pillow). Needs numpy and Pillow, not ptmtools.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from museum_parts.files import HEAD, File, between, constant, png, write
from museum_parts.furnishing import furnish, hang
from museum_parts.mesh import Thing
from museum_parts.noise import bytes_of
from museum_parts.obj import number, obj_text
from museum_parts.paintings import PAINTINGS
from museum_parts.plan import make_plan
from museum_parts.shell import make_shell
from museum_parts.surfaces import SURFACES
from museum_parts.two_rooms import two_rooms
from PIL import Image, ImageOps

Color = tuple[float, float, float]

#: Material: texture, tint of the texture, colour without the texture.
MATERIALS: dict[str, tuple[str, Color, Color]] = {
    "plaster_cream": ("plaster_cream", (1, 1, 1), (0.87, 0.84, 0.77)),
    "plaster_red": ("plaster_red", (1, 1, 1), (0.45, 0.15, 0.14)),
    "plaster_green": ("plaster_green", (1, 1, 1), (0.28, 0.36, 0.27)),
    "plaster_blue": ("plaster_cream", (0.52, 0.6, 0.74), (0.44, 0.5, 0.58)),
    "ceiling": ("plaster_cream", (1, 1, 1), (0.9, 0.88, 0.84)),
    "parquet": ("parquet", (1, 1, 1), (0.55, 0.37, 0.2)),
    "carpet": ("carpet", (1, 1, 1), (0.42, 0.12, 0.13)),
    "stone": ("stone", (1, 1, 1), (0.65, 0.64, 0.61)),
    "wood": ("wood", (1, 1, 1), (0.5, 0.33, 0.18)),
    "marble": ("marble", (1, 1, 1), (0.9, 0.89, 0.87)),
    "terracotta": ("marble", (0.78, 0.44, 0.3), (0.66, 0.36, 0.24)),
    "bronze": ("marble", (0.42, 0.36, 0.24), (0.34, 0.29, 0.19)),
    "frame_gilt": ("gilt", (1, 1, 1), (0.72, 0.55, 0.24)),
    "frame_dark": ("wood", (0.55, 0.45, 0.4), (0.3, 0.2, 0.13)),
    "frame_black": ("", (1, 1, 1), (0.09, 0.09, 0.1)),
    "facade": ("facade", (1, 1, 1), (0.72, 0.66, 0.54)),
    "roof": ("stone", (0.5, 0.5, 0.52), (0.32, 0.32, 0.33)),
}
GLASS = "newmtl glass\nKd 0.75 0.85 0.9\nd 0.3\nillum 1\n"


@dataclass(frozen=True)
class MuseumOptions:
    """Options of `make_museum`; ``size`` is the side of the square textures, texels."""

    rooms: int = 12
    textures: int = 31
    size: int = 1024
    seed: int = 1
    windows: bool = True
    images: Path | None = None


@dataclass(frozen=True)
class Picture:
    """A file in the textures folder: name, width over height as hung, and bytes."""

    name: str
    aspect: float
    load: Callable[[], bytes]


def generator(seed: int, *stream: int) -> np.random.Generator:
    """Returns an independent stream of random numbers for a part of the museum."""
    return np.random.Generator(np.random.PCG64([seed, *stream]))


def surface_names(things: list[Thing], textures: int) -> list[str]:
    """Returns the textures of walls and floors, at most a third of all; the rest are paintings."""
    used = {MATERIALS[f.material][0] for t in things for f in t.faces if f.material in MATERIALS}
    used.add("gilt")  # frames are hung later
    return [name for name in SURFACES if name in used][: textures // 3]


def surface_pictures(names: list[str], options: MuseumOptions) -> list[Picture]:
    def loader(name: str) -> Callable[[], bytes]:
        stream = list(SURFACES).index(name)

        def load() -> bytes:
            field = SURFACES[name](generator(options.seed, 1, stream), options.size)
            return png(Image.fromarray(bytes_of(field)))

        return load

    return [Picture(f"{name}.png", 1.0, loader(name)) for name in names]


def generated_pictures(count: int, options: MuseumOptions) -> list[Picture]:
    def loader(k: int) -> Callable[[], bytes]:
        paint = PAINTINGS[k % len(PAINTINGS)][1]
        return lambda: png(paint(generator(options.seed, 2, k), options.size))

    return [
        Picture(f"painting_{k + 1:02d}.png", PAINTINGS[k % len(PAINTINGS)][2], loader(k))
        for k in range(count)
    ]


def users_pictures(folder: Path) -> list[Picture]:
    """Returns the images of a folder, ordered by name, under names safe on every system.

    PNG and JPEG files are copied byte for byte unless the camera orientation must be applied; other
    formats are converted to PNG. Files that Pillow cannot read are named on stderr.
    """
    actual: list[Picture] = []
    for path in sorted(p for p in folder.iterdir() if p.is_file()):
        try:
            with Image.open(path) as image:
                image.load()
                upright = ImageOps.exif_transpose(image)
                kept = image.format in ("PNG", "JPEG") and image.getexif().get(0x0112, 1) == 1
                suffix = ".jpg" if kept and image.format == "JPEG" else ".png"
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
            print(f"make_museum: {path}: not an image, left out: {error}", file=sys.stderr)
            continue
        data = (
            path.read_bytes()
            if kept
            else png(upright.convert("RGBA" if "A" in upright.getbands() else "RGB"))
        )
        actual.append(
            Picture(
                f"painting_{len(actual) + 1:02d}{suffix}",
                upright.width / upright.height,
                constant(data),
            )
        )
    return actual


def mtl_text(things: list[Thing], surfaces: list[str], pictures: list[Picture]) -> str:
    """Returns the used materials in a fixed order."""
    used = {face.material for thing in things for face in thing.faces}
    blocks = [f"{HEAD} museum: materials\n"]
    for name, (texture, tint, plain) in MATERIALS.items():
        if name in used:
            textured = texture in surfaces
            kd = " ".join(number(c, 3) for c in (tint if textured else plain))
            image = f"map_Kd textures/{texture}.png\n" if textured else ""
            blocks.append(f"newmtl {name}\nKd {kd}\nillum 1\n{image}")
    if "glass" in used:
        blocks.append(GLASS)
    for k, picture in enumerate(pictures):
        image = f"map_Kd -clamp on textures/{picture.name}"
        blocks.append(f"newmtl painting_{k + 1:02d}\nKd 1 1 1\nillum 1\n{image}\n")
    return "\n".join(blocks)


def make_museum(options: MuseumOptions) -> Iterator[File]:
    """Returns the files of the museum: relative path and a function that returns the bytes; the OBJ
    comes last.

    Raises ValueError if there are more pictures than walls, or if no image of the user can be read.
    """
    plan = make_plan(options.rooms, generator(options.seed, 0), windows=options.windows)
    shell, panels = make_shell(plan)
    furniture = furnish(plan, generator(options.seed, 4))
    surfaces = surface_pictures(surface_names([*shell, *furniture], options.textures), options)
    if options.images:
        pictures = users_pictures(options.images)
    else:
        pictures = generated_pictures(options.textures - len(surfaces), options)
    if not pictures:
        raise ValueError(f"no image in {options.images}")
    hung = hang(panels, [p.aspect for p in pictures], options.rooms, generator(options.seed, 3))
    things = [*shell, *hung, *furniture]
    head = [
        f"{HEAD} museum: {options.rooms} rooms on {plan.storeys} floors, "
        f"{len(surfaces) + len(pictures)} textures, seed {options.seed}",
        "# metres, Y up",
    ]
    names = [p.name.removesuffix(".png") for p in surfaces]
    materials = mtl_text(things, names, pictures).encode()
    model = obj_text(things, head, "museum.mtl").encode()
    for picture in (*surfaces, *pictures):
        yield f"textures/{picture.name}", picture.load
    yield "museum.mtl", lambda: materials
    yield "museum.obj", lambda: model


def main(arguments: list[str] | None = None) -> int:
    default = MuseumOptions()
    parser = argparse.ArgumentParser(
        description="Make the sample museum: OBJ, MTL and PNG files.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add("-o", "--output", type=Path, required=True, metavar="DIR", help="folder to write")
    add("--rooms", type=between(1, 2000), default=default.rooms, help="rooms besides corridors")
    add(
        "--textures",
        type=between(1, 5000),
        default=default.textures,
        help="number of generated images",
    )
    add("--size", type=between(4, 8192), default=default.size, help="side of an image, texels")
    add("--seed", type=between(0, 2**63), default=default.seed, help="seed of the random numbers")
    add("--images", type=Path, metavar="DIR", help="hang the images of this folder instead")
    add("--no-windows", action="store_true", help="a closed building")
    add("--two-rooms", action="store_true", help="write the hand-checkable two rooms instead")
    add("--force", action="store_true", help="write into a folder that holds other files")
    given = parser.parse_args(arguments)
    if given.images and not given.images.is_dir():
        parser.error(f"{given.images} is not a folder")
    options = MuseumOptions(
        given.rooms, given.textures, given.size, given.seed, not given.no_windows, given.images
    )
    try:
        if given.two_rooms:
            files = [(name, constant(data)) for name, data in two_rooms().items()]
        else:
            files = list(make_museum(options))
        write(given.output, files, force=given.force)
    except (OSError, ValueError) as error:
        parser.exit(1, f"make_museum: {error}\n")
    total = sum((given.output / name).stat().st_size for name, _ in files)
    print(f"{given.output}: {len(files)} files, {total / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
