"""The workers that a user asked for, and what they may do beside the thread that builds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ptmtools.executors.aside import Aside, Begin, asked
from ptmtools.executors.local import Local
from ptmtools.executors.model import Executor
from ptmtools.executors.opening import open_executor, processors

#: So many textures are worth starting a process, which takes a second.
WORTH_A_PROCESS = 8


class Workers:
    """Executors as the user wants them, opened when there is first something to do."""

    def __init__(self, workers: int, scheduler: str | None) -> None:
        self._asked = workers, scheduler
        self._opened: Executor | None = None

    @property
    def here(self) -> int:
        """How many threads of this machine may be used."""
        workers, scheduler = self._asked
        return processors() if scheduler else workers or processors()

    @property
    def one_spare(self) -> bool:
        """Whether what is done `aside` and textures must take turns."""
        return self._asked[1] is None and self.here == 2

    def executor(self) -> Executor:
        """The one of this thread."""
        if self._opened is None:
            self._opened = open_executor(*self._asked)
        return self._opened

    def aside(
        self, worthwhile: bool, ended: Callable[[], object] = lambda: None
    ) -> Begin[Any, Any, Any]:
        """How a task is begun beside this thread, if there is a worker for it; ``ended`` is called
        when that is free again."""
        if self.here == 1 or not worthwhile:
            ended()
            return asked
        return lambda function, shared, task: Aside(function, shared, task, ended)

    def beside(self, textures: int) -> Executor | None:
        """Who encodes so many textures while this thread keeps the interpreter's lock, and `aside`
        one worker: others, if it is worth while, to be closed after use."""
        workers, scheduler = self._asked
        if textures < WORTH_A_PROCESS or (self.here == 1 and not scheduler):
            return None
        if scheduler:
            return open_executor(workers, scheduler)
        return Local(min(max(1, self.here - 2), textures // WORTH_A_PROCESS), threads=False)

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        if self._opened is not None:
            self._opened.close()
