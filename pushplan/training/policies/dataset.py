"""Episodes of any policy as a data set, in Minari's terms.

A data set is a folder: ``metadata.json``, and ``data/episode_00000.npz`` and so on with the arrays
``observations`` (T + 1, ...), ``actions``, ``rewards``, ``terminations`` and ``truncations``
(T, ...) of each episode, as Minari (https://minari.farama.org) names them, and ``executed``
(T, ...), the actions that were carried out, which differ from ``actions`` where the policy was
disturbed. No pickles. `to_minari` makes a data set of Minari's own.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pushplan.envs import PushEnv
from pushplan.files.safe_files import known_keys, read_data, read_npz
from pushplan.imports.on_demand import need
from pushplan.learned.builders import builder_from_dict, builder_to_dict
from pushplan.learned.specification import RobotSpec
from pushplan.observation import ObservationBuilder
from pushplan.training.policies.config import TrainingConfig
from pushplan.training.policies.environment import TRAINING_SEEDS, environments
from pushplan.world import ChoosesObservation, InvalidInputError, SchemaError, stream
from pushplan.world.checks import integer, number
from pushplan.world.policy_abilities import action_modes

SCHEMA = "pushplan-dataset/1"
METADATA = "metadata.json"
ARRAYS = ("observations", "actions", "rewards", "terminations", "truncations")
_EXECUTED = "executed"
_TRUTHS = ("terminations", "truncations")
_KEYS = (
    *("format", "task", "simulator", "preset", "scenarios", "policy", "action_mode", "observation"),
    *("robot", "control_step", "total_episodes", "total_steps", "successes", "first_seed", "noise"),
)
_LATER_KEYS = ("driver", "hold")


@dataclass(frozen=True, eq=False)
class EpisodeData:
    """The arrays of an episode."""

    observations: NDArray[Any]
    actions: NDArray[np.float32]
    rewards: NDArray[np.float32]
    terminations: NDArray[np.bool_]
    truncations: NDArray[np.bool_]
    executed: NDArray[np.float32]


def record(
    config: TrainingConfig,
    policy: Any,
    label: str,
    folder: str | Path,
    *,
    episodes: int,
    first_seed: int = TRAINING_SEEDS,
    noise: float = 0.0,
    hold: int = 4,
    driver: Any = None,
    driver_label: str | None = None,
) -> Path:
    """Run a policy and write what it saw and wanted.

    Args:
        config: of a training that learns from it: task, observation, and scenarios, which the
            episodes take in turn.
        policy: whose actions are recorded.
        label: what the data set calls it.
        folder: a new one.
        episodes: how many.
        first_seed: of the first layout; by default beyond all that scores are made on.
        noise: probability for each action that another one is carried out instead, for a few steps:
            a random one, or those of a driver. The one that the policy wanted is recorded all the
            same, so that a learner sees how to come back.
        hold: for how many steps a random action stands, or a driver drives.
        driver: a policy with the same actions that observes by itself, such as a network that is
            learning. It drives where else random actions are carried out, so that the data set
            shows what ``policy`` does where the driver gets to (DAgger, Ross et al. 2011, arXiv
            1011.0686).
        driver_label: what the data set calls it.

    Raises:
        InvalidInputError: if the folder holds something, or a number makes no sense.
    """
    integer("episodes", episodes, low=1)
    integer("first_seed", first_seed, low=0)
    number("noise", noise, low=0.0, high=1.0)
    integer("hold", hold, low=1)
    folder = Path(folder)
    if folder.exists() and any(folder.iterdir()):
        raise InvalidInputError(f"{folder} is not empty")
    builder = builder_from_dict(config.observation)
    wanted = "state"
    if isinstance(policy, ChoosesObservation):
        wanted = policy.observation
    envs = environments(config, wanted, action_modes(policy) or None)
    (folder / "data").mkdir(parents=True, exist_ok=True)
    steps = successes = 0
    for index in range(episodes):
        env = envs[index % len(envs)]
        arrays, success = _run(env, policy, driver, builder, noise, hold, first_seed + index)
        steps += len(arrays["actions"])
        successes += success
        np.savez_compressed(folder / "data" / f"episode_{index:05d}.npz", **arrays)
    env = envs[0]
    about = {
        "format": SCHEMA,
        "task": config.task,
        "simulator": config.simulator,
        "preset": config.preset,
        "scenarios": [dict(v) for v in config.scenarios],
        "policy": label,
        "action_mode": env.action_mode,
        "observation": builder_to_dict(builder),
        "robot": vars(RobotSpec.of(env.task.robot)),
        "control_step": env.task.control_step,
        "total_episodes": episodes,
        "total_steps": steps,
        "successes": successes,
        "first_seed": first_seed,
        "noise": noise,
        "hold": hold,
        "driver": driver_label,
    }
    (folder / METADATA).write_text(json.dumps(about, indent=2) + "\n", encoding="utf-8")
    for env in envs:
        env.close()
    return folder


def _run(
    env: PushEnv,
    policy: Any,
    driver: Any,
    builder: ObservationBuilder,
    noise: float,
    hold: int,
    seed: int,
) -> tuple[dict[str, Any], bool]:
    """The arrays of an episode, and its success."""
    seen, _ = env.reset(seed=seed)
    policy.reset(env.world, stream(seed, "policy"))
    rng = stream(seed, "noise")
    observed = [builder.observe(env.world)]
    rows: list[tuple[Any, ...]] = []
    held = 0
    disturbed = np.zeros(0)
    over = False
    while not over:
        action = env.encode(policy.act(env.world, seen))
        if held == 0 and noise and rng.random() < noise:
            held = hold
            disturbed = rng.uniform(-1.0, 1.0, action.shape)
            if driver is not None:
                driver.reset(env.world, stream(seed, "driver"))
        executed: NDArray[Any] = action
        if held:
            executed = disturbed
            if driver is not None:
                executed = env.encode(driver.act(env.world))
        held = max(0, held - 1)
        seen, reward, terminated, truncated, info = env.step(executed)
        observed.append(builder.observe(env.world))
        rows.append((action, reward, terminated, truncated, executed))
        over = terminated or truncated
    columns = zip((*ARRAYS[1:], _EXECUTED), zip(*rows, strict=True), strict=True)
    arrays = {
        name: np.array(values, np.bool_ if name in _TRUTHS else np.float32)
        for name, values in columns
    }
    return {"observations": np.stack(observed), **arrays}, bool(info["success"])


def read_metadata(folder: str | Path) -> dict[str, Any]:
    """Read the metadata of a data set.

    Raises:
        SchemaError: if the folder holds no data set.
    """
    path = Path(folder) / METADATA
    data = read_data(path, "data set")
    if not isinstance(data, dict) or data.get("format") != SCHEMA:
        raise SchemaError(f"{folder} is no data set of format {SCHEMA!r}")
    known_keys("the metadata of a data set", data, (*_KEYS, *_LATER_KEYS), _KEYS)
    return data


def episodes(folder: str | Path) -> Iterator[EpisodeData]:
    """The episodes of a data set, in their order.

    Raises:
        SchemaError: if one cannot be read, or one is missing.
    """
    about = read_metadata(folder)
    for index in range(int(about["total_episodes"])):
        path = Path(folder) / "data" / f"episode_{index:05d}.npz"
        found = read_npz(path, "episode of a data set", ARRAYS, (_EXECUTED,))
        arrays: dict[str, Any] = {_EXECUTED: found.get("actions"), **found}
        lengths = {len(arrays[name]) for name in (*ARRAYS[1:], _EXECUTED)}
        if lengths != {len(arrays["observations"]) - 1}:
            raise SchemaError(f"{path}: the arrays have lengths that do not belong together")
        yield EpisodeData(**arrays)


def to_minari(folder: str | Path, name: str) -> Any:
    """Make a data set of Minari's own, in Minari's folder (``MINARI_DATASETS_PATH``).

    Returns:
        The ``minari.MinariDataset``.

    Raises:
        MissingDependencyError: without Minari and h5py.
    """
    minari = need("minari")
    need("h5py")
    from gymnasium.spaces import Box

    about = read_metadata(folder)
    builder: Any = builder_from_dict(about["observation"])
    buffers = [
        minari.data_collector.EpisodeBuffer(id=i, **{key: getattr(one, key) for key in ARRAYS})
        for i, one in enumerate(episodes(folder))
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it misses an author and a link, which its users may add
        return minari.create_dataset_from_buffers(
            dataset_id=name,
            buffer=buffers,
            algorithm_name=about["policy"],
            description=f"{about['task']} of pushplan, {about['preset']}, {about['simulator']}",
            observation_space=Box(builder.low, builder.high, builder.shape, builder.dtype.type),
            action_space=Box(-1.0, 1.0, buffers[0].actions.shape[1:], np.float32),
            data_format="hdf5",
        )
