"""Worker processes on this machine: how they end, and what they leave."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import parallel_tasks as tasks
import pytest

from ptmtools import parallel
from ptmtools.errors import InputError, OutputError, WorkerError
from ptmtools.executor import Executor
from ptmtools.parallel import Local, in_background, open_executor

HERE = Path(__file__).parent / "tasks"

#: Starts two workers that sleep, and one that soon waits for more.
SCRIPT = """
import sys
from pathlib import Path
sys.path.append(sys.argv[1])
import parallel_tasks as tasks
from ptmtools.parallel import Local

{guard}
    with Local(3) as local:
        print("go", flush=True)
        for _ in local.each(tasks.note_and_sleep, Path(sys.argv[2]), [{seconds}, {seconds}, 0]):
            pass
"""


def started(
    tmp_path: Path, seconds: float = 60, guard: str = "if __name__ == '__main__':"
) -> subprocess.Popen[str]:
    """The script, with its temporary files in a folder of its own."""
    (tmp_path / "pids").mkdir()
    (tmp_path / "temporary").mkdir()
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(seconds=seconds, guard=guard))
    return subprocess.Popen(
        [sys.executable, str(script), str(HERE), str(tmp_path / "pids")],
        env=os.environ | {"TMPDIR": str(tmp_path / "temporary")},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # What is started in the background may have been told to ignore Ctrl-C.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def workers(tmp_path: Path) -> list[int]:
    """The processes of the workers, once all have begun."""
    pids = tmp_path / "pids"
    until(lambda: len(list(pids.iterdir())) == 3)
    return [int(file.name) for file in pids.iterdir()]


def until(condition: Callable[[], bool]) -> None:
    """Waits for what would otherwise never be: a minute is longer than any machine takes."""
    for _ in range(1200):
        if condition():
            return
        time.sleep(0.05)
    pytest.fail("waited in vain")


def gone(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return True
    return state == "Z"


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="another system")
def test_a_killed_parent_leaves_neither_processes_nor_files(tmp_path):
    parent = started(tmp_path)
    children = workers(tmp_path)
    assert not any(gone(child) for child in children)
    assert list((tmp_path / "temporary").iterdir()) == []
    parent.kill()
    parent.wait()
    until(lambda: all(gone(child) for child in children))
    assert list((tmp_path / "temporary").iterdir()) == []


def test_ctrl_c_ends_all_at_once_and_only_the_parent_speaks(tmp_path):
    parent = started(tmp_path)
    children = workers(tmp_path)
    os.killpg(parent.pid, signal.SIGINT)  # as a terminal does
    _, printed = parent.communicate()
    assert printed.count("KeyboardInterrupt") == 1
    assert "Process Spawn" not in printed
    until(lambda: all(gone(child) for child in children))


def test_a_worker_that_is_killed_is_an_error_and_not_the_end(local):
    actual = local.each(tasks.die, 3, range(100))
    with pytest.raises(WorkerError, match="PTM-W004"):
        list(actual)
    assert list(local.each(tasks.die, 3, range(3))) == [0, 1, 2]


def test_a_worker_that_stands_still_is_replaced(tmp_path, monkeypatch):
    monkeypatch.setattr(parallel, "IDLE", 0.6)
    with Local(1, threads=False) as local:
        assert list(local.each(tasks.send_half, tmp_path, [0])) == [bytes(1000)]
        monkeypatch.setattr(parallel, "_ATTEMPTS", 1)
        with pytest.raises(WorkerError, match=r"stood still for 0.6 s.*PTM-W006"):
            list(local.each(tasks.stand_still, tmp_path, [1]))


def test_a_busy_worker_is_left_alone(monkeypatch):
    """One that waits for a child of its own is busy, too."""
    monkeypatch.setattr(parallel, "IDLE", 0.6)
    with Local(1, threads=False) as local:
        assert list(local.each(tasks.compute, 0.9, [1])) == [1]
        assert list(local.each(tasks.watch_a_child, 1.2, [1])) == [1]


def test_a_script_without_a_guard_is_told_what_it_needs(tmp_path):
    parent = started(tmp_path, 0, "if True:")
    _, printed = parent.communicate()
    assert parent.returncode == 1
    assert "needs `if __name__ == '__main__'` [PTM-W004]" in printed


def test_a_full_disk_is_told(local, monkeypatch):
    def full(*_args, **_settings):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    with pytest.raises(OutputError, match="PTM-O003"):
        list(local.each(tasks.die, 9, range(3)))


def test_without_threads_even_one_worker_is_another_process():
    with Local(1, threads=False) as one:
        actual = set(one.each(tasks.process, None, range(3), releases_lock=True))
    assert len(actual) == 1
    assert os.getpid() not in actual


@pytest.mark.parametrize("releases_lock", [False, True])
@pytest.mark.parametrize("threads", [False, True])
def test_nothing_is_begun_once_it_is_closed(releases_lock, threads):
    """By a thread that comes late, say: it would be waited for, or left behind."""
    local = Local(2, threads=threads)
    local.close()
    with pytest.raises(RuntimeError, match="after shutdown"):
        list(local.each(tasks.process, None, range(3), releases_lock=releases_lock))


def test_one_task_in_the_background():
    ended = threading.Event()
    task = in_background(tasks.slower_at_first, 0.02, 4, ended.set)
    assert task.result() == 16
    until(ended.is_set)
    with pytest.raises(InputError, match="PTM-I999"):
        in_background(tasks.refuse, 5, 5).result()
    with pytest.raises(WorkerError, match="PTM-W004"):
        in_background(tasks.die, 7, 7).result()


@pytest.mark.parametrize("begun", [False, True])
def test_an_unwanted_task_is_ended(tmp_path, begun):
    """During the task, or before its process has even started."""
    ended = threading.Event()
    task = in_background(tasks.note_and_sleep, tmp_path, 1e6, ended.set)
    if begun:
        until(lambda: any(tmp_path.iterdir()))
    task.cancel()
    until(ended.is_set)
    until(lambda: all(gone(int(file.name)) for file in tmp_path.iterdir()))
    with pytest.raises((WorkerError, RuntimeError)):
        task.result()


def test_a_worker_that_dies_while_it_sends_a_result_is_an_error(local):
    with pytest.raises(WorkerError, match="PTM-W004"):
        list(local.each(tasks.die_while_sending, None, range(3)))
    assert list(local.each(tasks.die, 3, range(3))) == [0, 1, 2]


def test_what_is_only_asked_for_is_not_done_before(tmp_path):
    pending = Executor().submit(tasks.note_and_sleep, tmp_path, 0.0)
    assert not list(tmp_path.iterdir())
    pending.result()
    assert list(tmp_path.iterdir())


def test_which_executor(one_processor, monkeypatch):
    monkeypatch.setattr("ptmtools.parallel.processors", one_processor)
    assert isinstance(open_executor(1), Executor)
    with open_executor(3) as three, open_executor() as all_:
        assert three.workers == 3
        assert all_.workers == len(os.sched_getaffinity(0))
        assert isinstance(three, Local)


def test_what_goes_wrong_on_the_way_is_told_as_it_is(local: Local) -> None:
    """Neither a shared value that cannot be taken in nor a result that cannot be sent costs a
    worker."""
    with pytest.raises(InputError, match="cannot be taken in"):
        list(local.each(tasks.keep, tasks.Unreadable(), range(2)))
    with pytest.raises(Exception, match="pickle") as raised:
        list(local.each(tasks.unsendable, None, range(4)))
    assert not isinstance(raised.value, WorkerError)
    assert list(local.each(tasks.unsendable, None, [2, 3])) == [2, 3]
