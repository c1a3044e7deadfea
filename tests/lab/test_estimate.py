"""A client's estimate of its link agrees with the link."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from ptmtools.link import Conditions, Step, Trace
from ptmtools_lab.client import Estimate
from ptmtools_lab.network import FluidLink
from tests.lab.links import PROTOCOL

SIZES = st.lists(st.integers(1000, 100_000), min_size=1, max_size=20)


def download(link: FluidLink, estimate: Estimate, sizes: list[int], pause: float = 0.0) -> None:
    """Everything at once, and a pause behind."""
    for size in sizes:
        link.request(size, 1.0)
    for _ in sizes:
        estimate.observe(link.advance(link.now + 1e5))
    link.advance(link.now + pause)
    estimate.observe()


def test_the_prior_holds_until_something_is_known() -> None:
    link = FluidLink(Conditions(4e6))
    estimate = Estimate(link, 1e6, 0.3)
    assert (estimate.bandwidth, estimate.latency) == (1e6, 0.3)
    assert estimate.duration(125_000) == pytest.approx(1.3)
    download(link, estimate, [1000])
    assert estimate.bandwidth == 1e6
    assert estimate.latency == pytest.approx(0.1)


@given(PROTOCOL, st.floats(2e4, 1e8), st.floats(0, 1), SIZES, st.floats(0, 100))
def test_a_link_that_does_not_change(
    protocol: str, bandwidth: float, latency: float, sizes: list[int], pause: float
) -> None:
    link = FluidLink(Conditions(bandwidth, latency, 300, protocol))
    estimate = Estimate(link, 1e6, 0.3)
    for _ in range(2):
        download(link, estimate, [20_000, *sizes], pause)
        assert estimate.bandwidth == pytest.approx(bandwidth)
        assert estimate.latency == pytest.approx(latency, abs=1e-9)
    alone = latency + 8 * 5000 / bandwidth
    assert estimate.duration(5000) == pytest.approx(alone)


def test_what_was_is_forgotten_by_halves() -> None:
    """Four seconds after a change, 15/16 of it is believed."""
    link = FluidLink(Conditions(None, 0.0, 0, trace=Trace((Step(100.0, 1e6), Step(100.0, 2e6)))))
    estimate = Estimate(link, 1e6, 0.1)
    link.request(10**9, 1.0)
    for second in (*range(1, 101), 101, 102, 103, 104):
        link.advance(float(second))
        estimate.observe()
    assert estimate.bandwidth == pytest.approx(2e6 - 1e6 / 16, rel=1e-3)


def test_the_latency_forgets_too() -> None:
    trace = Trace((Step(10.0), Step(1000.0, latency=0.4)))
    link = FluidLink(Conditions(1e6, 0.1, trace=trace))
    estimate = Estimate(link, 1e6, 0.01)
    download(link, estimate, [1000] * 6, pause=20.0)
    assert estimate.latency == pytest.approx(0.1)
    for _ in range(8):
        download(link, estimate, [1000])
    assert estimate.latency == pytest.approx(0.5)


def test_a_link_without_a_limit_and_one_that_is_down() -> None:
    link = FluidLink(Conditions())
    estimate = Estimate(link, 1e6, 0.3)
    download(link, estimate, [10**6])
    assert (estimate.bandwidth, estimate.duration(10**9)) == (math.inf, estimate.latency)
    link = FluidLink(Conditions(trace=Trace((Step(100.0, 0.0), Step(1.0)))))
    estimate = Estimate(link, 1e6, 0.3)
    link.request(1, 1.0)
    link.advance(50.0)
    estimate.observe()
    assert (estimate.bandwidth, estimate.duration(1)) == (0, math.inf)
