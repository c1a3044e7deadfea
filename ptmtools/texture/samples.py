"""Kinds of samples, the components of texels, and the order-preserving map from floats to integers.

Four kinds: unsigned integers of 8 and 16 bits and the IEEE floats of 16 and 32 bits. Coders work
on integers. The bit pattern of a float, with the sign bit flipped where it is positive and all bits
flipped where it is negative, is an unsigned integer that grows with the float: -inf < … < -0 < +0 <
… < +inf, neighbouring floats are neighbouring integers, and NaNs lie beyond the infinities. Nothing
is lost by it, not the payload of a NaN either. A difference of two such integers counts units in
the last place.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class SampleKind:
    """One kind of sample.

    Attributes
    ----------
    name: of the numpy type.
    number: its number in files.
    size: bytes of a sample.
    is_float: whether it is an IEEE float.
    mantissa: stored bits of a float's mantissa; 0 for integers.
    """

    name: str
    number: int
    size: int
    is_float: bool
    mantissa: int = 0

    @property
    def top(self) -> int:
        """The largest ordered integer: all bits set."""
        return (1 << (8 * self.size)) - 1

    @property
    def top_error(self) -> int:
        """The largest error that can be allowed: any for integers, none for floats."""
        return 0 if self.is_float else self.top

    @property
    def quiet_nan(self) -> int:
        """Bit pattern of the NaN of a mean that is not a number: 0x7E00 or 0x7FC00000."""
        exponent = (1 << (8 * self.size - 1)) - (1 << self.mantissa)
        return exponent | 1 << (self.mantissa - 1)


#: All kinds, by name.
KINDS = {
    kind.name: kind
    for kind in (
        SampleKind("uint8", 0, 1, False),
        SampleKind("uint16", 1, 2, False),
        SampleKind("float16", 2, 2, True, 10),
        SampleKind("float32", 3, 4, True, 23),
    )
}
#: All kinds, by their number in a file.
KINDS_BY_NUMBER = {kind.number: kind for kind in KINDS.values()}


def kind_of(dtype: np.dtype[Any]) -> SampleKind:
    """The kind of samples of that type. Raises KeyError for others, foreign byte order included."""
    if not dtype.isnative:
        raise KeyError(str(dtype))
    return KINDS[dtype.name]


def to_ordered(samples: NDArray[Any]) -> NDArray[Any]:
    """Samples as unsigned integers of the same size and order; a view where they are integers."""
    import numpy as np

    kind = kind_of(samples.dtype)
    if not kind.is_float:
        return samples
    bits = np.ascontiguousarray(samples).view(f"u{kind.size}")
    sign = bits.dtype.type(1 << (8 * kind.size - 1))
    return np.where(bits & sign, ~bits, bits | sign)


def from_ordered(ordered: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """The inverse of `to_ordered`: samples of ``dtype`` from unsigned integers of its size."""
    import numpy as np

    kind = kind_of(dtype)
    if not kind.is_float:
        return ordered
    sign = ordered.dtype.type(1 << (8 * kind.size - 1))
    return np.where(ordered & sign, ordered ^ sign, ~ordered).view(dtype)


def round_to(values: NDArray[np.float64], dtype: np.dtype[Any]) -> NDArray[Any]:
    """float64 rounded once to a type of float, half to even; every NaN becomes the quiet one."""
    import numpy as np

    kind = kind_of(dtype)
    with np.errstate(all="ignore"):
        rounded = values.astype(dtype)
    rounded.view(f"u{kind.size}")[np.isnan(values)] = kind.quiet_nan
    return rounded


def in_eight_bits(samples: NDArray[Any]) -> NDArray[np.uint8]:
    """Samples of any kind as screens show them: integers by their eight highest bits, floats from 0
    to 1."""
    import numpy as np

    if samples.dtype == np.uint8:
        return samples
    if samples.dtype == np.uint16:
        return (samples >> 8).astype(np.uint8)
    return round_to_eight_bits(samples)


def round_to_eight_bits(samples: NDArray[Any]) -> NDArray[np.uint8]:
    """Samples of any kind as the nearest of 256 values: integers by their range, floats from 0 to
    1."""
    import numpy as np

    if samples.dtype.kind == "u":
        largest = np.iinfo(samples.dtype).max
        return ((samples.astype(np.uint32) * 255 + largest // 2) // largest).astype(np.uint8)
    finite = np.nan_to_num(samples.astype(np.float32))
    return np.rint(np.clip(finite, 0, 1) * 255).astype(np.uint8)


def spread_colors(texels: NDArray[Any]) -> NDArray[Any]:
    """(h, w, c) texels, those of alpha 0 in the colours of the visible ones around; the same array
    if alpha hides none, or all, or if they are floats.

    Levels are means of texels, and filters mix neighbours by their distance alone: hidden white or
    black would show at the edges of a cut-out, and from afar all over it (docs/design/codec.md).
    """
    import numpy as np

    from ptmtools.arrays import fill_gaps

    alpha = texels[..., -1]
    if texels.shape[2] not in (2, 4) or texels.dtype.kind != "u" or alpha.all() or not alpha.any():
        return texels
    return np.concatenate([fill_gaps(texels[..., :-1], alpha), alpha[..., None]], axis=2)
