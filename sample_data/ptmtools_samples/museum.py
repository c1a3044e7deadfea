"""The sample museum, a building to try ptmtools on: OBJ, MTL and PNG files.

Metres, Y up. Floors of rooms, joined by doorways, corridors and stairwells; walls with thickness;
windows of transparent glass (without them, by ``--no-windows``, the building is closed); pictures,
statues and benches. The same seed gives the same bytes on every machine (for the same numpy and
Pillow).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from PIL import Image, ImageOps

from ptmtools.errors import InputError
from ptmtools_samples.files import HEAD, File, Note, constant, ignore, png
from ptmtools_samples.furnishing import furnish, hang
from ptmtools_samples.mesh import Thing
from ptmtools_samples.noise import bytes_of, generator
from ptmtools_samples.obj import number, obj_text
from ptmtools_samples.options import MuseumOptions
from ptmtools_samples.paintings import PAINTINGS
from ptmtools_samples.plan import make_plan
from ptmtools_samples.shell import make_shell
from ptmtools_samples.surfaces import SURFACES

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
class MuseumPicture:
    """A file in the textures folder: name, width over height as hung, and bytes."""

    name: str
    aspect: float
    load: Callable[[], bytes]


def surface_names(things: list[Thing], textures: int) -> list[str]:
    """Returns the textures of walls and floors, at most a third of all; the rest are paintings."""
    used = {MATERIALS[f.material][0] for t in things for f in t.faces if f.material in MATERIALS}
    used.add("gilt")  # frames are hung later
    return [name for name in SURFACES if name in used][: textures // 3]


def surface_pictures(names: list[str], options: MuseumOptions) -> list[MuseumPicture]:
    def loader(name: str) -> Callable[[], bytes]:
        stream = list(SURFACES).index(name)

        def load() -> bytes:
            field = SURFACES[name](generator(options.seed, 1, stream), options.size)
            return png(Image.fromarray(bytes_of(field)))

        return load

    return [MuseumPicture(f"{name}.png", 1.0, loader(name)) for name in names]


def generated_pictures(count: int, options: MuseumOptions) -> list[MuseumPicture]:
    def loader(k: int) -> Callable[[], bytes]:
        paint = PAINTINGS[k % len(PAINTINGS)][1]
        return lambda: png(paint(generator(options.seed, 2, k), options.size))

    return [
        MuseumPicture(f"painting_{k + 1:02d}.png", PAINTINGS[k % len(PAINTINGS)][2], loader(k))
        for k in range(count)
    ]


def users_pictures(folder: Path) -> tuple[list[MuseumPicture], list[str]]:
    """The images of a folder, ordered by name, under names safe on every system, and notes on
    files that Pillow cannot read.

    PNG and JPEG files are copied byte for byte unless the camera orientation must be applied; other
    formats are converted to PNG.
    """
    actual: list[MuseumPicture] = []
    notes: list[str] = []
    for path in sorted(p for p in folder.iterdir() if p.is_file()):
        try:
            with Image.open(path) as image:
                image.load()
                upright = ImageOps.exif_transpose(image)
                kept = image.format in ("PNG", "JPEG") and image.getexif().get(0x0112, 1) == 1
                suffix = ".jpg" if kept and image.format == "JPEG" else ".png"
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
            notes.append(f"{path}: not an image, left out: {error}")
            continue
        data = (
            path.read_bytes()
            if kept
            else png(upright.convert("RGBA" if "A" in upright.getbands() else "RGB"))
        )
        actual.append(
            MuseumPicture(
                f"painting_{len(actual) + 1:02d}{suffix}",
                upright.width / upright.height,
                constant(data),
            )
        )
    return actual, notes


def mtl_text(things: list[Thing], surfaces: list[str], pictures: list[MuseumPicture]) -> str:
    """Returns the used materials in a fixed order."""
    used = {face.material for thing in things for face in thing.faces}
    blocks = [f"# {HEAD} museum: materials\n"]
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


def make_museum(options: MuseumOptions, note: Note = ignore) -> Iterator[File]:
    """The files of the museum: relative path and a function that returns the bytes; the OBJ comes
    last. ``note`` gets a line about each of the user's files that is left out.

    Raises InputError: PTM-I111 more pictures than the walls hold, or no image of the user can be
    read.
    """
    plan = make_plan(options.rooms, generator(options.seed, 0), windows=options.windows)
    shell, panels = make_shell(plan)
    furniture = furnish(plan, generator(options.seed, 4))
    surfaces = surface_pictures(surface_names([*shell, *furniture], options.textures), options)
    if options.images:
        pictures, notes = users_pictures(Path(options.images))
        for text in notes:
            note(text)
    else:
        pictures = generated_pictures(options.textures - len(surfaces), options)
    if not pictures:
        raise InputError(
            "PTM-I111", "contains no image", file=options.images, remedy="name a folder of images"
        )
    hung = hang(panels, [p.aspect for p in pictures], options.rooms, generator(options.seed, 3))
    things = [*shell, *hung, *furniture]
    head = [
        f"# {HEAD} museum: {options.rooms} rooms on {plan.storeys} floors, "
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
