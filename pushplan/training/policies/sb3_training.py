"""PPO, SAC and SAM with Stable-Baselines3. Import it only where the library is there."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import stable_baselines3
import torch
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

from pushplan.training.policies.config import PpoOptions, SamOptions, TrainingConfig
from pushplan.training.policies.environment import TrainingEnv
from pushplan.training.policies.networks import SmallEncoder
from pushplan.training.policies.sam import SpatialActionDqn, SpatialActionPolicy
from pushplan.training.policies.training_run import Learned, chunk_seed

_LEAST_RATE = 0.1
_ARGUMENTS = {
    "rate": "learning_rate",
    "rollout": "n_steps",
    "batch": "batch_size",
    "epochs": "n_epochs",
    "discount": "gamma",
    "trace": "gae_lambda",
    "clip": "clip_range",
    "entropy": "ent_coef",
    "buffer": "buffer_size",
    "first": "learning_starts",
    "every": "train_freq",
    "updates": "gradient_steps",
    "follow": "tau",
    "lookahead": "n_steps",
}
"""Names of our options in the library, of those that the algorithm has."""
_BUFFER = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


class ImageFeatures(BaseFeaturesExtractor):
    """`SmallEncoder` as a features extractor; images arrive in [0, 1]."""

    def __init__(self, observation_space: Any, features_dim: int = 128) -> None:
        super().__init__(observation_space, features_dim)
        channels, rows, cols = observation_space.shape
        self.encoder = SmallEncoder(channels, (rows, cols), features_dim)

    def forward(self, observations: Any) -> Any:
        """(B, features_dim)."""
        return self.encoder(observations)


class Sb3Learner:
    """A model of the library.

    Args:
        config: what is trained.
        device: of PyTorch.
        processes: give each environment a process of its own.
        logs: folder for TensorBoard.
    """

    progress = (
        "%(steps)d of %(total)d decisions, %(seconds).0f s: success %(train_success).2f in "
        "training, %(valid_success).2f in validation, fraction %(valid_share).2f"
    )

    def __init__(self, config: TrainingConfig, device: str, processes: bool, logs: Path) -> None:
        self.config = config
        makers: list[Any] = [
            lambda: Monitor(TrainingEnv(config), info_keywords=("is_success",))
        ] * config.envs
        if processes and config.envs > 1:
            env: Any = SubprocVecEnv(makers, start_method="forkserver")
        else:
            env = DummyVecEnv(makers)
        is_image = len(env.observation_space.shape) == 3
        options = config.options
        arguments = {
            theirs: getattr(options, ours)
            for ours, theirs in _ARGUMENTS.items()
            if hasattr(options, ours)
        }
        network: dict[str, Any] = {"net_arch": list(options.widths), "activation_fn": torch.nn.ReLU}
        policy: Any = "CnnPolicy" if is_image else "MlpPolicy"
        if isinstance(options, SamOptions):
            algorithm: Any = partial(SpatialActionDqn, config)
            policy = SpatialActionPolicy
            layers = {name: getattr(options, name) for name in ("widths", "blocks", "shrink")}
            network = {"net_arch": layers, "averaged": options.follow > 0.0}
            arguments["max_grad_norm"] = arguments.pop("clip_range")
            # ``every`` steps of all environments belong to a gradient step for each of them
            arguments["gradient_steps"] = config.envs
        else:
            algorithm = getattr(stable_baselines3, config.algorithm.upper())
            if is_image:
                network["features_extractor_class"] = ImageFeatures
        if isinstance(options, PpoOptions):
            network["log_std_init"] = options.deviation
        self.model: Any = algorithm(
            policy=policy,
            env=env,
            seed=chunk_seed(config.seed, 0),
            device=device,
            tensorboard_log=str(logs),
            policy_kwargs=network,
            **arguments,
        )

    @property
    def policy(self) -> Any:
        """The policy of the model."""
        return self.model.policy

    @property
    def buffer(self) -> Any:
        """The replay buffer, None with PPO."""
        return getattr(self.model, "replay_buffer", None)

    def learn(self, steps: range, seed: int) -> Learned:
        """Learn with fresh episodes and generators, and the rate of this part of the training."""
        model = self.model
        config = self.config
        model.set_random_seed(seed)  # also of the environments, at their next reset
        model.env.seed(seed)
        model._last_obs = None
        if self.buffer is not None:  # returns of several steps end where the last episodes did
            last = self.buffer.pos - 1
            self.buffer.timeouts[last] = np.maximum(
                self.buffer.timeouts[last], 1.0 - self.buffer.dones[last]
            )
        if isinstance(config.options, PpoOptions | SamOptions):
            # rates fall chunk by chunk: the library's own schedule would begin anew in each
            chunks = -(-config.steps // config.chunk)
            fraction = steps.start // config.chunk / chunks
            model.learning_rate = config.options.rate * (1.0 - (1.0 - _LEAST_RATE) * fraction)
            model._setup_lr_schedule()
        ended: list[Any] = []

        def watch(local: dict[str, Any], _: dict[str, Any]) -> bool:
            ended.extend(info for info in local["infos"] if "episode" in info)
            return True

        model.learn(len(steps), callback=watch, reset_num_timesteps=False, tb_log_name="tb")
        loss = "train/loss"
        if config.algorithm == "sac":
            loss = "train/critic_loss"
        return Learned(
            model.num_timesteps,
            float(model.logger.name_to_value.get(loss, np.nan)),
            [float(info["episode"]["r"]) for info in ended],
            [float(info["is_success"]) for info in ended],
        )

    def decide(self, seen: Any) -> Any:
        """The action of the policy without exploration."""
        return self.model.predict(seen, deterministic=True)[0]

    def state(self) -> dict[str, Any]:
        """Optimisers and counters as tensors and numbers; a replay buffer beside them."""
        model = self.model
        parameters = model.get_parameters()
        parameters.pop("policy")
        state: dict[str, Any] = {
            "optimizers": parameters,
            "steps": int(model.num_timesteps),
            "updates": int(model._n_updates),
        }
        if self.config.algorithm == "sac":
            state["temperature"] = model.log_ent_coef.detach().cpu()
        if self.buffer is not None:
            state["position"] = int(self.buffer.pos)
            state["full"] = bool(self.buffer.full)
            for name in _BUFFER:
                used = getattr(self.buffer, name)[: self.buffer.size()]
                state[name] = torch.from_numpy(used)
        return state

    def restore(self, state: Any) -> None:
        """From a checkpoint."""
        model = self.model
        model.set_parameters(state["optimizers"], exact_match=False)
        model.num_timesteps = int(state["steps"])
        model._n_updates = int(state["updates"])
        if self.config.algorithm == "sac":
            model.log_ent_coef.data.copy_(state["temperature"])
        if self.buffer is not None:
            self.buffer.pos = int(state["position"])
            self.buffer.full = bool(state["full"])
            for name in _BUFFER:
                values = state[name].numpy()
                getattr(self.buffer, name)[: len(values)] = values

    def close(self) -> None:
        """Close the environments."""
        self.model.get_env().close()
