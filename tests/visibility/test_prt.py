"""A real Quake map, leaf by leaf against the answer of a mature tool."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from ptmtools.parallel import Local
from ptmtools.portal_flow import double_double as near_ties
from ptmtools.portal_flow.flow import leaf_matrix, portal_flow
from ptmtools.visibility import PvsOptions

BENCHMARK = Path(__file__).resolve().parents[2] / "benchmarks" / "prt.py"


@pytest.fixture(scope="module")
def prt():
    spec = importlib.util.spec_from_file_location("prt_benchmark", BENCHMARK)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module", autouse=True)
def _every_near_tie_is_decided():
    """As many as there are: otherwise the search from one portal counts as cut short."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(near_ties, "DECIDED", 10_000)
        yield


@pytest.fixture(scope="module")
def dm1(prt, shared):
    portals, cluster = prt.read_prt(shared / "prt" / "dm1.prt")
    flow = portal_flow(portals, PvsOptions().budget)
    with np.load(shared / "prt" / "dm1.visible.npz") as stored:
        theirs = np.unpackbits(stored["visible"], axis=1, count=stored["shape"][1]).astype(bool)
    return portals, cluster, flow, theirs & theirs.T


def test_dm1_is_at_least_as_tight_as_the_reference(prt, dm1):
    portals, cluster, flow, theirs = dm1
    ours = prt.visible_leafs(portals, flow, cluster)
    assert not flow.cut.any()
    assert np.array_equal(ours, ours.T)
    assert 83 < ours.sum() / len(ours) <= theirs.sum() / len(theirs)
    assert (ours != theirs).mean() < 5e-4


def test_dm1_hides_nothing_that_a_line_reaches(prt, dm1):
    portals, cluster, flow, theirs = dm1
    ours = leaf_matrix(portals, flow)
    lost = np.argwhere(theirs & ~prt.visible_leafs(portals, flow, cluster))
    assert prt.arriving(portals, cluster[lost], 500).sum() == 0
    rng = np.random.default_rng(0)
    hidden, shown = np.argwhere(~ours), np.argwhere(ours & ~np.eye(len(ours), dtype=bool))
    assert prt.arriving(portals, rng.choice(hidden, 300), 50).sum() == 0
    assert (prt.arriving(portals, rng.choice(shown, 300), 50) > 0).mean() > 0.5


def test_dm1_is_the_same_for_any_number_of_workers(dm1):
    portals, _, flow, _ = dm1
    for budget, expected in ((PvsOptions().budget, flow), (500, None)):
        with Local(3) as local:
            three = portal_flow(portals, budget, executor=local)
        one = portal_flow(portals, budget)
        for other in (three, expected or one):
            assert np.array_equal(one.sees, other.sees)
            assert np.array_equal(one.cut, other.cut)
            assert one.operations == other.operations


def test_the_benchmark_writes_and_compares(prt, shared, tmp_path, capsys):
    out = tmp_path / "dm1.npz"
    reference = shared / "prt" / "dm1.visible.npz"
    arguments = [str(shared / "prt" / "dm1.prt"), "-o", str(out), "--reference", str(reference)]
    assert prt.main([*arguments, "--lines", "100"]) == 0
    assert "0 pairs really see each other" in capsys.readouterr().out
    with np.load(out) as ours, np.load(reference) as theirs:
        assert np.array_equal(ours["shape"], theirs["shape"])
        assert ours["visible"].shape == theirs["visible"].shape
