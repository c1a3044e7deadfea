"""The renderers that can draw the item buffers, as a table of declared values.

To add one: a module with two functions, as `Backend` says, and a line in `BACKENDS`. Help, checks
of options, "auto" and the sharing out to processes go by what the line says; nothing else knows a
backend by its name.
"""

from __future__ import annotations

from collections import ChainMap
from dataclasses import dataclass
from pkgutil import resolve_name
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ptmtools.coverage.item_buffer import Renderer, Surfaces

#: The choice of a backend by what it is expected to cost.
AUTO = "auto"


@dataclass(frozen=True)
class Backend:
    """One way to draw item buffers. Functions are named "module:function", and loaded when needed.

    Attributes
    ----------
    name: what ``--backend`` calls it, and results record.
    about: what it draws with, for help.
    opener: (`Surfaces`, pixels a side of a view, number of a graphics device or None) → `Renderer`;
        raises `MissingComponentError` where it cannot run.
    coster: (triangles of a PVS, pixels of all views, number of a graphics device or None) → the
        processor time in µs that a sample point is expected to take, 0 on graphics hardware; raises
        as the opener. Goes by the machine and the arguments, never by the clock.
    in_processes: it keeps the interpreter's lock while it draws, so that several workers mean
        processes; otherwise one process draws all cells.
    """

    name: str
    about: str
    opener: str
    coster: str
    in_processes: bool = False

    def open(self, surfaces: Surfaces, face: int, gpu: int | None = None) -> Renderer:
        """A renderer, to be closed after use; see ``opener``."""
        renderer: Renderer = resolve_name(self.opener)(surfaces, face, gpu)
        return renderer

    def cost(self, triangles: float, pixels: int, gpu: int | None = None) -> float:
        """See ``coster``."""
        return float(resolve_name(self.coster)(triangles, pixels, gpu))


#: By name; of equally cheap ones "auto" takes the first.
BACKENDS: dict[str, Backend] = {
    backend.name: backend
    for backend in (
        Backend(
            "gl",
            "OpenGL, on graphics hardware or in software",
            "ptmtools.coverage.backends.opengl:OpenGLRenderer",
            "ptmtools.coverage.backends.opengl:cost",
        ),
        Backend(
            "embree",
            "rays on the processor",
            "ptmtools.coverage.backends.embree:EmbreeRenderer",
            "ptmtools.coverage.backends.embree:cost",
            in_processes=True,
        ),
    )
}

_AUTO = SimpleNamespace(about="the one of them that can run here and is expected to be fastest")
#: What ``--backend`` takes, each with what it is `about`.
CHOICES: ChainMap[str, Any] = ChainMap(BACKENDS, {AUTO: _AUTO})
