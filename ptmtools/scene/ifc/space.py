"""The unit of length of an IFC file, and its storeys."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ptmtools.scene.ifc.names import FAULTS, name_of, one_line
from ptmtools.scene.model import Storey


def length_unit(file: Any) -> tuple[str, float | None]:
    """The name of the file's unit of length, and its metres; None if it says none."""
    from ifcopenshell.util import unit

    for context in file.by_type("IfcUnitAssignment"):
        for one in context.Units or ():
            if getattr(one, "UnitType", None) == "LENGTHUNIT":
                prefix = getattr(one, "Prefix", None) or ""
                name = f"{prefix}{name_of(one)}".lower()
                return name, float(unit.calculate_unit_scale(file))
    return "", None


def storeys(file: Any, metres: float) -> tuple[Storey, ...]:
    """The storeys that have a name and a height, at their heights in metres along z."""
    found = [(one, name) for one in file.by_type("IfcBuildingStorey") if (name := _name(one))]
    placed = [_placed(one) for one, _ in found]
    stated = [_stated(one) for one, _ in found]
    # What stands in a storey stands on its placement, whatever the elevation says of it, which is
    # often that above sea level. But some exporters place everything at 0, storeys included.
    if len(set(placed)) == 1 < len(set(stated)):
        placed = [None] * len(found)
    return tuple(
        Storey(name, height * metres)
        for (_, name), at, said in zip(found, placed, stated, strict=True)
        if (height := said if at is None else at) is not None and math.isfinite(height)
    )


def _name(storey: Any) -> str:
    return name_of(storey) or one_line(storey.LongName or "")


def _placed(product: Any) -> float | None:
    """How high a product is placed, in the file's unit; None if nothing says it."""
    from ifcopenshell.util import placement

    if product.ObjectPlacement is None:
        return None
    try:
        return float(placement.get_local_placement(product.ObjectPlacement)[2][3])
    except FAULTS:
        return None


def _stated(storey: Any) -> float | None:
    """A storey's elevation, which is above the zero of its building."""
    if storey.Elevation is None:
        return None
    building = next((one for one in _above(storey) if one.is_a("IfcBuilding")), None)
    ground = 0.0 if building is None else _placed(building) or 0.0
    return ground + float(storey.Elevation)


def _above(product: Any) -> Iterator[Any]:
    """What it is a part of, and what that is a part of."""
    seen = set()
    while product.id() not in seen:
        seen.add(product.id())
        for relation in product.Decomposes:
            product = relation.RelatingObject
            yield product
            break
