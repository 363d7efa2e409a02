"""`OnnxPolicy`: a network in an ONNX file."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.learned.network_policy import NetworkPolicy
from pushplan.learned.onnx_guard import GREATEST_FILE, NotOnnxError, inspect
from pushplan.learned.onnx_session import Door, Network
from pushplan.learned.specification import METADATA_KEY, Specification
from pushplan.world import InvalidInputError, World

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
            data = _read(self.path)
            contents = inspect(data)
            if METADATA_KEY not in contents.metadata:
                raise NotOnnxError(
                    f"it has no specification (metadata {METADATA_KEY!r}): see "
                    "pushplan.training.policies.export, or docs/learned.md"
                )
            specification = Specification.from_json(contents.metadata[METADATA_KEY])
            self._network = Network(data)
            _check_doors(self._network, specification)
            self._rng = np.random.default_rng(0)
            blank = np.zeros(specification.observation.shape, specification.observation.dtype)
            specification.action.read(_first(self._network.run(blank[None], self._noise())))
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
        given = self._noise() if noise is None else noise[None]
        return _first(self._network.run_fast(seen[None], given))

    def _noise(self) -> NDArray[np.float32] | None:
        """(1, N) fresh noise for a network that takes it."""
        if self._network.noise is None:
            return None
        return self._rng.standard_normal((1, self._network.noise.shape[1]), dtype=np.float32)


def read_specification(path: str | Path) -> Specification:
    """The specification in a file, without running anything.

    Raises:
        InvalidInputError: if there is none.
    """
    try:
        metadata = inspect(_read(Path(path))).metadata
        return Specification.from_json(metadata.get(METADATA_KEY, ""))
    except InvalidInputError as error:
        raise InvalidInputError(f"{path} is no policy: {error}") from error


def _read(path: Path) -> bytes:
    if not path.is_file():
        raise NotOnnxError("there is no such file")
    with path.open("rb") as file:
        return file.read(GREATEST_FILE + 1)


def _first(output: NDArray[Any]) -> NDArray[Any]:
    if output.ndim == 0 or len(output) != 1:
        raise NotOnnxError(f"the network must keep the batch axis, it gave shape {output.shape}")
    only: NDArray[Any] = output[0]
    return only


def _check_doors(network: Network, specification: Specification) -> None:
    """The network takes what is observed and gives what is acted on."""
    if network.noise is not None:
        _check_noise(network.noise)
    for door, shape, types in (
        (network.input, specification.observation.shape, (specification.observation.dtype.name,)),
        (network.output, specification.action.shape, ("float32",)),
    ):
        found = list(door.shape)
        fits = len(found) == len(shape) + 1 and all(
            not isinstance(has, int) or has == want
            for has, want in zip(found[1:], shape, strict=False)
        )
        if found and isinstance(found[0], int) and found[0] != 1:
            fits = False
        if not fits or _TYPES.get(door.type) not in types:
            raise NotOnnxError(
                f"{door.name!r:.40} must be {types[0]} of shape (batch, "
                f"{', '.join(map(str, shape))}) by its specification, it is {door.type} of shape "
                f"{tuple(found)}"
            )


def _check_noise(door: Door) -> None:
    batch, *sizes = door.shape or (0,)
    small = len(sizes) == 1 and isinstance(sizes[0], int) and 1 <= sizes[0] <= _MOST_NOISE
    if door.type != "tensor(float)" or not small or (isinstance(batch, int) and batch != 1):
        raise NotOnnxError(
            f"{door.name!r} must be float32 of shape (batch, N), N from 1 to {_MOST_NOISE}, it is "
            f"{door.type} of shape {door.shape}"
        )
