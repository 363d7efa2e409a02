"""Parts that derive from Stable-Baselines3. Import it only where the library is there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from pushplan.learned.sb3_saving import describe_model, write_beside
from pushplan.training.policies.networks import SmallEncoder


class ImageFeatures(BaseFeaturesExtractor):
    """`SmallEncoder` as a features extractor; images arrive in [0, 1]."""

    def __init__(self, observation_space: Any, features_dim: int = 128) -> None:
        super().__init__(observation_space, features_dim)
        channels, rows, cols = observation_space.shape
        self.encoder = SmallEncoder(channels, (rows, cols), features_dim)

    def forward(self, observations: Any) -> Any:
        """(B, features_dim)."""
        return self.encoder(observations)


class Watcher(BaseCallback):
    """Collects the episodes that end in a chunk."""

    def __init__(self) -> None:
        super().__init__()
        self.returns: list[float] = []
        self.successes: list[float] = []

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                self.returns.append(float(info["episode"]["r"]))
                self.successes.append(float(info["is_success"]))
        return True


class SpecificationWriter(BaseCallback):
    """See `pushplan.training.specification_callback`."""

    def __init__(self, path: str | Path, env: Any, repeat: int) -> None:
        super().__init__()
        self._path, self._env, self._repeat = path, env, repeat

    def _on_training_start(self) -> None:
        self._write()  # what cannot be described is an error before the training, not after it

    def _on_step(self) -> bool:
        return True

    def _on_training_end(self) -> None:
        self._write()

    def _write(self) -> None:
        specification = describe_model(self.model, env=self._env, repeat=self._repeat)
        write_beside(self._path, specification)
