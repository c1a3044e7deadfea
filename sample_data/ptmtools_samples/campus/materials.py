"""Materials of the campus: image, metres per repetition, and masks."""

from __future__ import annotations

from dataclasses import dataclass

from ptmtools_samples.noise import Color


@dataclass(frozen=True)
class StreetMaterial:
    """``tile``: metres per repetition; 0 if texture coordinates are explicit.

    ``mask``: whether there is a specular mask (``map_Ks``); ``alpha``: an opacity mask (``map_d``).
    """

    image: str
    tile: float
    tint: Color = (1, 1, 1)
    mask: bool = False
    alpha: bool = False
    opacity: float = 1.0


MATERIALS: dict[str, StreetMaterial] = {
    # walls
    "brick_red": StreetMaterial("brick_red", 2),
    "brick_yellow": StreetMaterial("brick_yellow", 2),
    "brick_brown": StreetMaterial("brick_brown", 2),
    "brick_dark": StreetMaterial("brick_dark", 2),
    "sandstone": StreetMaterial("sandstone", 3),
    "sandstone_red": StreetMaterial("sandstone_red", 3),
    "limestone": StreetMaterial("limestone", 4),
    "rubble": StreetMaterial("rubble", 3),
    "plaster_white": StreetMaterial("plaster_white", 4),
    "plaster_ochre": StreetMaterial("plaster_ochre", 4),
    "plaster_rose": StreetMaterial("plaster_rose", 4),
    "plaster_grey": StreetMaterial("plaster_white", 4, (0.62, 0.64, 0.67)),
    "concrete": StreetMaterial("concrete", 4),
    "concrete_panel": StreetMaterial("concrete_panel", 3),
    "cladding_metal": StreetMaterial("cladding_metal", 2, mask=True),
    "cladding_timber": StreetMaterial("cladding_timber", 2),
    "cladding_terracotta": StreetMaterial("cladding_terracotta", 2.4),
    "rustic": StreetMaterial("rustic", 3),
    # trims, frames, doors
    "stone_trim": StreetMaterial("stone_trim", 2),
    "stone_polished": StreetMaterial("stone_polished", 2, mask=True),
    "paint_white": StreetMaterial("paint", 1),
    "paint_green": StreetMaterial("paint", 1, (0.22, 0.36, 0.3)),
    "paint_red": StreetMaterial("paint", 1, (0.5, 0.16, 0.13)),
    "metal_dark": StreetMaterial("metal", 1, (0.3, 0.31, 0.34), mask=True),
    "metal": StreetMaterial("metal", 1, mask=True),
    "louvre": StreetMaterial("louvre", 1),
    "door_oak": StreetMaterial("door_oak", 0),
    "door_blue": StreetMaterial("door_blue", 0),
    "door_glass": StreetMaterial("door_glass", 0, mask=True),
    # glass
    "glass_dark": StreetMaterial("glass_dark", 0, mask=True),
    "glass_sky": StreetMaterial("glass_sky", 0, mask=True),
    "glass_blinds": StreetMaterial("glass_blinds", 0, mask=True),
    "glass_curtains": StreetMaterial("glass_curtains", 0, mask=True),
    "glass_clear": StreetMaterial("glass_sky", 0, mask=True, opacity=0.35),
    # roofs
    "roof_tiles": StreetMaterial("roof_tiles", 2),
    "roof_slate": StreetMaterial("roof_slate", 2),
    "roof_copper": StreetMaterial("roof_copper", 3),
    "roof_zinc": StreetMaterial("roof_copper", 3, (1, 0.78, 0.9)),
    "roof_gravel": StreetMaterial("gravel", 3, (0.75, 0.75, 0.78)),
    # ground
    "asphalt": StreetMaterial("asphalt", 4),
    "paving": StreetMaterial("paving", 3),
    "cobbles": StreetMaterial("cobbles", 2),
    "gravel": StreetMaterial("gravel", 3),
    "grass": StreetMaterial("grass", 5),
    "marking": StreetMaterial("paint", 1),
    # plants and furniture
    "hedge": StreetMaterial("hedge", 2),
    "bark": StreetMaterial("bark", 1),
    "bench_wood": StreetMaterial("bark", 1, (1, 0.8, 0.6)),
    "tree_broad": StreetMaterial("tree_broad", 0, alpha=True),
    "tree_slender": StreetMaterial("tree_slender", 0, alpha=True),
    "signs": StreetMaterial("signs", 0),
}
