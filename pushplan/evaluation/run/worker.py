"""The loop of a worker process of `pushplan.evaluation.run.pool`."""

from __future__ import annotations

import base64
import contextlib
import ctypes
import faulthandler
import importlib
import json
import os
import pickle
import runpy
import signal
import socket
import sys
import types
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from io import BufferedRWPair
from typing import Any

from pushplan.errors import describe
from pushplan.evaluation.run.job_limits import limit_memory
from pushplan.imports.named_objects import fresh_modules
from pushplan.world import InvalidInputError

_DIE_WITH_OWNER = 1  # PR_SET_PDEATHSIG of Linux, however the owner ends
_ADOPT_ORPHANS = 36  # PR_SET_CHILD_SUBREAPER: what a policy leaves behind can still be found


@dataclass(frozen=True)
class WorkerSetup:
    """Settings that a worker gets before its first call."""

    main: str | None  # file of the owner's ``__main__`` module, for what is defined there
    preload: Sequence[str]  # modules to import before the first call, so that no call pays for it
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
    line = socket.socket(fileno=descriptor)
    with contextlib.suppress(OSError, ValueError), line, line.makefile("rwb") as lines:
        setup = WorkerSetup(**json.loads(lines.readline()))
        for name in setup.preload:
            with contextlib.suppress(ImportError):  # a job that needs it will say so
                importlib.import_module(name)
        limit_memory(setup.memory_limit_mb)
        _say(lines, kind="ready")
        last = False
        while not last and (text := lines.readline()):
            last = _answer(lines, base64.b64decode(json.loads(text)), setup)
            for stream in (sys.stdout, sys.stderr):
                with contextlib.suppress(OSError):
                    stream.flush()


def _say(lines: BufferedRWPair, **message: Any) -> None:
    """Send one message to the owner: a line of JSON, nothing that could run there."""
    lines.write(json.dumps(message).encode() + b"\n")
    lines.flush()


def _answer(lines: BufferedRWPair, payload: bytes, setup: WorkerSetup) -> bool:
    """Run a job and send what became of it; whether this worker ends with it."""
    from pushplan.evaluation.run.execute import execute

    try:
        if setup.trace_after_s is not None:
            faulthandler.dump_traceback_later(setup.trace_after_s)
        try:
            with fresh_modules():
                if b"__main__" in payload and setup.main is not None:
                    _import_main(setup.main)
                job, settings = pickle.loads(payload)
        except (AttributeError, ImportError) as error:
            text = (
                f"a worker process cannot load what it was sent ({error}): define it at the top "
                "level of a file, name it as 'file.py:Class', or use workers=0"
            )
            _say(lines, kind="refused", text=text)
            return False
        except InvalidInputError as error:
            _say(lines, kind="refused", text=str(error))
            return False
        _say(lines, kind="running")
        result = execute(job, settings)
        trace = None
        if result.trace is not None:
            trace = base64.b64encode(result.trace).decode()
        said = {**vars(result), "row": asdict(result.row), "trace": trace}
        _say(lines, kind="result", **said)
        return result.tainted
    except InvalidInputError as error:  # `execute` lets through what is no policy's fault
        _say(lines, kind="refused", text=str(error))
    except MemoryError:
        _say(lines, kind="out of memory")
    except BaseException as error:
        _say(lines, kind="error", text=describe(error))
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
