"""An executor of each kind; those that start processes are shared by the tests of a module. A store
of objects, shared by all."""

from __future__ import annotations

import logging
import shutil
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from itertools import count
from pathlib import Path

import pytest

from ptmtools.executor import Executor
from ptmtools.parallel import Local, open_executor
from tests.stores import CREDENTIALS, Store, s3_store

# Where worker processes find `parallel_tasks`: they are given this path.
sys.path.append(str(Path(__file__).parent / "tasks"))

KINDS = ("serial", "local", "cluster")
ROOMS = Path(__file__).resolve().parents[2] / "sample_data" / "two_rooms"
_number = count()


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


@pytest.fixture(scope="session")
def running(require: Callable[[str, str], None]) -> Iterator[Store]:
    """A store of S3; each test has a bucket of its own."""
    for module in ("s3fs", "moto", "flask", "distributed"):
        if not find_spec(module):
            require(module, "pip install -e '.[dev]'")
    with s3_store() as store:
        yield store


@pytest.fixture
def store(running: Store, monkeypatch: pytest.MonkeyPatch, machine: Callable[[], Path]) -> Store:
    for name, value in CREDENTIALS.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("AWS_ENDPOINT_URL", running.url)
    running.requests.clear()
    monkeypatch.setattr(running, "refuse", lambda request: False)
    machine()
    return running


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], Path]:
    """From the call on, this process has another cache folder, as on another machine."""

    def another() -> Path:
        folder = tmp_path / f"machine-{next(_number)}"
        monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
        return folder

    return another


@pytest.fixture
def bucket(store: Store) -> str:
    name = f"builds-{next(_number)}"
    store.make_bucket(name)
    return name


@pytest.fixture
def rooms(tmp_path: Path) -> Path:
    """A model of two rooms, to be changed."""
    return Path(shutil.copytree(ROOMS, tmp_path / "rooms")) / "two_rooms.obj"
