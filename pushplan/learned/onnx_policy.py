"""`OnnxPolicy`: a network in an ONNX file, on a session with one thread and bounded memory."""

from __future__ import annotations

import functools
import hashlib
import threading
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.files.safe_files import name_unused
from pushplan.imports.on_demand import need
from pushplan.learned.network_policy import NetworkPolicy
from pushplan.learned.onnx_guard import GREATEST_FILE, NotOnnxError, inspect
from pushplan.learned.specification import METADATA_KEY, Specification
from pushplan.world import InvalidInputError, World

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
_MOST_NOISE = 4096
_TYPES = {"tensor(float)": "float32", "tensor(uint8)": "uint8"}


class OnnxPolicy(NetworkPolicy):
    """Runs a network on ONNX Runtime, in one thread.

    The file has one input, a batch of observations as the specification says (uint8 images 0 to
    255, float32 vectors), and one output (batch, ...); the same observation gives the same action.
    A network that samples has an input ``noise`` too, float32 (batch, N): each decision gets
    Gaussian numbers of the episode's generator, so the same episode is the same again. What
    normalises observations is part of the network. The specification is JSON in the model's
    metadata, under the key ``pushplan``.

    Args:
        path: an ``.onnx`` file.
        label: what errors call it; the file's name by default.

    Raises:
        InvalidInputError: if the file is no such network. Nothing of it has been run then, or a
            single decision for an observation of zeros.
        MissingDependencyError: without onnxruntime.
    """

    def __init__(self, path: str | Path, label: str | None = None) -> None:
        self.path = Path(path)
        label = self.path.stem if label is None else label
        try:
            data, specification = _read(self.path)
            self._network = Network(data)
            _check_doors(self._network, specification)
            self._rng = np.random.default_rng(0)
            blank = np.zeros(specification.observation.shape, specification.observation.dtype)
            specification.action.steps(self._network.run(blank, self._noise(), timed=True))
        except InvalidInputError as error:
            raise InvalidInputError(f"{self.path} is no policy: {error}") from error
        self.sha256 = hashlib.sha256(data).hexdigest()
        super().__init__(self.decide, specification, label)

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode; ``rng`` makes the noise of the next."""
        super().reset(world, rng)
        self._rng = rng

    def decide(self, seen: NDArray[Any], noise: NDArray[np.float32] | None = None) -> NDArray[Any]:
        """The output of the network for one observation.

        Args:
            seen: the observation.
            noise: (N,) for a network that takes noise; drawn if None.
        """
        return self._network.run(seen, self._noise() if noise is None else noise)

    def _noise(self) -> NDArray[np.float32] | None:
        """(N,) fresh noise for a network that takes it."""
        if self._network.noise is None:
            return None
        (size,) = self._network.noise.shape[1:]
        noise: NDArray[np.float32] = self._rng.standard_normal(size, dtype=np.float32)
        return noise


def read_specification(path: str | Path) -> Specification:
    """The specification in a file, without running anything.

    Raises:
        InvalidInputError: if there is none.
    """
    try:
        return _read(Path(path))[1]
    except InvalidInputError as error:
        raise InvalidInputError(f"{path} is no policy: {error}") from error


def _read(path: Path) -> tuple[bytes, Specification]:
    """The content of a file, looked through, and its specification."""
    if not path.is_file():
        raise NotOnnxError("there is no such file")
    with path.open("rb") as file:
        data = file.read(GREATEST_FILE + 1)
    metadata = inspect(data)
    if METADATA_KEY not in metadata:
        raise NotOnnxError(
            f"it has no specification (metadata {METADATA_KEY!r}): see "
            "pushplan.training.policies.export, or docs/learned.md"
        )
    name_unused(f"metadata of {path}", metadata.keys() - {METADATA_KEY})
    return data, Specification.from_json(metadata[METADATA_KEY])


def _check_doors(network: Network, specification: Specification) -> None:
    """The network takes what is observed and gives what is acted on."""
    if network.noise is not None:
        sizes = network.noise.shape[1:]
        small = len(sizes) == 1 and isinstance(sizes[0], int) and 1 <= sizes[0] <= _MOST_NOISE
        wanted = f"float32 of shape (batch, N), N from 1 to {_MOST_NOISE}"
        _check_door(network.noise, small, "float32", wanted)
    seen = specification.observation
    for door, shape, kind in (
        (network.input, seen.shape, seen.dtype.name),
        (network.output, specification.action.shape, "float32"),
    ):
        fits = len(door.shape) == len(shape) + 1 and all(
            has == want or not isinstance(has, int)
            for has, want in zip(door.shape[1:], shape, strict=False)
        )
        wanted = f"{kind} of shape (batch, {', '.join(map(str, shape))}) by its specification"
        _check_door(door, fits, kind, wanted)


def _check_door(door: Door, fits: bool, kind: str, wanted: str) -> None:
    """Refuse an input or output of another type or shape, or of batches of a fixed size."""
    batch = door.shape[0] if door.shape else 0
    if not fits or _TYPES.get(door.type) != kind or (isinstance(batch, int) and batch != 1):
        raise NotOnnxError(
            f"{door.name!r:.40} must be {wanted}, it is {door.type} of shape {door.shape}"
        )


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
