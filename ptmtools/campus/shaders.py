"""Which shader a material has: it follows from the channels that exist (the paper's II.B).

A combination of channels is a shader of its own: "diffuse + lightmap", "diffuse + lightmap +
alpha". A material without textures is a colour.
"""

from __future__ import annotations

from collections.abc import Iterable

from ptmtools.campus.model import ALPHA, DIFFUSE, LIGHT, MASK

#: In the order in which a name has them.
PARTS = {DIFFUSE: "diffuse", LIGHT: "lightmap", ALPHA: "alpha", MASK: "mask"}


def shader(channels: Iterable[str]) -> str:
    """The name of the shader for the channels that are there, such as "diffuse+lightmap+alpha".

    Raises KeyError for an unknown channel.
    """
    there = set(channels)
    if unknown := there - set(PARTS):
        raise KeyError(min(unknown))
    first = "" if DIFFUSE in there else "color"
    return "+".join(filter(None, [first, *(PARTS[c] for c in PARTS if c in there)]))
