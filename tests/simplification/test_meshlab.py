"""Simplification by pymeshlab, and what is said where it cannot be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ptmtools import lazy
from ptmtools.errors import InputError, MissingComponentError
from ptmtools.simplification import SimplifyOptions, simplify
from tests.simplification.shapes import sphere

TO_500 = SimplifyOptions(500, method="meshlab")


def test_a_sphere_stays_one(require: Callable[[str, str], None]) -> None:
    if lazy.pymeshlab_absence():
        require("pymeshlab", "pip install pymeshlab; apt install libopengl0 libgl1")
    given = sphere(20)
    given = replace(given, points=given.points * 1e-3 + 5)
    actual = simplify(given, TO_500)
    assert 490 <= len(actual.mesh.triangles) <= 500
    assert np.linalg.norm(actual.mesh.points - 5, axis=1) == pytest.approx(1e-3, rel=0.02)
    here = actual.mesh.points[actual.mesh.triangles].mean(axis=1)
    there = given.points[given.triangles[actual.source]].mean(axis=1)
    assert np.linalg.norm(here - there, axis=1).max() < 3e-4
    assert np.isnan(actual.error)


def test_painted_meshes_are_refused() -> None:
    given = replace(sphere(20), material=np.zeros(4800, np.int32))
    with pytest.raises(InputError, match="PTM-I111") as caught:
        simplify(given, TO_500)
    assert "quadric" in str(caught.value)


def test_without_pymeshlab_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lazy, "find_spec", lambda name: None)
    monkeypatch.setattr(lazy.sys, "platform", "elsewhere")
    with pytest.raises(MissingComponentError, match="PTM-M100"):
        simplify(sphere(20), TO_500)
