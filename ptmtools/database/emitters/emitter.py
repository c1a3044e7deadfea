"""What an emitter is: one frozen value that says what it is called, what it writes, and where."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ptmtools.lazy import Lazy

if TYPE_CHECKING:
    from ptmtools.database.content import Content
    from ptmtools.database.validation.served import ServedDatabase

#: Suffix of a gzip copy.
GZIP = ".gz"


@dataclass(frozen=True)
class Emitter:
    """A form in which cells, or their textures, are served.

    Attributes
    ----------
    name: as `--format` and the index of the hints have it.
    about: what it is, in a few words, for help.
    owns: files and folders in the served folder that are its own; a folder ends in a slash. The
        files must be there once it has been written.
    entry: the one of its files that leads to the others, if any, and that a browser opens; written
        when those are on the disk. A form without one is for clients of the hints.
    cell_files: template of the paths of the cells' geometry (`names.path_of`), if it writes that.
    texture_files: template of the folders of the textures' files, if it writes textures in a form
        of its own (`names.texture_name`).
    writer: function from a `Content` to the files, as (path in the served folder, str or bytes);
        what it can refuse, it refuses before it gives the first.
    reader: function from (path in the served folder, bytes) of one of its files to what the check
        needs of it, None if that cannot be had; called from several threads. Raises FileError, see
        `ptmtools.database.fault`. Without one nothing is read.
    check: function from a `ServedDatabase` to the counts of the manifest that it can tell, by name.
        Without one there is nothing to check.
    """

    name: str
    about: str
    owns: tuple[str, ...]
    writer: Lazy[Callable[[Content], Iterator[tuple[str, str | bytes]]]]
    reader: Lazy[Callable[[str, bytes], object | None]] | None = None
    check: Lazy[Callable[[ServedDatabase], Mapping[str, int]]] | None = None
    entry: str = ""
    cell_files: str = ""
    texture_files: str = ""

    def is_owner(self, path: str) -> bool:
        """Whether a path in the served folder is that of one of its files, or of a gzip copy."""
        plain = path.removesuffix(GZIP)
        return any(path.startswith(own) if own.endswith("/") else plain == own for own in self.owns)

    def files(self, content: Content) -> Iterator[tuple[str, str | bytes]]:
        """Path in the served folder and contents of each of its files, in the order of writing."""
        return self.writer.load()(content)

    def read(self, path: str, data: bytes) -> object | None:
        """What the check needs of a file."""
        return self.reader.load()(path, data) if self.reader else data

    def validate(self, database: ServedDatabase) -> Mapping[str, int]:
        """Holds its files against each other and against those of others; returns counts."""
        return self.check.load()(database) if self.check else {}
