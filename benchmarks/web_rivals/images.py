"""The textures of a scene in the forms that the rivals send, kept by content below ``build``.

``png`` and ``webp`` are lossless; ``webp-90`` is lossy, and ``webp-128`` to ``webp-1024`` are the
same with at most as many texels a side; ``jpeg-256`` has at most 256 texels a side;
``etc1s`` and ``uastc`` are KTX2 with all levels, by npm's ktx2-encoder (WebAssembly, seconds each).
"""

from __future__ import annotations

import hashlib
import io
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from PIL import Image

from benchmarks.npm import KTX2, ROOT
from ptmtools.scene.model import SourceImage

KEPT = ROOT / "build/bench/rivals"
MEDIA = {
    "png": "image/png",
    "webp": "image/webp",
    "webp-90": "image/webp",
    "webp-128": "image/webp",
    "webp-256": "image/webp",
    "webp-512": "image/webp",
    "webp-1024": "image/webp",
    "jpeg-256": "image/jpeg",
    "etc1s": "image/ktx2",
    "uastc": "image/ktx2",
}
#: To be raised when the same name stands for other bytes.
_EDITION = 1


def in_form(images: Sequence[SourceImage], form: str) -> list[bytes]:
    """All of them in one form of `MEDIA`; what is not kept yet is made."""
    files = [_file(image, form) for image in images]
    lacking = [(i, f) for i, f in zip(images, files, strict=True) if not f.is_file()]
    KEPT.mkdir(parents=True, exist_ok=True)
    for image, file in lacking:
        keep(file, _ENCODERS[form](_opened(image)))
    return [file.read_bytes() for file in files]


def _file(image: SourceImage, form: str) -> Path:
    key = hashlib.sha256(f"{_EDITION} {form} {image.sha256}".encode()).hexdigest()[:16]
    return KEPT / f"{key}.{form}"


def _opened(image: SourceImage) -> Image.Image:
    with Image.open(io.BytesIO(image.load())) as opened:
        opaque = opened.mode in ("L", "RGB", "1") or (opened.mode == "P" and image.plain)
        return opened.convert("RGB" if opaque else "RGBA")


def size_of(image: bytes) -> tuple[int, int]:
    """Width and height of an encoded image."""
    with Image.open(io.BytesIO(image)) as opened:
        return opened.size


def keep(file: Path, data: bytes) -> None:
    """Writes a file below `KEPT`, whole or not at all."""
    file.parent.mkdir(parents=True, exist_ok=True)
    part = file.with_name(f"{file.name}.part")
    part.write_bytes(data)
    part.replace(file)


def _by_pillow(name: str, **options: object) -> Callable[[Image.Image], bytes]:
    def encoded(image: Image.Image) -> bytes:
        out = io.BytesIO()
        image.save(out, name, **options)
        return out.getvalue()

    return encoded


def _small(image: Image.Image, side: int) -> Image.Image:
    small = image.copy()
    small.thumbnail((side, side), Image.Resampling.BOX)
    return small


def _small_jpeg(image: Image.Image) -> bytes:
    return _by_pillow("JPEG", quality=85, optimize=True)(_small(image, 256).convert("RGB"))


def _small_webp(image: Image.Image, side: int) -> bytes:
    return _ENCODERS["webp-90"](_small(image, side))


def _ktx2(image: Image.Image, form: str) -> bytes:
    """Raises SystemExit with what to install."""
    KTX2.require()
    script = Path(__file__).with_name("ktx2.mjs")
    with tempfile.TemporaryDirectory(prefix="ktx2-") as name:
        texels, out = Path(name) / "texels", Path(name) / "out"
        texels.write_bytes(image.convert("RGBA").tobytes())
        size = (str(image.width), str(image.height))
        command = ["node", str(script), str(KTX2.folder), form, *size, str(texels), str(out)]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
        return out.read_bytes()


_ENCODERS: dict[str, Callable[[Image.Image], bytes]] = {
    "png": _by_pillow("PNG", optimize=True),
    "webp": _by_pillow("WEBP", lossless=True, quality=80, method=4, exact=True),
    "webp-90": _by_pillow("WEBP", quality=90, method=4),
    **{f"webp-{side}": partial(_small_webp, side=side) for side in (128, 256, 512, 1024)},
    "jpeg-256": _small_jpeg,
    "etc1s": partial(_ktx2, form="etc1s"),
    "uastc": partial(_ktx2, form="uastc"),
}
