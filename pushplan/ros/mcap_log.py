"""`McapLog`: what a `Runner` sees and does, as an MCAP file."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from queue import SimpleQueue

from pushplan.ros.mcap_writer import McapWriter
from pushplan.runtime import Command
from pushplan.world import InvalidInputError, Plan, World
from pushplan.world.checks import expect, integer


class McapLog:
    """Keeps worlds, plans, commands and their ages; a `pushplan.runtime.RunLog`.

    Its methods may be called by any thread and never wait for the disk: another thread encodes
    and writes. What comes in while ``backlog`` notes are waiting is dropped and counted. A log
    holds one episode, and `pushplan.ros.load_episode` reads it.

    Args:
        path: the file; one that is there is replaced.
        frame_id: the world frame.
        backlog: how many notes may wait to be written.

    Attributes:
        dropped: how many notes were lost because the disk was too slow; the file says it too.

    Raises:
        InvalidInputError: if the file cannot be written; later also if writing has failed.
        MissingDependencyError: if `mcap` or `rosbags` is not installed.

    Example:
        >>> log = McapLog("run.mcap")  # doctest: +SKIP
        >>> with log, Runner("push-aware", period=0.05, log=log) as runner:  # doctest: +SKIP
        ...     runner.start(world)
    """

    def __init__(self, path: str | Path, *, frame_id: str = "map", backlog: int = 1000) -> None:
        self._backlog = integer("backlog", backlog, low=1)
        self.dropped = 0
        self._writer = McapWriter(path, frame_id)
        self._newest = -1.0
        self._error: Exception | None = None
        self._tasks: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._lock = threading.RLock()
        self._closed = False
        self._thread = threading.Thread(target=self._write, name="pushplan log", daemon=True)
        self._thread.start()

    def __enter__(self) -> McapLog:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def world(self, world: World) -> None:
        """Note a snapshot; one that is not later than the last is in the log already."""
        expect("world", world, World)
        with self._lock:
            if world.time <= self._newest:
                return
            self._newest = world.time
            self._put(partial(self._writer.world, world))

    def plan(self, plan: Plan, time: float) -> None:
        """Note a plan that was taken up, at a time [s]."""
        self._put(partial(self._writer.plan, expect("plan", plan, Plan), time))

    def command(self, command: Command) -> None:
        """Note a command."""
        self._put(partial(self._writer.command, expect("command", command, Command)))

    def close(self) -> None:
        """Write what is left and the index; a file that is not closed cannot be read.

        Raises:
            InvalidInputError: if writing has failed.
        """
        if not self._closed:
            self._closed = True
            self._tasks.put(None)
            self._thread.join()
            self._check()

    def _put(self, task: Callable[[], None]) -> None:
        if self._closed:
            raise InvalidInputError("the log is closed")
        self._check()
        with self._lock:
            if self._tasks.qsize() < self._backlog:
                self._tasks.put(task)
            else:
                self.dropped += 1

    def _check(self) -> None:
        if self._error is not None:
            raise InvalidInputError(f"cannot write the log: {self._error}") from self._error

    def _write(self) -> None:
        try:
            while (task := self._tasks.get()) is not None:
                task()
        except Exception as error:  # said by the next call
            self._error = error
        try:
            self._writer.close(self.dropped)
        except Exception as error:
            self._error = self._error or error
