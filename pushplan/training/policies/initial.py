"""Weights to begin a training with, from a network that was exported before."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pushplan.learned.shipped import learned_names, weights_of
from pushplan.training.policies.libraries import need
from pushplan.world import InvalidInputError


def load_weights(network: Any, source: str) -> None:
    """Give a PyTorch module the weights of an ONNX file that was exported from one like it.

    Args:
        network: the module.
        source: name of a shipped policy, or a file.

    Raises:
        InvalidInputError: if there is no such file, or its weights are not those of such a module.
    """
    onnx, torch = need("onnx"), need("torch")
    path = weights_of(source) if source in learned_names() else Path(source)
    if not path.is_file():
        names = ", ".join(learned_names())
        raise InvalidInputError(f"start {source!r} is no file and none of the policies {names}")
    try:
        model = onnx.load(str(path), load_external_data=False)
        found = {
            entry.name: torch.from_numpy(onnx.numpy_helper.to_array(entry).copy())
            for entry in model.graph.initializer
        }
    except Exception as error:  # protobuf has errors of its own
        raise InvalidInputError(f"start {source!r} is no ONNX file: {error}") from error
    for name, weights in network.state_dict().items():
        shape = tuple(found[name].shape) if name in found else None
        if shape != tuple(weights.shape):
            raise InvalidInputError(
                f"start {source!r} does not fit: its {name} has shape {shape}, that of the network "
                f"to be trained {tuple(weights.shape)}"
            )
    network.load_state_dict({name: found[name] for name in network.state_dict()})
