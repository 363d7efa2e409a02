"""Weights to begin a training with, from a network that was exported before."""

from __future__ import annotations

from typing import Any

from pushplan.imports.on_demand import need
from pushplan.learned.loading import learned_file, learned_names, weights_of
from pushplan.learned.onnx_guard import inspect
from pushplan.world import InvalidInputError


def load_weights(network: Any, source: str) -> None:
    """Give a PyTorch module the weights of an ONNX file that was exported from one like it.

    Raises:
        InvalidInputError: if there is no such file, or its weights are not those of such a module.
    """
    found = _read(source)
    wanted = {name: tuple(entry.shape) for name, entry in network.state_dict().items()}
    for name in dict.fromkeys((*wanted, *found)):
        there = tuple(found[name].shape) if name in found else "missing"
        if there != wanted.get(name):
            raise InvalidInputError(
                f"start {source!r} does not fit the network to be trained: {name} is {there} "
                f"there and {wanted.get(name, 'missing')} here"
            )
    network.load_state_dict(found)


def _read(source: str) -> dict[str, Any]:
    """The weights by name, as tensors; looked through as any policy's file."""
    onnx, torch = need("onnx"), need("torch")
    if source in learned_names():
        path = weights_of(source)
    else:
        try:
            path = learned_file(source if source.startswith("onnx:") else f"onnx:{source}")
        except InvalidInputError as error:
            names = ", ".join(learned_names())
            raise InvalidInputError(f"start: {error}, nor is it one of {names}") from error
    data = path.read_bytes()
    try:
        inspect(data)
        graph = onnx.load_model_from_string(data).graph
        found = {
            entry.name: torch.from_numpy(onnx.numpy_helper.to_array(entry).copy())
            for entry in graph.initializer
        }
    except Exception as error:  # protobuf has errors of its own
        raise InvalidInputError(f"start {source!r} cannot be read: {error}") from error
    weights = {name: entry for name, entry in found.items() if name.endswith(("weight", "bias"))}
    if not all(bool(torch.isfinite(entry).all()) for entry in weights.values()):
        raise InvalidInputError(f"start {source!r} holds weights that are not finite")
    return weights
