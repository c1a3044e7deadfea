"""The grid that coordinates were rounded to, as a file tells it."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from ptmtools.errors import InputError
from ptmtools.scene import ingest
from ptmtools.scene.gltf.compression import DracoPrimitive
from ptmtools.tolerance import COARSEST
from tests.scene.conftest import GltfModel, Put

SEEDS = st.integers(0, 2**32 - 1)


@pytest.fixture(autouse=True)
def _draco(require: Callable[[str, str], None]) -> None:
    if find_spec("DracoPy") is None:
        require("DracoPy", "pip install DracoPy")


def decoded(points: np.ndarray, bits: int) -> tuple[DracoPrimitive, int]:
    import DracoPy

    faces = np.arange(len(points) // 3 * 3, dtype=np.uint32).reshape(-1, 3)
    data = DracoPy.encode(points, faces, quantization_bits=bits)
    rows = DracoPy.decode(data).attributes
    attributes = {row["unique_id"]: row["data"] for row in rows}
    return DracoPrimitive(faces.astype(np.int64), attributes, data), rows[0]["unique_id"]


@settings(max_examples=60)
@given(SEEDS)
def test_the_step_is_the_encoders(seed: int) -> None:
    """Wherever the grid begins, at the origin, too."""
    import DracoPy

    random = np.random.default_rng(seed)
    bits = int(random.integers(8, 24))
    width = float(10 ** random.uniform(-2, 4))
    points = width * random.random((30, 3)) * random.choice([0.0, 0.5, 1.0], 3)
    points[0], points[1] = 0.0, [width, 0, 0]
    points += random.choice([0.0, 1.0, 1000.0]) * width * random.random(3)
    try:
        actual, attribute = decoded(points, bits)
    except DracoPy.EncodingFailedException:  # of triangles without area
        assume(False)
    reported = actual.step(attribute)
    assert reported is not None
    expected = float(np.ptp(points, axis=0).max()) / (2**bits - 1)
    assert reported == pytest.approx(expected, rel=1e-3) or expected < np.spacing(
        np.float32(np.abs(points).max())
    )


def test_what_is_not_known_is_0() -> None:
    actual, attribute = decoded(np.random.default_rng(1).random((9, 3)), 14)
    assert actual.step(attribute + 99) == 0
    assert DracoPrimitive(actual.triangles, actual.attributes, b"").step(attribute) == 0
    whole = {attribute: actual.attributes[attribute].astype(np.int16)}
    assert DracoPrimitive(actual.triangles, whole, actual.data).step(attribute) is None


def blocks(scale: float) -> GltfModel:
    """A room of whole numbers."""
    doc = GltfModel()
    quad = doc.quad()
    corners = np.array([[0, 0, 0], [100, 0, 0], [100, 40, 0], [0, 40, 0]], np.int16)
    quad["attributes"]["POSITION"] = doc.add(corners)
    doc.place(quad, scale=[scale] * 3)
    return doc


def test_a_step_is_told_and_bounded(put: Put) -> None:
    """What is made of blocks of a metre is meant so."""
    fine, coarse = (ingest(put("a.glb", blocks(scale).glb())) for scale in (0.001, 1.0))
    assert fine.tolerance.step == pytest.approx(0.1e-3)  # a cluster's share of 10 cm
    assert coarse.tolerance.step == COARSEST
    (message,) = [note.message for note in coarse.notes if note.code == "PTM-N201"]
    assert message.startswith(
        "compressed: coordinates are rounded to 1e+03 mm, so points within 15 mm "
    )
    float_ = ingest(put("a.glb", GltfModel.wall().glb()))
    assert float_.tolerance.step == 0
    assert "PTM-N201" not in {note.code for note in float_.notes}


def test_a_coarse_mesh_beside_a_small_one_that_is_turned(put: Put) -> None:
    """The tolerances go by the building's own axes, along which it is smaller."""
    doc = GltfModel()
    turn = {"rotation": [0.0, 0.0, float(np.sin(np.pi / 8)), float(np.cos(np.pi / 8))]}
    doc.place(doc.quad(), scale=[0.1, 0.25, 1], **turn)
    quad = doc.quad()
    quad["attributes"]["POSITION"] = doc.add(np.zeros((4, 3), np.int16))
    doc.place(quad, scale=[1.6] * 3)
    assert ingest(put("a.glb", doc.glb())).tolerance.step <= COARSEST


def test_draco_of_more_than_the_accessor_says(put: Put) -> None:
    """Nothing is drawn more often than was counted."""
    from tests.scene.features.gltf import draco

    doc = GltfModel()
    quad = draco(doc, doc.quad())
    doc.place(quad)
    doc.tree["accessors"][quad["indices"]]["count"] = 3
    with pytest.raises(InputError, match=r"Draco has 2 triangles, the accessors 1.*PTM-I249"):
        ingest(put("a.glb", doc.glb()))


def test_draco_without_indices_has_its_own(put: Put) -> None:
    from tests.scene.features.gltf import draco
    from tests.scene.features.registry import the_quad

    doc = GltfModel()
    quad = draco(doc, doc.quad())
    del quad["indices"]
    doc.place(quad)
    the_quad(ingest(put("a.glb", doc.glb())))


def test_zeros_without_end_are_searched_no_further(put: Put) -> None:
    """A mark of zeros is found at every byte."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]], np.float32)
    stream = DracoPrimitive(np.zeros((0, 3), np.int64), {0: points}, bytes(1 << 20))
    assert stream.step(0) == 0
    huge = np.array([[-3e38] * 3, [3e38] * 3], np.float32)
    assert DracoPrimitive(np.zeros((0, 3), np.int64), {0: huge}, bytes(100)).step(0) == 0


def test_draco_of_a_strip_has_triangles(put: Put) -> None:
    from tests.scene.features.gltf import draco
    from tests.scene.features.registry import the_quad

    doc = GltfModel()
    quad = draco(doc, doc.quad()) | {"mode": 5}
    doc.tree["accessors"][quad["indices"]]["count"] = 4
    doc.place(quad)
    the_quad(ingest(put("a.glb", doc.glb())))
