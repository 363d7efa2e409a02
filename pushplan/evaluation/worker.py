"""The loop of a worker process of `pushplan.evaluation.pool`."""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import importlib
import pickle
import runpy
import signal
import sys
import types
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from pushplan.world import InvalidInputError

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""Set to 1 in a worker: parallel workers that each use all cores slow each other down."""

WORKER_VARIABLE = "PUSHPLAN_WORKER"
"""Set in the environment of a worker."""


@dataclass(frozen=True)
class WorkerSetup:
    """What a worker is told before its first call."""

    main: str | None  # file of the owner's ``__main__`` module, for what is defined there
    preload: tuple[str, ...]  # modules to import before the first call, so that no call pays for it
    memory_limit_mb: float | None  # private memory at which allocations fail [MB]
    trace_after_s: float | None  # a call that takes this long has its stack written to the log [s]


@dataclass(frozen=True)
class Reply:
    """What a worker sends after a call."""

    result: Any = None  # what the call returned
    error: BaseException | None = None  # what it raised
    last: bool = False  # whether the worker ends now


def main(descriptor: int) -> None:
    """Answer calls that come through an inherited socket until it closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the owner's business
    faulthandler.enable()
    _die_with_owner()
    with Connection(descriptor) as connection, contextlib.suppress(EOFError, BrokenPipeError):
        setup: WorkerSetup = pickle.loads(connection.recv_bytes())
        for name in setup.preload:
            with contextlib.suppress(ImportError):  # a job that needs it will say so
                importlib.import_module(name)
        from pushplan.evaluation.limits import limit_memory

        limit_memory(setup.memory_limit_mb)
        connection.send_bytes(pickle.dumps("ready"))
        reply = Reply()
        while not reply.last:
            payload = connection.recv_bytes()
            reply = _answer(payload, setup)
            connection.send_bytes(_packed(reply))
            sys.stdout.flush()
            sys.stderr.flush()


def _answer(payload: bytes, setup: WorkerSetup) -> Reply:
    try:
        if setup.trace_after_s is not None:
            faulthandler.dump_traceback_later(setup.trace_after_s)
        function, arguments, keywords = _unpacked(payload, setup.main)
        result = function(*arguments, **keywords)
    except (Exception, SystemExit) as error:
        return Reply(error=error, last=isinstance(error, MemoryError))
    finally:
        faulthandler.cancel_dump_traceback_later()
    return Reply(result=result, last=bool(getattr(result, "tainted", False)))


def _unpacked(payload: bytes, main_path: str | None) -> Any:
    if b"__main__" in payload and main_path is not None:
        _import_main(main_path)
    try:
        return pickle.loads(payload)
    except (AttributeError, ImportError) as error:
        raise InvalidInputError(
            f"a worker process cannot load what it was sent ({error}): define it at the top level "
            "of a file, name it as 'file.py:Class', or use workers=0"
        ) from error


def _packed(reply: Reply) -> bytes:
    try:
        return pickle.dumps(reply)
    except Exception as error:
        text = f"the result of a call cannot be sent back: {type(error).__name__}: {error}"
        return pickle.dumps(Reply(error=RuntimeError(text), last=reply.last))


def _import_main(path: str) -> None:
    """Run the owner's main file as ``__mp_main__``, as `multiprocessing` does."""
    if sys.modules["__main__"].__name__ == "__mp_main__":
        return
    module = types.ModuleType("__mp_main__")
    try:
        module.__dict__.update(runpy.run_path(path, run_name="__mp_main__"))
    except InvalidInputError:
        raise
    except (Exception, SystemExit) as error:
        raise InvalidInputError(
            f"a worker process cannot import the main script {path} "
            f"({type(error).__name__}: {error}): put what the script does under "
            "`if __name__ == '__main__':`"
        ) from error
    sys.modules["__main__"] = sys.modules["__mp_main__"] = module


def _die_with_owner() -> None:
    """Ask the kernel to end this process when its owner ends, however that happens (Linux)."""
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(1, int(signal.SIGKILL), 0, 0, 0)  # PR_SET_PDEATHSIG
