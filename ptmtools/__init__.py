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
from ptmtools.version import __version__ as __version__

if TYPE_CHECKING:
    from ptmtools.cells import Cells as Cells
    from ptmtools.cells import SubdivideOptions as SubdivideOptions
    from ptmtools.cells import subdivide as subdivide
    from ptmtools.coverage.ach import compute_ach as compute_ach
    from ptmtools.coverage.model import Ach as Ach
    from ptmtools.coverage.options import AchOptions as AchOptions
    from ptmtools.database import EmitOptions as EmitOptions
    from ptmtools.database import PlotOptions as PlotOptions
    from ptmtools.database import ValidationReport as ValidationReport
    from ptmtools.database import emit as emit
    from ptmtools.database import plot_plan as plot_plan
    from ptmtools.errors import CheckError as CheckError
    from ptmtools.errors import DatabaseError as DatabaseError
    from ptmtools.errors import InputError as InputError
    from ptmtools.errors import LimitError as LimitError
    from ptmtools.errors import MissingComponentError as MissingComponentError
    from ptmtools.errors import OutputError as OutputError
    from ptmtools.errors import PtmError as PtmError
    from ptmtools.pipeline import Artifacts as Artifacts
    from ptmtools.pipeline import BuildReport as BuildReport
    from ptmtools.pipeline import TextureOptions as TextureOptions
    from ptmtools.pipeline import build_scene as build_scene
    from ptmtools.pipeline import run_stage as run_stage
    from ptmtools.pipeline import validate as validate
    from ptmtools.scene import IngestOptions as IngestOptions
    from ptmtools.scene import Scene as Scene
    from ptmtools.scene import ingest as ingest
    from ptmtools.store.folder import DatabaseFolder as DatabaseFolder
    from ptmtools.texture import Description as Description
    from ptmtools.texture import EncodeOptions as EncodeOptions
    from ptmtools.texture import Limits as Limits
    from ptmtools.texture import Picture as Picture
    from ptmtools.texture import PtmHeader as PtmHeader
    from ptmtools.texture import PtmReader as PtmReader
    from ptmtools.texture import decode as decode
    from ptmtools.texture import encode as encode
    from ptmtools.texture import encode_to as encode_to
    from ptmtools.texture import load_image as load_image
    from ptmtools.texture import read_header as read_header
    from ptmtools.texture import read_image as read_image
    from ptmtools.texture import write_image as write_image
    from ptmtools.texture.reader import open as open
    from ptmtools.visibility.model import Pvs as Pvs
    from ptmtools.visibility.options import PvsOptions as PvsOptions
    from ptmtools.visibility.pvs import compute_pvs as compute_pvs

__getattr__ = names(__name__)
