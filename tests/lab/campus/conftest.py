"""Campuses that several tests walk through."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ptmtools.arrays import Floats
from ptmtools.scene import IngestOptions
from ptmtools_systems.campus import CampusOptions, make_campus
from tests.systems.campus.models import house, level, write_campus, write_obj


def round_(radius: float, k: int) -> Floats:
    """(64, 5) the k-th of eight rings of a dome, x, y, z, u, v, outward."""
    turn, up = np.linspace(0, 2 * np.pi, 17), np.pi / 16 * np.array([k, k + 1])
    point = np.array([[[np.cos(h) * np.sin(t), np.sin(h), np.cos(h) * np.cos(t)] for t in turn]
                      for h in up])  # fmt: skip
    low, high = point * radius + [30, 0, 6]
    corner = np.stack([low[:-1], low[1:], high[1:], high[:-1]], axis=1).reshape(-1, 3)
    return np.concatenate([corner, np.zeros((len(corner), 2))], axis=1)


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Houses and a dome on a lawn, without lightmaps; not to be changed."""
    model = write_campus(tmp_path_factory.mktemp("model"))
    dome = {"roof": np.concatenate([round_(10, k) for k in range(8)])}
    houses = [(f"House {i}", house(14 * i, 0, 8, 8, 9, 2)) for i in range(2)]
    lawn = {"lawn": level((-30, -30), (60, 40), 0)}
    write_obj(model, [("Lawn", lawn), *houses, ("Dome", dome)])
    made = tmp_path_factory.mktemp("campus") / "made"
    options = CampusOptions(lightmaps="none", faces=8, error=0.2)
    make_campus(model, made, options, IngestOptions(unit="m", up="y"))
    return made
