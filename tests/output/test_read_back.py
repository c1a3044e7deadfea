"""What `emit` writes as VRML, the reader of models reads back: the same faces and materials."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ptmtools.output import EmitExtras, EmitOptions, emit
from ptmtools.scene.model import Material
from tests.scene.conftest import noise, png, read_source

from .test_emission import records


def random_materials(rng: np.random.Generator, *, white: bool) -> tuple[Material, ...]:
    """Materials of every kind, and more; their colours are multiples of 1/255."""
    result = []
    for number in range(8):
        color = np.ones(3) if white or number == 0 else rng.integers(64, 256, 3) / 255
        opacity = 1.0 if number % 2 else float(rng.integers(1, 16) / 16)
        wraps = rng.choice(["repeat", "clamp"], 2).tolist()
        image = int(rng.integers(-1, 2))
        red, green, blue = color.tolist()
        result.append(
            Material(f"m{number}", (red, green, blue), opacity, image, *wraps, opacity < 1)
        )
    return tuple(result)


@pytest.mark.parametrize("seed", range(4))
def test_faces_and_materials(artifacts, tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene, cells = artifacts.scene, artifacts.cells
    count, tinted = len(scene.triangles), seed % 2 == 0
    materials = random_materials(rng, white=tinted)
    colors = np.repeat(rng.integers(0, 256, (count, 1, 3), np.uint8), 3, axis=1)
    scene = replace(
        scene,
        materials=materials,
        triangle_material=rng.integers(0, len(materials), count).astype(np.int32),
        two_sided=rng.random(count) < 0.5,
        colors=colors if tinted else None,
    )
    for number, name in enumerate("ab"):
        (tmp_path / "textures").mkdir(parents=True, exist_ok=True)
        (tmp_path / f"textures/{name}.png").write_bytes(png(noise(number)))
    emit(scene, cells, artifacts.pvs, artifacts.ach, records(), tmp_path, EmitOptions(),
         EmitExtras())  # fmt: skip

    written = set()
    piece, _ = cells.emitted(scene.two_sided)
    for row in piece.tolist():
        origin = int(cells.triangle_source[row])
        material = materials[scene.triangle_material[origin]]
        corner = cells.triangle[row]
        color = np.rint(255 * np.array(material.color))
        if tinted:
            color = colors[origin, 0]
        image = "" if material.image < 0 else f"{'ab'[material.image]}.png"
        uv = cells.vertex_uv[corner].astype(np.float32)
        wraps = (material.wrap_s, material.wrap_t) if image else ()
        written.add(
            (
                *sorted(map(tuple, np.hstack([cells.vertex[corner], uv if image else 0 * uv]))),
                tuple(color.astype(int).tolist()),
                *(image, wraps, round(material.opacity, 6), bool(scene.two_sided[origin])),
            )
        )
    source = read_source(tmp_path / "root.wrl")
    read = set()
    points = source.points.astype(np.float32)
    for row, corner in enumerate(source.triangles):
        original = source.materials[source.triangle_material[row]]
        color = np.rint(255 * np.array(original.color or (1.0, 1.0, 1.0)))
        if source.colors is not None:
            color = np.rint(color * source.colors[row, 0] / 255)
        texture = original.texture
        uv = source.uv[row].astype(np.float32)
        read.add(
            (
                *sorted(map(tuple, np.hstack([points[corner], uv if texture else 0 * uv]))),
                tuple(color.astype(int).tolist()),
                *((texture.label, (texture.wrap_s, texture.wrap_t)) if texture else ("", ())),
                *(round(original.opacity, 6), original.two_sided),
            )
        )
    assert read == written
    assert [camera.name for camera in source.cameras]
