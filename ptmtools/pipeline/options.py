"""The options of a build: those of all stages, and of who does the work."""

from __future__ import annotations

from dataclasses import dataclass, field

from ptmtools.cells.options import SubdivideOptions
from ptmtools.coverage.options import AchOptions
from ptmtools.database.model import EmitOptions
from ptmtools.scene.options import IngestOptions
from ptmtools.texture.model import EncodeOptions
from ptmtools.visibility.options import PvsOptions


@dataclass(frozen=True)
class TextureOptions(EncodeOptions):
    """How the images of a scene are encoded.

    Attributes
    ----------
    fallback: write a PNG twin of each texture, for clients that cannot read `.ptm`.
    fallback_size: the twin holds the finest level whose longer side is at most this, texels, or the
        coarsest if none is: a browser that knows no `.ptm` loads all of them. 0 is the finest.
    limit: as in `IngestOptions`.
    """

    fallback: bool = True
    fallback_size: int = 0
    limit: int = field(default=1024, compare=False)


@dataclass(frozen=True)
class BuildOptions:
    """The options of all stages.

    Attributes
    ----------
    ingest, subdivide, pvs, ach, textures, emit: of each stage.
    workers: of the executor, see `open_executor`. Changes nothing in the result.
    scheduler: address of a Dask cluster that does the tasks of the stages.
    force: write into a folder that is not ours, or over the database of another model.
    """

    ingest: IngestOptions = field(default_factory=IngestOptions)
    subdivide: SubdivideOptions = field(default_factory=SubdivideOptions)
    pvs: PvsOptions = field(default_factory=PvsOptions)
    ach: AchOptions = field(default_factory=AchOptions)
    textures: TextureOptions = field(default_factory=TextureOptions)
    emit: EmitOptions = field(default_factory=EmitOptions)
    workers: int = 0
    scheduler: str | None = None
    force: bool = False
