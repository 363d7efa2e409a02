"""Networks as ONNX files that say what they are."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.learned import OnnxPolicy, Specification
from pushplan.learned.onnx_session import NOISE
from pushplan.learned.specification import METADATA_KEY
from pushplan.training.libraries import write_onnx
from pushplan.training.policies.config import TrainingConfig
from pushplan.training.policies.environment import TrainingEnv
from pushplan.world import InvalidInputError
from pushplan.world.libraries import need

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
    torch, onnx = need("torch"), need("onnx")
    path = Path(path)
    network = network.to("cpu").eval()
    inputs = tuple(map(torch.from_numpy, _inputs(network, specification, 2)))
    names = ("observation", NOISE)[: len(inputs)]
    write_onnx(network, inputs, path, (*names, "output"))
    model = onnx.load(str(path))
    del model.metadata_props[:]
    entry = model.metadata_props.add()
    entry.key, entry.value = METADATA_KEY, specification.to_json()
    model.producer_version = ""
    onnx.save(model, str(path))
    if (off := difference(network, path, specification)) > PARITY:
        raise InvalidInputError(f"{path} differs from the network by {off:.2g} (limit {PARITY:g})")
    return path


def difference(network: Any, path: Path, specification: Specification, count: int = 16) -> float:
    """Greatest difference of outputs between PyTorch and the file, relative to the greatest."""
    torch = need("torch")
    policy = OnnxPolicy(path)
    inputs = _inputs(network, specification, count)
    with torch.no_grad():
        wanted = network(*map(torch.from_numpy, inputs)).numpy()
    found = np.stack([policy.decide(*one) for one in zip(*inputs, strict=True)])
    scale = max(1.0, float(np.abs(wanted).max()))
    return float(np.abs(found - wanted).max()) / scale


def decision_time(path: Path, count: int = 200) -> float:
    """Median time of a decision of the network in a file, without the observation [s]."""
    policy = OnnxPolicy(path)
    times = []
    for seen in examples(policy.specification, count):
        began = time.perf_counter()
        policy.decide(seen)
        times.append(time.perf_counter() - began)
    return float(np.median(times))


def observation_time(config: TrainingConfig, count: int = 50) -> float:
    """Median time of an observation in validation episodes with random actions [s]."""
    env = TrainingEnv(config)
    env.action_space.seed(0)
    times: list[float] = []
    env.reset(options={"layout": 0})
    while len(times) < count:
        *_, terminated, truncated, _ = env.step(env.action_space.sample())
        began = time.perf_counter()
        env.observe()
        times.append(time.perf_counter() - began)
        if terminated or truncated:
            env.reset(options={"layout": len(times)})
    env.close()
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
