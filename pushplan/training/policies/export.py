"""Networks as ONNX files that say what they are."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from timeit import timeit
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.imports.on_demand import need
from pushplan.learned import OnnxPolicy, Specification
from pushplan.learned.onnx_policy import NOISE
from pushplan.learned.specification import METADATA_KEY
from pushplan.training.libraries import write_onnx
from pushplan.training.policies.environment import TrainingEnv
from pushplan.world import InvalidInputError

PARITY = 1e-4
"""Greatest difference between PyTorch and ONNX Runtime, relative to the greatest output."""


def export(network: Any, specification: Specification, path: str | Path) -> Path:
    """Write a network with its specification, and check that it gives the same.

    Args:
        network: a PyTorch module from a batch of observations, as they are observed, to a batch
            of outputs. If it has ``noise``, a shape, then it also takes a batch of such noise.
        specification: what is said about it in the file.
        path: the ``.onnx`` file.

    Raises:
        InvalidInputError: if ONNX Runtime gives something else than PyTorch.
        MissingDependencyError: without PyTorch or onnx.
    """
    torch = need("torch")
    onnx = need("onnx")
    path = Path(path)
    network = network.to("cpu").eval()
    inputs = tuple(map(torch.from_numpy, _inputs(network, specification, 2)))
    names = ("observation", NOISE)[: len(inputs)]
    write_onnx(network, inputs, path, (*names, "output"))
    model = onnx.load(str(path))
    del model.metadata_props[:]
    entry = model.metadata_props.add()
    entry.key = METADATA_KEY
    entry.value = specification.to_json()
    model.producer_version = ""
    onnx.save(model, str(path))
    policy = OnnxPolicy(path)
    batch = _inputs(network, specification, 16)
    with torch.no_grad():
        wanted = network(*map(torch.from_numpy, batch)).numpy()
    found = np.stack([policy.decide(*one) for one in zip(*batch, strict=True)])
    off = float(np.abs(found - wanted).max()) / max(1.0, float(np.abs(wanted).max()))
    if off > PARITY:
        raise InvalidInputError(f"{path} differs from the network by {off:.2g} (limit {PARITY:g})")
    return path


def decision_time(path: Path, count: int = 200) -> float:
    """Median time of a decision of the network in a file, without the observation [s]."""
    policy = OnnxPolicy(path)
    seen = examples(policy.specification, count)
    return float(np.median([timeit(partial(policy.decide, one), number=1) for one in seen]))


def observation_time(env: TrainingEnv, count: int = 50) -> float:
    """Median time of an observation in validation episodes with random actions [s]."""
    env.action_space.seed(0)
    times: list[float] = []
    over = True
    while len(times) < count:
        if over:
            env.reset(options={"layout": len(times)})
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        times.append(timeit(env.observe, number=1))
        over = terminated or truncated
    return float(np.median(times))


def _inputs(network: Any, specification: Specification, count: int) -> tuple[NDArray[Any], ...]:
    """Random batches of all that a network takes."""
    seen = examples(specification, count)
    if (shape := getattr(network, "noise", None)) is None:
        return (seen,)
    rng = np.random.default_rng(1)
    return seen, rng.standard_normal((count, *shape), dtype=np.float32)


def examples(specification: Specification, count: int) -> NDArray[Any]:
    """Random observations of the right shape and type."""
    rng = np.random.default_rng(0)
    shape = (count, *specification.observation.shape)
    if specification.observation.dtype == np.uint8:
        return rng.integers(0, 256, shape, dtype=np.uint8)
    return rng.uniform(-1.0, 1.0, shape).astype(np.float32)
