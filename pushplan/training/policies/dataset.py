"""Episodes of any policy as a data set, in Minari's terms.

A data set is a folder: ``metadata.json``, and ``data/episode_00000.npz`` and so on with the arrays
``observations`` (T + 1, ...), ``actions``, ``rewards``, ``terminations`` and ``truncations``
(T, ...) of each episode, as Minari (https://minari.farama.org) names them, and ``executed``
(T, ...), the actions that were carried out, which differ from ``actions`` where the policy was
disturbed. No pickles. `to_minari` makes a data set of Minari's own.
"""

from __future__ import annotations

import json
import logging
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.envs import PushEnv
from pushplan.files.output_files import check_folder, make_folder, write_atomic
from pushplan.files.safe_files import known_keys, read_data, read_npz
from pushplan.imports.on_demand import need
from pushplan.learned.specification import RobotSpec, builder_from_dict, builder_to_dict
from pushplan.observation import ObservationBuilder
from pushplan.training.policies.config import TrainingConfig
from pushplan.training.policies.environment import TRAINING_SEEDS, environments
from pushplan.world import (
    ChoosesObservation,
    InvalidInputError,
    ObjectGoals,
    SchemaError,
    World,
    stream,
)
from pushplan.world.checks import integer, number
from pushplan.world.policy_abilities import action_modes

log = logging.getLogger(__name__)

SCHEMA = "pushplan-dataset/1"
METADATA = "metadata.json"
ARRAYS = ("observations", "actions", "rewards", "terminations", "truncations")
_EXECUTED = "executed"
_MOVED = 1e-4
"""By more has an object moved in a step [m, rad]."""
_TRUTHS = ("terminations", "truncations")
_KEYS = (
    *("format", "task", "simulator", "preset", "scenarios", "policy", "action_mode", "observation"),
    *("robot", "control_step", "total_episodes", "total_steps", "successes", "first_seed", "noise"),
)
_COUNTS = ("total_episodes", "total_steps", "successes", "starts_done")
_LATER_KEYS = ("driver", "hold", "sources", "starts", "afresh", "hindsight", "starts_done")


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
    afresh: bool = False,
    hindsight: int = 0,
    sources: Sequence[str] = (),
) -> Path:
    """Run a policy and write what it saw and wanted.

    After each start the metadata say how far it is. If this is called again with the same arguments
    and an unfinished data set, it goes on with the next start; the bytes are those of one call.

    Args:
        config: of a training that learns from it: task, observation, and scenarios, which the
            episodes take in turn.
        policy: whose actions are recorded.
        label: what the data set calls it.
        folder: a new one, or that of a call with the same arguments.
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
        afresh: for a policy that follows a plan. Where a disturbance ends it is reset, and another
            episode of the data set begins; the disturbance itself is left out.
        hindsight: how many more episodes are made of each one in which objects have places of
            their own, as if these had been where the objects came to be at some later step: its
            actions lead there too (Andrychowicz et al. 2017, arXiv 1707.01495). Without rewards.
        sources: `PolicySpec.identity` of policy and driver; a call with others does not go on.

    Raises:
        InvalidInputError: if the folder holds something else, or a number makes no sense.
    """
    integer("episodes", episodes, low=1)
    integer("first_seed", first_seed, low=0)
    number("noise", noise, low=0.0, high=1.0)
    integer("hold", hold, low=1)
    integer("hindsight", hindsight, low=0)
    folder = Path(folder)
    check_folder(folder, "data set", METADATA)
    builder = builder_from_dict(config.observation)
    wanted = "state"
    if isinstance(policy, ChoosesObservation):
        wanted = policy.observation
    envs = environments(config, wanted, action_modes(policy) or None)
    if getattr(builder, "is_sensor", False):
        for env in envs:
            if (sensing := env.task.variations.sensing) != "full":
                raise InvalidInputError(
                    "a data set with observations of a lidar is made in scenarios without sensing: "
                    f"the scans are made of the scene; got sensing {sensing!r}"
                )
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
        "first_seed": first_seed,
        "noise": noise,
        "hold": hold,
        "driver": driver_label,
        "sources": [*sources],
        "starts": episodes,
        "afresh": afresh,
        "hindsight": hindsight,
    }
    counts = _counts(folder, about)
    folder.mkdir(parents=True, exist_ok=True)
    _write(folder, about, counts)  # the mark of a data set comes first
    make_folder(folder / "data")
    for index in range(counts["starts_done"], episodes):
        env = envs[index % len(envs)]
        seed = first_seed + index
        for part in _run(env, policy, driver, noise, hold, seed, afresh):
            counts["successes"] += part.success
            rng = stream(seed, f"hindsight {len(part.rows)}")
            for each in (part, *(part.hindsight(rng) for _ in range(hindsight))):
                if each is not None:
                    path = folder / "data" / f"episode_{counts['total_episodes']:05d}.npz"
                    np.savez_compressed(path, **each.arrays(builder))
                    counts["total_episodes"] += 1
                    counts["total_steps"] += len(each.rows)
        counts["starts_done"] += 1
        _write(folder, about, counts)
    for env in envs:
        env.close()
    return folder


def _write(folder: Path, about: Mapping[str, Any], counts: Mapping[str, int]) -> None:
    text = json.dumps({**about, **counts}, indent=2) + "\n"
    write_atomic(folder / METADATA, text.encode())
    said = (counts["starts_done"], about["starts"], counts["total_steps"], counts["successes"])
    log.info("%d of %d starts: %d steps, %d successes", *said)


def _counts(folder: Path, about: Mapping[str, Any]) -> dict[str, int]:
    """Return the counts of a data set of this description, by key of its metadata.

    Raises:
        InvalidInputError: if the folder holds one of another description.
    """
    if not (folder / METADATA).exists():
        return dict.fromkeys(_COUNTS, 0)
    there = _stored(folder)
    asked = json.loads(json.dumps(about))  # as values come back from a file
    if other := [key for key in asked if there.get(key) != asked[key]]:
        raise InvalidInputError(
            f"{folder} holds a data set that differs in {', '.join(other)}: give the same values, "
            "or choose a new folder; nothing in this one was changed"
        )
    return {key: integer(key, there.get(key), low=0) for key in _COUNTS}


class _Part(NamedTuple):
    """An episode of a data set before it is observed."""

    worlds: list[World]  # (T + 1)
    rows: list[tuple[Any, ...]]  # (T) in the order of the arrays
    success: bool = False

    def arrays(self, builder: ObservationBuilder) -> dict[str, Any]:
        """Its arrays, as they are stored."""
        columns = zip((*ARRAYS[1:], _EXECUTED), zip(*self.rows, strict=True), strict=True)
        arrays = {
            name: np.array(values, np.bool_ if name in _TRUTHS else np.float32)
            for name, values in columns
        }
        arrays["truncations"][-1] |= not arrays["terminations"][-1]
        return {"observations": np.stack([builder.observe(w) for w in self.worlds]), **arrays}

    def hindsight(self, rng: np.random.Generator) -> _Part | None:
        """The beginning, with the places where objects came to be; None if none has moved."""
        goal = self.worlds[0].goal
        if not isinstance(goal, ObjectGoals):
            return None
        poses = np.stack([world.movables.poses for world in self.worlds])
        moved = np.flatnonzero((np.abs(np.diff(poses, axis=0)) > _MOVED).any(axis=(1, 2)))
        if not len(moved):
            return None
        end = int(rng.choice(moved)) + 1
        ids = self.worlds[0].movables.ids.tolist()
        of_places = [ids.index(label) for label in goal.ids.tolist()]
        later = replace(goal, poses=poses[end][of_places])
        worlds = [replace(world, goal=later) for world in self.worlds[: end + 1]]
        rows = [(action, 0.0, False, False, executed) for action, *_, executed in self.rows[:end]]
        return _Part(worlds, rows)


def _run(
    env: PushEnv, policy: Any, driver: Any, noise: float, hold: int, seed: int, afresh: bool
) -> Iterator[_Part]:
    """Run an episode; if the policy begins afresh, give its parts between disturbances."""
    seen, _ = env.reset(seed=seed)
    policy.reset(env.world, stream(seed, "policy"))
    rng = stream(seed, "noise")
    part = _Part([env.world], [])
    held = 0
    disturbed = np.zeros(0)
    over = False
    while not over:
        if held == 0 and noise and rng.random() < noise:
            held = hold
            disturbed = rng.uniform(-1.0, 1.0, env.action_space.shape)
            if driver is not None:
                driver.reset(env.world, stream(seed, "driver"))
            if afresh and part.rows:
                yield part
                part = _Part([], [])
        asked = not (afresh and held)
        action: NDArray[Any] = disturbed
        if asked:
            action = env.encode(policy.act(env.world, seen))
        executed = action
        if held:
            executed = disturbed
            if driver is not None:
                executed = env.encode(driver.act(env.world))
        held = max(0, held - 1)
        seen, reward, terminated, truncated, info = env.step(executed)
        over = terminated or truncated
        if asked:
            part.worlds.append(env.world)
            part.rows.append((action, reward, terminated, truncated, executed))
        elif not held and not over:
            policy.reset(env.world, stream(seed, "policy"))
            part = _Part([env.world], [])
    if part.rows:
        yield part._replace(success=bool(info["success"]))


def read_metadata(folder: str | Path) -> dict[str, Any]:
    """Read the metadata of a data set.

    Raises:
        SchemaError: if the folder holds no data set, or an unfinished one.
    """
    data = _stored(folder)
    if data.get("starts_done") != data.get("starts"):
        raise SchemaError(
            f"{folder} holds a data set of which {data.get('starts_done')} of {data.get('starts')} "
            "starts are done: run the command that began it again to finish it"
        )
    return data


def _stored(folder: str | Path) -> dict[str, Any]:
    """Read the metadata of a data set, finished or not."""
    data = read_data(Path(folder) / METADATA, "data set")
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
