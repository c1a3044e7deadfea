"""What may be chosen of `ptm serve`."""

from __future__ import annotations

from dataclasses import dataclass

from ptmtools.quantities import parse_bandwidth, parse_duration
from ptmtools.server.throttle import Throttle


@dataclass(frozen=True)
class ServeOptions:
    """
    Attributes
    ----------
    port: the port to listen on; 0 picks a free one.
    host: the address to listen on; 0.0.0.0 is all that this machine has, for other machines too.
    bandwidth: limit the bandwidth, bit/s over all connections together, such as 56k, 4M (powers of
        ten) or inf.
    latency: delay before the first byte of each response, such as 100ms or 0.1.

    Raises InputError: PTM-I711 a link that cannot be; PTM-I712 a word that is no such quantity.
    """

    port: int = 0
    host: str = "127.0.0.1"
    bandwidth: str = "inf"
    latency: str = "0"

    def __post_init__(self) -> None:
        self.throttle  # noqa: B018 - raises for what cannot be read

    @property
    def throttle(self) -> Throttle:
        """The link."""
        return Throttle(parse_bandwidth(self.bandwidth), parse_duration(self.latency))
