"""ptmtools: architectural scenes that stream.

The functions here are the commands of `ptm`: `build_scene` builds a database from a model,
`run_stage` runs one stage of it, `ingest`, `subdivide`, `compute_pvs`, `compute_ach` and `emit` are
the stages, `encode` and `decode` turn one image into a `.ptm` and back, `open` reads one level by
level, `validate` and `plot_plan` look at the result, `read_served` reads it as clients do,
`site_of`, `publish` and `serving` bring it to browsers. Each has a frozen class of options, which
holds the defaults. Every failure that a user can cause raises a `PtmError`.

Names are imported when first used. They are the public interface, together with `ptmtools.pillow`
and the names of `ptmtools_lab` and others that docs/reference lists.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import lazy_exports
from ptmtools.sources import watch
from ptmtools.version import __version__ as __version__

if TYPE_CHECKING:
    from ptmtools.cells import (
        Cells as Cells,
        SubdivideOptions as SubdivideOptions,
        subdivide as subdivide,
    )
    from ptmtools.coverage.ach import compute_ach as compute_ach
    from ptmtools.coverage.model import Ach as Ach
    from ptmtools.coverage.options import AchOptions as AchOptions
    from ptmtools.diagnostics import ValidationReport as ValidationReport
    from ptmtools.errors import (
        CheckError as CheckError,
        DatabaseError as DatabaseError,
        InputError as InputError,
        LimitError as LimitError,
        MissingComponentError as MissingComponentError,
        OutputError as OutputError,
        PtmError as PtmError,
        WorkerError as WorkerError,
    )
    from ptmtools.output import (
        EmitExtras as EmitExtras,
        EmitOptions as EmitOptions,
        PlotOptions as PlotOptions,
        emit as emit,
        plot_plan as plot_plan,
    )
    from ptmtools.output.served import Served as Served, read_served as read_served
    from ptmtools.pipeline.artifacts import Artifacts as Artifacts
    from ptmtools.pipeline.build import build_scene as build_scene, run_stage as run_stage
    from ptmtools.pipeline.encoding import TextureOptions as TextureOptions
    from ptmtools.pipeline.report import BuildReport as BuildReport
    from ptmtools.pipeline.validation import validate as validate
    from ptmtools.scene import IngestOptions as IngestOptions, Scene as Scene, ingest as ingest
    from ptmtools.site.content import (
        Site as Site,
        SiteOptions as SiteOptions,
        site_of as site_of,
    )
    from ptmtools.site.published import (
        Published as Published,
        PublishOptions as PublishOptions,
    )
    from ptmtools.site.publishing import publish as publish
    from ptmtools.site.serving import serving as serving
    from ptmtools.store.folder import DatabaseFolder as DatabaseFolder
    from ptmtools.texture import (
        Description as Description,
        EncodeOptions as EncodeOptions,
        Limits as Limits,
        Picture as Picture,
        PtmHeader as PtmHeader,
        PtmReader as PtmReader,
        decode as decode,
        encode as encode,
        encode_to as encode_to,
        load_image as load_image,
        read_header as read_header,
        read_image as read_image,
        write_image as write_image,
    )
    from ptmtools.texture.reader import open as open
    from ptmtools.visibility.model import Pvs as Pvs
    from ptmtools.visibility.options import PvsOptions as PvsOptions
    from ptmtools.visibility.pvs import compute_pvs as compute_pvs
    from ptmtools.walk import Walk as Walk, read_walk as read_walk

watch()

__getattr__ = lazy_exports(
    __name__,
    {
        "ptmtools.cells": "Cells SubdivideOptions subdivide",
        "ptmtools.coverage.ach": "compute_ach",
        "ptmtools.coverage.model": "Ach",
        "ptmtools.coverage.options": "AchOptions",
        "ptmtools.diagnostics": "ValidationReport",
        "ptmtools.errors": (
            "CheckError DatabaseError InputError LimitError MissingComponentError OutputError "
            "PtmError WorkerError"
        ),
        "ptmtools.output": "EmitExtras EmitOptions PlotOptions emit plot_plan",
        "ptmtools.output.served": "Served read_served",
        "ptmtools.pipeline.build": "build_scene run_stage",
        "ptmtools.pipeline.encoding": "TextureOptions",
        "ptmtools.pipeline.report": "BuildReport",
        "ptmtools.pipeline.artifacts": "Artifacts",
        "ptmtools.pipeline.validation": "validate",
        "ptmtools.scene": "IngestOptions Scene ingest",
        "ptmtools.site.content": "Site SiteOptions site_of",
        "ptmtools.site.published": "Published PublishOptions",
        "ptmtools.site.publishing": "publish",
        "ptmtools.site.serving": "serving",
        "ptmtools.store.folder": "DatabaseFolder",
        "ptmtools.texture": (
            "Description EncodeOptions Limits Picture PtmHeader PtmReader decode encode "
            "encode_to load_image read_header read_image write_image"
        ),
        "ptmtools.texture.reader": "open",
        "ptmtools.visibility.model": "Pvs",
        "ptmtools.visibility.options": "PvsOptions",
        "ptmtools.visibility.pvs": "compute_pvs",
        "ptmtools.walk": "Walk read_walk",
    },
)
