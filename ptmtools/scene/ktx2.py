"""KTX2 images with Basis Universal textures (KHR_texture_basisu), as PNG.

Their transcoder, in C++, is run in a process of its own (`apart`). As a program:
``python -P -m ptmtools.scene.ktx2 MEMORY IN OUT``.
"""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from ptmtools.errors import InputError, MissingComponentError
from ptmtools.scene.sandbox import run_apart, serve
from ptmtools.scene.source import FileRange

MAGIC = b"\xabKTX 20\xbb\r\n\x1a\n"
#: Where the header has width and height, in texels.
_SIZE, _SIZE_AT = struct.Struct("<II"), 20
#: No GPU takes a larger texture.
_MOST = 1 << 14


@dataclass(frozen=True)
class TranscodedBytes:
    """The bytes of a PNG made of those of a KTX2 image; of any other image, its own.

    Raises what `transcoded` does.
    """

    read: Callable[[], bytes]

    def size(self) -> int:
        """How many bytes are read for it. Raises OSError."""
        return self.read.size() if isinstance(self.read, FileRange) else 0

    def __call__(self) -> bytes:
        data = self.read()
        return transcoded(data) if data.startswith(MAGIC) else data


def transcoded(data: bytes) -> bytes:
    """A PNG of the first image of a KTX2 file.

    Raises InputError PTM-I258, and MissingComponentError PTM-M204 without opengl-basisu.
    """
    if len(data) < _SIZE_AT + _SIZE.size:
        raise InputError("PTM-I258", "is cut short")
    width, height = _SIZE.unpack_from(data, _SIZE_AT)
    if not (0 < width <= _MOST and 0 < height <= _MOST):
        raise InputError("PTM-I258", f"{width} x {height} texels in a KTX2 image")
    if find_spec("opengl_basisu") is None:
        raise MissingComponentError(
            "PTM-M204",
            "opengl-basisu is needed for KTX2 textures",
            remedy="pip install 'ptmtools[basisu]', or "
            "run `npx @gltf-transform/cli ktxdecompress IN.glb OUT.glb`",
        )
    with tempfile.TemporaryDirectory() as scratch:
        given, made = Path(scratch, "image.ktx2"), Path(scratch, "image.png")
        given.write_bytes(data)
        try:
            run_apart(__name__, "the transcoder", given, given, made)
        except InputError as error:
            raise InputError("PTM-I258", error.message) from None
        return made.read_bytes()


def _transcode_here(given: str, made: str) -> None:
    import opengl_basisu
    from PIL import Image

    texture = opengl_basisu.open(given)
    texels = texture.transcode("rgba8").data
    shown = Image.fromarray(texels.reshape(texture.height, texture.width, 4), "RGBA")
    (shown if texture.has_alpha else shown.convert("RGB")).save(made)


if __name__ == "__main__":
    serve(_transcode_here)
