"""The small database of three rooms again, with glTF files."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ptmtools.output import EmitOptions, TextureRecord, emit

#: emit_gltf(www, changed artifacts…, options…): textures, VRML and glTF files.
EmitGltf = Callable[..., Path]


@pytest.fixture(scope="session")
def emit_gltf(
    artifacts: Any, put_textures: Callable[[Path], tuple[TextureRecord, ...]]
) -> EmitGltf:
    """``emit_gltf(www, scene=…, cells=…, records=…, fallback=…)``; plain unless asked for."""

    def write(
        www: Path,
        *,
        scene: Any = None,
        cells: Any = None,
        rename: Callable[[TextureRecord], TextureRecord] = lambda record: record,
        **options: Any,
    ) -> Path:
        records = tuple(map(rename, put_textures(www)))
        a = artifacts
        given = EmitOptions(**{"format": "vrml,gltf", "plain_gltf": True, **options})
        emit(scene or a.scene, cells or a.cells, a.pvs, a.ach, records, www, given)
        return www

    return write


@pytest.fixture(scope="session")
def gltf_finished(emit_gltf: EmitGltf, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its served folder; not to be changed."""
    return emit_gltf(tmp_path_factory.mktemp("gltf") / "rooms" / "www")


@pytest.fixture
def gltf_database(gltf_finished: Path, tmp_path: Path, seal: Callable[[Path], None]) -> Path:
    """A copy to damage, with its manifest."""
    db = tmp_path / "rooms"
    shutil.copytree(gltf_finished.parent, db)
    seal(db)
    return db
