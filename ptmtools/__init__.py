"""ptmtools: architectural scenes that stream.

The functions here are the commands of `ptm`: `build_scene` builds a database from a model,
`ingest`, `subdivide`, `compute_pvs`, `compute_ach` and `emit` are its stages, `encode` and
`decode` turn one image into a `.ptm` and back, `open` reads one level by level, `validate` and
`plot_plan` look at the result.
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
        BuildOptions,
        BuildReport,
        DatabaseFolder,
        TextureOptions,
        build_scene,
        make_ach,
        make_cells,
        make_files,
        make_pvs,
        make_textures,
        validate,
    )
    from ptmtools.scene import IngestOptions, Scene, ingest
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
    "BuildOptions": "pipeline",
    "BuildReport": "pipeline",
    "Cells": "cells",
    "CheckError": "errors",
    "DatabaseError": "errors",
    "DatabaseFolder": "pipeline",
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
    "make_ach": "pipeline",
    "make_cells": "pipeline",
    "make_files": "pipeline",
    "make_pvs": "pipeline",
    "make_textures": "pipeline",
    "open": "texture",
    "plot_plan": "database",
    "read_header": "texture",
    "read_image": "texture",
    "subdivide": "cells",
    "validate": "pipeline",
    "write_image": "texture",
}

__all__ = [
    "Ach",
    "AchOptions",
    "Artifacts",
    "BuildOptions",
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
    "make_ach",
    "make_cells",
    "make_files",
    "make_pvs",
    "make_textures",
    "plot_plan",
    "read_header",
    "read_image",
    "subdivide",
    "validate",
    "write_image",
]

__getattr__ = names(__name__, _HOME)
