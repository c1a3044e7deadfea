"""Builds beside those at URLs, and what a store holds of one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.coverage.options import AchOptions
from ptmtools.light.options import LightOptions
from ptmtools.pipeline.build import build_scene
from ptmtools.pipeline.encoding import TextureOptions
from ptmtools.store import lists
from ptmtools.store.layout import MANIFEST
from ptmtools.store.lists import read_list
from ptmtools.store.manifest import Manifest
from ptmtools.texture.images.png import png_bytes
from tests.conftest import files_below
from tests.stores import Store

EMBREE = AchOptions(backend="embree")
#: Files with light, of few rays.
DIM = LightOptions(light_samples=4)
FAST = TextureOptions(fallback=False)


def built_here(model: Path, folder: Path, *options: Any) -> dict[str, bytes]:
    build_scene(model, folder, EMBREE, DIM, *options, workers=1)
    return files_below(folder)


def manifest_of(store: Store, bucket: str, prefix: str) -> Manifest:
    body = store.client().get_object(Bucket=bucket, Key=f"{prefix}/{MANIFEST}")["Body"]

    def read(digest: str) -> Mapping[str, str]:
        key = f"{prefix}/objects/{digest}"
        return read_list(store.client().get_object(Bucket=bucket, Key=key)["Body"].read(), file=key)

    return Manifest.from_bytes(body.read(), file=MANIFEST, lists=read)


def objects_of(store: Store, bucket: str, prefix: str) -> set[str]:
    rows = store.client().list_objects_v2(Bucket=bucket, Prefix=f"{prefix}/objects/")
    return {row["Key"].rpartition("/")[2] for row in rows.get("Contents", ())}


def painted(rooms: Path, name: str, color: int) -> None:
    (rooms.parent / name).write_bytes(png_bytes(np.full((24, 24, 3), color, np.uint8)))


def few_in_lists(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lists, "INLINE", 4)
    monkeypatch.setattr(lists, "MEAN", 4)
