"""The forms in which clients load textures, as a table: their columns, and the image of each
column.

The columns of a texture come one after the other (`Catalogue`). Each displayed image is compared
with the same picture, that of the `.ptm`s with all levels. To add a form, add a module with two
functions, and a line here; a policy names its form.

Form `ptm`: ranges of a `.ptm`, each a level.

Form `interlaced`: interlaced images, files that are joined on the GPU one after the other (Englert
et al. 2014, §3.2). After some files the display shows their image with its mip levels by box, as
`generateMipmap` makes them; the paper has powers of two for these. So a texture takes 4/3 of its
texels, and each step has mip levels of its own, of an image that was decimated without a filter.
The next step replaces the one before. Each file is a request. Manifests are not on the link: axes
follow from the paper's rules, and the index could hold the sizes. While files are joined, the old
image, the file and the new image are in texture memory together; this is not counted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ptmtools.errors import DatabaseError, InputError, LimitError
from ptmtools.output.served import Served
from ptmtools.progress import Progress
from ptmtools.rendering.pyramids import in_colors, pack_pyramids
from ptmtools.rendering.records import Pyramids, Shows
from ptmtools.texture.model import Limits, gpu_texel_bytes
from ptmtools_lab.catalogue import Columns, align_columns, columns_of
from ptmtools_systems.interlace.model import Interlaced
from ptmtools_systems.interlace.reading import check_joined, read_manifest, read_part
from ptmtools_systems.interlace.steps import join

#: The form of a database without other files.
PTM = "ptm"


@dataclass(frozen=True)
class Form:
    """A form of textures.

    Attributes
    ----------
    name, about: its name and description.
    columns: the columns of the textures of a served folder; with RGB of three bytes in texture
        memory if the second argument is true. Raises DatabaseError.
    shows: the images of the columns, given the `.ptm`s; None: the levels of those. Raises
        DatabaseError, LimitError.
    needs: the texture set or list of the index that it reads, and how to get it.
    octrees: whether octree textures are also fetched, which only lit pictures show.
    """

    name: str
    about: str
    columns: Callable[[Served, bool], Columns]
    shows: Callable[[Served, Pyramids, Progress], Shows] | None = None
    needs: tuple[str, str] | None = None
    octrees: bool = False


def level_columns(served: Served, paper: bool) -> Columns:
    """See `Form.columns`."""
    return columns_of(served.index["textures"], paper=paper)


#: The form of the index's texture sets.
_SET = "interlace"
_AGAIN = "write them again with `ptm emit DB --format vrml,gltf,interlace`"
#: A texture that needs more memory than this to decode is refused.
_LIMITS = Limits(decoded_bytes=1 << 33)


def interlaced_columns(served: Served, paper: bool) -> Columns:
    """See `Form.columns`: a column is a file.

    Raises DatabaseError: PTM-D005, PTM-D006 a manifest is missing or damaged, or does not match the
    index.
    """
    rows = []
    for t in range(len(served.index["textures"])):
        manifest = _manifest(served, t)[1]
        parts, stored = manifest.parts, manifest.texel_bytes
        texel_bytes = stored if paper else gpu_texel_bytes(stored, manifest.components)
        memory = [texel_bytes * sum(w * h for w, h in mip_sizes(*part.joined)) for part in parts]
        ends = [*accumulate(part.bytes for part in parts)]
        rows.append((ends, memory, [part.joined for part in parts]))
    return align_columns(rows)


def shows(served: Served, levels: Pyramids, progress: Progress) -> Shows:
    """See `Form.shows`: the image of the files of each column, with its mip levels.

    Raises DatabaseError: as `columns`, and of the files. LimitError: PTM-L104, L204.
    """
    count = len(served.index["textures"])
    chains: list[list[NDArray[np.uint8]]] = []
    steps = []
    for t in range(count):
        progress(t, count, "joining interlaced images")
        joined = [mip_levels(image) for image in _images(served, t)]
        chains += joined
        steps.append(len(joined))
    first = np.cumsum([0, *steps[:-1]]) if steps else np.zeros(0, np.int64)
    counts = np.array(steps, dtype=np.int64)
    pyramids = pack_pyramids(chains)
    wide = int(counts.max(initial=0)) + 1
    row = first[:, None] + np.clip(np.arange(wide) - 1, 0, counts[:, None] - 1)
    resident = np.where(np.arange(wide) > 0, pyramids.levels[row], 0)
    return Shows(pyramids, row, resident, counts, levels.mean)


def mip_sizes(width: int, height: int) -> Iterator[tuple[int, int]]:
    """Yields the sizes of an image and of its mip levels, the finest first."""
    yield width, height
    while max(width, height) > 1:
        width, height = max(1, width >> 1), max(1, height >> 1)
        yield width, height


def mip_levels(image: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """Returns the mip levels of an (h, w, 3) image with power-of-two sides, the coarsest first:
    rounded means of 2 × 2 texels."""
    levels = [image]
    while max(image.shape[:2]) > 1:
        for axis in (0, 1):
            if image.shape[axis] == 1:
                image = np.repeat(image, 2, axis=axis)
        total = np.full((image.shape[0] >> 1, image.shape[1] >> 1, 3), 2, np.uint16)
        for y, x in np.ndindex(2, 2):
            total += image[y::2, x::2]
        image = (total >> 2).astype(np.uint8)
        levels.append(image)
    return levels[::-1]


def _images(served: Served, texture: int) -> Iterator[NDArray[np.uint8]]:
    """(h, w, 3) images of the first file, of the first two, …"""
    folder, interlaced = _manifest(served, texture)
    check_joined(interlaced, len(interlaced.parts), _LIMITS, folder)
    image = None
    for part in interlaced.parts:
        try:
            texels = read_part(folder, interlaced, part)
        except InputError as fault:
            raise _damage(fault) from None
        image = texels if image is None or part.axis is None else join(image, texels, part.axis)
        yield np.ascontiguousarray(in_colors(image)[..., :3])


def _manifest(served: Served, texture: int) -> tuple[Path, Interlaced]:
    """The set of a texture: its folder and its manifest."""
    folder, row = served.texture_set(_SET, texture), served.index["textures"][texture]
    try:
        interlaced = read_manifest(folder)
    except (InputError, LimitError) as fault:
        raise _damage(fault) from None
    if interlaced.original != (row["width"], row["height"]):
        raise DatabaseError(
            "PTM-D006", "is not of the texture that the index has", file=folder, remedy=_AGAIN
        )
    return folder, interlaced


def _damage(fault: InputError | LimitError) -> DatabaseError:
    code = "PTM-D005" if fault.code in ("PTM-I120", "PTM-I122") else "PTM-D006"
    return DatabaseError(code, fault.message, file=fault.file, place=fault.place, remedy=_AGAIN)


_LIST = (
    Form("ptm", "levels of `.ptm`s", level_columns),
    Form(
        "interlaced",
        "interlaced images",
        interlaced_columns,
        shows,
        ("interlace", "write them with `ptm emit DB --format vrml,gltf,interlace`"),
    ),
    Form(
        "octree",
        "levels of `.ptm`s and of octree textures",
        level_columns,
        needs=("octrees", "build it with `ptm build-scene --apo`"),
        octrees=True,
    ),
)
#: Forms by name.
FORMS = {form.name: form for form in _LIST}
