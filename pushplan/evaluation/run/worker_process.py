"""A worker process as its owner sees it."""

from __future__ import annotations

import base64
import contextlib
import json
import math
import os
import secrets
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pushplan.evaluation.run.job_limits import (
    THREAD_VARIABLES,
    WORKER_VARIABLE,
    descendants,
    marked,
    memory_kb,
    process_group,
)
from pushplan.evaluation.run.jobs import BatchStoppedError, JobResult
from pushplan.evaluation.run.worker import WorkerSetup
from pushplan.evaluation.store.rows import ResultRow, Status
from pushplan.files.file_locks import NO_FOLLOW
from pushplan.imports.named_objects import import_path
from pushplan.world import PushplanError

_POLL_S = 0.2
_CHUNK_BYTES = 2**18
_LONGEST_MESSAGE_BYTES = 2**30
_LOG_TAIL_BYTES = 6000
_LONGEST_LOG_BYTES = 1_000_000
_TRACE_S = 0.2  # time that a worker has to write where it hangs before it is ended
_FAREWELL_S = 1.0
_LOOKS = 3
_BETWEEN_LOOKS_S = 0.002
_ROUNDS = 200  # so often what a worker has started is looked for, while it starts others


def _no_link(path: str, flags: int) -> int:
    return os.open(path, flags | NO_FOLLOW, 0o666)


class WorkerDiedError(PushplanError):
    """The process that ran a call ended, or had to be ended.

    Attributes:
        log: what it had written to its standard error.
        status: of the job that it ran.
        from_outside: somebody else may have killed it.
    """

    def __init__(
        self, message: str, log: str, status: Status = Status.CRASHED, *, from_outside: bool = False
    ) -> None:
        super().__init__(message)
        self.log = log
        self.status = status
        self.from_outside = from_outside


class WorkerProcess:
    """A process that answers one call after the other, and writes into a log.

    It leads a process group, which ends with it.

    Args:
        setup: what it is told first.
        log: file for what it writes to standard output and error; discarded if None.
    """

    def __init__(self, setup: WorkerSetup, log: Path | None) -> None:
        self.group: str | None = None  # of the calls that it answers; None before the first
        self._setup = setup
        self._log = log
        self._log_start = 0
        ours, theirs = socket.socketpair()
        self._line = ours
        self._heard = bytearray()
        self._mark = secrets.token_hex(16)
        environment = {**os.environ, WORKER_VARIABLE: self._mark, "PYTHONUNBUFFERED": "1"}
        environment.update(dict.fromkeys(THREAD_VARIABLES, "1"))
        code = (
            f"import sys; sys.path[:] = {import_path()!r}\n"
            f"from pushplan.evaluation.run.worker import main; main({theirs.fileno()})"
        )
        with theirs, open(log or os.devnull, "ab", opener=_no_link) as output:
            self._process = subprocess.Popen(
                [sys.executable, "-c", code],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                env=environment,
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
            )

    def begin(self) -> None:
        """Wait until it is ready.

        Raises:
            WorkerDiedError: if it ends before.
        """
        self._send(asdict(self._setup))
        self._receive(math.inf)

    def ask(self, payload: bytes, limit_s: float) -> JobResult:
        """The answer to a call.

        Raises:
            InvalidInputError: if it cannot load what it was sent; it is well.
            WorkerDiedError: if it has ended, or was ended.
        """
        self._log_start = self._trimmed_log()
        begin = time.monotonic()
        self._send(base64.b64encode(payload).decode())
        said = self._receive(limit_s)
        if said.get("kind") == "running":
            said = self._receive(limit_s + begin - time.monotonic(), limit_s)
        if said.get("kind") == "refused":
            raise BatchStoppedError(str(said.get("text")))
        if said.get("kind") == "error":
            raise self._died(str(said.get("text")))
        if said.get("kind") == "out of memory":
            raise self._died("an allocation failed", Status.OUT_OF_MEMORY)
        try:  # who sends it is not trusted: the owner checks what it says
            trace = said["trace"]
            if trace is not None:
                trace = base64.b64decode(trace)
            row = ResultRow(**said["row"])
            return JobResult(row, trace, str(said["detail"]), dict(said["read"]))
        except (KeyError, TypeError, ValueError) as error:
            raise self._died(f"its message is no result: {error}") from error

    def _send(self, message: Any) -> None:
        """Send a line of JSON; if it has died, `_receive` finds out how."""
        with contextlib.suppress(OSError):
            self._line.settimeout(None)
            self._line.sendall(json.dumps(message).encode() + b"\n")

    def _receive(self, left_s: float, limit_s: float = math.inf) -> dict[str, Any]:
        """The next message: a line of JSON, nothing that could run here."""
        until = time.monotonic() + left_s + _TRACE_S
        limit_mb = self._setup.memory_limit_mb

        def waiting() -> None:
            if self._has_ended():  # it may die without closing its socket
                raise EOFError
            if time.monotonic() > until:
                raise self._died(f"not done after {min(limit_s, left_s):g} s", Status.TIMEOUT)
            pids = (self._process.pid, *descendants(self._process.pid))
            if limit_mb is not None and (used := memory_kb(pids) * 1024 / 1e6) > limit_mb:
                text = f"{used:.0f} MB in use, the limit is {limit_mb:.0f} MB"
                raise self._died(text, Status.OUT_OF_MEMORY)
            self._trimmed_log()

        try:
            message = json.loads(self._next_line(waiting))
            if not isinstance(message, dict):
                raise ValueError("it is no mapping")
            return message
        except (ValueError, RecursionError) as error:
            text = f"the worker process sent what is no message: {error}"
            raise self._died(text) from error
        except (EOFError, OSError):
            code = self.end()
            raise WorkerDiedError(
                _describe_exit(code),
                self._tail(),
                from_outside=code in (-signal.SIGKILL, -signal.SIGTERM),
            ) from None

    def _next_line(self, waiting: Callable[[], None]) -> bytes:
        """Its next message; ``waiting`` is called several times a second until all is there."""
        self._line.settimeout(_POLL_S)
        end = self._heard.find(b"\n")
        while end < 0:
            begin = len(self._heard)
            if begin > _LONGEST_MESSAGE_BYTES:
                raise ValueError("it is too long")
            try:
                chunk = self._line.recv(_CHUNK_BYTES)
            except TimeoutError:
                waiting()
                continue
            if not chunk:
                raise EOFError
            self._heard += chunk
            end = self._heard.find(b"\n", begin)
        line = bytes(self._heard[:end])
        del self._heard[: end + 1]
        return line

    def _died(self, reason: str, status: Status = Status.CRASHED) -> WorkerDiedError:
        """End it for a reason."""
        log = self._tail()
        self.end(force=True)
        return WorkerDiedError(reason, log, status)

    def end(self, *, force: bool = False) -> int:
        """Let it finish, or not, and end what it started; its log stays if it holds anything.

        Returns:
            Its exit code.
        """
        self._line.close()
        deadline = time.monotonic() + (0.0 if force else _FAREWELL_S)
        while not self._has_ended() and time.monotonic() < deadline:
            time.sleep(0.005)
        self._end_others()
        self.kill()
        self._end_others()
        code = self._process.wait()
        self._trimmed_log()
        if self._log is not None and self._log.exists() and self._log.stat().st_size == 0:
            self._log.unlink()
        return code

    def _end_others(self) -> None:
        """End what it started: until nothing is left, for such a process may start another one.

        While it lives it adopts what its children leave behind. What was left behind when it
        ended by itself bears its mark in the environment.
        """
        if not self._has_ended():
            with contextlib.suppress(OSError):
                os.kill(self._process.pid, signal.SIGSTOP)
        empty = 0  # looks in a row that found none: one may miss what is just being started
        for _ in range(_ROUNDS):
            found = {*descendants(self._process.pid), *marked(self._mark)}
            groups = {group for pid in found if (group := process_group(pid)) is not None}
            others = groups - {self._process.pid, os.getpgrp()}  # its own group ends with it
            empty = 0 if others else empty + 1
            if empty == _LOOKS:
                return
            for group in others:
                with contextlib.suppress(OSError):
                    os.killpg(group, signal.SIGKILL)  # before it can grow
            time.sleep(_BETWEEN_LOOKS_S)

    def kill(self) -> None:
        """End its process group at once, from any thread."""
        if self._process.returncode is None:  # not waited for yet, so that the number is its own
            with contextlib.suppress(OSError):
                os.killpg(self._process.pid, signal.SIGKILL)

    def _has_ended(self) -> bool:
        # without waiting for it, so that nothing else gets its number
        how = os.WEXITED | os.WNOHANG | os.WNOWAIT
        try:
            return os.waitid(os.P_PID, self._process.pid, how) is not None
        except ChildProcessError:
            return True

    def _trimmed_log(self) -> int:
        """Bytes in the log, of which the beginning is dropped when they are too many."""
        if self._log is None or not self._log.exists():
            return 0
        size = self._log.stat().st_size
        if size > _LONGEST_LOG_BYTES:
            tail = self._tail()
            os.truncate(self._log, 0)
            with self._log.open("ab") as file:
                file.write(tail.encode())
            self._log_start = 0
            size = len(tail)
        return size

    def _tail(self) -> str:
        if self._log is None or not self._log.exists():
            return ""
        with self._log.open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(self._log_start, size - _LOG_TAIL_BYTES))
            return file.read(_LOG_TAIL_BYTES).decode(errors="replace")


def _describe_exit(code: int) -> str:
    if code >= 0:
        return f"the worker process exited with code {code}"
    known = {int(one): one.name for one in signal.Signals}
    return f"the worker process was ended by {known.get(-code, f'signal {-code}')}"
