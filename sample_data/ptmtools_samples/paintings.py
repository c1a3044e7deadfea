"""Painting styles in the order in which a museum uses them.

A composition is a (size, size, 3) field of colours in layered noise and gradients. Most styles then
cover it with three passes of strokes, from broad to fine, that follow its colours and contours
(`brush.py`). Each style takes a generator and a size and returns an image.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from PIL import Image

from ptmtools_samples.abstract import color_field, constructivism, drips, marble_paper
from ptmtools_samples.figurative import landscape, night, portrait, seascape, still_life
from ptmtools_samples.printed import manuscript, poster

Painting = Callable[[np.random.Generator, int], Image.Image]

#: Name, style, and width over height of the canvas.
PAINTINGS: list[tuple[str, Painting, float]] = [
    ("landscape", landscape, 4 / 3),
    ("portrait", portrait, 3 / 4),
    ("poster", poster, 3 / 4),
    ("seascape", seascape, 4 / 3),
    ("still_life", still_life, 5 / 4),
    ("color_field", color_field, 4 / 5),
    ("night", night, 5 / 4),
    ("constructed", constructivism, 1.0),
    ("manuscript", manuscript, 3 / 4),
    ("drips", drips, 4 / 3),
    ("marbled", marble_paper, 1.0),
]
