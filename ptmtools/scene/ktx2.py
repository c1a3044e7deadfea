"""Transcodes KTX2 images with Basis Universal textures (KHR_texture_basisu) to PNG.

The transcoder, in C++, runs in a child process (`sandbox`):
``python -P -m ptmtools.scene.ktx2 MEMORY IN OUT``.
"""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ptmtools.errors import InputError
from ptmtools.scene.sandbox import require, run_in_sandbox, serve
from ptmtools.scene.source import FileRange

MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
#: Width and height in texels, and their offset in the header.
_SIZE, _SIZE_AT = struct.Struct("<II"), 20
#: Largest side; no GPU supports a larger texture.
_LARGEST_SIDE = 1 << 14


@dataclass(frozen=True)
class TranscodedBytes:
    """The bytes of an image, as PNG if it is KTX2. Raises the errors of `transcoded`."""

    read: Callable[[], bytes]

    def size(self) -> int:
        """The number of bytes that reading takes. Raises OSError."""
        return self.read.size() if isinstance(self.read, FileRange) else 0

    def __call__(self) -> bytes:
        data = self.read()
        return transcoded(data) if data.startswith(MAGIC) else data


def transcoded(data: bytes) -> bytes:
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
            run_in_sandbox(__name__, "the transcoder", ktx2, ktx2, png)
        except InputError as error:
            raise InputError("PTM-I125", error.message) from None
        return png.read_bytes()


def _transcode(ktx2: str, png: str) -> None:
    import opengl_basisu
    from PIL import Image

    texture = opengl_basisu.open(ktx2)
    texels = texture.transcode("rgba8").data
    image = Image.fromarray(texels.reshape(texture.height, texture.width, 4), "RGBA")
    (image if texture.has_alpha else image.convert("RGB")).save(png)


if __name__ == "__main__":
    serve(_transcode)
