"""`OnnxPolicy`: a network in an ONNX file."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.learned.network_policy import NetworkPolicy
from pushplan.learned.onnx_guard import GREATEST_FILE, NotOnnxError, inspect
from pushplan.learned.onnx_session import Network
from pushplan.learned.specification import METADATA_KEY, Specification
from pushplan.world import InvalidInputError

_TYPES = {"tensor(float)": "float32", "tensor(uint8)": "uint8"}


class OnnxPolicy(NetworkPolicy):
    """Runs a network on ONNX Runtime, in one thread; the same observation, the same action.

    The file has one input, a batch of observations as the specification says (uint8 images 0 to
    255, float32 vectors), and one output (batch, ...). What normalises observations is part of
    the network. The specification is JSON in the model's metadata, under the key ``pushplan``.

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
            blank = np.zeros(specification.observation.shape, specification.observation.dtype)
            specification.action.read(_first(self._network.run(blank[None])))
        except InvalidInputError as error:
            raise InvalidInputError(f"{self.path} is no policy: {error}") from error
        self.sha256 = hashlib.sha256(data).hexdigest()
        super().__init__(self.decide, specification, label)

    def decide(self, seen: NDArray[Any]) -> NDArray[Any]:
        """The output of the network for one observation."""
        return _first(self._network.run_fast(seen[None]))


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
