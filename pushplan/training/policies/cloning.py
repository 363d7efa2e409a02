"""Behaviour cloning: a small network that does what a data set shows."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.training.policies.config import TrainingConfig
from pushplan.training.policies.dataset import episodes, read_metadata
from pushplan.training.policies.environment import TrainingEnv
from pushplan.training.policies.options import BcOptions
from pushplan.training.policies.run import Learned, TrainingRun, Until, train_chunks
from pushplan.training.policies.sb3_training import chunk_seed
from pushplan.world import InvalidInputError
from pushplan.world.libraries import need

log = logging.getLogger(__name__)

_LEAST_RATE = 0.01


def train_bc(
    run: TrainingRun,
    data: str | Path,
    *,
    device: str = "cpu",
    until: Until | None = None,
) -> Any:
    """Fit a network to a data set; ``steps`` and ``chunk`` count the pairs that are shown.

    Returns:
        The network with the weights of the best chunk.
    """
    from pushplan.training.policies.networks import DirectPolicy

    config, torch = run.config, need("torch")
    options = config.options
    assert isinstance(options, BcOptions)
    check_dataset(config, data)
    env = TrainingEnv(config)
    train, test = _pairs(config, data, options.held_out)
    torch.manual_seed(chunk_seed(config.seed, 0))
    shape = env.observation_space.shape
    network = DirectPolicy(shape, options.widths, env.action.shape[0]).to(device)
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


def check_dataset(config: TrainingConfig, data: str | Path) -> None:
    """Refuse a data set of another task, observation or action.

    Raises:
        InvalidInputError: naming both sides.
    """
    about = read_metadata(data)
    for name, mine, theirs in (
        ("task", config.task, about["task"]),
        ("action mode", config.action.mode, about["action_mode"]),
    ):
        if mine != theirs:
            raise InvalidInputError(f"the {name} is {mine!r}, that of the data set {theirs!r}")
    from pushplan.learned.builders import builder_from_dict

    if builder_from_dict(config.observation) != builder_from_dict(about["observation"]):
        raise InvalidInputError(
            f"the observation is {dict(config.observation)}, that of the data set "
            f"{about['observation']}"
        )


def _pairs(
    config: TrainingConfig, data: str | Path, held_out: float
) -> tuple[tuple[NDArray[Any], NDArray[Any]], tuple[NDArray[Any], NDArray[Any]]]:
    """Observations and wanted outputs, to learn from and to measure on; split by episode."""
    parts: tuple[list[Any], list[Any]] = ([], [])
    every = max(2, round(1.0 / held_out)) if held_out > 0.0 else 0
    for i, episode in enumerate(episodes(data)):
        wanted = episode.actions
        if config.action.output == "direction":
            angle = np.pi * wanted[:, :1]
            wanted = np.concatenate([np.cos(angle), np.sin(angle)], axis=1).astype(np.float32)
        away = bool(every) and i % every == every - 1
        parts[1 if away else 0].append((episode.observations[:-1], wanted))
    if not parts[0]:
        raise InvalidInputError(f"{data} has too few episodes to learn from")
    found = [
        (np.concatenate([p[0] for p in part]), np.concatenate([p[1] for p in part]))
        for part in (parts[0], parts[1] or parts[0])
    ]
    return found[0], found[1]


def _fit(
    network: Any,
    optimizer: Any,
    pairs: tuple[NDArray[Any], NDArray[Any]],
    config: TrainingConfig,
    chunk: int,
    device: str,
) -> None:
    torch, options = need("torch"), config.options
    assert isinstance(options, BcOptions)
    rng = np.random.default_rng(chunk_seed(config.seed, chunk))
    network.train()
    size = min(config.chunk, config.steps - chunk * config.chunk)
    for shown in range(0, size, options.batch):
        fraction = (chunk * config.chunk + shown) / config.steps
        rate = options.rate * max(_LEAST_RATE, 0.5 * (1.0 + np.cos(np.pi * fraction)))
        for group in optimizer.param_groups:
            group["lr"] = float(rate)
        chosen = rng.integers(len(pairs[0]), size=options.batch)
        seen, wanted = (torch.from_numpy(values[chosen]).to(device) for values in pairs)
        loss = torch.nn.functional.smooth_l1_loss(network(seen), wanted)
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        optimizer.step()


def _decide(network: Any, seen: NDArray[Any], device: str) -> NDArray[Any]:
    torch = need("torch")
    with torch.no_grad():
        decided: NDArray[Any] = network(torch.from_numpy(seen[None]).to(device))[0].cpu().numpy()
    return decided


def _error(network: Any, pairs: tuple[NDArray[Any], NDArray[Any]], device: str) -> float:
    """Root mean squared error of the outputs."""
    torch = need("torch")
    total, count = 0.0, 0
    network.eval()
    with torch.no_grad():
        for i in range(0, len(pairs[0]), 1024):
            seen, wanted = (torch.from_numpy(v[i : i + 1024]).to(device) for v in pairs)
            total += float(((network(seen) - wanted) ** 2).sum())
            count += wanted.numel()
    return float(np.sqrt(total / max(count, 1)))
