"""Optional libraries, imported when they are needed, with one clear error where they are not."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

from pushplan.imports.on_demand import need
from pushplan.world import InvalidInputError

OPSET = 17
"""Of the ONNX files that are written."""


def chosen_device(name: str) -> str:
    """A device of PyTorch by name, ``"auto"`` for a GPU where there is one.

    Raises:
        InvalidInputError: if it is not there.
    """
    torch = need("torch")
    has_gpu = bool(torch.cuda.is_available())
    if name == "auto":
        return "cuda" if has_gpu else "cpu"
    if name != "cpu" and not name.startswith("cuda"):
        raise InvalidInputError(f"device must be auto, cpu or cuda, got {name!r}")
    if name != "cpu" and not has_gpu:
        raise InvalidInputError(f"device {name!r}: PyTorch sees no GPU here, use cpu")
    return name


def hardware(device: str) -> str:
    """The machine in words, for model cards; nothing that names it."""
    import os
    import platform

    torch = need("torch")
    words = f"{os.cpu_count()}-core {platform.machine()} machine"
    if device == "cpu":
        return words
    return f"{words}, {torch.cuda.get_device_name()}"


def parameter_count(network: Any) -> int:
    """Count the learned parameters of a PyTorch module."""
    return sum(p.numel() for p in network.parameters())


def write_onnx(network: Any, example: Any, path: str | Path, names: tuple[str, ...]) -> None:
    """Write a PyTorch module as ONNX for any batch size; PyTorch is not needed to run it.

    Args:
        network: the module.
        example: a batch that it takes, or a tuple of them.
        path: the ``.onnx`` file; its folder is made if it is not there.
        names: of its inputs, then of its outputs.
    """
    inputs = example if isinstance(example, tuple) else (example,)
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    with warnings.catch_warnings():
        # the exporter that needs no further package; it is marked as old
        warnings.simplefilter("ignore")
        need("torch").onnx.export(
            network,
            inputs,
            str(path),
            input_names=list(names[: len(inputs)]),
            output_names=list(names[len(inputs) :]),
            dynamic_axes={name: {0: "batch"} for name in names},
            opset_version=OPSET,
            dynamo=False,
        )
