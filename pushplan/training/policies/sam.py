"""Spatial action maps: double deep Q-learning where each pixel is an action.

After Wu et al. 2020, Spatial Action Maps for Mobile Manipulation (arXiv 2004.09141): a fully
convolutional network gives a value for each pixel of the map around the robot, and the robot drives
the shortest way to the best one.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from pushplan.observation.channels import MOVABLE
from pushplan.training.policies.config import TrainingConfig
from pushplan.training.policies.environment import TrainingEnv
from pushplan.training.policies.initial import load_weights
from pushplan.training.policies.networks import SpatialActionNetwork
from pushplan.training.policies.options import SamOptions
from pushplan.training.policies.replay import Lookahead, ReplayBuffer
from pushplan.training.policies.run import Learned, chunk_seed
from pushplan.world import InvalidInputError, stream

_LEAST_RATE = 0.1
_PARTS = ("network", "target", "optimizer")
_AROUND = 2  # pixels about a movable one that exploration at objects may take


class SamLearner:
    """Network, target and memory of a training."""

    progress = (
        "%(steps)d of %(total)d decisions, %(seconds).0f s: fraction %(valid_share).2f, "
        "success %(valid_success).2f in validation"
    )

    def __init__(self, config: TrainingConfig, device: str) -> None:
        options = config.options
        assert isinstance(options, SamOptions)
        self.envs = [TrainingEnv(config) for _ in range(config.envs)]
        shape = self.envs[0].observation_space.shape
        least = 4 * options.shrink
        if shape[1] % least or shape[2] % least:
            raise InvalidInputError(
                f"the sides of a map must be divisible by {least}, got {shape[1:]}"
            )
        self.config = config
        self.options = options
        self.device = device
        channels = list(config.observation.get("channels", ()))
        self.occupancy = channels.index("occupancy") if "occupancy" in channels else None
        torch.manual_seed(chunk_seed(config.seed, 0))
        network: Any = SpatialActionNetwork(
            shape[0], options.widths, options.blocks, options.shrink
        )
        self.network = network.to(device, memory_format=torch.channels_last)
        self.target = copy.deepcopy(self.network)
        self.optimizer = torch.optim.Adam(self.network.parameters(), lr=options.rate)
        self.memory = ReplayBuffer(options.buffer, shape)
        self.updates = 0

    @property
    def policy(self) -> Any:
        """The network that is the policy."""
        return self.target if self.options.follow else self.network

    def begin_with(self, source: str) -> None:
        """Take the weights of a network that was exported before."""
        load_weights(self.network, source)
        self.target.load_state_dict(self.network.state_dict())

    def best(self, seen: NDArray[Any], network: Any = None) -> int:
        """Number of the pixel with the greatest value, by the network that learns or another."""
        with torch.no_grad():
            batch = torch.from_numpy(seen[None]).to(self.device)
            return int((network or self.network)(batch).argmax())

    def decide(self, seen: NDArray[Any]) -> int:
        """The best pixel by the policy."""
        return self.best(seen, self.policy)

    def update(self, rng: np.random.Generator, rate: float) -> float:
        """One gradient step on decisions drawn from the memory; gives its loss."""
        options = self.options
        seen, actions, rewards, following, discounts = self.memory.sample(options.batch, rng)
        cols = seen.shape[-1]
        if options.mirror and rng.random() < 0.5:  # what is left is right
            seen, following = seen[..., ::-1], following[..., ::-1]
            actions = actions - actions % cols + (cols - 1 - actions % cols)
        before, after = (
            torch.from_numpy(np.ascontiguousarray(a)).to(
                self.device, memory_format=torch.channels_last
            )
            for a in (seen, following)
        )
        chosen, reward, discount = (
            torch.from_numpy(a).to(self.device) for a in (actions, rewards, discounts)
        )
        with torch.no_grad():
            choice = self.network(after).flatten(1).argmax(1, keepdim=True)
            future = self.target(after).flatten(1).gather(1, choice)[:, 0]
            wanted = reward + discount * future
        value = self.network(before).flatten(1).gather(1, chosen[:, None])[:, 0]
        loss: Any = torch.nn.functional.smooth_l1_loss(value, wanted)
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), options.clip)
        self.optimizer.step()
        self.updates += 1
        if options.follow:
            with torch.no_grad():
                pairs = (self.target.parameters(), self.network.parameters())
                for slow, fast in zip(*pairs, strict=True):
                    slow.lerp_(fast, options.follow)
        elif self.updates % options.target_every == 0:
            self.target.load_state_dict(self.network.state_dict())
        return float(loss.detach())

    def state(self) -> dict[str, Any]:
        """For a checkpoint."""
        memory = {
            key: torch.from_numpy(value) if isinstance(value, np.ndarray) else value
            for key, value in self.memory.state().items()
        }
        parts = {name: getattr(self, name).state_dict() for name in _PARTS}
        return {**parts, "memory": memory, "updates": self.updates}

    def restore(self, state: Any) -> None:
        """From a checkpoint."""
        for name in _PARTS:
            getattr(self, name).load_state_dict(state[name])
        self.memory.restore(state["memory"])
        self.updates = int(state["updates"])

    def close(self) -> None:
        """Close the environments."""
        for env in self.envs:
            env.close()

    def learn(self, steps: range, seed: int) -> Learned:
        """Act, in one environment after the other, and learn."""
        options, envs = self.options, self.envs
        torch.manual_seed(seed)
        rng = stream(seed, "exploration")
        seen = [env.reset(seed=seed + i)[0] for i, env in enumerate(envs)]
        totals = [0.0] * len(envs)
        behind = [Lookahead(self.memory, options.discount, options.lookahead) for _ in envs]
        returns: list[float] = []
        successes: list[float] = []
        losses: list[float] = []
        for step in steps:
            i = step % len(envs)
            fraction = step / self.config.steps
            action = self.explore(seen[i], rng, fraction)
            following, reward, terminated, truncated, info = envs[i].step(action)
            over = terminated or truncated
            behind[i].add(seen[i], action, reward, following, terminated=terminated, last=over)
            totals[i] += reward
            if over:
                returns.append(totals[i])
                successes.append(info["is_success"])
                following, totals[i] = envs[i].reset()[0], 0.0
            seen[i] = following
            if self.memory.count >= options.first and step % options.every == 0:
                rate = options.rate * (1.0 - (1.0 - _LEAST_RATE) * fraction)
                losses.append(self.update(rng, rate))
        loss = float(np.mean(losses)) if losses else float("nan")
        return Learned(steps.stop, loss, returns, successes)

    def explore(self, seen: NDArray[Any], rng: np.random.Generator, fraction: float) -> int:
        """A pixel: the best, or with the probability of this part of the training a random one."""
        options = self.options
        fallen = 1.0 - (1.0 - options.explore_end) * min(1.0, fraction / max(options.explore, 1e-9))
        knows = bool(options.start) or self.memory.count >= options.first
        if rng.random() >= fallen and knows:
            return self.best(seen)
        rows, cols = seen.shape[1:]
        if self.occupancy is not None and rng.random() < options.at_objects:
            at = np.argwhere(seen[self.occupancy] == MOVABLE)
            if len(at):
                spot = at[rng.integers(len(at))] + rng.integers(-_AROUND, _AROUND + 1, 2)
                row, col = np.clip(spot, 0, (rows - 1, cols - 1)).tolist()
                return int(row * cols + col)
        return int(rng.integers(rows * cols))
