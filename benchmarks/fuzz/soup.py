"""Triangles with names and materials, and the OBJ file of them.

Faces are written corner by corner with all digits, so a file holds exactly the geometry that was
made. Corners at the same place share one vertex.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ptmtools.arrays import Floats, Ints

MATERIALS = "materials.mtl"
#: Materials by number: one colour, one image, one that sight passes.
NAMES = ("plain", "painted", "glass")
MTL = "newmtl plain\nKd 0.7 0.7 0.6\nnewmtl painted\nmap_Kd tile.png\nnewmtl glass\nd 0.4\n"


@dataclass(frozen=True)
class Soup:
    """A model.

    Attributes
    ----------
    corners: (T, 3, 3) of the triangles, metres, Y up.
    of: (T,) object of each.
    names: of the objects.
    material: (T,) row of `NAMES`.
    """

    corners: Floats
    of: Ints
    names: tuple[str, ...]
    material: Ints

    @staticmethod
    def of_parts(parts: Mapping[str, Floats], *, up: str = "y") -> Soup:
        """Of triangles, (t, 3, 3), by the names of objects; Z is ``up``, or Y."""
        corners = np.concatenate([*parts.values()]).astype(np.float64)
        if up == "z":
            corners = corners[..., [0, 2, 1]] * [1.0, 1.0, -1.0]
        of = np.repeat(np.arange(len(parts)), [len(part) for part in parts.values()])
        return Soup(corners, of, tuple(parts), np.zeros(len(of), dtype=np.int64))

    def __len__(self) -> int:
        return len(self.corners)

    @property
    def extent(self) -> float:
        """Largest side of the bounding box, metres."""
        return float(np.ptp(self.corners.reshape(-1, 3), axis=0).max(initial=0.0))

    def moved_to(self, corners: Floats) -> Soup:
        """The same triangles with other corners."""
        return replace(self, corners=corners)

    def take(self, rows: Ints) -> Soup:
        """Some of the triangles, by number, in this order."""
        return replace(
            self, corners=self.corners[rows], of=self.of[rows], material=self.material[rows]
        )

    def with_more(self, corners: Floats, like: Ints) -> Soup:
        """With further triangles, (n, 3, 3), that belong to the objects of the triangles ``like``,
        (n,)."""
        return replace(
            self,
            corners=np.concatenate([self.corners, corners]),
            of=np.concatenate([self.of, self.of[like]]),
            material=np.concatenate([self.material, self.material[like]]),
        )

    def obj(self) -> bytes:
        """The OBJ file."""
        points, index = np.unique(self.corners.reshape(-1, 3), axis=0, return_inverse=True)
        lines = [f"mtllib {MATERIALS}", *(f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist())]
        lines += ["vt 0 0", "vt 2 0", "vt 0 3"]
        order = np.lexsort((np.arange(len(self)), self.material, self.of))
        last = (-1, -1)
        faces = (index.reshape(-1, 3) + 1).tolist()
        for row in order.tolist():
            key = int(self.of[row]), int(self.material[row])
            if key[0] != last[0]:
                lines.append(f"o {self.names[key[0]]}")
            if key != last:
                lines.append(f"usemtl {NAMES[key[1]]}")
            last = key
            a, b, c = faces[row]
            lines.append(f"f {a}/1 {b}/2 {c}/3")
        return ("\n".join(lines) + "\n").encode()


def write_materials(folder: Path) -> None:
    """The material library and its image, beside which models are written."""
    from PIL import Image

    (folder / MATERIALS).write_text(MTL)
    texels = np.random.default_rng(1).integers(0, 255, (8, 8, 3), np.uint8)
    Image.fromarray(texels).save(folder / "tile.png")
