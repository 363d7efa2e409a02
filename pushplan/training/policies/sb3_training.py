"""PPO and SAC with Stable-Baselines3."""

from __future__ import annotations

import logging
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from pushplan.training.policies.config import TrainingConfig
from pushplan.training.policies.environment import TrainingEnv
from pushplan.training.policies.options import PpoOptions, SacOptions
from pushplan.training.policies.run import Learned, TrainingRun, Until, train_chunks
from pushplan.world.libraries import need

log = logging.getLogger(__name__)

_LEAST_RATE = 0.1
MODEL = "model.zip"


def train_sb3(
    run: TrainingRun,
    *,
    device: str = "cpu",
    processes: bool = False,
    until: Until | None = None,
) -> Any:
    """Train from the last checkpoint of a run to its end.

    Each chunk begins with fresh episodes and with generators seeded by the seed and the number of
    the chunk, so that a training that was left off ends with the same weights as one that was not
    (on the same machine and versions, on the processor).

    Returns:
        The Stable-Baselines3 model with the weights of the best chunk.
    """
    need("stable_baselines3")
    from pushplan.training.policies.sb3_parts import Watcher

    config = run.config
    valid_env = TrainingEnv(config)
    state = run.load()
    model: Any = None

    def learn(chunk: int) -> Learned:
        nonlocal model
        seed = chunk_seed(config.seed, chunk)
        if model is None:
            model = make_model(config, vector_env(config, processes), device, run.folder, seed)
            if state is not None:
                _restore(model, state, run)
        _begin_chunk(model, config, seed, chunk / run.chunks)
        watcher = Watcher()
        size = min(config.chunk, config.steps - chunk * config.chunk)
        model.learn(size, callback=watcher, reset_num_timesteps=False, tb_log_name="tb")
        loss = float(model.logger.name_to_value.get(_loss_key(config), np.nan))
        return Learned(model.num_timesteps, loss, watcher.returns, watcher.successes)

    def decide(seen: Any) -> Any:
        return model.predict(seen, deterministic=True)[0]

    def state_now() -> dict[str, Any]:
        return _state(model, config)

    for point in train_chunks(run, valid_env, until, learn=learn, decide=decide, state=state_now):
        log.info(
            "%d of %d decisions, %.0f s: success %.2f in training, %.2f in validation",
            *(point.steps, config.steps, point.seconds, point.train_success, point.valid_success),
        )
    valid_env.close()
    if model is None:
        model = make_model(config, vector_env(config, False), device, None, config.seed)
    if run.done:
        model.policy.load_state_dict(run.best_weights())
    model.get_env().close()
    return model


def chunk_seed(seed: int, chunk: int) -> int:
    """A seed for a chunk, far from those of its neighbours."""
    return zlib.crc32(f"{seed} {chunk}".encode()) % 2**31


def vector_env(config: TrainingConfig, processes: bool) -> Any:
    """The environments of a training, as Stable-Baselines3 wants them."""
    vectors = need("stable_baselines3.common.vec_env")
    monitor = need("stable_baselines3.common.monitor").Monitor

    def one() -> Any:
        return monitor(TrainingEnv(config), info_keywords=("is_success",))

    makers = [one] * config.envs
    if processes and config.envs > 1:
        return vectors.SubprocVecEnv(makers, start_method="forkserver")
    return vectors.DummyVecEnv(makers)


def make_model(
    config: TrainingConfig, env: Any, device: str, logs: Path | None, seed: int | None = None
) -> Any:
    """An untrained model."""
    sb3 = need("stable_baselines3")
    from pushplan.training.policies.sb3_parts import ImageFeatures

    options = config.options
    is_image = len(env.observation_space.shape) == 3
    network: dict[str, Any] = {"net_arch": list(options.widths)}
    if is_image:
        network |= {"features_extractor_class": ImageFeatures}
    shared: dict[str, Any] = {
        "policy": "CnnPolicy" if is_image else "MlpPolicy",
        "env": env,
        "seed": config.seed if seed is None else seed,
        "device": device,
        "tensorboard_log": None if logs is None else str(logs),
    }
    relu = need("torch").nn.ReLU
    if isinstance(options, PpoOptions):
        return sb3.PPO(
            **shared,
            learning_rate=options.rate,
            n_steps=options.rollout,
            batch_size=options.batch,
            n_epochs=options.epochs,
            gamma=options.discount,
            gae_lambda=options.trace,
            clip_range=options.clip,
            ent_coef=options.entropy,
            policy_kwargs={
                **network,
                "log_std_init": options.deviation,
                "activation_fn": relu,
            },
        )
    assert isinstance(options, SacOptions)
    return sb3.SAC(
        **shared,
        learning_rate=options.rate,
        buffer_size=options.buffer,
        learning_starts=options.first,
        batch_size=options.batch,
        train_freq=options.every,
        gradient_steps=options.updates,
        gamma=options.discount,
        tau=options.follow,
        policy_kwargs={**network, "activation_fn": relu},
    )


def _begin_chunk(model: Any, config: TrainingConfig, seed: int, fraction: float) -> None:
    """Fresh episodes and generators, and the learning rate of this part of the training."""
    model.set_random_seed(seed)  # also of the environments, at their next reset
    model.env.seed(seed)
    model._last_obs = None
    options = config.options
    if isinstance(options, PpoOptions):
        rate = options.rate * (1.0 - (1.0 - _LEAST_RATE) * fraction)
        model.learning_rate = rate
        model._setup_lr_schedule()


def _loss_key(config: TrainingConfig) -> str:
    return "train/loss" if config.algorithm == "ppo" else "train/critic_loss"


def _state(model: Any, config: TrainingConfig) -> dict[str, Any]:
    """Weights, optimisers and counters as tensors and numbers; a replay buffer beside them."""
    parameters = model.get_parameters()
    state: dict[str, Any] = {
        "weights": parameters.pop("policy"),
        "optimizers": parameters,
        "steps": int(model.num_timesteps),
        "updates": int(model._n_updates),
    }
    if config.algorithm == "sac":
        torch = need("torch")
        buffer = model.replay_buffer
        used = buffer.buffer_size if buffer.full else buffer.pos
        state["temperature"] = model.log_ent_coef.detach().cpu()
        state["position"], state["full"] = int(buffer.pos), bool(buffer.full)
        for name in _BUFFER:
            state[name] = torch.from_numpy(getattr(buffer, name)[:used])
    return state


_BUFFER = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


def _restore(model: Any, state: Any, run: TrainingRun) -> None:
    model.set_parameters({"policy": state["weights"], **state["optimizers"]})
    model.num_timesteps = int(state["steps"])
    model._n_updates = int(state["updates"])
    if run.config.algorithm == "sac":
        model.log_ent_coef.data.copy_(state["temperature"])
        buffer = model.replay_buffer
        buffer.pos, buffer.full = int(state["position"]), bool(state["full"])
        for name in _BUFFER:
            values = state[name].numpy()
            getattr(buffer, name)[: len(values)] = values
