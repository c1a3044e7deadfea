"""What a floor is called: by the storeys that a model names."""

from __future__ import annotations

from ptmtools.scene.model import Scene


def storey_name(scene: Scene, floor: float, gap: float) -> str:
    """The name of the storey that is nearest to a floor, the lower of two; "" if the model names
    none that is nearer than half of ``gap``, metres. Floors that far apart are different storeys'.
    """
    near = [(abs(storey.height - floor), storey.name) for storey in scene.storeys]
    distance, name = min(near, key=lambda one: one[0], default=(gap, ""))
    return name if distance < gap / 2 else ""
