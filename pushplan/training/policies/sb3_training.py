"""PPO, SAC and SAM with Stable-Baselines3. Import it only where the library is there."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import stable_baselines3
import torch
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter
from stable_baselines3 import DQN
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.utils import polyak_update
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv
from stable_baselines3.dqn.policies import DQNPolicy

from pushplan.imports.on_demand import need
from pushplan.learned.loading import learned_file, learned_names, weights_of
from pushplan.learned.onnx_guard import inspect
from pushplan.observation.channels import MOVABLE
from pushplan.training.policies.config import PpoOptions, SamOptions, TrainingConfig
from pushplan.training.policies.environment import TrainingEnv
from pushplan.training.policies.networks import SmallEncoder, SpatialActionNetwork
from pushplan.training.policies.training_run import Learned, chunk_seed
from pushplan.world import InvalidInputError

_AROUND = 2  # pixels about a movable one that exploration at objects may take
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


class SpatialActionPolicy(DQNPolicy):
    """The network that learns and its target; ``net_arch`` are options of the network.

    Args:
        arguments: of the library.
        averaged: the target is the policy, which follows the network that learns.
        options: of the library.
    """

    def __init__(self, *arguments: Any, averaged: bool, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.averaged = averaged

    @property
    def acting(self) -> Any:
        """The network that is the policy."""
        return self.q_net_target if self.averaged else self.q_net

    def make_q_net(self) -> Any:
        """A network for the maps of the environment."""
        shape: Any = self.observation_space.shape
        network: Any = self.net_arch
        least = 4 * network["shrink"]
        if shape[1] % least or shape[2] % least:
            raise InvalidInputError(
                f"the sides of a map must be divisible by {least}, got {shape[1:]}"
            )
        made: Any = SpatialActionNetwork(shape[0], **network)
        return made.to(self.device, memory_format=torch.channels_last)

    def begin_with(self, source: str) -> None:
        """Take the weights of a shipped policy, or an ONNX file, whose network is like this one.

        Raises:
            InvalidInputError: if there is no such file, or its weights are not those of such a
                network.
        """
        found = _exported_weights(source)
        wanted = {name: tuple(entry.shape) for name, entry in self.q_net.state_dict().items()}
        for name in dict.fromkeys((*wanted, *found)):
            there = tuple(found[name].shape) if name in found else "missing"
            if there != wanted.get(name):
                raise InvalidInputError(
                    f"start {source!r} does not fit the network to be trained: {name} is {there} "
                    f"there and {wanted.get(name, 'missing')} here"
                )
        for network in (self.q_net, self.q_net_target):
            network.load_state_dict(found)

    def _predict(self, obs: Any, deterministic: bool = True) -> torch.Tensor:
        best: torch.Tensor = self.acting(obs).flatten(1).argmax(1)
        return best


def _exported_weights(source: str) -> dict[str, torch.Tensor]:
    """The weights by name, as tensors; looked through as any policy's file."""
    onnx = need("onnx")
    if source in learned_names():
        path = weights_of(source)
    else:
        try:
            path = learned_file(source if source.startswith("onnx:") else f"onnx:{source}")
        except InvalidInputError as error:
            names = ", ".join(learned_names())
            raise InvalidInputError(f"start: {error}, nor is it one of {names}") from error
    data = path.read_bytes()
    try:
        inspect(data)
        graph = onnx.load_model_from_string(data).graph
        found = {
            entry.name: torch.from_numpy(onnx.numpy_helper.to_array(entry).copy())
            for entry in graph.initializer
        }
    except Exception as error:  # protobuf has errors of its own
        raise InvalidInputError(f"start {source!r} cannot be read: {error}") from error
    weights = {name: entry for name, entry in found.items() if name.endswith(("weight", "bias"))}
    if not all(bool(torch.isfinite(entry).all()) for entry in weights.values()):
        raise InvalidInputError(f"start {source!r} holds weights that are not finite")
    return weights


class SpatialActionDqn(DQN):
    """The library's deep Q-learning with a double target, mirrored maps, random pixels at objects.

    After Wu et al. 2020, Spatial Action Maps for Mobile Manipulation (arXiv 2004.09141): a fully
    convolutional network gives a value for each pixel of the map around the robot, and the robot
    drives the shortest way to the best one.

    Args:
        config: what is trained.
        settings: of the library.
    """

    def __init__(self, config: TrainingConfig, **settings: Any) -> None:
        options = config.options
        assert isinstance(options, SamOptions)
        self.config = config
        self.options = options
        channels = list(config.observation.get("channels", ()))
        self.occupancy: int | None = None
        if "occupancy" in channels:
            self.occupancy = channels.index("occupancy")
        super().__init__(
            exploration_fraction=max(options.explore, 1e-9),
            exploration_final_eps=options.explore_end,
            **settings,
        )

    def _on_step(self) -> None:
        """Nothing: the target follows gradient steps, exploration the whole training."""

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        """The best pixels by the network that learns, or random ones as often as is due now."""
        rng = self.action_space.np_random
        seen = self._last_obs
        assert isinstance(seen, np.ndarray)
        chance = self.exploration_schedule(1.0 - self.num_timesteps / self.config.steps)
        if self.num_timesteps < learning_starts and not self.options.start:
            chance = 1.0
        with torch.no_grad():
            values = self.q_net(torch.from_numpy(seen).to(self.device)).flatten(1)
        pixels: NDArray[Any] = values.argmax(1).cpu().numpy()
        for i in range(n_envs):
            if rng.random() < chance:
                pixels[i] = self._random_pixel(seen[i], rng)
        return pixels, pixels

    def _random_pixel(self, seen: NDArray[Any], rng: np.random.Generator) -> int:
        """Any pixel, or one at an object."""
        if self.occupancy is not None and rng.random() < self.options.at_objects:
            near = maximum_filter(seen[self.occupancy] == MOVABLE, 2 * _AROUND + 1)
            if near.any():
                return int(rng.choice(np.flatnonzero(near)))
        return int(rng.integers(seen[0].size))

    def train(self, gradient_steps: int, batch_size: int = 100) -> None:
        """Take gradient steps on decisions drawn from the replay buffer."""
        options = self.options
        memory = self.replay_buffer
        assert memory is not None
        self._update_learning_rate(self.policy.optimizer)
        losses = []
        for _ in range(gradient_steps):
            drawn = memory.sample(batch_size)
            seen = drawn.observations
            actions = drawn.actions
            following = drawn.next_observations
            if options.mirror and self.action_space.np_random.random() < 0.5:
                cols = seen.shape[-1]
                seen = seen.flip(-1)
                following = following.flip(-1)
                actions = actions + cols - 1 - 2 * (actions % cols)  # what is left is right
            discounts = self.gamma if drawn.discounts is None else drawn.discounts
            with torch.no_grad():
                choice = self.q_net(following).flatten(1).argmax(1, keepdim=True)
                future = self.q_net_target(following).flatten(1).gather(1, choice)
                wanted = drawn.rewards + (1.0 - drawn.dones) * discounts * future
            value = self.q_net(seen).flatten(1).gather(1, actions)
            loss: Any = torch.nn.functional.smooth_l1_loss(value, wanted)
            self.policy.optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self.q_net.parameters(), self.max_grad_norm)
            self.policy.optimizer.step()
            losses.append(loss.item())
            self._n_updates += 1
            if options.follow or self._n_updates % options.target_every == 0:
                networks = (self.q_net.parameters(), self.q_net_target.parameters())
                polyak_update(*networks, options.follow or 1.0)
        self.logger.record("train/loss", np.mean(losses))


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
