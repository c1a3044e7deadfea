"""The declaration of a form in which a database is served."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ptmtools.lazy import Lazy

#: Suffix of a gzip copy.
GZIP = ".gz"
#: Path in the served folder, and its text or bytes.
File = tuple[str, str | bytes]


@dataclass(frozen=True)
class SiteTextures:
    """How a site has the textures of an emitter with `Emitter.texture_files`.

    Attributes
    ----------
    member: of the site's index, with the URL of the document that describes them.
    folder: of their files in the site.
    script: the file of the script that walks with them.
    entries: function from (index of the hints, function from a URL of it to the file and its
        SHA-256) to the files, the document last.
    """

    member: str
    folder: str
    script: Path
    entries: Lazy[Callable[[Mapping[str, Any], Callable[[str], tuple[Path, str]]], Iterable[Any]]]


@dataclass(frozen=True)
class Emitter:
    """A form of the cells or of their textures.

    Attributes
    ----------
    name: the name in `--format` and in the index of the hints.
    about: a short description for help.
    owns: files and folders in the served folder that belong to the form; a folder ends in a slash.
        The files must exist once the form has been written.
    entry: the file that leads to the others and that a browser opens, written last; "" for a form
        that only clients of the hints read.
    cell_files: template of the paths of the cells' geometry (`names.path_of`), if it has geometry.
    has_meshes: whether finer meshes of objects are files of their own (`names.mesh_path`).
    texture_files: template of the folders of the textures' files, if it has a texture form of its
        own (`names.texture_name`).
    site: how a site has these; None if it leaves them out.
    writer: function from a `Content` to the files, in the order of writing. The call itself,
        before the first file, raises the refusals of the form.
    reader: function from (path in the served folder, bytes) of one file to its content for
        `check`, None if the check needs nothing of it; called from several threads. Raises
        FileError. None if only the hashes of the files are checked.
    check: function that checks the references of a `ServedDatabase`'s files; None as `reader`.
    """

    name: str
    about: str
    owns: tuple[str, ...]
    writer: Lazy[Callable[[Any], Iterator[File]]]
    reader: Lazy[Callable[[str, bytes], object | None]] | None = None
    check: Lazy[Callable[[Any], None]] | None = None
    entry: str = ""
    cell_files: str = ""
    has_meshes: bool = False
    texture_files: str = ""
    site: SiteTextures | None = None

    def is_owner(self, path: str) -> bool:
        """Whether a path in the served folder, or that of a gzip copy, belongs to the form."""
        plain = path.removesuffix(GZIP)
        return any(
            path.startswith(owned) if owned.endswith("/") else plain == owned for owned in self.owns
        )
