"""Decodes primitives compressed with Draco (KHR_draco_mesh_compression) in a child process.

``python -P -m ptmtools.scene.gltf.draco MEMORY FOLDER COUNT`` reads ``0.drc``, … in the folder and
writes ``0.npz``, … (`sandbox`).
"""

from __future__ import annotations

import re
import struct
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.scene.gltf.document import Document
from ptmtools.scene.sandbox import require, run_in_sandbox, serve
from ptmtools.store.archive import pack_arrays, unpack_arrays

EXTENSION = "KHR_draco_mesh_compression"
#: The grid of an attribute: its width, and its number of bits, at most 30.
_GRID, _GRID_MARK = struct.Struct("<fB"), b"(.{4}[\x01-\x1e])"
#: Largest number of matches that are tested; a hostile stream may match everywhere.
_TRIES = 1000
#: Largest difference between the width of the grid and of the decoded values, in units in the last
#: place of the largest value.
_WIDTH_ULPS = 4


@dataclass(frozen=True)
class Decoded:
    """A decoded primitive.

    Attributes
    ----------
    triangles: (m, 3).
    attributes: by id, (n, items) as stored.
    data: the compressed stream.
    """

    triangles: NDArray[np.int64]
    attributes: dict[int, NDArray[Any]]
    data: bytes

    def step(self, attribute: int) -> float | None:
        """The step of the grid that an attribute was rounded to, 0 if it is unknown; None for
        integers, which Draco does not round.

        The stream contains the origin of the grid, its width and its number of bits in sequence.
        Encoders use the minimum of each component as the origin, which locates the sequence; a grid
        set by the user is not recognised.
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
        for match in islice(grids.finditer(self.data), _TRIES):
            width, bits = _GRID.unpack(match[1])
            if abs(width - widest) <= slack:
                return widest / float((1 << bits) - 1)
        return 0.0


def decode_primitives(document: Document, views: Iterable[int]) -> dict[int, Decoded]:
    """The primitives in these buffer views.

    Raises ValueError for a view that exceeds its buffer, InputError PTM-I254 if one cannot be
    decoded, MissingComponentError PTM-M100 without DracoPy.
    """
    distinct = sorted(set(views))
    if not distinct:
        return {}
    message = "meshes compressed with Draco require DracoPy"
    require("DracoPy", message, "pip install DracoPy", document.path)
    primitives = {}
    with tempfile.TemporaryDirectory() as scratch:
        for k, view in enumerate(distinct):
            buffer, start, length = document.view(view)
            Path(scratch, f"{k}.drc").write_bytes(buffer.data[start : start + length])
        run_in_sandbox(__name__, "Draco", document.path, scratch, str(len(distinct)))
        for k, view in enumerate(distinct):
            file = Path(scratch, f"{k}.npz")
            arrays = unpack_arrays(file.read_bytes(), file=file)
            triangles = arrays.pop("triangles").astype(np.int64)
            attributes = {int(name.removeprefix("id_")): array for name, array in arrays.items()}
            data = Path(scratch, f"{k}.drc").read_bytes()
            primitives[view] = Decoded(triangles, attributes, data)
    return primitives


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
