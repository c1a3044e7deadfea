"""The sample campus: forty buildings along a street of 1 km, as OBJ, MTL and PNG files.

Metres, Y up. The campus stands in for that of the paper on levels of detail (section IV): in the
first third no two buildings share a wall texture, the last third is homogeneous. Some materials
also have a specular mask (``map_Ks``), the trees an opacity mask (``map_d``).
``campus_way.json`` is a walk along the street at 11 km/h, for ``ptm simulate``. The same seed gives
the same bytes on every machine (for the same numpy and Pillow).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from PIL import Image

from ptmtools_samples.campus.buildings import build
from ptmtools_samples.campus.furniture import furnish
from ptmtools_samples.campus.ground import make_ground
from ptmtools_samples.campus.layout import CURB_HEIGHT, FRONT, Street
from ptmtools_samples.campus.materials import MATERIALS, StreetMaterial
from ptmtools_samples.campus.monuments import HETEROGENEOUS
from ptmtools_samples.campus.quarters import MIXED, residence
from ptmtools_samples.campus.recipes import Recipe
from ptmtools_samples.campus.textures import ALPHAS, IMAGES, mask, signs
from ptmtools_samples.campus.way import way_text
from ptmtools_samples.files import HEAD, File, Note, ignore, png
from ptmtools_samples.mesh import Face, Thing
from ptmtools_samples.noise import bytes_of, generator
from ptmtools_samples.obj import number, obj_text
from ptmtools_samples.options import StreetOptions

#: Recipes in order along the street: all different, then recurring ones, then a single kind.
RECIPES = [*HETEROGENEOUS, *MIXED, *(residence(k) for k in range(14))]


def choose_recipes(buildings: int) -> list[Recipe]:
    """Selects a recipe for each building; small numbers are spread over the whole list."""
    return [RECIPES[k * len(RECIPES) // buildings] for k in range(buildings)]


def make_things(options: StreetOptions) -> tuple[list[Thing], Street, tuple[float, float]]:
    """Returns all objects in world coordinates, the street, and the (x, z) offset that centres
    them."""
    street = Street(options.buildings, options.length)
    recipes = choose_recipes(options.buildings)
    things: list[Thing] = make_ground(street)
    depths = []
    for plot, recipe in zip(street.plots, recipes, strict=True):
        built = build(recipe, generator(options.seed, 1, plot.number))
        depths.append(max(-z for _, z in built.rings[0]))
        middle = (plot.low + plot.high) / 2 * street.segment_length
        back = FRONT + (plot.number * 7 % 5) * 0.8
        frame = street.frame(plot.segment, middle, plot.side * back, CURB_HEIGHT - 0.02, plot.side)
        faces = sorted(frame.place(built.faces), key=lambda f: f.material)
        things.append(Thing(f"building_{plot.number + 1:02d}_{recipe.name}", faces))
    things += furnish(street, recipes, depths, generator(options.seed, 2))
    xs, zs = ([p[i] for t in things for f in t.faces for p in f.points] for i in (0, 2))
    # Whole tenths of millimetres, so centring does not change the rounding.
    x, z = (round((min(c) + max(c)) / 2, 4) for c in (xs, zs))
    for thing in things:
        thing.faces = [
            Face(f.material, tuple((p[0] - x, p[1], p[2] - z) for p in f.points), f.uv)
            for f in thing.faces
        ]
    return things, street, (x, z)


def used_materials(things: list[Thing]) -> dict[str, StreetMaterial]:
    names = {face.material for thing in things for face in thing.faces}
    return {name: material for name, material in MATERIALS.items() if name in names}


def mtl_text(materials: dict[str, StreetMaterial]) -> str:
    blocks = [f"# {HEAD} campus: materials\n"]
    for name, m in materials.items():
        kd = " ".join(number(c, 3) for c in m.tint)
        lines = [f"newmtl {name}", f"Kd {kd}"]
        lines += [f"d {number(m.opacity, 2)}"] if m.opacity < 1 else []
        lines += ["Ks 0.5 0.5 0.5", "Ns 60", "illum 2"] if m.mask else ["illum 1"]
        clamp = "" if m.tile else "-clamp on "
        lines.append(f"map_Kd {clamp}textures/{m.image}.png")
        lines += [f"map_Ks {clamp}textures/{m.image}_mask.png"] if m.mask else []
        lines += [f"map_d {clamp}textures/{m.image}_alpha.png"] if m.alpha else []
        blocks.append("\n".join(lines) + "\n")
    return "\n".join(blocks)


def pictures(materials: dict[str, StreetMaterial], options: StreetOptions) -> Iterator[File]:
    """Returns the images of the materials with their masks."""
    size, seed = options.texture, options.seed
    streams = {name: k for k, name in enumerate(IMAGES)}
    masked = {m.image for m in materials.values() if m.mask}
    clear = {m.image for m in materials.values() if m.alpha}

    def draw_signs() -> bytes:
        labels = [recipe.label for recipe in choose_recipes(options.buildings)]
        return png(signs(labels)(generator(seed, 6), size))

    def draw_later(name: str) -> Callable[[], bytes]:
        def load() -> bytes:
            field = IMAGES[name](generator(seed, 3, streams[name]), size)
            return png(Image.fromarray(bytes_of(field)))

        return load

    def reflecting(name: str) -> Callable[[], bytes]:
        def load() -> bytes:
            field = IMAGES[name](generator(seed, 3, streams[name]), size)
            grey = mask(name, field, generator(seed, 4, streams[name]), size)
            return png(Image.fromarray(bytes_of(grey)))

        return load

    def cut(name: str) -> Callable[[], bytes]:
        def load() -> bytes:
            return png(
                Image.fromarray(bytes_of(ALPHAS[name](generator(seed, 5, streams[name]), size)))
            )

        return load

    for name in dict.fromkeys(m.image for m in materials.values()):
        if name == "signs":
            yield f"textures/{name}.png", draw_signs
            continue
        yield f"textures/{name}.png", draw_later(name)
        if name in masked:
            yield f"textures/{name}_mask.png", reflecting(name)
        if name in clear:
            yield f"textures/{name}_alpha.png", cut(name)


def make_campus(options: StreetOptions, note: Note = ignore) -> Iterator[File]:
    """Returns the files of the campus: relative path and a function that returns the bytes; the OBJ
    comes last.

    Raises InputError: PTM-I111 the buildings do not fit along the street.
    """
    things, street, centre = make_things(options)
    materials = used_materials(things)
    images = list(pictures(materials, options))
    triangles = sum(len(f.points) - 2 for t in things for f in t.faces)
    head = [
        f"# {HEAD} campus: {options.buildings} buildings on {number(options.length, 1)} m, "
        f"{triangles} triangles, {len(images)} images, seed {options.seed}",
        "# metres, Y up",
    ]
    model = obj_text(things, head, "campus.mtl").encode()
    library = mtl_text(materials).encode()
    way = way_text(street, options.length, centre).encode()
    yield from images
    yield "campus_way.json", lambda: way
    yield "campus.mtl", lambda: library
    yield "campus.obj", lambda: model
