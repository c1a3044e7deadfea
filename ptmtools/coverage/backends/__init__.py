"""The renderers that can draw the item buffers, as a table of declared values.

To add one: a module with the two functions of `Backend`, and a line in `BACKENDS`. Help, checks of
    options, "auto" and the distribution to processes read that line; no other code names a backend.
"""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from ptmtools.lazy import Lazy

if TYPE_CHECKING:
    from ptmtools.coverage.item_buffer import ItemRenderer, ItemSurfaces

#: The choice of a backend by its expected cost.
AUTO = "auto"


@dataclass(frozen=True)
class Backend:
    """A renderer of item buffers.

    Attributes
    ----------
    name: its name in ``--backend`` and in results.
    about: the library that it draws with, for help.
    opener: (`ItemSurfaces`, pixels a side of a view, number of a graphics device or None) →
        `ItemRenderer`; raises `MissingComponentError` where it cannot run.
    coster: (triangles of a PVS, pixels of all views, number of a graphics device or None) → the
        processor time in µs that a sample point is expected to take, 0 on graphics hardware; raises
        as the opener. Depends on the machine and the arguments, never on the clock.
    in_processes: it keeps the interpreter's lock while it draws, so that several workers mean
        processes; otherwise one process draws all cells.
    """

    name: str
    about: str
    opener: Lazy[Callable[[ItemSurfaces, int, int | None], ItemRenderer]]
    coster: Lazy[Callable[[float, int, int | None], float]]
    in_processes: bool = False

    def open(self, surfaces: ItemSurfaces, face: int, gpu: int | None = None) -> ItemRenderer:
        """A renderer, to be closed after use; see ``opener``."""
        return self.opener.load()(surfaces, face, gpu)

    def cost(self, triangles: float, pixels: int, gpu: int | None = None) -> float:
        """See ``coster``."""
        return self.coster.load()(triangles, pixels, gpu)


#: By name; of equally cheap ones "auto" takes the first.
BACKENDS: dict[str, Backend] = {
    backend.name: backend
    for backend in (
        Backend(
            "gl",
            "OpenGL, on graphics hardware or in software",
            Lazy("ptmtools.coverage.backends.opengl:OpenGLRenderer"),
            Lazy("ptmtools.coverage.backends.opengl:cost"),
        ),
        Backend(
            "embree",
            "rays on the processor",
            Lazy("ptmtools.coverage.backends.embree:EmbreeRenderer"),
            Lazy("ptmtools.coverage.backends.embree:cost"),
            in_processes=True,
        ),
    )
}

_AUTO = SimpleNamespace(about="the faster of the available renderers")
#: The values of ``--backend``, each with its `about`.
CHOICES: ChainMap[str, Any] = ChainMap(BACKENDS, {AUTO: _AUTO})
