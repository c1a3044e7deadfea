"""Options of `ptm serve`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ptmtools.options import option
from ptmtools.quantities import parse_bandwidth, parse_duration
from ptmtools.server.throttle import Throttle


@dataclass(frozen=True)
class ServeOptions:
    """Options of `ptm serve`.

    Raises InputError: PTM-I711 an impossible link; PTM-I712 an unreadable quantity.
    """

    heading: ClassVar[str] = "Server"

    port: int = option(0, "Port to listen on; 0 for any free one.")
    host: str = option(
        "127.0.0.1",
        "Address to listen on; 0.0.0.0 for all addresses of this machine.",
        metavar="ADDRESS",
    )
    bandwidth: str = option(
        "inf",
        "Bandwidth of all connections together, in bit/s: 56k, 4M (powers of ten) or inf.",
        metavar="RATE",
    )
    latency: str = option(
        "0", "Delay before the first byte of each response: 100ms or 0.1.", metavar="TIME"
    )

    def __post_init__(self) -> None:
        self.throttle  # noqa: B018 - raises for what cannot be read

    @property
    def throttle(self) -> Throttle:
        """The link."""
        return Throttle(parse_bandwidth(self.bandwidth), parse_duration(self.latency))
