"""Decodes what a glTF has compressed by libraries in C++: meshes (KHR_draco_mesh_compression) and
KTX2 images with Basis Universal textures (KHR_texture_basisu).

Both run in a child process (`sandbox`). ``python -P -m ptmtools.scene.gltf.compression MEMORY
meshes FOLDER COUNT`` reads ``0.drc``, … in the folder and writes ``0.npz``, …; ``image IN OUT``
writes a PNG.
"""

from __future__ import annotations

import re
import struct
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ptmtools.arrays import Ints
from ptmtools.errors import InputError
from ptmtools.scene.gltf.document import GltfDocument
from ptmtools.scene.sandbox import require, run_in_sandbox, serve
from ptmtools.scene.source import FileRange
from ptmtools.store.archive import pack_arrays, unpack_arrays

DRACO = "KHR_draco_mesh_compression"
#: The grid of an attribute: its width, and its number of bits, at most 30.
_GRID, _GRID_MARK = struct.Struct("<fB"), b"(.{4}[\x01-\x1e])"
#: Largest number of matches that are tested; a hostile stream may match everywhere.
_TRIES = 1000
#: Largest difference between the width of the grid and of the decoded values, in units in the last
#: place of the largest value.
_WIDTH_ULPS = 4


@dataclass(frozen=True)
class DracoPrimitive:
    """A decoded primitive.

    Attributes
    ----------
    triangles: (m, 3).
    attributes: by id, (n, items) as stored.
    data: the compressed stream.
    """

    triangles: Ints
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


def decode_primitives(document: GltfDocument, views: Iterable[int]) -> dict[int, DracoPrimitive]:
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
        run_in_sandbox(__name__, "Draco", document.path, "meshes", scratch, str(len(distinct)))
        for k, view in enumerate(distinct):
            file = Path(scratch, f"{k}.npz")
            arrays = unpack_arrays(file.read_bytes(), file=file)
            triangles = arrays.pop("triangles").astype(np.int64)
            attributes = {int(name.removeprefix("id_")): array for name, array in arrays.items()}
            data = Path(scratch, f"{k}.drc").read_bytes()
            primitives[view] = DracoPrimitive(triangles, attributes, data)
    return primitives


def _decode_meshes(folder: str, count: str) -> None:
    import DracoPy

    for k in range(int(count)):
        mesh = DracoPy.decode(Path(folder, f"{k}.drc").read_bytes())
        arrays = {f"id_{row['unique_id']}": np.asarray(row["data"]) for row in mesh.attributes}
        faces = getattr(mesh, "faces", np.zeros((0, 3)))
        arrays["triangles"] = np.asarray(faces, dtype=np.uint32).reshape(-1, 3)
        Path(folder, f"{k}.npz").write_bytes(pack_arrays(arrays))


MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
#: Width and height in texels, and their offset in the header.
_SIZE, _SIZE_AT = struct.Struct("<II"), 20
#: Largest side; no GPU supports a larger texture.
_LARGEST_SIDE = 1 << 14


@dataclass(frozen=True)
class TranscodedBytes:
    """The bytes of an image, as PNG if it is KTX2. Raises the errors of `transcode`."""

    read: Callable[[], bytes]

    def size(self) -> int:
        """The number of bytes that reading takes. Raises OSError."""
        return self.read.size() if isinstance(self.read, FileRange) else 0

    def __call__(self) -> bytes:
        data = self.read()
        return transcode(data) if data.startswith(MAGIC) else data


def transcode(data: bytes) -> bytes:
    """A PNG of the first image of a KTX2 file.

    Raises InputError PTM-I125, and MissingComponentError PTM-M100 without opengl-basisu.
    """
    if len(data) < _SIZE_AT + _SIZE.size:
        raise InputError("PTM-I125", "truncated KTX2 image")
    width, height = _SIZE.unpack_from(data, _SIZE_AT)
    if not (0 < width <= _LARGEST_SIDE and 0 < height <= _LARGEST_SIDE):
        raise InputError("PTM-I125", f"{width} x {height} texels in a KTX2 image")
    require(
        "opengl_basisu",
        "opengl-basisu is needed for KTX2 textures",
        "pip install 'ptmtools[basisu]', or "
        "run `npx @gltf-transform/cli ktxdecompress IN.glb OUT.glb`",
    )
    with tempfile.TemporaryDirectory() as scratch:
        ktx2, png = Path(scratch, "image.ktx2"), Path(scratch, "image.png")
        ktx2.write_bytes(data)
        try:
            run_in_sandbox(__name__, "the transcoder", ktx2, "image", ktx2, png)
        except InputError as error:
            raise InputError("PTM-I125", error.message) from None
        return png.read_bytes()


def _transcode_image(ktx2: str, png: str) -> None:
    import opengl_basisu

    from ptmtools.texture.images.png import png_bytes

    texture = opengl_basisu.open(ktx2)
    texels = texture.transcode("rgba8").data
    image = texels.reshape(texture.height, texture.width, 4)[..., : 4 if texture.has_alpha else 3]
    Path(png).write_bytes(png_bytes(image, lossy=Path(ktx2).stat().st_size))


def _work(task: str, *arguments: str) -> None:
    (_decode_meshes if task == "meshes" else _transcode_image)(*arguments)


if __name__ == "__main__":
    serve(_work)
