"""A building with statues: the two rooms of the sample, and balls of relief on their floors."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from ptmtools.arrays import Floats, Ints
from tests.systems.apo.meshes import sphere

TWO_ROOMS = Path(__file__).resolve().parents[3] / "sample_data" / "two_rooms"
#: Where each statue stands, on the floor, and its radius, metres.
STATUES = {"statue_01": ((1.3, 0.0, 1.2), 0.6), "statue_02": ((6.8, 0.0, 2.8), 0.45)}
RELIEF = 0.03


def statue(name: str, subdivisions: int) -> tuple[Floats, Ints]:
    """Points and triangles of a statue."""
    points, triangles = sphere(subdivisions, RELIEF)
    (x, y, z), radius = STATUES[name]
    points = np.round(points * radius, 6)
    return points + [x, y - points[:, 1].min(), z], triangles


def wrapped(points: Floats, triangles: Ints) -> Floats:
    """(T, 3, 2) texture coordinates around a statue, with a seam."""
    corner = points[triangles] - (points.min(axis=0) + points.max(axis=0)) / 2
    turn = np.arctan2(corner[..., 2], corner[..., 0]) / (2 * np.pi) + 0.5
    turn = np.where(turn.max(axis=1, keepdims=True) - turn > 0.5, turn + 1, turn)
    height = corner[..., 1] / np.ptp(points[:, 1]) + 0.5
    return np.stack([turn, height], axis=-1)


def write_rooms(folder: Path, subdivisions: int = 4, names: tuple[str, ...] = ()) -> Path:
    """The model with its images; the first statue has a texture, the second has none. ``names``
    are what the statues are called, where that is something else."""
    model = Path(shutil.copytree(TWO_ROOMS, folder)) / "two_rooms.obj"
    lines, begin, begin_uv = [model.read_text()], 0, 0
    begin = sum(line.startswith("v ") for line in lines[0].splitlines())
    begin_uv = sum(line.startswith("vt ") for line in lines[0].splitlines())
    for k, name in enumerate(STATUES):
        points, triangles = statue(name, subdivisions)
        called = names[k] if names else name
        lines.append(f"o {called}\nusemtl {'room_a' if k == 0 else 'ceiling'}")
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in points.tolist()]
        uv, place = np.unique(
            wrapped(points, triangles).round(5).reshape(-1, 2), axis=0, return_inverse=True
        )
        lines += [f"vt {u:.5f} {v:.5f}" for u, v in uv.tolist()]
        for face, at in zip(triangles.tolist(), place.reshape(-1, 3).tolist(), strict=True):
            corners = zip(face, at, strict=True)
            lines.append("f " + " ".join(f"{begin + p + 1}/{begin_uv + t + 1}" for p, t in corners))
        begin += len(points)
        begin_uv += len(uv)
    model.write_text("\n".join(lines) + "\n")
    return model
