"""The museum script as a module, and its models as arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray


@pytest.fixture(scope="session")
def museum() -> ModuleType:
    """The generator of the museum."""
    from ptmtools_samples import museum

    return museum


@dataclass(frozen=True)
class Triangles:
    """(n, 3, 3) corners, (n, 3, 2) texture coordinates, object and material of each."""

    corners: NDArray[np.float64]
    uv: NDArray[np.float64]
    objects: NDArray[np.str_]
    materials: NDArray[np.str_]

    def where(self, chosen: NDArray[np.bool_]) -> Triangles:
        return Triangles(
            self.corners[chosen], self.uv[chosen], self.objects[chosen], self.materials[chosen]
        )

    @property
    def normals(self) -> NDArray[np.float64]:
        a, b, c = self.corners.transpose(1, 0, 2)
        return np.cross(b - a, c - a)

    def volume(self) -> float:
        """What the triangles enclose, if they are closed and face outwards."""
        return float(np.einsum("ij,ij->", self.corners[:, 0], self.normals) / 6)

    def distances(
        self, origins: NDArray[np.float64], directions: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Distance to the nearest triangle along rays, infinite where there is none."""
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh

        tracer = rtcore_scene.EmbreeScene()
        TriangleMesh(tracer, np.ascontiguousarray(self.corners, dtype=np.float32))
        rays = np.ascontiguousarray(directions, dtype=np.float32)
        hit = tracer.run(np.ascontiguousarray(origins, dtype=np.float32), rays, output=1)
        return np.where(np.asarray(hit["primID"]) < 0, np.inf, np.asarray(hit["tfar"]))


def read_obj(lines: Iterable[str]) -> Triangles:
    """A reader of its own, for what the script writes: v, vt, o, usemtl, f a/b …"""
    points: list[list[float]] = []
    coordinates: list[list[float]] = []
    corners, uv, objects, materials = [], [], [], []
    name = material = ""
    for line in lines:
        word, *rest = line.split() or [""]
        if word == "v":
            points.append([float(c) for c in rest])
        elif word == "vt":
            coordinates.append([float(c) for c in rest])
        elif word == "o":
            (name,) = rest
        elif word == "usemtl":
            (material,) = rest
        elif word == "f":
            loop = [[int(n) - 1 for n in corner.split("/")] for corner in rest]
            for k in range(1, len(loop) - 1):
                triangle = [loop[0], loop[k], loop[k + 1]]
                corners.append([points[a] for a, _ in triangle])
                uv.append([coordinates[b] for _, b in triangle])
                objects.append(name)
                materials.append(material)
    return Triangles(np.array(corners), np.array(uv), np.array(objects), np.array(materials))


@pytest.fixture(scope="session")
def read() -> Callable[[Iterable[str]], Triangles]:
    return read_obj


@pytest.fixture(scope="session")
def model(museum: ModuleType) -> Callable[..., Triangles]:
    """``model(rooms=…, windows=…)``: the geometry alone, without making a texture."""

    def build(**options: object) -> Triangles:
        files = dict(museum.make_museum(museum.MuseumOptions(**options)))
        return read_obj(files["museum.obj"]().decode().splitlines())

    return build
