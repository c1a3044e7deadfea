"""`ptm encode` on several machines: parts of the images, or the workers of a cluster."""

from __future__ import annotations

import json
import operator
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from ptmtools.cli import encoding
from ptmtools.cli.batch import FileJob, Shard
from ptmtools.texture.images.png import png_bytes
from tests.conftest import files_below
from tests.e2e.conftest import Ptm, ptm
from tests.parallel.conftest import scheduler

__all__ = ["ptm", "scheduler"]


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    """Twelve images of three folders, of which each four have one name."""
    random = np.random.default_rng(3)
    for number in range(12):
        file = tmp_path / "scans" / f"{number // 4}" / f"scan{number % 4}.png"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(png_bytes(random.integers(0, 256, (9, 7, 3), np.uint8)))
    return tmp_path / "scans"


@given(st.sets(st.text("abc/", min_size=1, max_size=8), max_size=40), st.integers(1, 9))
def test_every_job_is_in_one_part(names: set[str], count: int) -> None:
    jobs = [FileJob(f"/data/{name}") for name in sorted(names)] + [FileJob("")]
    parts = [Shard(number + 1, count).jobs(jobs) for number in range(count)]
    assert Counter(job.source for part in parts for job in part) == Counter(j.source for j in jobs)


def test_parts_are_of_similar_size() -> None:
    jobs = [FileJob(f"/data/{n // 100}/albedo{n % 100}.png") for n in range(8000)]
    sizes = [len(Shard(number, 16).jobs(jobs)) for number in range(1, 17)]
    # Five standard deviations of a binomial distribution are 108.
    assert all(abs(size - 500) < 108 for size in sizes)


def test_the_part_of_an_image_depends_on_no_machine_and_no_other_image() -> None:
    names = [f"{n}/a.png" for n in range(30)]
    here = Shard(2, 5).jobs([FileJob(f"/mnt/here/{name}") for name in names])
    there = Shard(2, 5).jobs(
        [FileJob(f"/elsewhere/{name}") for name in [*reversed(names), "new.png"]]
    )
    one = {job.source.removeprefix("/mnt/here/") for job in here}
    other = {job.source.removeprefix("/elsewhere/") for job in there}
    assert one == other - {"new.png"}
    assert 0 < len(one) < len(names)


def test_all_parts_together_are_the_whole(ptm: Ptm, scans: Path, tmp_path: Path) -> None:
    shutil.copytree(scans, tmp_path / "whole")
    assert ptm("-q", "encode", f"{tmp_path}/whole/**/*.png", "--profile", "raw").status == 0
    written: list[str] = []
    for number in (1, 2, 3):
        done = ptm(
            "encode", f"{scans}/**/*.png", "--profile", "raw", "--shard", f"{number}/3", "--json"
        )
        assert done.status == 0
        written += [report["file"] for report in json.loads(done.out)]
    assert len(written) == len(set(written)) == 12
    assert files_below(scans) == files_below(tmp_path / "whole")
    done = ptm("encode", f"{scans}/0", "--shard", "1/1", "--skip-existing")
    assert done.out.startswith("shard 1/1: 4 of 4 images\n")


@pytest.mark.parametrize("shard", ["0/3", "4/3", "1", "1/0", "a/b", "-1/3", "1/3/5"])
def test_wrong_parts(ptm: Ptm, scans: Path, shard: str) -> None:
    done = ptm("encode", f"{scans}/0", "--shard", shard)
    assert (done.status, "3/16" in done.err) == (2, True)


def test_streams_have_no_parts(ptm: Ptm) -> None:
    assert ptm("encode", "-", "--shard", "1/2").status == 2
    assert ptm("encode", "-", "--scheduler", "tcp://127.0.0.1:1").status == 2


def test_a_cluster_writes_the_same_files(
    ptm: Ptm, scans: Path, tmp_path: Path, scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (scans / "0" / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\nbroken")
    monkeypatch.chdir(tmp_path)
    reports = {}
    for name, more in (("here", ()), ("away", ("--scheduler", scheduler))):
        words = ("encode", "scans/0", "-o", f"{name}/", "--preview", "80", "--json")
        done = ptm(*words, *more)
        assert done.status == 3
        assert "broken.png" in done.err
        reports[name] = json.loads(done.out.replace(f"{name}/", ""))
    assert reports["here"] == reports["away"]
    assert len(reports["away"]) == 4
    assert files_below(tmp_path / "here") == files_below(tmp_path / "away")
    done = ptm("encode", "scans/0/scan0.png", "-o", "away/scan0.ptm", "--scheduler", scheduler)
    assert (done.status, "PTM-O001" in done.err) == (4, True)


def test_workers_that_do_not_see_the_folder(
    ptm: Ptm, scans: Path, scheduler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(encoding, "_sees", operator.eq)  # path and number differ
    before = files_below(scans)
    done = ptm("encode", f"{scans}/0", "--scheduler", scheduler)
    assert (done.status, "PTM-W005" in done.err, "--shard" in done.err) == (9, True, True)
    assert files_below(scans) == before
