"""Features of PLY."""

from __future__ import annotations

from tests.scene.conftest import Put, png
from tests.scene.features.registry import FOUR, feature, four, vertex_colors

PLY_ROWS = "".join(
    f"{place} {color}\n"
    for place, color in (
        ("0 0 0", "255 0 0"),
        ("10 0 0", "0 255 0"),
        ("10 4 0", "0 0 255"),
        ("0 4 0", "0 0 0"),
    )
)


@feature("PLY", "vertex colours", "carried over", vertex_colors)
def _(put: Put) -> str:
    colors = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    head = f"ply\nformat ascii 1.0\nelement vertex 4\n{axes}{colors}element face 2\n"
    put(
        "a.ply",
        f"{head}property list uchar int vertex_indices\nend_header\n{PLY_ROWS}3 0 1 2\n3 0 2 3\n",
    )
    return "a.ply"


@feature("PLY", "textures", "carried over", four)
def _(put: Put) -> str:
    put("a.png", png(FOUR))
    axes = "".join(f"property float {axis}\n" for axis in ("x", "y", "z", "s", "t"))
    head = f"ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 4\n{axes}"
    rows = "0 0 0 0 0\n10 0 0 1 0\n10 4 0 1 1\n0 4 0 0 1\n"
    faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    put("a.ply", f"{head}{faces}{rows}4 0 1 2 3\n")
    return "a.ply"
