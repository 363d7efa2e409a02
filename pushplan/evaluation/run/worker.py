"""The loop of a worker process of `pushplan.evaluation.run.pool`."""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import importlib
import os
import pickle
import runpy
import signal
import socket
import sys
import types
from dataclasses import asdict, dataclass

from pushplan.errors import describe
from pushplan.evaluation.run.channel import Channel
from pushplan.world import InvalidInputError

_DIE_WITH_OWNER = 1  # PR_SET_PDEATHSIG of Linux, however the owner ends
_ADOPT_ORPHANS = 36  # PR_SET_CHILD_SUBREAPER: what a policy leaves behind can still be found

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""Set to 1 in a worker: parallel workers that each use all cores slow each other down."""


@dataclass(frozen=True)
class WorkerSetup:
    """What a worker is told before its first call."""

    main: str | None  # file of the owner's ``__main__`` module, for what is defined there
    preload: tuple[str, ...]  # modules to import before the first call, so that no call pays for it
    memory_limit_mb: float | None  # private memory at which allocations fail [MB]
    trace_after_s: float | None  # a call that takes this long has its stack written to the log [s]


def main(descriptor: int) -> None:
    """Answer calls that come through an inherited socket until it closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the owner's business
    faulthandler.enable()
    for option, value in ((_DIE_WITH_OWNER, int(signal.SIGKILL)), (_ADOPT_ORPHANS, 1)):
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None).prctl(option, value, 0, 0, 0)
    os.set_inheritable(descriptor, False)
    channel = Channel(socket.socket(fileno=descriptor))
    with contextlib.suppress(EOFError, OSError):
        _, payload = channel.receive()
        setup: WorkerSetup = pickle.loads(payload)
        for name in setup.preload:
            with contextlib.suppress(ImportError):  # a job that needs it will say so
                importlib.import_module(name)
        from pushplan.evaluation.run.job_limits import limit_memory

        limit_memory(setup.memory_limit_mb)
        channel.send({"kind": "ready"})
        last = False
        while not last:
            _, payload = channel.receive()
            last = _answer(channel, payload, setup)
            for stream in (sys.stdout, sys.stderr):
                with contextlib.suppress(OSError):
                    stream.flush()


def _answer(channel: Channel, payload: bytes, setup: WorkerSetup) -> bool:
    """Run a job and send what became of it; whether this worker ends with it."""
    from pushplan.evaluation.run.execute import execute

    try:
        if setup.trace_after_s is not None:
            faulthandler.dump_traceback_later(setup.trace_after_s)
        try:
            if b"__main__" in payload and setup.main is not None:
                _import_main(setup.main)
            job, settings = pickle.loads(payload)
        except (AttributeError, ImportError) as error:
            text = (
                f"a worker process cannot load what it was sent ({error}): define it at the top "
                "level of a file, name it as 'file.py:Class', or use workers=0"
            )
            channel.send({"kind": "refused", "text": text})
            return False
        except InvalidInputError as error:
            channel.send({"kind": "refused", "text": str(error)})
            return False
        channel.send({"kind": "running"})
        result = execute(job, settings)
        row, traced = asdict(result.row), result.trace is not None
        header = {"kind": "result", "row": row, "traced": traced, "detail": result.detail}
        channel.send(header, result.trace or b"")
        return result.tainted
    except InvalidInputError as error:  # `execute` lets through what is no policy's fault
        channel.send({"kind": "refused", "text": str(error)})
    except MemoryError:
        channel.send({"kind": "out of memory"})
    except BaseException as error:
        channel.send({"kind": "error", "text": describe(error)})
    finally:
        faulthandler.cancel_dump_traceback_later()
    return True


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
