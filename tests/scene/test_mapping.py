"""Mapping of textures on triangles, against the corners."""

from __future__ import annotations

import numpy as np
import pytest

from ptmtools.scene.colors import gradients


def test_gradients_of_triangles() -> None:
    random = np.random.default_rng(2)
    corners, uv = random.normal(size=(50, 3, 3)), random.normal(size=(50, 3, 2))
    actual = gradients(corners, uv)
    for change, points, at in zip(actual, corners, uv, strict=True):
        assert change @ (points[1] - points[0]) == pytest.approx(at[1] - at[0])
        assert change @ (points[2] - points[0]) == pytest.approx(at[2] - at[0])
        assert change @ np.cross(points[1] - points[0], points[2] - points[0]) == pytest.approx(
            0, abs=1e-9
        )
    assert (gradients(np.zeros((1, 3, 3)), uv[:1]) == 0).all()


def test_slivers() -> None:
    """A metre long and 0.01 mm high, turned anyhow."""
    random = np.random.default_rng(3)
    foot, height, uv = random.uniform(size=50), 1e-5, random.normal(size=(50, 3, 2))
    flat = np.zeros((50, 3, 3))
    flat[:, 1, 0], flat[:, 2, 0], flat[:, 2, 1] = 1, foot, height
    turn = np.linalg.qr(random.normal(size=(50, 3, 3)))[0]
    across = uv[:, 1] - uv[:, 0]
    up = (uv[:, 2] - uv[:, 0] - foot[:, None] * across) / height
    expected = np.stack([across, up, 0 * up], axis=2) @ turn
    error = abs(gradients(flat @ turn, uv) - expected).max(axis=(1, 2))
    assert (error <= 1e-9 * abs(expected).max(axis=(1, 2))).all()
