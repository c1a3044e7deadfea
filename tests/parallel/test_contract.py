"""The contract of all executors."""

from __future__ import annotations

import itertools
import os

import numpy as np
import parallel_tasks as tasks
import pytest

from ptmtools.errors import InputError
from ptmtools.executor import AHEAD

#: Whether the function may run in threads.
IN_THREADS = pytest.mark.parametrize("releases_lock", [False, True])


@IN_THREADS
@pytest.mark.parametrize("chunk", [1, 3])
def test_results_come_in_the_order_of_the_tasks(executor, releases_lock, chunk):
    actual = executor.each(
        tasks.slower_at_first, 0.02, range(20), releases_lock=releases_lock, chunk=chunk
    )
    assert list(actual) == [i * i for i in range(20)]
    assert list(executor.each(tasks.slower_at_first, 0.0, [], chunk=chunk)) == []


@IN_THREADS
@pytest.mark.parametrize("chunk", [1, 3])
def test_few_tasks_are_taken_ahead(executor, releases_lock, chunk):
    taken = 0

    def endless():
        nonlocal taken
        for i in itertools.count():
            taken += 1
            yield i

    actual = executor.each(
        tasks.slower_at_first, 0.0, endless(), releases_lock=releases_lock, chunk=chunk
    )
    assert taken == 0
    for i in range(12):
        assert next(actual) == i * i
        assert taken <= (AHEAD * executor.workers + i // chunk) * chunk + 1
    if executor.workers > 1:
        assert taken > 12
    actual.close()
    assert list(executor.each(tasks.slower_at_first, 0.0, [3])) == [9]


@IN_THREADS
@pytest.mark.parametrize("chunk", [1, 2])
def test_an_exception_comes_out_in_its_place(executor, releases_lock, chunk):
    actual = executor.each(tasks.refuse, 5, range(100), releases_lock=releases_lock, chunk=chunk)
    assert [next(actual) for _ in range(5)] == [0, 1, 2, 3, 4]
    with pytest.raises(InputError) as caught:
        next(actual)
    assert str(caught.value) == "a.png: byte 7: no 5; take another [PTM-I999]"
    assert (caught.value.code, caught.value.place) == ("PTM-I999", "byte 7")
    assert list(actual) == []
    assert list(executor.each(tasks.refuse, 5, [1, 2])) == [1, 2]


def test_exceptions_that_cannot_travel_are_told_all_the_same(executor):
    with pytest.raises(Exception, match="7 and 7") as caught:
        list(executor.each(tasks.fail_oddly, None, [7]))
    if executor.workers > 1:
        assert "fail_oddly" in caught.value.__notes__[0]


def test_what_is_shared_is_sent_once_to_a_worker_and_is_one_object_there(executor, tmp_path):
    shared = tasks.Marked(tmp_path)
    met: dict[int, list[int]] = {}
    for process, count in executor.each(tasks.keep, shared, range(12)):
        met.setdefault(process, []).append(count)
    assert all(sorted(counts) == list(range(1, len(counts) + 1)) for counts in met.values())
    apart = executor.workers > 1
    assert len(met) <= executor.workers
    assert (os.getpid() in met) != apart
    assert len(list(tmp_path.iterdir())) == (len(met) if apart else 0)


def test_copies_can_be_written_and_are_copies(executor):
    if executor.workers == 1:
        pytest.skip("the caller's own is the only one")
    array = np.arange(5000.0)
    assert os.getpid() not in set(executor.each(tasks.spoil, array, range(4)))
    assert array[7] == 7
    assert list(executor.each(tasks.at, array, [7, 8])) == [7, 8]


def test_functions_that_keep_the_lock_are_alone_in_their_process(executor, tmp_path):
    assert all(executor.each(tasks.alone, tmp_path, range(8)))
