"""A process pool that survives its workers: a dead or hanging one costs its own call only."""

from __future__ import annotations

import contextlib
import itertools
import math
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

from pushplan.evaluation.worker import THREAD_VARIABLES, WORKER_VARIABLE, Reply, WorkerSetup
from pushplan.world import PushplanError

_POLL_S = 0.2
_STARTS = 2  # so many workers in a row may end before they are ready until a call gives up
_LOG_TAIL = 6000
_TRACE_S = 0.2  # time that a worker has to write where it hangs before it is ended


class WorkerDiedError(PushplanError):
    """The process that ran a call ended.

    Attributes:
        log: what it had written to its standard error.
    """

    def __init__(self, message: str, log: str = "") -> None:
        super().__init__(message)
        self.log = log


class WorkerOverranError(WorkerDiedError):
    """The process that ran a call was ended because the call took too long."""


class _Worker:
    """A process that answers one call after the other, and writes into a log."""

    def __init__(self, setup: WorkerSetup, log: Path | None) -> None:
        self._log, self._log_start = log, 0
        self._connection, theirs = Pipe(duplex=True)
        environment = {**os.environ, WORKER_VARIABLE: "1", "PYTHONUNBUFFERED": "1"}
        environment.update(dict.fromkeys(THREAD_VARIABLES, "1"))
        code = (
            f"import sys; sys.path[:] = {sys.path!r}\n"
            f"from pushplan.evaluation.worker import main; main({theirs.fileno()})"
        )
        with theirs, open(log or os.devnull, "wb") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-c", code],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                env=environment,
                pass_fds=(theirs.fileno(),),
            )
        self._connection.send_bytes(pickle.dumps(setup))

    def ask(self, payload: bytes, limit_s: float) -> Reply:
        """The answer to a call.

        Raises:
            WorkerDiedError: if it has ended, or was ended because it took too long.
        """
        self._log_start = self._log.stat().st_size if self._log else 0
        with contextlib.suppress(OSError):  # it has died: `receive` finds out how
            self._connection.send_bytes(payload)
        answer = self.receive(limit_s)
        try:
            reply: Reply = pickle.loads(answer)
        except Exception as error:  # an exception that pickles but does not unpickle
            return Reply(error=RuntimeError(f"a reply cannot be read: {error}"))
        return reply

    def receive(self, limit_s: float) -> bytes:
        """What it sends next; see `ask`."""
        until = time.monotonic() + limit_s + _TRACE_S
        try:
            while not self._connection.poll(_POLL_S):
                # it may die without closing its socket
                if self.process.poll() is not None and not self._connection.poll():
                    raise EOFError
                if time.monotonic() > until:
                    log = self._tail()
                    self.end(force=True)
                    raise WorkerOverranError(f"not done after {limit_s:g} s", log)
            return self._connection.recv_bytes()
        except (EOFError, OSError):
            self.end()
            raise WorkerDiedError(_describe_exit(self.process.returncode), self._tail()) from None

    def end(self, *, force: bool = False) -> None:
        """Let it finish, or not; its log stays if there is something in it."""
        self._connection.close()
        try:
            self.process.wait(0.0 if force else 1.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        if self._log is not None and self._log.exists() and self._log.stat().st_size == 0:
            self._log.unlink()

    def _tail(self) -> str:
        if self._log is None or not self._log.exists():
            return ""
        text = self._log.read_bytes()[self._log_start :]
        return text[-_LOG_TAIL:].decode(errors="replace")


class WorkerPool(Executor):
    """Runs calls in processes of its own, one call at a time in each.

    Unlike `concurrent.futures.ProcessPoolExecutor` it knows which call a process was running
    when it died, ends calls that take too long, replaces processes, and does not import the
    main module of the program unless a call needs it. Workers ignore Ctrl-C and end when their
    owner does. Results with a true attribute ``tainted`` retire the worker they come from.

    Args:
        workers: number of processes.
        limit_s: wall-clock time after which a call is ended by force [s].
        memory_limit_mb: private memory of a worker at which allocations fail [MB].
        preload: modules that each worker imports before its first call.
        log_dir: folder for what workers write to standard output and error; discarded if None.
    """

    def __init__(
        self,
        workers: int,
        *,
        limit_s: float | None = None,
        memory_limit_mb: float | None = None,
        preload: Sequence[str] = (),
        log_dir: Path | None = None,
    ) -> None:
        main = getattr(sys.modules.get("__main__"), "__file__", None)
        self._setup = WorkerSetup(
            main=None if main is None else os.path.abspath(main),
            preload=tuple(preload),
            memory_limit_mb=memory_limit_mb,
            trace_after_s=limit_s,
        )
        self._most, self._log_dir = workers, log_dir
        self._limit_s = math.inf if limit_s is None else limit_s
        self._calls: queue.SimpleQueue[tuple[Future[Any], bytes] | None] = queue.SimpleQueue()
        self._threads: list[threading.Thread] = []  # one for each worker
        self._workers: list[_Worker] = []  # all that were ever started
        self._lock = threading.Lock()
        self._closing = self._killed = False
        self._numbers = itertools.count(1)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Queue one call. Arguments and result have to be picklable."""
        future: Future[Any] = Future()
        payload = pickle.dumps((fn, args, kwargs))
        with self._lock:
            if self._closing:
                raise RuntimeError("cannot submit to a pool that has been shut down")
            self._calls.put((future, payload))
            if len(self._threads) < self._most:
                self._threads.append(threading.Thread(target=self._serve, daemon=True))
                self._threads[-1].start()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Finish the queue, or drop it, and end the workers."""
        with self._lock:
            self._closing = True
            if cancel_futures:
                with contextlib.suppress(queue.Empty):
                    while True:
                        if (call := self._calls.get_nowait()) is not None:
                            call[0].cancel()
            for _ in self._threads:
                self._calls.put(None)
        for thread in self._threads if wait else ():
            thread.join()

    def kill(self) -> None:
        """End the workers at once, whatever they are doing."""
        with self._lock:
            self._killed = True
            for worker in self._workers:
                worker.process.kill()
        self.shutdown(cancel_futures=True)

    def _serve(self) -> None:
        """Hand calls to a worker of this thread's own until there are no more."""
        worker: _Worker | None = None
        while (call := self._calls.get()) is not None:
            future, payload = call
            if not future.set_running_or_notify_cancel():
                continue
            try:
                if worker is None or worker.process.poll() is not None:
                    worker = self._start()
                reply = worker.ask(payload, self._limit_s)
            except Exception as error:
                worker = None
                future.set_exception(error)
                continue
            if reply.last:
                worker.end()
                worker = None
            if reply.error is not None:
                future.set_exception(reply.error)
            else:
                future.set_result(reply.result)
        if worker is not None:
            worker.end(force=self._killed)

    def _start(self) -> _Worker:
        """A worker that is ready."""
        ending = ""
        for _ in range(_STARTS):
            name = f"worker-{os.getpid()}-{next(self._numbers)}.log"
            worker = _Worker(self._setup, None if self._log_dir is None else self._log_dir / name)
            with self._lock:
                self._workers.append(worker)
                if self._killed:
                    worker.process.kill()
            try:
                worker.receive(math.inf)
            except WorkerDiedError as error:
                ending = f"{error} while it started: {error.log[-500:]}"
            else:
                return worker
        raise BrokenExecutor(ending)


def _describe_exit(code: int | None) -> str:
    if code is not None and code < 0:
        try:
            return f"the worker process was ended by {signal.Signals(-code).name}"
        except ValueError:
            return f"the worker process was ended by signal {-code}"
    return f"the worker process exited with code {code}"
