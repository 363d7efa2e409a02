"""Spatial action maps: double deep Q-learning where each pixel is an action.

After Wu et al. 2020, Spatial Action Maps for Mobile Manipulation (arXiv 2004.09141): a fully
convolutional network gives a value for each pixel of the map around the robot, and the robot drives
the shortest way to the best one.
"""

from __future__ import annotations

import copy
import logging
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.observation.channels import MOVABLE
from pushplan.training.policies.config import TrainingConfig
from pushplan.training.policies.environment import TrainingEnv
from pushplan.training.policies.initial import load_weights
from pushplan.training.policies.options import SamOptions
from pushplan.training.policies.replay import Lookahead, ReplayBuffer
from pushplan.training.policies.run import CurvePoint, Learned, TrainingRun, Until, train_chunks
from pushplan.training.policies.sb3_training import chunk_seed
from pushplan.world import InvalidInputError, stream
from pushplan.world.libraries import need

log = logging.getLogger(__name__)

_LEAST_RATE = 0.1
_AROUND = 2  # pixels about a movable one that exploration at objects may take


class SamLearner:
    """Network, target and memory of a training."""

    def __init__(self, config: TrainingConfig, shape: tuple[int, ...], device: str) -> None:
        from pushplan.training.policies.networks import SpatialActionNetwork

        assert isinstance(config.options, SamOptions)
        least = 4 * config.options.shrink
        if shape[1] % least or shape[2] % least:
            raise InvalidInputError(
                f"the sides of a map must be divisible by {least}, got {shape[1:]}"
            )
        self.torch = need("torch")
        self.options = config.options
        self.device = device
        channels = list(config.observation.get("channels", ()))
        self.occupancy = channels.index("occupancy") if "occupancy" in channels else None
        self.torch.manual_seed(chunk_seed(config.seed, 0))
        options = self.options
        network: Any = SpatialActionNetwork(
            shape[0], options.widths, options.blocks, options.shrink
        )
        self.network = network.to(device, memory_format=self.torch.channels_last)
        self.target = copy.deepcopy(self.network)
        self.optimizer = self.torch.optim.Adam(self.network.parameters(), lr=options.rate)
        self.memory = ReplayBuffer(options.buffer, shape)
        self.updates = 0
        self.losses: list[float] = []

    @property
    def result(self) -> Any:
        """The network that is the policy."""
        return self.target if self.options.follow else self.network

    def begin_with(self, source: str) -> None:
        """Take the weights of a network that was exported before."""
        load_weights(self.network, source)
        self.target.load_state_dict(self.network.state_dict())

    def best(self, seen: NDArray[Any], network: Any = None) -> int:
        """Number of the pixel with the greatest value, by the network that learns or another."""
        with self.torch.no_grad():
            batch = self.torch.from_numpy(seen[None]).to(self.device)
            return int((network or self.network)(batch).argmax())

    def update(self, rng: np.random.Generator, rate: float) -> None:
        """One gradient step on decisions drawn from the memory."""
        torch, options = self.torch, self.options
        seen, actions, rewards, following, discounts = self.memory.sample(options.batch, rng)
        cols = seen.shape[-1]
        if options.mirror and rng.random() < 0.5:  # what is left is right
            seen, following = seen[..., ::-1], following[..., ::-1]
            actions = actions - actions % cols + (cols - 1 - actions % cols)
        seen, following = (
            torch.from_numpy(np.ascontiguousarray(a)).to(
                self.device, memory_format=torch.channels_last
            )
            for a in (seen, following)
        )
        chosen, reward, discount = (
            torch.from_numpy(a).to(self.device) for a in (actions, rewards, discounts)
        )
        with torch.no_grad():
            choice = self.network(following).flatten(1).argmax(1, keepdim=True)
            future = self.target(following).flatten(1).gather(1, choice)[:, 0]
            wanted = reward + discount * future
        value = self.network(seen).flatten(1).gather(1, chosen[:, None])[:, 0]
        loss = torch.nn.functional.smooth_l1_loss(value, wanted)
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), options.clip)
        self.optimizer.step()
        self.losses.append(float(loss.detach()))
        self.updates += 1
        if options.follow:
            with torch.no_grad():
                pairs = (self.target.parameters(), self.network.parameters())
                for slow, fast in zip(*pairs, strict=True):
                    slow.lerp_(fast, options.follow)
        elif self.updates % options.target_every == 0:
            self.target.load_state_dict(self.network.state_dict())

    def state(self) -> dict[str, Any]:
        """For a checkpoint."""
        memory = {
            key: self.torch.from_numpy(value) if isinstance(value, np.ndarray) else value
            for key, value in self.memory.state().items()
        }
        return {
            "weights": self.result.state_dict(),
            "network": self.network.state_dict(),
            "target": self.target.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "memory": memory,
            "updates": self.updates,
        }

    def restore(self, state: Any) -> None:
        """From a checkpoint."""
        self.network.load_state_dict(state["network"])
        self.target.load_state_dict(state["target"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.memory.restore(state["memory"])
        self.updates = int(state["updates"])


def train_sam(run: TrainingRun, *, device: str = "cpu", until: Until | None = None) -> Any:
    """Train from the last checkpoint of a run to its end; as `train_sb3`, resumable exactly.

    Returns:
        The network with the weights of the best chunk.
    """
    config = run.config
    envs = [TrainingEnv(config) for _ in range(config.envs)]
    learner = SamLearner(config, envs[0].observation_space.shape, device)
    state = run.load()
    if state is not None:
        learner.restore(state)
    elif learner.options.start:
        learner.begin_with(learner.options.start)

    def learn(chunk: int) -> Learned:
        learner.losses.clear()
        ended = _chunk(learner, config, envs, chunk)
        loss = float(np.mean(learner.losses)) if learner.losses else float("nan")
        steps = min((chunk + 1) * config.chunk, config.steps)
        return Learned(steps, loss, *(zip(*ended, strict=True) if ended else ()))

    def decide(seen: NDArray[Any]) -> int:
        return learner.best(seen, learner.result)

    logger = _Board(run)
    for point in train_chunks(run, envs[0], until, learn=learn, decide=decide, state=learner.state):
        logger.write(point)
        log.info(
            "%d of %d decisions, %.0f s: fraction %.2f, success %.2f in validation",
            *(point.steps, config.steps, point.seconds, point.valid_share, point.valid_success),
        )
    logger.close()
    for env in envs:
        env.close()
    if run.done:
        learner.result.load_state_dict(run.best_weights())
    return learner.result


def _chunk(
    learner: SamLearner, config: TrainingConfig, envs: list[TrainingEnv], chunk: int
) -> list[tuple[float, bool]]:
    """Act and learn for one chunk; returns of the episodes that ended in it, and successes."""
    options = learner.options
    seed = chunk_seed(config.seed, chunk)
    learner.torch.manual_seed(seed)
    rng = stream(seed, "exploration")
    seen = [env.reset(seed=seed + i)[0] for i, env in enumerate(envs)]
    totals = [0.0] * len(envs)
    behind = [Lookahead(learner.memory, options.discount, options.lookahead) for _ in envs]
    ended: list[tuple[float, bool]] = []
    first = chunk * config.chunk
    for step in range(first, min(first + config.chunk, config.steps)):
        i = step % len(envs)
        action = _explore(learner, seen[i], rng, step / config.steps)
        following, reward, terminated, truncated, info = envs[i].step(action)
        behind[i].add(seen[i], action, reward)
        behind[i].settle(following, terminated, last=terminated or truncated)
        totals[i] += reward
        if terminated or truncated:
            ended.append((totals[i], bool(info["is_success"])))
            following, totals[i] = envs[i].reset()[0], 0.0
        seen[i] = following
        if len(learner.memory) >= options.first and step % options.every == 0:
            fraction = step / config.steps
            learner.update(rng, options.rate * (1.0 - (1.0 - _LEAST_RATE) * fraction))
    return ended


def _explore(
    learner: SamLearner, seen: NDArray[Any], rng: np.random.Generator, fraction: float
) -> int:
    """A pixel: the best, or with the probability of this part of the training a random one."""
    options = learner.options
    fallen = 1.0 - (1.0 - options.explore_end) * min(1.0, fraction / max(options.explore, 1e-9))
    knows = bool(options.start) or len(learner.memory) >= options.first
    if rng.random() >= fallen and knows:
        return learner.best(seen)
    rows, cols = seen.shape[1:]
    if learner.occupancy is not None and rng.random() < options.at_objects:
        at = np.argwhere(seen[learner.occupancy] == MOVABLE)
        if len(at):
            spot = at[rng.integers(len(at))] + rng.integers(-_AROUND, _AROUND + 1, 2)
            row, col = np.clip(spot, 0, (rows - 1, cols - 1)).tolist()
            return int(row * cols + col)
    return int(rng.integers(rows * cols))


class _Board:
    """Scalars for TensorBoard, where it is installed."""

    def __init__(self, run: TrainingRun) -> None:
        self._writer: Any = None
        try:
            from torch.utils.tensorboard import SummaryWriter
        except ImportError:
            return
        self._writer = SummaryWriter(str(run.path("tb_0")))

    def write(self, point: CurvePoint) -> None:
        """A row of the curve."""
        if self._writer is not None:
            for name in ("train_return", "valid_return", "valid_share", "valid_success", "loss"):
                self._writer.add_scalar(f"pushplan/{name}", getattr(point, name), point.steps)

    def close(self) -> None:
        """Write what is left."""
        if self._writer is not None:
            self._writer.close()
