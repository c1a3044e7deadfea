"""``--trim``: the levels of the textures that no eye resolves, and what leaving them out saves."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from ptmtools.errors import naming
from ptmtools.pipeline.options import TextureOptions
from ptmtools.pipeline.reading import image_rows_of, images_of
from ptmtools.pipeline.run import Artifacts
from ptmtools.pipeline.stages import APO, CELLS, PVS, SCENE
from ptmtools.quantities import count, size
from ptmtools.store.layout import IMAGES

if TYPE_CHECKING:
    from ptmtools.texture.model import PtmHeader


def unresolved(artifacts: Artifacts, options: TextureOptions) -> list[int]:
    """Of each image of the scene how many of its finest levels are left out for that.

    Raises what reading the artifacts of the scene, the cells and the sets raises.
    """
    rows = image_rows_of(artifacts)
    if not options.trim:
        return [0] * len(rows)
    from ptmtools.coverage.required_levels import Screen, unresolved_levels

    screen = Screen(options.trim_height, options.trim_fov, options.trim_distance)

    def levels() -> list[int]:
        stages = artifacts[APO], artifacts[CELLS], artifacts[PVS]
        return [int(n) for n in unresolved_levels(*stages, _sizes(artifacts, options), screen)]

    return artifacts.held(f"levels unresolved by {screen}", levels)


def _sizes(artifacts: Artifacts, options: TextureOptions) -> list[tuple[int, int]]:
    """(width, height) of the scene's images. One that is not in the database yet, of a dry run,
    counts as a texel: it is encoded anew in any case."""
    from ptmtools.texture.images.opening import opened, pillow_faults
    from ptmtools.texture.model import Limits

    there = artifacts.record(SCENE).outputs
    found = []
    for image in images_of(artifacts):
        width = height = 1
        if f"{IMAGES}/{image.sha256}" in there:
            with naming(image.name), pillow_faults():
                file = io.BytesIO(image.load())
                width, height = opened(file, Limits(options.limit << 20)).size
        found.append((width, height))
    return found


def _left_out(header: PtmHeader, options: TextureOptions) -> list[tuple[int, int]]:
    """(width, height) of the levels that only ``--trim`` has left out, coarsest first."""
    from ptmtools.texture.encoder import kept_levels
    from ptmtools.texture.pyramid import level_sizes

    sizes = level_sizes(header.width, header.height)
    return sizes[len(sizes) - header.trimmed : kept_levels(*sizes[-1], options)[-1] + 1]


def unresolved_counts(headers: Iterable[PtmHeader], options: TextureOptions) -> dict[str, int]:
    """The figures of ``--trim``, none without: of how many textures levels were left out, and how
    many bytes less their finest levels have, decoded."""
    if not options.trim:
        return {}
    found = {"unresolved": 0, "unresolved_bytes": 0}
    for header in headers:
        if sizes := _left_out(header, options):
            (width, height), finest = sizes[-1], header.levels[-1]
            found["unresolved"] += 1
            texels = width * height - finest.width * finest.height
            found["unresolved_bytes"] += texels * header.texel_bytes
    return found


def notes_on_trim(
    names: Iterable[str], headers: Sequence[PtmHeader], options: TextureOptions
) -> Iterator[str]:
    """Which textures have less levels for it, and what about that saves: as many bytes for a texel
    as the finest level that is kept."""
    for name, header in zip(names, headers, strict=True):
        sizes = _left_out(header, options) if options.trim else []
        if sizes:
            (width, height), finest = sizes[-1], header.levels[-1]
            texels = sum(w * h for w, h in sizes)
            saved = finest.length * texels // (finest.width * finest.height)
            yield (
                f"--trim leaves out {count(len(sizes), 'level')} of {name} that no eye resolves: "
                f"{finest.width} x {finest.height} of {width} x {height}, about {size(saved)} less"
            )
