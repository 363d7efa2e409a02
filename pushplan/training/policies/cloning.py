"""Imitation: a small network that does what a data set shows, by regression or as a flow."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from pushplan.training.policies.config import BcOptions, FlowOptions, TrainingConfig
from pushplan.training.policies.demonstrations import demonstrations
from pushplan.training.policies.environment import TrainingEnv
from pushplan.training.policies.networks import DirectPolicy, FlowPolicy
from pushplan.training.policies.training_run import Learned, chunk_seed

_LEAST_RATE = 0.01


class Imitator:
    """Fits a network to data sets; ``steps`` and ``chunk`` count the pairs that are shown."""

    progress = (
        "%(steps)d of %(total)d pairs, %(seconds).0f s: error %(loss).4f held out, "
        "success %(valid_success).2f in validation"
    )

    def __init__(
        self, config: TrainingConfig, data: Sequence[str | Path], env: TrainingEnv, device: str
    ) -> None:
        options = config.options
        assert isinstance(options, BcOptions)
        self.config = config
        self.options = options
        self.device = device
        self.pairs, self.held_out = demonstrations(config, data, options.held_out)
        torch.manual_seed(chunk_seed(config.seed, 0))
        shape = env.observation_space.shape
        outputs = env.action.shape
        if isinstance(options, FlowOptions):
            network: Any = FlowPolicy(shape, options.widths, outputs, options.euler, options.waves)
        else:
            network = DirectPolicy(shape, options.widths, outputs[0], options.waves)
        self.policy = network.to(device)
        self.optimizer = torch.optim.AdamW(
            network.parameters(), lr=options.rate, weight_decay=options.decay
        )

    def learn(self, steps: range, seed: int) -> Learned:
        """Show random pairs, with the learning rate of this part of the training."""
        options = self.options
        rng = np.random.default_rng(seed)
        torch.manual_seed(seed)
        self.policy.train()
        for shown in steps[:: options.batch]:
            fraction = shown / self.config.steps
            rate = options.rate * max(_LEAST_RATE, 0.5 * (1.0 + np.cos(np.pi * fraction)))
            for group in self.optimizer.param_groups:
                group["lr"] = float(rate)
            chosen = rng.integers(len(self.pairs.seen), size=options.batch)
            loss = self.policy.loss(*(self._tensor(values[chosen]) for values in self.pairs))
            self.optimizer.zero_grad(set_to_none=True)
            loss.backward()
            self.optimizer.step()
        return Learned(steps.stop, self._error())

    def decide(self, seen: NDArray[Any]) -> NDArray[Any]:
        """The output of the network for an observation."""
        with torch.no_grad():
            decided: NDArray[Any] = self.policy(self._tensor(seen[None]))[0].cpu().numpy()
        return decided

    def state(self) -> dict[str, Any]:
        """The optimiser."""
        return {"optimizer": self.optimizer.state_dict()}

    def restore(self, state: Any) -> None:
        """From a checkpoint."""
        self.optimizer.load_state_dict(state["optimizer"])

    def close(self) -> None:
        """There is nothing to close."""

    def _error(self) -> float:
        """Root mean squared error of the outputs that count, held out."""
        total = 0.0
        count = 0.0
        self.policy.eval()
        with torch.no_grad():
            for i in range(0, len(self.held_out.seen), 1024):
                seen, wanted, counted = (self._tensor(v[i : i + 1024]) for v in self.held_out)
                squares = ((self.policy(seen) - wanted) ** 2).mean(dim=-1)  # (B,) or (B, horizon)
                counted = counted.reshape(squares.shape)
                total += float((squares * counted).sum())
                count += float(counted.sum())
        return float(np.sqrt(total / max(count, 1.0)))

    def _tensor(self, values: NDArray[Any]) -> torch.Tensor:
        return torch.from_numpy(values).to(self.device)
