"""Decodes primitives compressed with Draco (KHR_draco_mesh_compression), in a process of its own.

As a program: ``python -P -m ptmtools.scene.gltf.draco MEMORY FOLDER COUNT`` reads ``0.drc``, … in
the folder and writes ``0.npz``, …
"""

from __future__ import annotations

import re
import struct
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import MissingComponentError
from ptmtools.scene.gltf.document import Document
from ptmtools.scene.sandbox import run_in_sandbox, serve
from ptmtools.store.archive import pack_arrays, unpack_arrays

EXTENSION = "KHR_draco_mesh_compression"
#: Of the grid of an attribute: its width, and its bits, of which Draco has 30 at most.
_GRID, _GRID_MARK = struct.Struct("<fB"), b"(.{4}[\x01-\x1e])"
#: So many places are looked at, as a hostile stream may have its beginning everywhere.
_TRIES = 1000
#: What the width may differ by from what is decoded, in units of the last place of the largest
#: number: rounding of float32.
_WIDTH_ULPS = 4


@dataclass(frozen=True)
class Decoded:
    """A primitive.

    Attributes
    ----------
    triangles: (m, 3).
    attributes: by their ids, (n, items) as stored.
    data: what it was decoded from.
    """

    triangles: NDArray[np.int64]
    attributes: dict[int, NDArray[Any]]
    data: bytes

    def step(self, attribute: int) -> float | None:
        """The step of the grid that an attribute was rounded to, 0 if that is not known; None for
        integers, which were not rounded here.

        The stream has where the grid begins, its width and its bits one after the other. Encoders
        let it begin with the least number of each component, by which it is found; a grid that the
        user has set is not.
        """
        values = self.attributes.get(attribute)
        if values is not None and values.dtype.kind != "f":
            return None
        if values is None or values.dtype != np.float32 or not len(values):
            return 0.0
        with np.errstate(all="ignore"):
            low, high = values.min(axis=0), values.max(axis=0)
            widest = float((high.astype(np.float64) - low).max())
            slack = _WIDTH_ULPS * float(np.spacing(np.abs(values).max()))
        mark = re.escape(low.astype("<f4").tobytes())
        grids = re.compile(b"(?=" + mark + _GRID_MARK + b")", re.DOTALL)
        for found in islice(grids.finditer(self.data), _TRIES):
            width, bits = _GRID.unpack(found[1])
            if abs(width - widest) <= slack:
                return widest / float((1 << bits) - 1)
        return 0.0


def decode_primitives(document: Document, views: Iterable[int]) -> dict[int, Decoded]:
    """The primitives that these buffer views hold.

    Raises ValueError for a view that leaves its buffer, InputError PTM-I254 for what cannot be
    decoded, MissingComponentError PTM-M100 without DracoPy.
    """
    wanted = sorted(set(views))
    if not wanted:
        return {}
    if find_spec("DracoPy") is None:
        raise MissingComponentError(
            "PTM-M100",
            "DracoPy is needed for meshes compressed with Draco",
            file=document.path,
            remedy="pip install DracoPy",
        )
    found = {}
    with tempfile.TemporaryDirectory() as scratch:
        for k, view in enumerate(wanted):
            buffer, start, length = document.view(view)
            Path(scratch, f"{k}.drc").write_bytes(buffer.data[start : start + length])
        run_in_sandbox(__name__, "Draco", document.path, scratch, str(len(wanted)))
        for k, view in enumerate(wanted):
            file = Path(scratch, f"{k}.npz")
            arrays = unpack_arrays(file.read_bytes(), file=file)
            triangles = arrays.pop("triangles").astype(np.int64)
            attributes = {int(name.removeprefix("id_")): array for name, array in arrays.items()}
            data = Path(scratch, f"{k}.drc").read_bytes()
            found[view] = Decoded(triangles, attributes, data)
    return found


def _decode(folder: str, count: str) -> None:
    import DracoPy

    for k in range(int(count)):
        mesh = DracoPy.decode(Path(folder, f"{k}.drc").read_bytes())
        arrays = {f"id_{row['unique_id']}": np.asarray(row["data"]) for row in mesh.attributes}
        faces = getattr(mesh, "faces", np.zeros((0, 3)))
        arrays["triangles"] = np.asarray(faces, dtype=np.uint32).reshape(-1, 3)
        Path(folder, f"{k}.npz").write_bytes(pack_arrays(arrays))


if __name__ == "__main__":
    serve(_decode)
