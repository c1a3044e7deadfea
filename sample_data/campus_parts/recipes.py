"""What stands on the campus, in the order of the way.

The first third is a building of its own each, no two of one wall; the second takes up what was
there; the last is a quarter of halls of residence from a few materials.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from campus_parts import plans
from campus_parts.facade import Look
from campus_parts.openings import Style
from campus_parts.solids import Ring


@dataclass(frozen=True)
class Recipe:
    """A building: its footprint, facades, roof, and what is added.

    ``roof``: kind, surface, and rise over run of sloped ones. ``door_wall``: number of the wall
    that has the entrance. ``extras``: names that `campus_parts.buildings` knows.
    """

    name: str
    label: str
    footprint: Callable[[], list[Ring]]
    look: Look
    roof: tuple[str, str] = ("flat", "roof_gravel")
    pitch: float = 0.8
    door_wall: int = 0
    extras: frozenset[str] = field(default_factory=frozenset)


SASH = Style(panes=(2, 3), depth=0.14, bar=0.05)
CASEMENT = Style(panes=(2, 2), transom=True)
CROSS = Style(panes=(2, 2), transom=True, depth=0.24, surround="frame", frame="paint_green")
NOBLE = Style(panes=(2, 3), depth=0.2, surround="pediment")
ROUND = Style(arched=True, depth=0.3, surround="keystone", frame="metal_dark", bar=0.08)
MODERN = Style(panes=(3, 1), frame="metal_dark", depth=0.12, sill=False)
RIBBON = Style(panes=(2, 2), frame="metal", depth=0.1, transom=True)
CURTAIN = Style(panes=(2, 2), frame="metal_dark", glass=("glass_sky",), depth=0.08, sill=False)
PLAIN = Style(panes=(2, 1), frame="paint_white", depth=0.18)
LINTEL = Style(panes=(3, 3), frame="metal_dark", depth=0.2, surround="lintel", transom=True)
SHOP = Style(
    panes=(2, 2), frame="metal_dark", depth=0.3, glass=("glass_dark", "glass_sky"), transom=True
)


def look(wall: str, style: Style, **more: object) -> Look:
    known = {"ground": wall, "ground_style": style, **more}
    return Look(wall=wall, style=style, **known)  # type: ignore[arg-type]


def recipe(
    name: str,
    label: str,
    footprint: Callable[[], list[Ring]],
    facade: Look,
    roof: str = "flat roof_gravel",
    extras: str = "",
    **more: object,
) -> Recipe:
    kind, surface = roof.split()
    return Recipe(
        name, label, footprint, facade, (kind, surface), extras=frozenset(extras.split()), **more
    )  # type: ignore[arg-type]


HETEROGENEOUS = [
    recipe(
        "rectorate",
        "Rectorate",
        lambda: plans.risalit(38, 15, 13, 1.6),
        look(
            "sandstone",
            NOBLE,
            ground="rustic",
            ground_style=ROUND,
            plinth=1.28,
            height=4.2,
            ground_height=4.6,
            bay=3.3,
            ratio=0.42,
            head=3.2,
            band=1.5,
        ),
        "hip roof_slate",
        "cornice dentils courses portico chimneys",
        door_wall=2,
    ),
    recipe(
        "chemistry",
        "Chemistry",
        lambda: plans.bar(40, 16),
        look(
            "concrete_panel",
            RIBBON,
            ground="concrete",
            storeys=6,
            height=3.6,
            bay=3.0,
            ratio=0.8,
            sill=1.0,
            head=2.8,
            door="door_glass",
            reveals="concrete",
        ),
        "flat roof_gravel",
        "equipment louvres canopy railing",
    ),
    recipe(
        "library",
        "University Library",
        lambda: plans.bar(40, 24),
        look(
            "limestone",
            replace(ROUND, trim="limestone"),
            plinth=1.6,
            storeys=2,
            height=5.8,
            ground_height=6.2,
            bay=4.0,
            ratio=0.62,
            sill=0.7,
            head=5.0,
            band=1.7,
            reveals="limestone",
        ),
        "flat roof_copper",
        "cornice dentils columns courses skylights",
    ),
    recipe(
        "chapel",
        "Chapel",
        lambda: plans.bar(13, 28),
        look(
            "rubble",
            replace(ROUND, glass=("glass_curtains", "glass_dark"), trim="sandstone_red"),
            storeys=1,
            ground_height=8.4,
            bay=4.2,
            ratio=0.45,
            sill=1.6,
            head=6.9,
            band=0.8,
            reveals="sandstone_red",
        ),
        "gable_front roof_tiles",
        "belfry buttresses",
        pitch=1.1,
    ),
    recipe(
        "physics",
        "Physics",
        lambda: plans.ell(36, 30, 14),
        look(
            "cladding_metal",
            CURTAIN,
            storeys=4,
            height=3.9,
            ground_height=4.4,
            bay=3.2,
            ratio=0.9,
            sill=0.7,
            head=3.3,
            door="door_glass",
            reveals="metal",
        ),
        "flat roof_gravel",
        "equipment canopy",
    ),
    recipe(
        "academy",
        "Academy of Fine Arts",
        lambda: plans.bar(34, 15),
        look(
            "plaster_rose",
            CROSS,
            ground="stone_trim",
            height=4.0,
            bay=2.9,
            ratio=0.4,
            head=2.9,
            band=0.9,
        ),
        "mansard roof_slate",
        "cornice dormers courses pilasters",
    ),
    recipe(
        "sports_hall",
        "Sports Hall",
        lambda: plans.bar(38, 24),
        look(
            "cladding_timber",
            replace(MODERN, panes=(4, 2)),
            ground="concrete",
            storeys=2,
            height=3.6,
            ground_height=3.4,
            bay=4.4,
            ratio=0.84,
            sill=0.9,
            head=2.7,
            band=0.5,
            door="door_glass",
            reveals="metal",
        ),
        "barrel roof_zinc",
        "canopy",
    ),
    recipe(
        "tower",
        "Humanities Tower",
        lambda: plans.bar(22, 20),
        look(
            "cladding_terracotta",
            MODERN,
            ground="stone_polished",
            ground_style=SHOP,
            storeys=8,
            height=3.5,
            ground_height=4.6,
            bay=2.7,
            ratio=0.6,
            door="door_glass",
            reveals="metal",
        ),
        "flat roof_gravel",
        "equipment canopy louvres railing",
    ),
    recipe(
        "conservatory",
        "School of Music",
        lambda: plans.court(36, 32, 10.5),
        look(
            "plaster_ochre",
            SASH,
            ground_style=replace(ROUND, frame="paint_white"),
            storeys=2,
            height=3.9,
            ground_height=4.4,
            bay=2.9,
            ratio=0.48,
            head=3.1,
            band=0.9,
            door="door_blue",
        ),
        "hip roof_tiles",
        "cornice courses chimneys",
        pitch=0.62,
    ),
    recipe(
        "engineering",
        "Engineering",
        lambda: plans.bar(40, 18),
        look(
            "brick_dark",
            LINTEL,
            storeys=3,
            height=4.1,
            ground_height=4.6,
            bay=3.6,
            ratio=0.66,
            head=3.2,
            band=0.5,
            reveals="brick_dark",
        ),
        "gable roof_zinc",
        "pilasters_brick chimneys courses",
        pitch=0.55,
    ),
    recipe(
        "observatory",
        "Observatory",
        lambda: plans.tee(30, 24, 11),
        look(
            "brick_yellow",
            replace(SASH, frame="paint_green", surround="lintel"),
            storeys=2,
            plinth=0.96,
            bay=2.9,
            ratio=0.42,
            band=1.0,
        ),
        "flat roof_copper",
        "dome cornice courses",
    ),
    recipe(
        "refectory",
        "Refectory",
        lambda: plans.bar(38, 22),
        look(
            "concrete",
            replace(SHOP, panes=(3, 2)),
            storeys=1,
            ground_height=4.8,
            bay=5.2,
            ratio=0.9,
            sill=0.35,
            head=2.9,
            band=0.8,
            door="door_glass",
            reveals="metal",
        ),
        "flat roof_gravel",
        "canopy equipment skylights eaves",
    ),
    recipe(
        "law",
        "Law School",
        lambda: plans.you(40, 26, 11),
        look(
            "sandstone_red",
            CROSS,
            ground_style=replace(CROSS, surround=""),
            plinth=0.8,
            height=3.8,
            ground_height=4.2,
            bay=3.0,
            ratio=0.44,
            band=1.0,
        ),
        "hip roof_slate",
        "cornice dormers chimneys courses",
        pitch=0.9,
        door_wall=2,
    ),
]

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


def _residence(k: int) -> Recipe:
    """Halls of residence: two brick rows with flat roofs, then plastered ones with tiles."""
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


RECIPES = [*HETEROGENEOUS, *MIXED, *(_residence(k) for k in range(14))]
