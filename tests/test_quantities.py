"""Numbers as people read and write them."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from ptmtools.errors import InputError
from ptmtools.quantities import count, parse_bandwidth, parse_duration, parse_memory, size

NO_NUMBERS = ["", "k", "-1", "-4M", "1e3", "nan", "٤", "1,5", "1.5.5", "0x10", "4 4", "9" * 400]


@pytest.mark.parametrize(
    ("text", "bits"),
    [("56k", 56_000), ("512k", 512_000), ("4M", 4_000_000), ("1.5 G", 1_500_000_000)]
    + [("9600", 9600), (" 0.1k ", 100), ("inf", None)],
)
def test_bandwidths(text: str, bits: int | None) -> None:
    assert parse_bandwidth(text) == bits


@pytest.mark.parametrize("text", [*NO_NUMBERS, "4m", "4K", "4MB", "4MiB", "0", "0.5", "10%"])
def test_what_is_no_bandwidth(text: str) -> None:
    with pytest.raises(InputError, match=r"is no bandwidth; use bit/s.*\[PTM-I111\]"):
        parse_bandwidth(text)


@pytest.mark.parametrize(
    ("text", "seconds"), [("100ms", 0.1), ("0.1s", 0.1), ("0.1", 0.1), ("0", 0.0), ("2 s", 2.0)]
)
def test_durations(text: str, seconds: float) -> None:
    assert parse_duration(text) == seconds


@pytest.mark.parametrize("text", [*NO_NUMBERS, "1min", "1S", "10%", "inf"])
def test_what_is_no_duration(text: str) -> None:
    with pytest.raises(InputError, match=r"is no duration; use seconds.*\[PTM-I111\]"):
        parse_duration(text)


@pytest.mark.parametrize(
    ("text", "of_1000"),
    [("4MiB", 4 << 20), ("4MB", 4_000_000), ("1.5KiB", 1536), ("2GB", 2 * 10**9), ("64B", 64)]
    + [("4096", 4096), ("1.9", 1), ("10%", 100), ("29%", 290), ("12.34%", 123), ("inf", None)],
)
def test_memory(text: str, of_1000: int | None) -> None:
    assert parse_memory(f" {text}").limit_of(1000) == of_1000
    assert str(parse_memory(text)) == text


@pytest.mark.parametrize("text", [*NO_NUMBERS, "4M", "4mb", "4KB", "0", "0.5", "0%", "0MB", "%"])
def test_what_is_no_memory(text: str) -> None:
    with pytest.raises(InputError, match=r"is no amount of memory; use bytes.*\[PTM-I111\]"):
        parse_memory(text)


@given(st.integers(1, 10**12), st.integers(0, 10**14))
def test_hundredths_of_a_percent_are_exact(hundredths: int, whole: int) -> None:
    text = f"{hundredths // 100}.{hundredths % 100:02}%"
    assert parse_memory(text).limit_of(whole) == hundredths * whole // 10_000


def test_what_people_read() -> None:
    assert [size(n) for n in (999, 1000, 97_450_000, 4 * 10**9)] == [
        "999 B",
        "1.0 kB",
        "97.5 MB",
        "4.0 GB",
    ]
    assert (count(1, "portal"), count(2048, "body", "bodies")) == ("1 portal", "2,048 bodies")
