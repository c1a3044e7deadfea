"""Writes the files of a sample: all or none, and never over foreign files."""

from __future__ import annotations

import io
import os
import re
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

from PIL import Image

from ptmtools.errors import OutputError
from ptmtools.files import writing
from ptmtools.progress import Progress, silent

#: In the first lines of each model; OBJ and MTL have it in a comment.
HEAD = "ptmtools sample"
MODELS = (".obj", ".ply", ".glb")
#: A path in the output folder, and a function that returns the bytes.
File = tuple[str, Callable[[], bytes]]
#: Gets a line about a file of the user that is left out.
Note = Callable[[str], object]


def constant(data: bytes) -> Callable[[], bytes]:
    return lambda: data


def png(image: Image.Image) -> bytes:
    out = io.BytesIO()
    image.save(out, "PNG", compress_level=3)  # 3 % more than 6, three times as fast
    return out.getvalue()


def ignore(text: str) -> None:
    """Drops a note."""


def earlier_files(folder: Path, names: Iterable[str]) -> set[str]:
    """The files of an earlier sample in ``folder``, by the models among ``names``; none if a file
    of such a name is of other origin."""
    earlier: set[str] = set()
    for name in names:
        if not name.endswith(MODELS):
            continue
        try:
            with (folder / name).open("rb") as file:
                head = file.read(4096)
        except FileNotFoundError:
            continue
        except OSError:
            return set()
        if HEAD.encode() not in head:
            return set()
        earlier |= {name, *material_files(folder, name)}
    return earlier


def material_files(folder: Path, name: str) -> set[str]:
    """The material library of an OBJ of ours, and its images."""
    library = Path(name).with_suffix(".mtl").name
    try:
        lines = (folder / library).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return set()
    images = {
        line.split()[-1] for line in lines if line.startswith(("map_Kd ", "map_Ks ", "map_d "))
    }
    safe = re.compile(r"(textures/)?[a-z0-9_]+\.(png|jpg)")
    return {library, *(image for image in images if safe.fullmatch(image))}


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
        before = earlier_files(folder, dict(files)) if folder.is_dir() else set()
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
