"""What there is to serve of a folder that somebody names."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from ptmtools.errors import DatabaseError
from ptmtools.pipeline.command import naming_command, open_database
from ptmtools.pipeline.stages.emit import EMIT
from ptmtools.server.lookup import INDEX, Lookup, among, below, first_of
from ptmtools.store.layout import MANIFEST, SERVED


def files_of(folder: str | PathLike[str]) -> Lookup:
    """The files of a database, which are its site and then what lies in its `www`; or those of a
    folder that `ptm publish` wrote. The site has no pictures but the walk itself, which is there as
    soon as they would be.

    Raises
    ------
    DatabaseError: PTM-D001 it is neither; PTM-D002, D003 a damaged database, or one of another
        schema; PTM-D004 one that is not built to the end; and what making the site raises.
    """
    from ptmtools.viewer.site import SiteOptions, site_of

    path = Path(folder)
    if (path / INDEX).is_file() and not (path / MANIFEST).exists():
        return below(path, hashed=True)
    with naming_command(path):
        try:
            database = open_database(path)
        except DatabaseError as fault:
            if fault.code == "PTM-D001" and path.exists():
                fault.message = "neither a database nor a folder that `ptm publish` wrote"
            raise
        database.record(EMIT.name)
        site = site_of(path, SiteOptions(pictures=False))
    return first_of(among(site.entries), below(path / SERVED))
