"""An executor of each kind; those that start processes are shared by the tests of a module."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from ptmtools.executor import Executor
from ptmtools.parallel import Local, open_executor

# Where worker processes find `parallel_tasks`: they are given this path.
sys.path.append(str(Path(__file__).parent / "tasks"))

KINDS = ("serial", "local", "cluster")


@pytest.fixture(scope="module")
def local() -> Iterator[Executor]:
    """Two threads, or two processes."""
    with Local(2) as executor:
        yield executor


@pytest.fixture(scope="module")
def scheduler(require) -> Iterator[str]:
    """The address of a cluster of two processes on this machine, of two threads each. Its memory
    manager is off: it drops copies from idle workers, which fetch them again as other objects."""
    try:
        from dask import config
        from distributed import LocalCluster
    except ImportError:
        require("distributed", "pip install 'ptmtools[cluster]'")
    keep = config.set({"distributed.scheduler.active-memory-manager.start": False})
    with (
        keep,
        LocalCluster(
            n_workers=2,
            threads_per_worker=2,
            host="127.0.0.1",
            scheduler_port=0,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL,
        ) as cluster,
    ):
        yield cluster.scheduler_address


@pytest.fixture(scope="module")
def cluster(scheduler: str) -> Iterator[Executor]:
    """Two workers of a Dask cluster."""
    with open_executor(scheduler=scheduler) as executor:
        yield executor


@pytest.fixture(params=KINDS)
def executor(request) -> Executor:
    """Each kind in turn."""
    return Executor() if request.param == "serial" else request.getfixturevalue(request.param)
