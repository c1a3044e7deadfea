"""A cluster that is not there, not right, or dying."""

from __future__ import annotations

import logging
import os
import pickle
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import parallel_tasks as tasks
import pytest

from ptmtools import cluster as module
from ptmtools.cli.main import main
from ptmtools.cluster import Cluster, software
from ptmtools.errors import InputError, MissingComponentError, WorkerError
from ptmtools.parallel import open_executor


def test_without_dask(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingComponentError, match=r"pip install 'ptmtools\[cluster\]'.*PTM-M100"):
        open_executor(scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense", "tcp://", "ftp://x:1", ""])
def test_without_a_scheduler(address, monkeypatch):
    before = _loops()
    monkeypatch.setattr(module, "PATIENCE", 0.1)
    with pytest.raises(WorkerError, match=r"no scheduler answers.*PTM-W001"):
        open_executor(scheduler=address)
    assert _loops() <= before  # a client that the collector closes can stop the next one


def _loops() -> set[threading.Thread]:
    return {thread for thread in threading.enumerate() if thread.name == "IO loop"}


def test_limits(scheduler):
    with open_executor(scheduler=scheduler) as all_, open_executor(3, scheduler) as three:
        assert (all_.workers, three.workers) == (4, 3)


def test_workers_with_other_software(scheduler, cluster, monkeypatch):
    ours = software()
    monkeypatch.setattr(module, "software", lambda: ("ptmtools 0.0.1", *ours[1:]))
    with pytest.raises(
        WorkerError, match=r"has ptmtools .*, this process has ptmtools 0\.0\.1.*W003"
    ):
        open_executor(scheduler=scheduler)
    with pytest.raises(WorkerError, match="PTM-W003"):  # one that joined since
        list(cluster.each(tasks.refuse, 0, [1]))


def test_a_task_that_stands_still_ends_its_worker(monkeypatch):
    ended: list[int] = []
    monkeypatch.setattr(os, "_exit", ended.append)
    monkeypatch.setattr(module, "IDLE", 0.3)
    for function, expected in ((tasks.compute, []), (tasks.sleep, [1])):
        call = pickle.dumps((function, [1]))
        assert module._perform(0.5, call, False, software()) == ([1], None)
        assert ended == expected


def test_a_value_is_lost_while_it_is_scattered(cluster, monkeypatch):
    scatter = cluster._client.scatter

    def lost(*_args, **_settings):
        monkeypatch.setattr(cluster._client, "scatter", scatter)
        raise ValueError("Can not use replicate to delete data")

    monkeypatch.setattr(cluster._client, "scatter", lost)
    assert list(cluster.each(tasks.at, np.arange(9.0), [7, 8])) == [7, 8]


def test_dying_workers(require, monkeypatch):
    """One worker, then both: others repeat the tasks, over the shared value."""
    from distributed import LocalCluster

    monkeypatch.setattr(module, "PATIENCE", 0.5)
    settings = {"host": "127.0.0.1", "dashboard_address": ":0", "silence_logs": logging.CRITICAL}
    with LocalCluster(n_workers=0, **settings) as machines:
        with pytest.raises(WorkerError, match="PTM-W001"):
            open_executor(scheduler=machines.scheduler_address)
        monkeypatch.undo()
        machines.scale(2)
        machines.wait_for_workers(2)
        array = np.arange(5000.0)
        with open_executor(scheduler=machines.scheduler_address) as executor:
            processes = set(executor.each(tasks.process, None, range(20)))
            for victims in (1, 2):
                actual = executor.each(tasks.at, array, [7] * 40)
                assert next(actual) == 7
                for process in list(processes)[:victims]:
                    os.kill(process, signal.SIGKILL)
                assert list(actual) == [7] * 39
                processes = set(executor.each(tasks.process, None, range(20)))
            with pytest.raises(WorkerError, match="PTM-W004"):
                list(executor.each(tasks.die, 1, [0, 1]))


@pytest.fixture
def alone(scheduler) -> Iterator[Cluster]:
    """An executor of its own, since a fault of these tests could outlast them."""
    with Cluster(scheduler) as executor:
        yield executor


@pytest.fixture
def gate(tmp_path) -> Iterator[Path]:
    """A file for `wait_for`, so that no task waits longer than the test."""
    yield tmp_path / "gate"
    (tmp_path / "gate").touch()


def test_closing_while_results_wait_to_be_fetched(alone, gate):
    """Dask keeps the one fetch that all results join which come while five fetches go on."""
    client = alone._client
    fetches = client._gather_semaphore
    actual = alone.each(tasks.wait_for, gate, range(100))
    assert next(actual) == 0

    async def occupy() -> int:
        count = 0
        while not fetches.locked():
            await fetches.acquire()
            count += 1
        return count

    async def free() -> None:
        for _ in range(count):
            fetches.release()

    count = client.sync(occupy)
    assert count > 0
    gate.touch()
    while client._gather_future is None:
        time.sleep(0.01)
    actual.close()
    client.sync(free)
    assert list(alone.each(tasks.wait_for, gate, [3])) == [3]


def _left(executor: Cluster) -> int:
    """The keys that the scheduler still has, once it has had time to drop them."""
    for _ in range(1000):
        if not (left := executor._client.run_on_scheduler(_known)):
            break
        time.sleep(0.01)
    return left


def _known(dask_scheduler) -> int:
    return len(dask_scheduler.tasks)


def test_closing_drops_the_tasks(alone, gate):
    actual = alone.each(tasks.wait_for, gate, range(100))
    assert next(actual) == 0
    while alone._client.run_on_scheduler(_known) <= alone.workers:
        time.sleep(0.01)
    actual.close()
    assert _left(alone) == 0


@pytest.mark.parametrize("kind", ["of a task", "of a worker"])
def test_a_fault_that_is_kept_keeps_nothing_on_the_cluster(alone, monkeypatch, kind):
    """Its traceback has the frames in which the shared value and the other tasks were."""
    if kind == "of a worker":
        monkeypatch.setattr(module, "software", lambda: ("ptmtools 0.0.1",))
    with pytest.raises(InputError if kind == "of a task" else WorkerError) as caught:
        list(alone.each(tasks.refuse, 3, range(100)))
    assert _left(alone) == 0
    assert caught.tb


def test_a_worker_that_ends_before_it_gets_the_value(cluster, monkeypatch):
    from distributed.comm import CommClosedError

    scatter, calls = cluster._client.scatter, []

    def ends_once(*values, **options):
        calls.append(values)
        if len(calls) == 1:
            raise CommClosedError("Stream is closed")
        return scatter(*values, **options)

    monkeypatch.setattr(cluster._client, "scatter", ends_once)
    assert list(cluster.each(tasks.slower_at_first, 0.0, [3, 4])) == [9, 16]
    assert len(calls) == 2


def test_the_command(tmp_path, capfd, monkeypatch):
    """One line, its own exit status, and no database."""
    monkeypatch.setattr(module, "PATIENCE", 0.1)
    model = Path(__file__).resolve().parents[2] / "sample_data/two_rooms/two_rooms.obj"
    arguments = ["build-scene", str(model), "-o", str(tmp_path / "db")]
    assert main([*arguments, "--scheduler", "tcp://127.0.0.1:1"]) == 9
    lines = capfd.readouterr().err.splitlines()
    assert lines[-1].startswith("ptm: tcp://127.0.0.1:1: no scheduler answers; start one")
    assert lines[-1].endswith("[PTM-W001]")
    for stage in ("pvs", "ach", "textures"):
        assert main([stage, "--help"]) == 0
        assert "--scheduler ADDRESS" in capfd.readouterr().out
