"""ptmtools: architectural scenes that stream.

The functions here are the commands of `ptm`: `build_scene` builds a database from a model,
`run_stage` runs one stage of it, `ingest`, `subdivide`, `compute_pvs`, `compute_ach` and `emit`
are what the stages do, `encode` and `decode` turn one image into a `.ptm` and back, `open` reads
one level by level, `validate` and `plot_plan` look at the result.
Each has a frozen class of options, which holds the defaults. Whatever a user can cause raises a
`PtmError`.

All of it is loaded when first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names
from ptmtools.version import __version__

if TYPE_CHECKING:
    from ptmtools.cells import Cells, SubdivideOptions, subdivide
    from ptmtools.coverage.ach import compute_ach
    from ptmtools.coverage.model import Ach
    from ptmtools.coverage.options import AchOptions
    from ptmtools.database import EmitOptions, PlotOptions, ValidationReport, emit, plot_plan
    from ptmtools.errors import (
        CheckError,
        DatabaseError,
        InputError,
        LimitError,
        MissingComponentError,
        OutputError,
        PtmError,
    )
    from ptmtools.pipeline import (
        Artifacts,
        BuildReport,
        TextureOptions,
        build_scene,
        run_stage,
        validate,
    )
    from ptmtools.scene import IngestOptions, Scene, ingest
    from ptmtools.store.folder import DatabaseFolder
    from ptmtools.texture import (
        Description,
        EncodeOptions,
        Limits,
        Picture,
        PtmHeader,
        PtmReader,
        decode,
        encode,
        encode_to,
        load_image,
        read_header,
        read_image,
        write_image,
    )
    from ptmtools.texture.reader import open as open
    from ptmtools.visibility.model import Pvs
    from ptmtools.visibility.options import PvsOptions
    from ptmtools.visibility.pvs import compute_pvs

_HOME = {
    "Ach": "coverage.model",
    "AchOptions": "coverage.options",
    "Artifacts": "pipeline",
    "BuildReport": "pipeline",
    "Cells": "cells",
    "CheckError": "errors",
    "DatabaseError": "errors",
    "DatabaseFolder": "store.folder",
    "Description": "texture",
    "EmitOptions": "database",
    "EncodeOptions": "texture",
    "IngestOptions": "scene",
    "InputError": "errors",
    "LimitError": "errors",
    "Limits": "texture",
    "MissingComponentError": "errors",
    "OutputError": "errors",
    "Picture": "texture",
    "PlotOptions": "database",
    "PtmError": "errors",
    "PtmHeader": "texture",
    "PtmReader": "texture",
    "Pvs": "visibility.model",
    "PvsOptions": "visibility.options",
    "Scene": "scene",
    "SubdivideOptions": "cells",
    "TextureOptions": "pipeline",
    "ValidationReport": "database",
    "build_scene": "pipeline",
    "compute_ach": "coverage.ach",
    "compute_pvs": "visibility.pvs",
    "decode": "texture",
    "emit": "database",
    "encode": "texture",
    "encode_to": "texture",
    "ingest": "scene",
    "load_image": "texture",
    "open": "texture",
    "plot_plan": "database",
    "read_header": "texture",
    "read_image": "texture",
    "run_stage": "pipeline",
    "subdivide": "cells",
    "validate": "pipeline",
    "write_image": "texture",
}

__all__ = [
    "Ach",
    "AchOptions",
    "Artifacts",
    "BuildReport",
    "Cells",
    "CheckError",
    "DatabaseError",
    "DatabaseFolder",
    "Description",
    "EmitOptions",
    "EncodeOptions",
    "IngestOptions",
    "InputError",
    "LimitError",
    "Limits",
    "MissingComponentError",
    "OutputError",
    "Picture",
    "PlotOptions",
    "PtmError",
    "PtmHeader",
    "PtmReader",
    "Pvs",
    "PvsOptions",
    "Scene",
    "SubdivideOptions",
    "TextureOptions",
    "ValidationReport",
    "__version__",
    "build_scene",
    "compute_ach",
    "compute_pvs",
    "decode",
    "emit",
    "encode",
    "encode_to",
    "ingest",
    "load_image",
    "plot_plan",
    "read_header",
    "read_image",
    "run_stage",
    "subdivide",
    "validate",
    "write_image",
]

__getattr__ = names(__name__, _HOME)
