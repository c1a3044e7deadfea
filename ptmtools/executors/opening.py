"""Which executor the user's wishes come to."""

from __future__ import annotations

from ptmtools.executors.model import Executor, processors


def open_executor(workers: int = 0, scheduler: str | None = None) -> Executor:
    """The executor for ``workers`` tasks at a time, or a cluster's; to be closed after use.

    Parameters
    ----------
    workers: 0 is one for each processor that this process may use, or each thread of the cluster.
        Changes nothing in the result.
    scheduler: address of a Dask scheduler, such as ``tcp://10.0.0.1:8786``.

    Raises
    ------
    MissingComponentError: PTM-M700 Dask is not installed.
    WorkerError: PTM-W001 the scheduler cannot be reached, PTM-W002 it has no workers, PTM-W003
        they have other software than this process.
    """
    if scheduler is not None:
        from ptmtools.executors.cluster import Cluster

        return Cluster(scheduler, workers)
    workers = workers or processors()
    if workers == 1:
        from ptmtools.executors.serial import Serial

        return Serial()
    from ptmtools.executors.local import Local

    return Local(workers)
