"""Fixtures shared by all tests: the real data, required components, and hand-made rooms."""

from __future__ import annotations

import gc
import importlib.util
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from numpy.typing import ArrayLike

from ptmtools.cells.model import Cells
from ptmtools.coverage.backends.opengl import APT, create_context
from ptmtools.errors import MissingComponentError
from ptmtools.scene.model import Material, Scene
from ptmtools.scene.orientation.main_axes import tolerance_of

# How long an example takes says how busy the machine is.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


@cache
def _syntax() -> Any:
    del sys.modules["rfc3987_syntax"]
    return importlib.import_module("rfc3987_syntax")


def _is_valid_syntax(*given: object) -> bool:
    """Of rfc3987_syntax, which jsonschema imports and few schemas need: it compiles its grammars,
    for 4 s, when it is imported."""
    valid: bool = _syntax().is_valid_syntax(*given)
    return valid


if importlib.util.find_spec("rfc3987_syntax"):
    sys.modules["rfc3987_syntax"] = SimpleNamespace(is_valid_syntax=_is_valid_syntax)

# Many tests start processes, each of which would compile the package.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """The garbage collector looks through modules and tests neither while they come, nor later."""
    gc.disable()
    yield
    gc.freeze()
    gc.enable()


ROOT = Path(__file__).resolve().parent.parent
SHARED = Path(os.environ.get("PTM_SHARED", ROOT.parent / "shared"))


def absent(what: str, remedy: str) -> None:
    """Skip on a user's machine, fail in CI."""
    if os.environ.get("CI", "").lower() == "true":
        pytest.fail(f"{what} is missing; {remedy}", pytrace=False)
    pytest.skip(f"{what} is missing; {remedy}")


@pytest.fixture(scope="session", autouse=True)
def one_processor() -> Iterator[Callable[[], int]]:
    """Builds in this process have one worker, unless asked for more: the run of the tests has as
    many as processors, and processes take longer to start than most builds here. Yields what
    counts the processors."""
    from ptmtools import parallel

    count = parallel.processors
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parallel, "processors", lambda: 1)
        yield count


@pytest.fixture(scope="session", autouse=True)
def _no_waiting_for_the_disk() -> Iterator[None]:
    """A build waits for the disk forty times, and no test switches the power off."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda file: None)
        yield


@pytest.fixture(scope="session")
def require() -> Callable[[str, str], None]:
    """``require(what, remedy)``: report a missing component (skip, or fail with CI=true)."""
    return absent


@pytest.fixture(scope="session")
def has_gl() -> bool:
    try:
        create_context().release()
    except MissingComponentError:
        return False
    return True


@pytest.fixture
def gl(has_gl, require) -> None:
    """For tests that need OpenGL; a missing one is reported."""
    if not has_gl:
        require("OpenGL", APT)


@pytest.fixture(scope="session")
def chromium(require: Callable[[str, str], None]) -> Iterator[Any]:
    """Headless Chromium by playwright, of which a process can have one; visits have contexts."""
    from tests.e2e.browsers import web

    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        require("playwright", "pip install -e '.[dev]'")
    if (program := web.chromium()) is None:
        require("Chromium", "apt install chromium")
    with sync_playwright() as playwright:
        flags = ["--no-sandbox", web.WITHOUT_POPUPS]
        browser = playwright.chromium.launch(executable_path=program, args=flags)
        yield browser
        browser.close()


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of real test data."""
    if not SHARED.is_dir():
        absent(f"test data {SHARED}", "put it beside the checkout or name it in PTM_SHARED")
    return SHARED


def files_below(folder: Path) -> dict[str, bytes]:
    """Every file below a folder with its bytes."""
    files = (file for file in sorted(folder.rglob("*")) if file.is_file())
    return {str(file.relative_to(folder)): file.read_bytes() for file in files}


#: Texture coordinates of the corners of a face.
CORNER_UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float64)

RoomRow = Callable[[int], tuple[Scene, Cells]]


@pytest.fixture(scope="session")
def room_row() -> RoomRow:
    """``room_row(n)``: n cubic rooms of 4 m in a row along x, joined by doors 2 m wide, 3 m high.

    Room i spans x in [4i, 4i + 4], y in [0, 4], z in [-2, 2]; a door spans y in [0, 3], z in
    [-1, 1]. Walls have no thickness; cells, portals and pieces are written down by hand.
    """
    return make_room_row


def scene_of(
    faces: ArrayLike,
    objects: Sequence[str] | None = None,
    materials: Sequence[Material] = (Material("plain"),),
    material: Sequence[int] | None = None,
) -> Scene:
    """A scene of (n, 4, 3) quadrilaterals or (n, 3, 3) triangles, which share no points.

    ``objects`` is a name and ``material`` an index for each face.
    """
    corners = np.array(faces, dtype=np.float64)
    n, sides = corners.shape[:2]
    loop = np.array([[0, 1, 2], [0, 2, 3]])[: sides - 2]
    triangles = (sides * np.arange(n)[:, None, None] + loop).reshape(-1, 3).astype(np.int32)
    of_face = np.zeros(n, np.int32) if material is None else np.array(material, np.int32)
    points = corners.reshape(-1, 3)
    return Scene(
        points=points,
        triangles=triangles,
        uv=np.tile(CORNER_UV[loop], (n, 1, 1)),
        triangle_object=np.repeat(np.arange(n, dtype=np.int32), len(loop)),
        triangle_material=np.repeat(of_face, len(loop)),
        two_sided=np.ones(len(triangles), dtype=bool),
        objects=tuple(objects or [f"quad{i}" for i in range(n)]),
        materials=tuple(materials),
        tolerance=tolerance_of(points, triangles),
    )


def subdivided(scene: Scene, times: int) -> Scene:
    """The same scene with every triangle in ``times``² alike, corners in single precision."""
    i, j = (k.ravel() for k in np.meshgrid(np.arange(times), np.arange(times), indexing="ij"))
    upper, lower = i + j < times, i + j < times - 1
    first = np.stack([i, j], axis=1)
    steps = np.array([[[0, 0], [1, 0], [0, 1]], [[1, 0], [1, 1], [0, 1]]])
    second_third = np.concatenate([first[upper, None] + steps[0], first[lower, None] + steps[1]])
    share = np.concatenate([times - second_third.sum(2, keepdims=True), second_third], 2) / times
    corners = np.einsum("pcw,twx->tpcx", share, scene.corners).reshape(-1, 3)
    count = len(share)
    return replace(
        scene,
        points=corners.astype(np.float32).astype(np.float64),
        triangles=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
        uv=np.einsum("pcw,twx->tpcx", share, scene.uv).reshape(-1, 3, 2),
        triangle_object=np.repeat(scene.triangle_object, count),
        triangle_material=np.repeat(scene.triangle_material, count),
        two_sided=np.repeat(scene.two_sided, count),
    )


def make_room_row(n: int) -> tuple[Scene, Cells]:
    quads: list[np.ndarray] = []
    sides: list[tuple[int, int]] = []

    def quad(
        a: list[float], b: list[float], c: list[float], d: list[float], f: int, k: int
    ) -> None:
        quads.append(np.array([a, b, c, d], dtype=np.float64))
        sides.append((f, k))

    for i in range(n):
        l, r = 4.0 * i, 4.0 * i + 4
        quad([l, 0, -2], [l, 0, 2], [r, 0, 2], [r, 0, -2], i, -1)  # floor, faces up
        quad([l, 4, -2], [r, 4, -2], [r, 4, 2], [l, 4, 2], i, -1)  # ceiling, faces down
        quad([l, 0, -2], [r, 0, -2], [r, 4, -2], [l, 4, -2], i, -1)  # faces +z
        quad([l, 0, 2], [l, 4, 2], [r, 4, 2], [r, 0, 2], i, -1)  # faces -z
    quad([0, 0, -2], [0, 4, -2], [0, 4, 2], [0, 0, 2], 0, -1)  # faces +x
    e = 4.0 * n
    quad([e, 0, -2], [e, 0, 2], [e, 4, 2], [e, 4, -2], n - 1, -1)  # faces -x
    for i in range(n - 1):  # partitions face +x: front is room i + 1
        x = 4.0 * i + 4
        quad([x, 0, -2], [x, 4, -2], [x, 4, -1], [x, 0, -1], i + 1, i)
        quad([x, 0, 1], [x, 4, 1], [x, 4, 2], [x, 0, 2], i + 1, i)
        quad([x, 3, -1], [x, 4, -1], [x, 4, 1], [x, 3, 1], i + 1, i)

    scene = scene_of(np.array(quads))

    box = np.array([[x, y, z] for x in (0, 4) for y in (0, 4) for z in (-2, 2)], dtype=np.float64)
    loops = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    leaf_point = np.concatenate([box + [4.0 * i, 0, 0] for i in range(n)])
    face_index = np.concatenate([np.array(loops).ravel() + 8 * i for i in range(n)])
    # A chain of planes x = 4i: behind it room i - 1, in front the rest.
    node_plane = np.array([[1.0, 0, 0, -4.0 * i] for i in range(1, n)]).reshape(-1, 4)
    front = [i if i < n - 1 else -2 - (n - 1) for i in range(1, n)]
    back = [-2 - (i - 1) for i in range(1, n)]
    node_child = np.array([front, back], dtype=np.int32).T.reshape(-1, 2)
    door = np.array([[0, 0, -1], [0, 3, -1], [0, 3, 1], [0, 0, 1]], dtype=np.float64)
    doors = [door + [4.0 * i, 0, 0] for i in range(1, n)]
    cells = Cells(
        node_plane=node_plane,
        node_child=node_child,
        root_box=np.array([[0.0, 0, -2], [e, 4, 2]]),
        leaf_cell=np.arange(n, dtype=np.int32),
        leaf_standing=np.ones(n, dtype=np.bool_),
        leaf_point=leaf_point,
        leaf_point_start=8 * np.arange(n + 1),
        face_index=face_index.astype(np.int32),
        face_start=4 * np.arange(6 * n + 1),
        leaf_face_start=6 * np.arange(n + 1),
        portal_leaf=np.array([[i - 1, i] for i in range(1, n)], dtype=np.int32).reshape(-1, 2),
        portal_plane=np.array([[1.0, 0, 0, -4.0 * i] for i in range(1, n)]).reshape(-1, 4),
        portal_point=np.concatenate(doors) if doors else np.zeros((0, 3)),
        portal_start=4 * np.arange(n),
        portal_area=np.full(n - 1, 6.0),
        portal_passage=np.zeros(n - 1, np.bool_),
        vertex=scene.points,
        vertex_uv=np.tile(CORNER_UV, (len(quads), 1)),
        triangle=scene.triangles,
        triangle_source=np.arange(2 * len(quads), dtype=np.int32),
        triangle_cell=np.repeat(np.array(sides, dtype=np.int32), 2, axis=0),
        tolerance=scene.tolerance,
    )
    return scene, cells
