"""Writes the files of a sample: all or none, and never over foreign files."""

from __future__ import annotations

import io
import os
import re
import tempfile
from collections.abc import Callable
from pathlib import Path

from PIL import Image

from ptmtools.errors import OutputError
from ptmtools.files import writing
from ptmtools.progress import Progress, silent

HEAD = "# ptmtools sample"
#: A path in the output folder, and a function that returns the bytes.
File = tuple[str, Callable[[], bytes]]


def constant(data: bytes) -> Callable[[], bytes]:
    return lambda: data


def png(image: Image.Image) -> bytes:
    out = io.BytesIO()
    image.save(out, "PNG", compress_level=3)  # 3 % more than 6, three times as fast
    return out.getvalue()


def ours(folder: Path, stem: str) -> set[str]:
    """Returns the files of an earlier sample in ``folder``; none if the folder holds no such
    model."""
    try:
        with (folder / f"{stem}.obj").open(encoding="utf-8") as file:
            if not file.readline().startswith(HEAD):
                return set()
        lines = (folder / f"{stem}.mtl").read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return set()
    images = {
        line.split()[-1] for line in lines if line.startswith(("map_Kd ", "map_Ks ", "map_d "))
    }
    safe = re.compile(r"(textures/)?[a-z0-9_]+\.(png|jpg)")
    return {f"{stem}.obj", f"{stem}.mtl", *(name for name in images if safe.fullmatch(name))}


def write(folder: Path, files: list[File], *, force: bool, progress: Progress = silent) -> None:
    """Writes the files, all or (short of a power cut during the renames) none.

    A folder that is not empty and holds no sample is refused without ``force``; foreign files are
    left alone. Textures of an earlier sample that the new one lacks are removed.

    Raises OutputError: PTM-O001 the folder holds other files, PTM-O002 it cannot be written,
    PTM-O003 the disk is full.
    """
    with writing(folder):
        if folder.exists() and not folder.is_dir():
            raise OutputError("PTM-O002", "is not a folder", file=folder, remedy="name a folder")
        before = ours(folder, Path(files[-1][0]).stem) if folder.is_dir() else set()
        if folder.exists() and not before and not force and any(folder.iterdir()):
            raise OutputError(
                "PTM-O001",
                "holds files that are no sample",
                file=folder,
                remedy="name another folder, or use --force",
            )
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".sample-", dir=folder) as staging:
            for k, (_, load) in enumerate(files):
                progress(k, len(files), "files")
                (Path(staging) / str(k)).write_bytes(load())
            progress(len(files), len(files), "files")
            for k, (name, _) in enumerate(files):
                target = folder / name
                target.parent.mkdir(exist_ok=True)
                os.replace(Path(staging) / str(k), target)
        for name in sorted(before - {name for name, _ in files}):
            (folder / name).unlink(missing_ok=True)
