"""Kinds of folders that are no databases, such as an octree texture, each recognised by its index.

A kind is an entry point of the group ``ptmtools.pages``: `ptm info`, `validate`, `serve`, `publish`
and `render` look a folder up here, and nothing else branches on a kind.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ptmtools import plugins
from ptmtools.errors import DatabaseError
from ptmtools.lazy import Lazy

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ptmtools.diagnostics import ValidationReport
    from ptmtools.texture.model import Limits


@dataclass(frozen=True)
class FolderPicture:
    """A picture of a folder, (height, width, 3) uint8, what ``ptm render --json`` says of it, and
    its line of text."""

    texels: NDArray[np.uint8]
    document: Mapping[str, Any]
    text: str


@dataclass(frozen=True)
class FolderDrawing:
    """How ``ptm render`` draws a folder: the class of its options, and a function of the folder
    and the options."""

    options: Lazy[type]
    draw: Lazy[Callable[[Path, Any], FolderPicture]]


@dataclass(frozen=True)
class FolderKind:
    """A kind of folder.

    Attributes
    ----------
    index: the file in it that describes the others.
    about: a noun for messages.
    again: the command that writes it.
    check: checks a folder.
    describe: the lines of ``ptm info`` for a folder, and its record as JSON. Raises the errors of
        reading the index.
    schema: of the index. script: the file of the script of the page that shows it.
    files: of an index: the other files that the page fetches.
    records: whether the page shows HTML of others in frames.
    drawing: how ``ptm render`` draws it; None if it does not.
    """

    index: str
    about: str
    again: str
    check: Lazy[Callable[[Path, Limits], ValidationReport]]
    describe: Lazy[Callable[[Path], tuple[tuple[str, ...], Mapping[str, Any]]]]
    schema: str
    script: Path
    files: Lazy[Callable[[Mapping[str, Any]], Iterable[str]]]
    records: bool = False
    drawing: FolderDrawing | None = None

    @property
    def noun(self) -> str:
        """`about` with its article."""
        return f"{'an' if self.about[0] in 'aeiou' else 'a'} {self.about}"


def folder_kinds() -> dict[str, FolderKind]:
    """All kinds, by the name of the index; raises as `plugins.declarations`."""
    return {kind.index: kind for kind in plugins.declarations("pages", FolderKind).values()}


def folder_kind(folder: Path) -> FolderKind | None:
    """The kind of a folder, or None."""
    return next((kind for kind in folder_kinds().values() if (folder / kind.index).is_file()), None)


def check_folder(folder: Path, kind: FolderKind, limits: Limits) -> None:
    """Raises DatabaseError PTM-D006 if a folder of this kind has an error."""
    if errors := kind.check.load()(folder, limits).errors:
        first = errors[0]
        raise DatabaseError(
            "PTM-D006",
            f"damaged: {first.message}",
            file=folder / first.file,
            remedy=f"write the folder again with `{kind.again}`",
        )
