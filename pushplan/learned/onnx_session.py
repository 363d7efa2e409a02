"""An ONNX Runtime session with one thread and a bound on its memory."""

from __future__ import annotations

import functools
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.learned.onnx_guard import NotOnnxError
from pushplan.world.libraries import need

GREATEST_MEMORY = 256 * 2**20
"""Bytes that all networks of a process may use for weights and values together."""
LONGEST_DECISION_S = 10.0
"""After that much time of one decision the network is told to stop [s]."""


NOISE = "noise"
"""Name of the input for random numbers, of a network that samples its output."""


@dataclass(frozen=True)
class Door:
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
        self._runtime = _runtime()
        options = self._runtime.SessionOptions()
        options.intra_op_num_threads = 1
        options.inter_op_num_threads = 1
        options.log_severity_level = 4
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
        except Exception as error:  # its errors share no root of their own
            raise NotOnnxError(f"ONNX Runtime does not take it: {_short(error)}") from error
        noise = [door for door in inputs if door.name == NOISE]
        inputs = [door for door in inputs if door.name != NOISE]
        if len(inputs) != 1 or len(outputs) != 1:
            raise NotOnnxError(
                f"a policy has one input and one output beside an input {NOISE!r}, this one has "
                f"{len(inputs)} and {len(outputs)}"
            )
        self.input, self.output = inputs[0], outputs[0]
        self.noise = noise[0] if noise else None

    def run(self, batch: NDArray[Any], noise: NDArray[np.float32] | None = None) -> NDArray[Any]:
        """The output for a batch.

        Args:
            batch: of observations.
            noise: a batch for the input ``noise``, where the network has one.

        Raises:
            NotOnnxError: if it fails, also for want of memory or time.
        """
        limits = self._runtime.RunOptions()
        limits.log_severity_level = 4
        over = threading.Event()

        def stop() -> None:
            over.set()
            limits.terminate = True

        timer = threading.Timer(LONGEST_DECISION_S, stop)
        timer.daemon = True
        timer.start()
        try:
            result: NDArray[Any] = self._session.run(None, self._fed(batch, noise), limits)[0]
        except Exception as error:
            if over.is_set():
                raise NotOnnxError(
                    f"the network takes more than {LONGEST_DECISION_S:g} s for a decision"
                ) from None
            raise NotOnnxError(f"the network cannot be run: {_short(error)}") from error
        finally:
            timer.cancel()
        return np.asarray(result)

    def run_fast(
        self, batch: NDArray[Any], noise: NDArray[np.float32] | None = None
    ) -> NDArray[Any]:
        """`run` without a limit of time, for a network that has kept it."""
        try:
            result: NDArray[Any] = self._session.run(None, self._fed(batch, noise))[0]
        except Exception as error:
            raise NotOnnxError(f"the network cannot be run: {_short(error)}") from error
        return result

    def _fed(
        self, batch: NDArray[Any], noise: NDArray[np.float32] | None
    ) -> dict[str, NDArray[Any]]:
        return {self.input.name: batch} | ({} if noise is None else {NOISE: noise})


@functools.lru_cache(maxsize=1)
def _runtime() -> Any:
    """The library, with one allocator that stops at `GREATEST_MEMORY`."""
    onnxruntime = need("onnxruntime")
    where = onnxruntime.OrtMemoryInfo(
        "Cpu", onnxruntime.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, onnxruntime.OrtMemType.DEFAULT
    )
    bound = onnxruntime.OrtArenaCfg({"max_mem": GREATEST_MEMORY, "arena_extend_strategy": 1})
    onnxruntime.create_and_register_allocator(where, bound)
    return onnxruntime


def _short(error: BaseException) -> str:
    return " ".join(str(error).split())[:200]
