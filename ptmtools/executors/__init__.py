"""Where the work of a stage is done: here, in threads and processes, or on a cluster.

A stage is handed an `Executor` and gives it independent tasks; that is all it knows of cores and
machines. `open_executor` opens the one that the user asked for::

    with open_executor(workers=4) as executor:  # or scheduler="tcp://10.0.0.1:8786"
        for bytes_ in executor.each(encoded, options, images, releases_lock=True):
            ...

`model` has the contract.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ptmtools.lazy import names

if TYPE_CHECKING:
    from ptmtools.executors.local import Local as Local, open_executor as open_executor
    from ptmtools.executors.model import Executor as Executor, Sharing as Sharing
    from ptmtools.executors.serial import Serial as Serial
    from ptmtools.executors.worker import BackgroundTask as BackgroundTask

__getattr__ = names(__name__)
