"""A small, complete database of three rooms, made once; tests damage copies of it."""

from __future__ import annotations

import hashlib
import io
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ptmtools.cells.model import Cells
from ptmtools.coverage.model import Ach
from ptmtools.output import EmitOptions, TextureRecord, emit
from ptmtools.scene.model import Material, Scene, SourceImage
from ptmtools.texture import encode_to, read_header
from ptmtools.visibility.model import Pvs

MATERIALS = (
    Material("plain"),
    Material("picture", (1.0, 1.0, 1.0), image=0),
    Material("tinted", (1.0, 0.3, 0.3), image=0, wrap_s="clamp"),
    Material("curtain", (1.0, 1.0, 0.5), opacity=0.25, image=1, transparent=True),
    Material("glass", (0.0, 1.0, 0.5), opacity=0.5, transparent=True),
)


@dataclass(frozen=True)
class Artifacts:
    scene: Scene
    cells: Cells
    pvs: Pvs
    ach: Ach


def hints_by_hand(pvs: Pvs, value: np.ndarray) -> Ach:
    """Made-up hints of a thousand pixels for each cell."""
    cells = pvs.cell_count
    return Ach(
        start=pvs.start,
        value=value,
        pixels=value * 1000,
        error=value / 10,
        p95=np.minimum(2 * value, 1),
        seen=np.where(value > 0, 0.5, 0.0),
        views=np.tile(value[:, None], 6),
        missed=np.zeros(cells),
        samples=np.full(cells, 8, np.int32),
        rejected=np.zeros(cells, np.int32),
        uncertain=np.full(cells, 0.05),
        unseen_below=np.full(cells, 3 / 8),
        floor=np.full(cells, 0.5 / 1000),
        texture_start=np.zeros(0, np.int64),
        texture=np.zeros(0, np.int32),
        texture_value=np.zeros(0),
        backend="embree",
        renderer="by hand",
    )


@pytest.fixture(scope="session")
def made_up_hints() -> Callable[[Pvs, np.ndarray], Ach]:
    """``made_up_hints(pvs, value)``."""
    return hints_by_hand


@pytest.fixture(scope="session")
def artifacts(room_row: Callable[[int], tuple[Scene, Cells]]) -> Artifacts:
    """Three rooms with every kind of material; coverage values are made up."""
    scene, cells = room_row(3)
    quad = np.arange(len(scene.triangles)) // 2
    scene = replace(
        scene,
        triangle_material=(quad % len(MATERIALS)).astype(np.int32),
        two_sided=quad % 3 > 0,
        materials=MATERIALS,
        objects=("Wände.001", "Wände 001", '"quoted"', *scene.objects[3:]),
        images=tuple(SourceImage(f"{n}.png", n * 64, bytes) for n in "ab"),
    )
    pvs = Pvs.from_matrix(np.ones((3, 3), np.bool_))
    pixels = np.array([700, 200, 100, 600, 250, 150, 800, 100, 100], np.int64)
    ach = hints_by_hand(pvs, pixels / 1000)
    return Artifacts(scene, cells, pvs, ach)


def write_textures(www: Path) -> tuple[TextureRecord, ...]:
    """Two textures with their fallback images, and their records."""
    (www / "textures").mkdir(parents=True)
    random = np.random.default_rng(3)
    records = []
    for image, (name, shape) in enumerate({"a": (16, 24, 3), "b": (9, 5, 4)}.items()):
        pixels = random.integers(0, 256, shape, np.uint8)
        buffer = io.BytesIO()
        detail = encode_to(buffer, pixels)
        data = buffer.getvalue()
        header = read_header(data)
        (www / f"textures/{name}.ptm").write_bytes(data)
        Image.fromarray(pixels).save(www / f"textures/{name}.png")
        digest = hashlib.sha256(data).hexdigest()
        height, width, components = shape
        records.append(
            TextureRecord(
                image,
                f"textures/{name}.ptm",
                f"textures/{name}.png",
                width,
                height,
                components,
                header.levels,
                digest,
                detail=detail,
                stored=www / f"textures/{name}.ptm",
            )
        )
    return tuple(records)


def write_manifest(db: Path) -> None:
    """The manifest of what lies in a database now."""
    hashes = {
        p.relative_to(db).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(db.rglob("*"))
        if p.is_file() and p.name != "manifest.json"
    }
    stages = {
        "textures": {n: h for n, h in hashes.items() if "/textures/" in n},
        "emit": {n: h for n, h in hashes.items() if "/textures/" not in n},
    }
    document = {
        "format": "ptmtools database",
        "schema": 3,
        "model": "rooms.obj",
        "stages": {
            name: {
                "recipe": 1,
                "parameters": {},
                "inputs": {},
                "outputs": outputs,
                "counts": {},
                "notes": [],
            }
            for name, outputs in stages.items()
        },
    }
    (db / "manifest.json").write_text(json.dumps(document))


@pytest.fixture(scope="session")
def finished(artifacts: Artifacts, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The database, with VRML alone; not to be changed."""
    db = tmp_path_factory.mktemp("finished") / "rooms"
    a, records = artifacts, write_textures(db / "www")
    emit(
        a.scene,
        a.cells,
        a.pvs,
        a.ach,
        records,
        db / "www",
        EmitOptions(format="vrml"),
    )
    write_manifest(db)
    return db


@pytest.fixture(scope="session")
def put_textures() -> Callable[[Path], tuple[TextureRecord, ...]]:
    """``put_textures(www)`` writes the two textures and returns their records."""
    return write_textures


@pytest.fixture(scope="session")
def seal() -> Callable[[Path], None]:
    """``seal(db)`` writes the manifest of what lies there now, faults included."""
    return write_manifest


@pytest.fixture
def database(finished: Path, tmp_path: Path) -> Path:
    """A copy to damage."""
    shutil.copytree(finished, tmp_path / "rooms")
    return tmp_path / "rooms"
