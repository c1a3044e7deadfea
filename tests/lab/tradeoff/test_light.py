"""The experiment of baked light, and its option on a walk."""

from __future__ import annotations

from pathlib import Path

import pytest

from ptmtools.light.options import LightOptions
from ptmtools.pipeline.artifacts import Artifacts
from ptmtools.pipeline.command import open_database
from ptmtools.pipeline.stages import LIGHT
from ptmtools_lab.tradeoff.experiment import Subject
from ptmtools_lab.tradeoff.knobs import own_options, settings
from ptmtools_lab.tradeoff.light import prepare_lightmaps

pytest.importorskip("xatlas", reason="pip install 'ptmtools[light]'")


def test_more_texels_and_rays_are_nearer_to_the_light(two_rooms: Path) -> None:
    artifacts = Artifacts(open_database(two_rooms))
    experiment = prepare_lightmaps(Subject(artifacts, 1, 1), limit=256)
    tried = {setting.name: setting for setting in experiment.settings}
    names = "samples 4", "samples 64", "density 2.5", "density 10"
    few, many, coarse, fine = (experiment.measure(tried[f"--light-{name}"]) for name in names)
    assert 0 < experiment.reference_error < many.error < few.error - 0.005
    assert few.more["texels"] == many.more["texels"]
    assert coarse.error > 2 * fine.error
    assert fine.error < 0.07
    assert fine.worst < 0.25
    assert (coarse.work, coarse.more["texels"]) < (fine.work, fine.more["texels"])


def test_rays_are_an_option_of_a_database_with_light(two_rooms: Path) -> None:
    own = {k: v for k, v in own_options(Artifacts(open_database(two_rooms))).items() if k != LIGHT}
    assert list(settings(own, 64, ("light-samples",))) == []
    lit = {**own, LIGHT: LightOptions()}
    assert [s.value for s in settings(lit, 64, ("light-samples",))] == [16, 256]
