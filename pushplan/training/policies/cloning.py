"""Imitation: a small network that does what a data set shows, by regression or as a flow."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.training.policies.config import TrainingConfig
from pushplan.training.policies.demonstrations import Demonstrations, demonstrations
from pushplan.training.policies.environment import TrainingEnv
from pushplan.training.policies.options import BcOptions, FlowOptions
from pushplan.training.policies.run import Learned, TrainingRun, Until, train_chunks
from pushplan.training.policies.sb3_training import chunk_seed
from pushplan.world.libraries import need

log = logging.getLogger(__name__)

_LEAST_RATE = 0.01


def train_imitation(
    run: TrainingRun,
    data: Sequence[str | Path],
    *,
    device: str = "cpu",
    until: Until | None = None,
) -> Any:
    """Fit a network to data sets; ``steps`` and ``chunk`` count the pairs that are shown.

    Returns:
        The network with the weights of the best chunk.
    """
    config, torch = run.config, need("torch")
    options = config.options
    assert isinstance(options, BcOptions)
    train, test = demonstrations(config, data, options.held_out)
    env = TrainingEnv(config)
    torch.manual_seed(chunk_seed(config.seed, 0))
    network = _network(config, env).to(device)
    optimizer = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=options.decay)
    state = run.load()
    if state is not None:
        network.load_state_dict(state["weights"])
        optimizer.load_state_dict(state["optimizer"])

    def learn(chunk: int) -> Learned:
        _fit(network, optimizer, train, config, chunk, device)
        steps = min((chunk + 1) * config.chunk, config.steps)
        return Learned(steps, _error(network, test, device))

    def decide(seen: NDArray[Any]) -> NDArray[Any]:
        return _decide(network, seen, device)

    def state_now() -> dict[str, Any]:
        return {"weights": network.state_dict(), "optimizer": optimizer.state_dict()}

    for point in train_chunks(run, env, until, learn=learn, decide=decide, state=state_now):
        log.info(
            "%d of %d pairs, %.0f s: error %.4f held out, success %.2f in validation",
            *(point.steps, config.steps, point.seconds, point.loss, point.valid_success),
        )
    env.close()
    if run.done:
        network.load_state_dict(run.best_weights())
    return network


def _network(config: TrainingConfig, env: TrainingEnv) -> Any:
    options, shape = config.options, env.observation_space.shape
    if isinstance(options, FlowOptions):
        from pushplan.training.policies.flow_network import FlowPolicy

        return FlowPolicy(shape, options.widths, env.action.shape, options.euler)
    from pushplan.training.policies.networks import DirectPolicy

    assert isinstance(options, BcOptions)
    return DirectPolicy(shape, options.widths, env.action.shape[0])


def _fit(
    network: Any,
    optimizer: Any,
    pairs: Demonstrations,
    config: TrainingConfig,
    chunk: int,
    device: str,
) -> None:
    torch, options = need("torch"), config.options
    assert isinstance(options, BcOptions)
    seed = chunk_seed(config.seed, chunk)
    rng = np.random.default_rng(seed)
    torch.manual_seed(seed)
    network.train()
    size = min(config.chunk, config.steps - chunk * config.chunk)
    for shown in range(0, size, options.batch):
        fraction = (chunk * config.chunk + shown) / config.steps
        rate = options.rate * max(_LEAST_RATE, 0.5 * (1.0 + np.cos(np.pi * fraction)))
        for group in optimizer.param_groups:
            group["lr"] = float(rate)
        chosen = rng.integers(len(pairs), size=options.batch)
        loss = network.loss(*(torch.from_numpy(values[chosen]).to(device) for values in pairs))
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        optimizer.step()


def _decide(network: Any, seen: NDArray[Any], device: str) -> NDArray[Any]:
    torch = need("torch")
    with torch.no_grad():
        decided: NDArray[Any] = network(torch.from_numpy(seen[None]).to(device))[0].cpu().numpy()
    return decided


def _error(network: Any, pairs: Demonstrations, device: str) -> float:
    """Root mean squared error of the outputs that count."""
    torch = need("torch")
    total, count = 0.0, 0.0
    network.eval()
    with torch.no_grad():
        for i in range(0, len(pairs), 1024):
            seen, wanted, counted = (torch.from_numpy(v[i : i + 1024]).to(device) for v in pairs)
            squares = ((network(seen) - wanted) ** 2).mean(dim=-1)  # (B,) or (B, horizon)
            counted = counted.reshape(squares.shape)
            total += float((squares * counted).sum())
            count += float(counted.sum())
    return float(np.sqrt(total / max(count, 1.0)))
