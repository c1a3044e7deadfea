"""Textures, encoded while other stages run: they depend on nothing that those have to say."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from threading import Event
from typing import Any

from ptmtools.executors.aside import Begin
from ptmtools.executors.model import Executor
from ptmtools.pipeline.options import TextureOptions
from ptmtools.pipeline.run import Run
from ptmtools.pipeline.textures import TextureStage
from ptmtools.pipeline.workers import Workers


class TexturesBeside:
    """The textures stage, done by another thread while this one runs other stages."""

    def __init__(self, run: Run, options: TextureOptions, workers: Workers) -> None:
        self._run = run
        self._options = options
        self._workers = workers
        self._stage: TextureStage | None = None
        self._stop, self._free = Event(), Event()
        self._pool = ThreadPoolExecutor(1, "textures")
        self._executor: Executor | None = None
        self._task: Future[None] | None = None
        self._progress = run.progress

    def begin(self, cutting: bool, large: bool) -> Begin[Any, Any, Any]:
        """To be called when the scene's images are known, and whether cells are cut next, of a
        ``large`` model; returns how a task is to be begun beside the thread that cuts them."""
        stage = self._stage = TextureStage(self._run, self._options)
        stage.begin()
        self._executor = self._workers.beside(stage.left) if cutting else None
        if self._executor:
            self._task = self._pool.submit(self._encode, stage, self._executor)
        if not self._workers.one_spare:
            self._free.set()
        return self._workers.aside(large, self._free.set)

    def _watched(self, done: int, total: int, what: str) -> None:
        """`Progress` that raises what has gone wrong so far."""
        if self._task is not None and self._task.done():
            self._task.result()
        self._progress(done, total, what)

    def finish(self) -> None:
        """Encodes with all workers what is left, and commits."""
        assert self._stage is not None
        if self._task is not None:
            self._end()
            self._task.result()
        if self._stage.left:
            self._stage.encode(self._workers.executor())
        self._stage.commit()

    def _encode(self, stage: TextureStage, executor: Executor) -> None:
        self._free.wait()
        with executor:
            stage.encode(executor, self._stop)

    def _end(self) -> None:
        self._stop.set()
        self._free.set()

    def __enter__(self) -> TexturesBeside:
        self._run.progress = self._watched
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._run.progress = self._progress
        self._end()
        if kind is not None and self._executor:
            self._executor.close()  # whoever waits for one of its tasks waits no longer
        self._pool.shutdown()
