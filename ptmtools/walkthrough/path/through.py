"""A walk through what a database was built from."""

from __future__ import annotations

from ptmtools.database.names import HINTS
from ptmtools.pipeline import Artifacts
from ptmtools.pipeline.stages import APO, CELLS
from ptmtools.store.layout import SERVED
from ptmtools.walkthrough.path.beginning import Viewpoints
from ptmtools.walkthrough.path.making import Path, make_path
from ptmtools.walkthrough.path.options import PathOptions
from ptmtools.walkthrough.served import read_index


def path_through(artifacts: Artifacts, options: PathOptions) -> Path:
    """A walk through the building, from one of the database's viewpoints on if it has any yet.

    Raises what `make_path` and `read_index` do.
    """
    return make_path(artifacts[APO], artifacts[CELLS], options, _viewpoints(artifacts))


def _viewpoints(artifacts: Artifacts) -> Viewpoints:
    folder = artifacts.db.path / SERVED
    if not (folder / HINTS).exists():
        return ()
    return [(v["cell"], v["position"], v["direction"]) for v in read_index(folder)["viewpoints"]]
