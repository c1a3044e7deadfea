"""What a walk through a campus depends on, beside the campus and the walk."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from ptmtools.errors import InputError
from ptmtools.lab.network import Conditions
from ptmtools.link import Trace
from ptmtools.neighbours.campus.model import PRESETS, Quality
from ptmtools.quantities import MemorySize, parse_bandwidth, parse_duration, parse_memory

#: High detail for so many of the nearest objects (the paper's IV).
NEAREST = 8
#: Objects that are loaded at a time; the paper does not say (notes).
THREADS = 4
#: Metres of the viewpoint after which objects are sorted again; the paper does not say (notes).
MOVE = 2.0


@dataclass(frozen=True)
class Choice:
    """A preset, and what is said of it where it is chosen."""

    quality: Quality

    @property
    def about(self) -> str:
        """Sides of textures and lightmaps."""
        cached = ", all of it in the browser's cache" if self.quality.cached else ""
        return f"{self.quality.diffuse} and {self.quality.light}{cached}"


#: Presets by how an option names them.
QUALITIES = {quality.name.lower().replace(" ", "-"): Choice(quality) for quality in PRESETS}


@dataclass(frozen=True)
class CampusWalkOptions:
    """How somebody walks through a campus.

    Attributes
    ----------
    preset: sides of textures and of lightmaps, texels, with commas in between
    bandwidth: of the link, bit/s, such as 512k, 4M (powers of ten) or inf.
    latency: from a request to the first byte of its response, such as 100ms or 0.1.
    overhead: bytes of headers a request.
    protocol: h1, connections that share the link, or h2, one with priorities.
    memory: for meshes, textures and lightmaps, such as 64MiB, or inf.
    nearest: so many objects are shown in high detail.
    threads: so many objects are loaded at a time.
    move: objects are sorted again when the viewpoint has moved so far, metres.
    lightmaps: load them, if the campus has some.
    stored: count meshes and index as they lie, and not as a server sends them, by gzip.

    Raises InputError: PTM-I711 a link that cannot be; PTM-I712 a word that is no such quantity;
    PTM-I713 another option that is out of range.
    """

    preset: str = field(
        default="low,medium,high,ultra,ultra-cached",
        metadata={"choices": QUALITIES, "several": True},
    )
    bandwidth: str = "4M"
    latency: str = "100ms"
    overhead: int = 300
    protocol: Literal["h1", "h2"] = "h1"
    memory: str = "inf"
    nearest: int = NEAREST
    threads: int = THREADS
    move: float = MOVE
    lightmaps: bool = True
    stored: bool = False

    def __post_init__(self) -> None:
        self.link()
        unknown = [name for name in self._presets() if name not in QUALITIES]
        for name, sound, wanted in (
            ("preset", not unknown, ", ".join(QUALITIES)),
            ("memory", self._memory().share is None, "bytes, such as 64MiB, or inf"),
            ("nearest", self.nearest >= 0, "0 or more"),
            ("threads", self.threads >= 1, "1 or more"),
            ("move", self.move >= 0, "0 or more"),
        ):
            if not sound:
                raise InputError(
                    "PTM-I713",
                    f"{name} of {getattr(self, name)} is out of range",
                    remedy=f"give --{name} {wanted}",
                )

    @property
    def qualities(self) -> list[Quality]:
        """In the order given, each once."""
        return [QUALITIES[name].quality for name in self._presets()]

    @property
    def budget(self) -> int | None:
        """Bytes of graphics memory, None without a limit."""
        return self._memory().bytes

    def link(self, trace: Trace | None = None) -> Conditions:
        """The link, which changes over time as a trace says."""
        return Conditions(
            parse_bandwidth(self.bandwidth),
            parse_duration(self.latency),
            self.overhead,
            self.protocol,
            trace=trace,
        )

    def _presets(self) -> list[str]:
        return list(dict.fromkeys(part.strip() for part in self.preset.split(",")))

    def _memory(self) -> MemorySize:
        return parse_memory(self.memory)
