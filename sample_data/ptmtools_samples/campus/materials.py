"""Materials of the campus: image, metres per repetition, and masks."""

from __future__ import annotations

from dataclasses import dataclass

from ptmtools_samples.noise import Color


@dataclass(frozen=True)
class CampusMaterial:
    """``tile``: metres per repetition; 0 if texture coordinates are explicit.

    ``mask``: whether there is a specular mask (``map_Ks``); ``alpha``: an opacity mask (``map_d``).
    """

    image: str
    tile: float
    tint: Color = (1, 1, 1)
    mask: bool = False
    alpha: bool = False
    opacity: float = 1.0


MATERIALS: dict[str, CampusMaterial] = {
    # walls
    "brick_red": CampusMaterial("brick_red", 2),
    "brick_yellow": CampusMaterial("brick_yellow", 2),
    "brick_brown": CampusMaterial("brick_brown", 2),
    "brick_dark": CampusMaterial("brick_dark", 2),
    "sandstone": CampusMaterial("sandstone", 3),
    "sandstone_red": CampusMaterial("sandstone_red", 3),
    "limestone": CampusMaterial("limestone", 4),
    "rubble": CampusMaterial("rubble", 3),
    "plaster_white": CampusMaterial("plaster_white", 4),
    "plaster_ochre": CampusMaterial("plaster_ochre", 4),
    "plaster_rose": CampusMaterial("plaster_rose", 4),
    "plaster_grey": CampusMaterial("plaster_white", 4, (0.62, 0.64, 0.67)),
    "concrete": CampusMaterial("concrete", 4),
    "concrete_panel": CampusMaterial("concrete_panel", 3),
    "cladding_metal": CampusMaterial("cladding_metal", 2, mask=True),
    "cladding_timber": CampusMaterial("cladding_timber", 2),
    "cladding_terracotta": CampusMaterial("cladding_terracotta", 2.4),
    "rustic": CampusMaterial("rustic", 3),
    # trims, frames, doors
    "stone_trim": CampusMaterial("stone_trim", 2),
    "stone_polished": CampusMaterial("stone_polished", 2, mask=True),
    "paint_white": CampusMaterial("paint", 1),
    "paint_green": CampusMaterial("paint", 1, (0.22, 0.36, 0.3)),
    "paint_red": CampusMaterial("paint", 1, (0.5, 0.16, 0.13)),
    "metal_dark": CampusMaterial("metal", 1, (0.3, 0.31, 0.34), mask=True),
    "metal": CampusMaterial("metal", 1, mask=True),
    "louvre": CampusMaterial("louvre", 1),
    "door_oak": CampusMaterial("door_oak", 0),
    "door_blue": CampusMaterial("door_blue", 0),
    "door_glass": CampusMaterial("door_glass", 0, mask=True),
    # glass
    "glass_dark": CampusMaterial("glass_dark", 0, mask=True),
    "glass_sky": CampusMaterial("glass_sky", 0, mask=True),
    "glass_blinds": CampusMaterial("glass_blinds", 0, mask=True),
    "glass_curtains": CampusMaterial("glass_curtains", 0, mask=True),
    "glass_clear": CampusMaterial("glass_sky", 0, mask=True, opacity=0.35),
    # roofs
    "roof_tiles": CampusMaterial("roof_tiles", 2),
    "roof_slate": CampusMaterial("roof_slate", 2),
    "roof_copper": CampusMaterial("roof_copper", 3),
    "roof_zinc": CampusMaterial("roof_copper", 3, (1, 0.78, 0.9)),
    "roof_gravel": CampusMaterial("gravel", 3, (0.75, 0.75, 0.78)),
    # ground
    "asphalt": CampusMaterial("asphalt", 4),
    "paving": CampusMaterial("paving", 3),
    "cobbles": CampusMaterial("cobbles", 2),
    "gravel": CampusMaterial("gravel", 3),
    "grass": CampusMaterial("grass", 5),
    "marking": CampusMaterial("paint", 1),
    # plants and furniture
    "hedge": CampusMaterial("hedge", 2),
    "bark": CampusMaterial("bark", 1),
    "bench_wood": CampusMaterial("bark", 1, (1, 0.8, 0.6)),
    "tree_broad": CampusMaterial("tree_broad", 0, alpha=True),
    "tree_slender": CampusMaterial("tree_slender", 0, alpha=True),
    "signs": CampusMaterial("signs", 0),
}
