"""Materials of the campus: image, metres per repetition, and masks."""

from __future__ import annotations

from dataclasses import dataclass

from ptmtools_samples.noise import Color


@dataclass(frozen=True)
class Material:
    """``tile``: metres per repetition; 0 if texture coordinates are explicit.

    ``mask``: whether there is a specular mask (``map_Ks``); ``alpha``: an opacity mask (``map_d``).
    """

    image: str
    tile: float
    tint: Color = (1, 1, 1)
    mask: bool = False
    alpha: bool = False
    opacity: float = 1.0


MATERIALS: dict[str, Material] = {
    # walls
    "brick_red": Material("brick_red", 2),
    "brick_yellow": Material("brick_yellow", 2),
    "brick_brown": Material("brick_brown", 2),
    "brick_dark": Material("brick_dark", 2),
    "sandstone": Material("sandstone", 3),
    "sandstone_red": Material("sandstone_red", 3),
    "limestone": Material("limestone", 4),
    "rubble": Material("rubble", 3),
    "plaster_white": Material("plaster_white", 4),
    "plaster_ochre": Material("plaster_ochre", 4),
    "plaster_rose": Material("plaster_rose", 4),
    "plaster_grey": Material("plaster_white", 4, (0.62, 0.64, 0.67)),
    "concrete": Material("concrete", 4),
    "concrete_panel": Material("concrete_panel", 3),
    "cladding_metal": Material("cladding_metal", 2, mask=True),
    "cladding_timber": Material("cladding_timber", 2),
    "cladding_terracotta": Material("cladding_terracotta", 2.4),
    "rustic": Material("rustic", 3),
    # trims, frames, doors
    "stone_trim": Material("stone_trim", 2),
    "stone_polished": Material("stone_polished", 2, mask=True),
    "paint_white": Material("paint", 1),
    "paint_green": Material("paint", 1, (0.22, 0.36, 0.3)),
    "paint_red": Material("paint", 1, (0.5, 0.16, 0.13)),
    "metal_dark": Material("metal", 1, (0.3, 0.31, 0.34), mask=True),
    "metal": Material("metal", 1, mask=True),
    "louvre": Material("louvre", 1),
    "door_oak": Material("door_oak", 0),
    "door_blue": Material("door_blue", 0),
    "door_glass": Material("door_glass", 0, mask=True),
    # glass
    "glass_dark": Material("glass_dark", 0, mask=True),
    "glass_sky": Material("glass_sky", 0, mask=True),
    "glass_blinds": Material("glass_blinds", 0, mask=True),
    "glass_curtains": Material("glass_curtains", 0, mask=True),
    "glass_clear": Material("glass_sky", 0, mask=True, opacity=0.35),
    # roofs
    "roof_tiles": Material("roof_tiles", 2),
    "roof_slate": Material("roof_slate", 2),
    "roof_copper": Material("roof_copper", 3),
    "roof_zinc": Material("roof_copper", 3, (1, 0.78, 0.9)),
    "roof_gravel": Material("gravel", 3, (0.75, 0.75, 0.78)),
    # ground
    "asphalt": Material("asphalt", 4),
    "paving": Material("paving", 3),
    "cobbles": Material("cobbles", 2),
    "gravel": Material("gravel", 3),
    "grass": Material("grass", 5),
    "marking": Material("paint", 1),
    # plants and furniture
    "hedge": Material("hedge", 2),
    "bark": Material("bark", 1),
    "bench_wood": Material("bark", 1, (1, 0.8, 0.6)),
    "tree_broad": Material("tree_broad", 0, alpha=True),
    "tree_slender": Material("tree_slender", 0, alpha=True),
    "signs": Material("signs", 0),
}
