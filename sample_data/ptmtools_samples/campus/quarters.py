"""Recipes of the last two thirds of the street: buildings with recurring walls, and residences."""

from __future__ import annotations

from dataclasses import replace

from ptmtools_samples.campus import plans
from ptmtools_samples.campus.recipes import (
    CASEMENT,
    CURTAIN,
    LINTEL,
    MODERN,
    PLAIN,
    RIBBON,
    ROUND,
    SASH,
    SHOP,
    Recipe,
    look,
    recipe,
)

MIXED = [
    recipe(
        "mathematics",
        "Mathematics",
        lambda: plans.bar(38, 14),
        look(
            "brick_red",
            PLAIN,
            ground="concrete",
            storeys=5,
            height=3.3,
            bay=2.7,
            ratio=0.55,
            door="door_glass",
        ),
        "flat roof_gravel",
        "equipment courses canopy",
    ),
    recipe(
        "biology",
        "Biology",
        lambda: plans.ell(38, 28, 13),
        look("brick_brown", LINTEL, storeys=3, height=3.7, bay=3.2, ratio=0.6),
        "flat roof_gravel",
        "equipment louvres",
    ),
    recipe(
        "administration",
        "Administration",
        lambda: plans.risalit(36, 14, 11, 1.2),
        look("plaster_white", SASH, ground="rustic", plinth=0.8, bay=2.8, ratio=0.42, band=0.9),
        "hip roof_tiles",
        "cornice chimneys courses dormers",
        door_wall=2,
    ),
    recipe(
        "informatics",
        "Informatics",
        lambda: plans.you(40, 26, 12),
        look(
            "concrete",
            CURTAIN,
            storeys=4,
            bay=3.2,
            ratio=0.82,
            sill=0.8,
            door="door_glass",
            reveals="metal",
        ),
        "flat roof_gravel",
        "equipment canopy",
        door_wall=2,
    ),
    recipe(
        "geology",
        "Geology",
        lambda: plans.bar(34, 15),
        look("sandstone", CASEMENT, bay=3.0, ratio=0.46, plinth=0.8, band=0.9, height=3.7),
        "mansard roof_slate",
        "dormers cornice courses",
    ),
    recipe(
        "pharmacy",
        "Pharmacy",
        lambda: plans.bar(36, 15),
        look("brick_yellow", RIBBON, storeys=4, bay=3.0, ratio=0.74, reveals="concrete"),
        "flat roof_gravel",
        "equipment louvres canopy",
    ),
    recipe(
        "archive",
        "Archive",
        lambda: plans.bar(30, 16),
        look(
            "brick_dark",
            replace(ROUND, frame="paint_white"),
            storeys=3,
            height=4.0,
            ground_height=4.4,
            bay=3.2,
            ratio=0.45,
            head=3.1,
            band=0.7,
        ),
        "gable roof_tiles",
        "courses chimneys",
    ),
    recipe(
        "medicine",
        "Medicine",
        lambda: plans.court(40, 32, 12),
        look("plaster_white", PLAIN, ground="stone_trim", storeys=4, bay=2.9, ratio=0.5),
        "flat roof_gravel",
        "equipment courses",
    ),
    recipe(
        "languages",
        "Languages",
        lambda: plans.bar(36, 14),
        look("plaster_ochre", CASEMENT, storeys=3, bay=2.8, ratio=0.46, band=0.8, door="door_blue"),
        "hip roof_tiles",
        "chimneys dormers courses cornice",
    ),
    recipe(
        "workshops",
        "Workshops",
        lambda: plans.bar(40, 20),
        look(
            "cladding_metal",
            replace(MODERN, panes=(4, 2)),
            ground="brick_red",
            storeys=2,
            ground_height=4.0,
            bay=4.2,
            ratio=0.8,
            band=0.5,
        ),
        "barrel roof_zinc",
        "",
    ),
    recipe(
        "economics",
        "Economics",
        lambda: plans.tee(38, 28, 13),
        look(
            "concrete_panel",
            MODERN,
            storeys=5,
            bay=2.9,
            ratio=0.66,
            door="door_glass",
            reveals="concrete",
        ),
        "flat roof_gravel",
        "equipment louvres canopy",
    ),
    recipe(
        "kindergarten",
        "Kindergarten",
        lambda: plans.bar(28, 13),
        look(
            "cladding_timber",
            replace(PLAIN, frame="paint_red"),
            storeys=2,
            height=3.1,
            ground_height=3.3,
            bay=3.2,
            ratio=0.6,
            door="door_blue",
            reveals="paint_white",
        ),
        "gable roof_tiles",
        "chimneys",
    ),
    recipe(
        "theatre",
        "Lecture Theatre",
        lambda: plans.bar(32, 26),
        look(
            "brick_red",
            replace(SHOP, panes=(3, 3)),
            storeys=2,
            height=4.4,
            ground_height=5.0,
            bay=4.6,
            ratio=0.7,
            head=3.6,
            band=1.4,
            door="door_glass",
            reveals="concrete",
        ),
        "flat roof_gravel",
        "columns equipment skylights",
    ),
]


def residence(k: int) -> Recipe:
    """Halls of residence: two brick rows with flat roofs, then plastered rows with tiled roofs."""
    letter = chr(ord("A") + k)
    wall = ("brick_red", "brick_red", "plaster_white")[k % 3]
    pitched = k % 3 == 2
    facade = look(
        wall,
        PLAIN,
        ground=wall if pitched else "brick_brown",
        storeys=3 + (k * 2) % 3,
        height=2.9,
        ground_height=3.0,
        bay=3.2,
        ratio=0.5,
        head=2.35,
        band=0.6,
        balconies=True,
        door="door_blue",
        reveals="concrete",
    )
    depth = 12 + k % 2
    shape = (lambda: plans.ell(36, 26, depth)) if k % 4 == 1 else (lambda: plans.bar(36, depth))
    roof = "hip roof_tiles" if pitched else "flat roof_gravel"
    extras = "balconies courses" + (" chimneys" if pitched else " equipment canopy")
    return recipe(f"residence_{letter.lower()}", f"Residence {letter}", shape, facade, roof, extras)
