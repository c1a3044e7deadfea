"""What the classes of IFC say of a product: whether it is drawn, and what it is to the structure.

Classes stand for their subclasses, in IFC2X3, IFC4 and IFC4X3; the first row that fits decides.
Tables are kept short by what shape tells as well: an opaque face of a column, a beam, a plate of a
curtain wall, a suspended ceiling or the ground divides the building if it is large enough, and need
not if it is not. As structural, each of the 32 sides of a round column would divide the hall that
it stands in.
"""

from __future__ import annotations

from collections.abc import Callable

from ptmtools.scene.model import Kind

#: Drawn though its superclass is not: it bears the ground.
_GROUND = "IfcSite"
#: Space, what is cut away, drawings and models of something else: not there to be seen.
_NOT_DRAWN = (
    "IfcSpatialElement",
    "IfcSpatialStructureElement",  # IFC2X3
    "IfcFeatureElementSubtraction",
    "IfcVirtualElement",
    "IfcAnnotation",
    "IfcGrid",
    "IfcPositioningElement",
    "IfcLinearElement",
    "IfcPort",
    "IfcStructuralActivity",
    "IfcStructuralItem",
)
_KINDS: tuple[tuple[Kind, tuple[str, ...]], ...] = (
    ("door", ("IfcDoor",)),
    (
        "structural",
        (
            "IfcWall",
            "IfcSlab",
            "IfcRoof",
            "IfcStair",
            "IfcStairFlight",
            "IfcRamp",
            "IfcRampFlight",
        ),
    ),
    # Takes the kind of what it is a part of: a layer of a wall.
    ("", ("IfcBuildingElementPart",)),
    (
        "detail",
        (
            # Its pane may be opaque for want of a style; nobody means a window to hide the street.
            "IfcWindow",
            "IfcRailing",
            "IfcFurnishingElement",
            "IfcDistributionElement",
            "IfcElectricalElement",  # IFC2X3
            "IfcEquipmentElement",  # IFC2X3
            "IfcElementComponent",
            "IfcReinforcingElement",  # in IFC2X3 no component
            "IfcShadingDevice",
            "IfcSurfaceFeature",
        ),
    ),
)
_PART = "IfcBuildingElementPart"


def drawn(is_a: Callable[[str], bool]) -> bool:
    """Whether products of a class are drawn; ``is_a`` says whether it is one or a subclass."""
    return is_a(_GROUND) or not any(map(is_a, _NOT_DRAWN))


def kind_of(is_a: Callable[[str], bool]) -> Kind:
    """What products of a class are."""
    return next((kind for kind, classes in _KINDS if any(map(is_a, classes))), "")


def is_part(is_a: Callable[[str], bool]) -> bool:
    """Whether products of a class are what the product is that they are parts of."""
    return is_a(_PART)
