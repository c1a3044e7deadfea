"""The same bytes on every machine, in every process, for every number of threads.

The other machine is this one with its loops compiled for the plainest processor of its family:
without vector instructions beyond the oldest and without fused multiply-add, whatever depends on
them would show.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from ptmtools.texture import EncodeOptions, decode, encode
from ptmtools.texture.previews import AVIF, image_bytes

PROFILES = ("raw", "fast", "small")


def images() -> dict[str, tuple[NDArray[Any], dict[str, Any]]]:
    rng = np.random.default_rng(11)
    y, x = np.mgrid[:90, :101]
    smooth = np.stack([120 + 70 * np.sin(x / 9 + c) + 40 * np.cos(y / 7) for c in range(3)], axis=2)
    photo = np.clip(smooth + rng.normal(0, 3, smooth.shape), 0, 255)
    actual: dict[str, tuple[NDArray[Any], dict[str, Any]]] = {
        "photo": (photo.astype(np.uint8), {}),
        "tiles": (photo.astype(np.uint8), {"tile": 32}),
        "grey": (photo[:, :, 0].astype(np.uint8), {}),
        "flat": (np.where(x[:, :, None] // 30 % 2, [9, 200, 30], 77).astype(np.uint8), {}),
        "deep": ((photo * 250).astype(np.uint16), {}),
        "float": (np.exp(photo / 20).astype(np.float32), {}),
    }
    return actual


def digests(threads: int) -> dict[str, str]:
    """Of every image in every profile: of the file and of what it decodes to."""
    actual = {}
    for name, (image, changes) in images().items():
        for profile in PROFILES:
            errors = (0, 2) if profile != "raw" and image.dtype.kind == "u" else (0,)
            for max_error in errors:
                options = EncodeOptions(profile, max_error=max_error, **changes)
                data = encode(image, options, threads=threads)
                back = decode(data, threads=threads).tobytes()
                key = f"{profile} {name} {max_error}"
                actual[key] = hashlib.sha256(data).hexdigest() + hashlib.sha256(back).hexdigest()
    return actual


@pytest.fixture(scope="module")
def here() -> dict[str, str]:
    return digests(threads=1)


@pytest.mark.parametrize(
    ("environment", "threads"),
    [({}, 2), ({"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}, 1)],
    ids=["another process, two threads", "another processor"],
)
def test_elsewhere(here: dict[str, str], environment: dict[str, str], threads: int) -> None:
    run = subprocess.run(
        [sys.executable, __file__, str(threads)],
        env={**os.environ, **environment},
        check=True,
        capture_output=True,
        text=True,
    )
    assert json.loads(run.stdout) == here


if __name__ == "__main__":
    print(json.dumps(digests(int(sys.argv[1]))))


def test_avif_does_not_depend_on_the_number_of_processors(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plugin = pytest.importorskip("PIL.AvifImagePlugin")
    y, x = np.mgrid[:256, :256]
    waves = [np.sin(x / 20 + c) * np.cos(y / 30) for c in range(3)]
    texels = (128 + 100 * np.stack(waves, axis=2)).astype(np.uint8)
    results = set()
    for threads in (1, 2, 4):
        monkeypatch.setattr(plugin, "_get_default_max_threads", lambda count=threads: count)
        results.add(image_bytes(texels, AVIF, 85))
    assert len(results) == 1
