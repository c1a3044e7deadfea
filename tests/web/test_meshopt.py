"""The browser's decoder of compressed geometry gives Python's bytes, or refuses."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.meshopt.decoding import decode
from ptmtools.meshopt.encoding import encode_attributes, encode_triangles, exponential
from tests.web.node import HERE, missing, run

View = tuple[dict[str, Any], bytes]


@pytest.fixture(scope="module", autouse=True)
def _node(require: Callable[[str, str], None]) -> None:
    if remedy := missing():
        require("node", remedy)


def in_browser(views: list[View], folder: Path) -> list[dict[str, str]]:
    for n, (_, data) in enumerate(views):
        (folder / f"{n}.bin").write_bytes(data)
    (folder / "views.json").write_text(json.dumps([extension for extension, _ in views]))
    results: list[dict[str, str]] = json.loads(run(HERE / "meshopt.mjs", folder))
    return results


def attributes(random: np.random.Generator) -> View:
    """Of all strides, widths of deltas and filters."""
    count, stride = int(random.integers(1, 900)), 4 * int(random.integers(1, 65))
    filtered = bool(random.random() < 0.4)
    if filtered:
        steps = np.cumsum(random.integers(-9, 9, (count, stride // 4)), axis=0)
        element = exponential(steps * 7, random.integers(-126, 100, stride // 4))
    else:
        width = random.choice([0, 1, 3, 200], stride)
        steps = random.integers(-width, width + 1, (count, stride))
        element = (np.cumsum(steps, axis=0) & 255).astype(np.uint8)
    extension = {"mode": "ATTRIBUTES", "count": count, "byteStride": stride}
    extension |= {"filter": "EXPONENTIAL"} if filtered else {}
    return extension, encode_attributes(element, int(random.choice([0, 2, 4, 6])))


def triangles(random: np.random.Generator) -> View:
    vertices = int(random.integers(3, 3000))
    count = int(random.integers(1, 500))
    strip = (np.arange(count)[:, None] + [0, 1, 2]) % vertices
    index = strip if random.random() < 0.5 else random.integers(0, vertices, (count, 3))
    extension = {"mode": "TRIANGLES", "count": 3 * count, "byteStride": 4, "vertices": vertices}
    return extension, encode_triangles(index)


def many(seed: int, count: int) -> Iterator[View]:
    random = np.random.default_rng(seed)
    for _ in range(count):
        yield (attributes if random.random() < 0.5 else triangles)(random)


def test_the_same_bytes(tmp_path: Path) -> None:
    views = list(many(1, 200))
    for (extension, data), actual in zip(views, in_browser(views, tmp_path), strict=True):
        expected = decode(data, {k: v for k, v in extension.items() if k != "vertices"})
        assert actual == {"hash": hashlib.sha256(expected).hexdigest()}, extension


def test_damaged_views_are_refused_or_other_numbers(tmp_path: Path) -> None:
    """All that Python refuses is refused, but corners that name vertices before the first: no
    index is outside the vertices."""
    random = np.random.default_rng(4)
    views: list[View] = []
    for extension, data in many(2, 300):
        spoilt = bytearray(data)
        for _ in range(int(random.integers(1, 4))):
            spoilt[int(random.integers(len(spoilt)))] = int(random.integers(256))
        length = len(spoilt) if random.random() < 0.7 else int(random.integers(len(spoilt)))
        views.append((extension, bytes(spoilt[:length])))
    refused = 0
    for (extension, data), actual in zip(views, in_browser(views, tmp_path), strict=True):
        try:
            expected = decode(data, {k: v for k, v in extension.items() if k != "vertices"})
        except ValueError:
            refused += 1
            assert extension["mode"] == "TRIANGLES" or "error" in actual
            continue
        if extension["mode"] == "TRIANGLES":
            outside = int(np.frombuffer(expected, "<u4").max()) >= extension["vertices"]
            assert outside == ("error" in actual)
            if outside:
                continue
        assert actual == {"hash": hashlib.sha256(expected).hexdigest()}
    assert refused > 50


def test_sizes_that_no_data_could_have(tmp_path: Path) -> None:
    extension, data = attributes(np.random.default_rng(3))
    index, corners = triangles(np.random.default_rng(3))
    views = [(extension | {"count": 10**9}, data), (extension | {"byteStride": 6}, data)]
    views += [(index | {"count": 3 * 10**9}, corners), (index | {"count": 4}, corners)]
    assert all("error" in actual for actual in in_browser(views, tmp_path))
