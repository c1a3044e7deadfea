"""The forms in which clients take textures, as a table: what can be fetched, and what it shows.

Of a texture in a form the columns come one after the other (`Catalogue`); what is on the screen
with each of them is compared with the same picture, that of the `.ptm`s with all of their levels.
To add a form: a module with two functions, and a line here; a policy says which one it takes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ptmtools.lazy import Lazy
from ptmtools.progress import Progress
from ptmtools.walkthrough.memory import Columns
from ptmtools.walkthrough.served import Served
from ptmtools.walkthrough.view.records import Pyramids, Shows


@dataclass(frozen=True)
class Form:
    """A form.

    Attributes
    ----------
    name, about: what it is called, and what it is.
    columns: what can be fetched of the textures of a served folder, with RGB of three bytes in
        texture memory if the second argument says so. Raises DatabaseError.
    shows: what the columns show, given the `.ptm`s; None: the levels of those. Raises
        DatabaseError, LimitError.
    needs: the one of the index's texture sets or lists that it reads, and how to get it.
    octrees: whether octree textures are fetched, too, which only lit pictures show.
    """

    name: str
    about: str
    columns: Lazy[Callable[[Served, bool], Columns]]
    shows: Lazy[Callable[[Served, Pyramids, Progress], Shows]] | None = None
    needs: tuple[str, str] | None = None
    octrees: bool = False


_LIST = (
    Form("ptm", "levels of `.ptm`s", Lazy("ptmtools.walkthrough.forms.levels:columns")),
    Form(
        "interlaced",
        "interlaced images",
        Lazy("ptmtools.walkthrough.forms.interlaced:columns"),
        Lazy("ptmtools.walkthrough.forms.interlaced:shows"),
        ("interlace", "write them with `ptm emit DB --format vrml,gltf,interlace`"),
    ),
    Form(
        "octree",
        "levels of `.ptm`s and of octree textures",
        Lazy("ptmtools.walkthrough.forms.levels:columns"),
        needs=("octrees", "build it with `ptm build-scene --apo`"),
        octrees=True,
    ),
)
#: By name, and the one that others are compared with.
FORMS = {form.name: form for form in _LIST}
PTM = "ptm"

__all__ = ["FORMS", "PTM", "Form"]
