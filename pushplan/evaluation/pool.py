"""A process pool that survives its workers: a dead or hanging one costs its own call only."""

from __future__ import annotations

import math
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from pushplan.evaluation.worker import THREAD_VARIABLES, WORKER_VARIABLE, Reply, WorkerSetup
from pushplan.world import PushplanError

_POLL_S = 0.2
_STARTS = 2  # so many workers in a row may end before they are ready until the pool gives up
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


@dataclass
class _Submission:
    future: Future[Any]
    payload: bytes


@dataclass
class _Worker:
    process: subprocess.Popen[bytes]
    connection: Connection
    log: Path | None
    ready: bool = False
    call: _Submission | None = None
    since: float = 0.0
    log_start: int = 0

    def tail(self) -> str:
        if self.log is None or not self.log.exists():
            return ""
        text = self.log.read_bytes()[self.log_start :]
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
        self._max_workers = workers
        self._limit_s = limit_s
        self._end_after_s = math.inf if limit_s is None else limit_s + _TRACE_S
        self._log_dir = log_dir
        main = getattr(sys.modules.get("__main__"), "__file__", None)
        self._setup = WorkerSetup(
            main=None if main is None else os.path.abspath(main),
            preload=tuple(preload),
            memory_limit_mb=memory_limit_mb,
            trace_after_s=limit_s,
        )
        self._queue: deque[_Submission] = deque()
        self._workers: list[_Worker] = []
        self._lock = threading.Lock()
        self._closing = False
        self._killed = False
        self._awake = False
        self._failed_starts = 0
        self._started = 0
        self._wake_read, self._wake_write = Pipe(duplex=False)
        self._thread = threading.Thread(target=self._manage, name="pushplan-pool", daemon=True)
        self._thread.start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Queue one call. Arguments and result have to be picklable."""
        call = _Submission(Future(), pickle.dumps((fn, args, kwargs)))
        with self._lock:
            if self._closing:
                raise RuntimeError("cannot submit to a pool that has been shut down")
            self._queue.append(call)
        self._wake()
        return call.future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Finish the queue, or drop it, and end the workers."""
        with self._lock:
            self._closing = True
            if cancel_futures:
                while self._queue:
                    self._queue.popleft().future.cancel()
        self._wake()
        if wait and threading.current_thread() is not self._thread:
            self._thread.join()

    def kill(self) -> None:
        """End the workers at once, whatever they are doing."""
        self._killed = True
        self.shutdown(cancel_futures=True)

    def _wake(self) -> None:
        with self._lock:
            if not self._awake and not self._wake_write.closed:
                self._awake = True
                self._wake_write.send_bytes(b"w")

    def _manage(self) -> None:
        try:
            while not self._finished():
                self._assign()
                connections = [worker.connection for worker in self._workers]
                for ready in wait([self._wake_read, *connections], _POLL_S):
                    if ready is self._wake_read:
                        with self._lock:
                            self._awake = False
                            self._wake_read.recv_bytes()
                    else:
                        self._receive(next(w for w in self._workers if w.connection is ready))
                self._check()
        finally:
            for worker in list(self._workers):
                self._end(worker, force=self._killed)
            with self._lock:
                self._closing = True
                self._wake_read.close()
                self._wake_write.close()

    def _finished(self) -> bool:
        busy = any(worker.call is not None for worker in self._workers)
        with self._lock:
            return self._killed or (self._closing and not self._queue and not busy)

    def _assign(self) -> None:
        """Give queued calls to idle workers; start workers while there is need."""
        idle = [w for w in self._workers if w.ready and w.call is None]
        while idle:
            with self._lock:
                call = self._queue.popleft() if self._queue else None
            if call is None:
                return
            if not call.future.set_running_or_notify_cancel():
                continue
            worker = idle.pop()
            worker.call, worker.since = call, time.monotonic()
            worker.log_start = worker.log.stat().st_size if worker.log else 0
            try:
                worker.connection.send_bytes(call.payload)
            except OSError:
                self._lost(worker)
        coming = sum(not worker.ready for worker in self._workers)
        wanted = min(self._max_workers - len(self._workers), len(self._queue) - coming)
        for _ in range(wanted):
            self._workers.append(self._start())

    def _start(self) -> _Worker:
        ours, theirs = Pipe(duplex=True)
        environment = {**os.environ, WORKER_VARIABLE: "1", "PYTHONUNBUFFERED": "1"}
        environment.update(dict.fromkeys(THREAD_VARIABLES, "1"))
        self._started += 1
        log = None
        output: Any = subprocess.DEVNULL
        if self._log_dir is not None:
            log = self._log_dir / f"worker-{os.getpid()}-{self._started}.log"
            output = log.open("wb")
        code = (
            f"import sys; sys.path[:] = {sys.path!r}\n"
            f"from pushplan.evaluation.worker import main; main({theirs.fileno()})"
        )
        try:
            process = subprocess.Popen(
                [sys.executable, "-c", code],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                env=environment,
                pass_fds=(theirs.fileno(),),
            )
        finally:
            theirs.close()
            if log is not None:
                output.close()
        ours.send_bytes(pickle.dumps(self._setup))
        return _Worker(process, ours, log)

    def _receive(self, worker: _Worker) -> None:
        try:
            message = pickle.loads(worker.connection.recv_bytes())
        except (EOFError, OSError):
            self._lost(worker)
            return
        except Exception as error:  # an exception that pickles but does not unpickle
            message = Reply(error=RuntimeError(f"a reply cannot be read: {error}"))
        if not worker.ready:
            worker.ready = True
            self._failed_starts = 0
            return
        assert isinstance(message, Reply) and worker.call is not None
        call, worker.call = worker.call, None
        if message.last:
            self._end(worker)
        if message.error is not None:
            call.future.set_exception(message.error)
        else:
            call.future.set_result(message.result)

    def _check(self) -> None:
        """Find workers that died without closing their socket, and calls that overran."""
        now = time.monotonic()
        for worker in list(self._workers):
            if worker.process.poll() is not None and not worker.connection.poll():
                self._lost(worker)
            elif worker.call and now > worker.since + self._end_after_s:
                call, log = worker.call, worker.tail()
                self._end(worker, force=True)
                call.future.set_exception(
                    WorkerOverranError(f"not done after {self._limit_s:g} s", log)
                )

    def _lost(self, worker: _Worker) -> None:
        self._end(worker)
        ending = _describe_exit(worker.process.returncode)
        if worker.call is not None:
            worker.call.future.set_exception(WorkerDiedError(ending, worker.tail()))
        elif not worker.ready:
            self._failed_starts += 1
            if self._failed_starts >= _STARTS:
                self._give_up(f"{ending} while it started: {worker.tail()[-500:]}")

    def _give_up(self, reason: str) -> None:
        with self._lock:
            self._closing = True
            calls, self._queue = list(self._queue), deque()
        for call in calls:
            if call.future.set_running_or_notify_cancel():
                call.future.set_exception(BrokenExecutor(reason))

    def _end(self, worker: _Worker, *, force: bool = False) -> None:
        if worker in self._workers:
            self._workers.remove(worker)
        worker.connection.close()
        try:
            worker.process.wait(0.0 if force else 1.0)
        except subprocess.TimeoutExpired:
            worker.process.kill()
            worker.process.wait()
        if worker.log is not None and worker.log.exists() and worker.log.stat().st_size == 0:
            worker.log.unlink()


def _describe_exit(code: int | None) -> str:
    if code is not None and code < 0:
        try:
            return f"the worker process was ended by {signal.Signals(-code).name}"
        except ValueError:
            return f"the worker process was ended by signal {-code}"
    return f"the worker process exited with code {code}"
