"""Options of a walk through a campus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from ptmtools.link import Conditions, Trace
from ptmtools.options import option, require
from ptmtools.quantities import MemorySize, parse_bandwidth, parse_duration, parse_memory
from ptmtools.site.client import CAMPUS_MOVE, CAMPUS_NEAREST, CAMPUS_THREADS
from ptmtools_systems.campus.model import PRESETS, Quality


@dataclass(frozen=True)
class Choice:
    """A preset and its description in ``--help``."""

    quality: Quality

    @property
    def about(self) -> str:
        """Sides of textures and lightmaps."""
        cached = ", all files in the browser's cache" if self.quality.cached else ""
        return f"{self.quality.diffuse} and {self.quality.light}{cached}"


#: Presets by their name in options.
QUALITIES = {quality.name.lower().replace(" ", "-"): Choice(quality) for quality in PRESETS}


@dataclass(frozen=True)
class CampusWalkOptions:
    """Options of a walk through a campus.

    Raises InputError PTM-I111: an impossible link, an unreadable quantity or another value out of
    range.
    """

    heading: ClassVar[str] = "Client and link"

    preset: str = option(
        "low,medium,high,ultra,ultra-cached",
        "Width and height of textures and of lightmaps, in texels",
        choices=QUALITIES,
        several=True,
    )
    bandwidth: str = option(
        "4M",
        "Bandwidth of the link in bit/s: 56k, 4M (k = 1,000, M = 1,000,000) or inf.",
        metavar="RATE",
    )
    latency: str = option(
        "100ms",
        "Time from a request to the first byte of its response: 100ms or 0.1.",
        metavar="TIME",
    )
    overhead: int = option(300, "Size of the headers of a request.", metavar="BYTES")
    protocol: Literal["h1", "h2"] = option(
        "h1", "Connections that share the link (h1), or one connection with priorities (h2)."
    )
    memory: str = option(
        "inf", "Memory for meshes, textures and lightmaps: 64MiB or inf.", metavar="SIZE"
    )
    nearest: int = option(CAMPUS_NEAREST, "Number of nearest objects shown in high detail.")
    threads: int = option(CAMPUS_THREADS, "Number of objects loaded at a time.")
    move: float = option(
        CAMPUS_MOVE, "Distance after which the client sorts the objects again.", metavar="METRES"
    )
    lightmaps: bool = option(True, "Load the lightmaps of the campus.")
    stored: bool = option(False, "Count meshes and index as stored, not as compressed by a server.")

    def __post_init__(self) -> None:
        self.link()
        unknown = [name for name in self._presets() if name not in QUALITIES]
        for name, valid, wanted in (
            ("preset", not unknown, ", ".join(QUALITIES)),
            ("memory", self._memory().share is None, "bytes, such as 64MiB, or inf"),
            ("nearest", self.nearest >= 0, "0 or more"),
            ("threads", self.threads >= 1, "1 or more"),
            ("move", self.move >= 0, "0 or more"),
        ):
            text = f"{name} of {getattr(self, name)} is out of range"
            require((valid, text, f"use --{name} {wanted}"))

    @property
    def qualities(self) -> list[Quality]:
        """Presets in the order given, each once."""
        return [QUALITIES[name].quality for name in self._presets()]

    @property
    def budget(self) -> int | None:
        """Bytes of graphics memory, None without a limit."""
        return self._memory().bytes

    def link(self, trace: Trace | None = None) -> Conditions:
        """The link; with a trace it changes over time."""
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
