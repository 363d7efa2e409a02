"""An ONNX Runtime session with one thread and a bound on its memory."""

from __future__ import annotations

import functools
import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.imports.on_demand import need
from pushplan.learned.onnx_guard import NotOnnxError

GREATEST_MEMORY = 256 * 2**20
"""Bytes that all networks of a process may use for weights and values together."""
LONGEST_DECISION_S = 10.0
"""After that much time of one decision the network is told to stop [s]."""
FATAL = 4
"""Severity from which on ONNX Runtime writes to standard error: what it raises is not written."""
BY_WHAT_IS_ASKED = 1
"""Growth of memory by what is asked for; its default, to the next power of two, meets the bound
with half of it unused."""


NOISE = "noise"
"""Name of the input for random numbers, of a network that samples its output."""


class Door(NamedTuple):
    """Input or output of a network."""

    name: str  # of the tensor
    type: str  # as ONNX Runtime writes it, such as ``tensor(float)``
    shape: tuple[Any, ...]  # numbers; texts where the size is open


class Network:
    """A model whose file has been checked, ready to run.

    Raises:
        NotOnnxError: if ONNX Runtime does not take it, or it has more inputs than an observation
            and ``noise``, or several outputs.
        MissingDependencyError: without onnxruntime.
    """

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._runtime = _runtime()
        options = self._runtime.SessionOptions()
        # sums depend on the number of threads, and worker processes have a core each
        options.intra_op_num_threads = 1
        options.inter_op_num_threads = 1
        options.log_severity_level = FATAL
        options.add_session_config_entry("session.use_env_allocators", "1")
        try:
            self._session = self._runtime.InferenceSession(
                data,
                options,
                providers=["CPUExecutionProvider"],
                # at load time it would compute with memory that is not bounded
                disabled_optimizers=["ConstantFolding"],
                enable_fallback=False,  # it prints, and tries the same again
            )
            inputs, outputs = (
                [Door(door.name, door.type, tuple(door.shape or ())) for door in doors]
                for doors in (self._session.get_inputs(), self._session.get_outputs())
            )
        except Exception as error:  # its errors share no root of their own; names may be no text
            raise NotOnnxError(f"ONNX Runtime does not take it: {_short(error)}") from error
        doors = {door.name: door for door in inputs}
        self.noise = doors.pop(NOISE, None)
        if len(doors) != 1 or len(outputs) != 1:
            raise NotOnnxError(
                f"a policy has one input and one output beside an input {NOISE!r}, this one has "
                f"{len(doors)} and {len(outputs)}"
            )
        (self.input,) = doors.values()
        (self.output,) = outputs

    def __reduce__(self) -> tuple[type[Network], tuple[bytes]]:
        """A copy has a session of its own."""
        return Network, (self._data,)

    def run(
        self, seen: NDArray[Any], noise: NDArray[np.float32] | None = None, *, timed: bool = False
    ) -> NDArray[Any]:
        """The output for one observation.

        Args:
            seen: the observation, without batch axis.
            noise: for the input ``noise``, where the network has one.
            timed: stop it after `LONGEST_DECISION_S`; a network that has kept it once
                need not be watched.

        Raises:
            NotOnnxError: if it fails, also for want of memory or time, or gives no batch.
        """
        fed = {self.input.name: seen[None]}
        if noise is not None:
            fed[NOISE] = noise[None]
        limits = self._runtime.RunOptions()
        limits.log_severity_level = FATAL
        timer = None
        if timed:  # a timer is a thread, which costs more than most decisions
            timer = threading.Timer(LONGEST_DECISION_S, setattr, (limits, "terminate", True))
            timer.daemon = True
            timer.start()
        try:
            output = np.asarray(self._session.run(None, fed, limits)[0])
        except Exception as error:
            if limits.terminate:
                raise NotOnnxError(
                    f"the network takes more than {LONGEST_DECISION_S:g} s for a decision"
                ) from None
            raise NotOnnxError(f"the network cannot be run: {_short(error)}") from error
        finally:
            if timer is not None:
                timer.cancel()
        if output.ndim == 0 or len(output) != 1:
            raise NotOnnxError(
                f"the network must keep the batch axis, it gave shape {output.shape}"
            )
        only: NDArray[Any] = output[0]
        return only


@functools.lru_cache(maxsize=1)
def _runtime() -> Any:
    """The library, with one allocator that stops at `GREATEST_MEMORY`."""
    onnxruntime = need("onnxruntime")
    where = onnxruntime.OrtMemoryInfo(
        "Cpu", onnxruntime.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, onnxruntime.OrtMemType.DEFAULT
    )
    bound = onnxruntime.OrtArenaCfg(
        {"max_mem": GREATEST_MEMORY, "arena_extend_strategy": BY_WHAT_IS_ASKED}
    )
    onnxruntime.create_and_register_allocator(where, bound)
    return onnxruntime


def _short(error: BaseException) -> str:
    return " ".join(str(error).split())[:200]
