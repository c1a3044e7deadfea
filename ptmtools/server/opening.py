"""What there is to serve of a folder that somebody names."""

from __future__ import annotations

import sys
from os import PathLike
from pathlib import Path
from threading import Lock

from ptmtools.errors import DatabaseError, PtmError
from ptmtools.pipeline.command import naming_command, open_database
from ptmtools.pipeline.stages.emit import EMIT
from ptmtools.server.lookup import INDEX, Lookup, among, below
from ptmtools.site.content import Entry
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
    path = Path(folder)
    if (path / INDEX).is_file() and not (path / MANIFEST).exists():
        return below(path, hashed=True)
    return _Database(path)


class _Database:
    """The files of a database, which may be built again meanwhile: the site is made anew for the
    next who asks for its page."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._making = Lock()
        # The site, and the state of the database that it is of.
        built = self._stamp()
        self._made = self._site(), built
        self._others = below(path / SERVED)

    def __call__(self, name: str) -> Entry | None:
        if name == INDEX and self._made[1] != self._stamp():
            self._renew()
        return self._made[0](name) or self._others(name)

    def _renew(self) -> None:
        with self._making:
            built = self._stamp()
            if self._made[1] == built:
                return
            try:
                self._made = self._site(), built
            except (PtmError, OSError) as fault:
                print(f"ptm: {fault}", file=sys.stderr)
                raise BlockingIOError("the database is being built, or damaged") from None

    def _stamp(self) -> tuple[int, int]:
        """Changes whenever a stage is finished."""
        try:
            state = (self._path / MANIFEST).stat()
        except OSError:
            return 0, 0
        return state.st_mtime_ns, state.st_ino

    def _site(self) -> Lookup:
        from ptmtools.site.content import SiteOptions, site_of

        with naming_command(self._path):
            try:
                database = open_database(self._path)
            except DatabaseError as fault:
                if fault.code == "PTM-D001" and self._path.exists():
                    fault.message = "neither a database nor a folder that `ptm publish` wrote"
                raise
            database.record(EMIT.name)
            return among(site_of(self._path, SiteOptions(pictures=False)).entries)
