"""Demonstrations for a network: observations, and the outputs wanted for them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.learned.specification import builder_from_dict
from pushplan.training.policies.config import TrainingConfig
from pushplan.training.policies.dataset import EpisodeData, episodes, read_metadata
from pushplan.world import InvalidInputError

_SAME = 0.1
"""An action this near to the one that was wanted did not disturb anything."""


class Demonstrations(NamedTuple):
    """Pairs to learn from."""

    seen: NDArray[Any]  # (N, ...) observations
    wanted: NDArray[np.float32]  # (N, n) actions or directions, or (N, horizon, n) chunks
    counted: NDArray[np.float32]  # (N, 1) or (N, horizon) 1 where it is known what was wanted


def check_dataset(config: TrainingConfig, data: str | Path) -> None:
    """Refuse a data set of another task, observation or action.

    Raises:
        InvalidInputError: naming both sides.
    """
    about = read_metadata(data)
    observation: Any = dict(config.observation)
    if builder_from_dict(observation) == builder_from_dict(about["observation"]):
        observation = about["observation"]  # the same one, maybe written otherwise
    for name, mine, theirs in (
        ("task", config.task, about["task"]),
        ("action mode", config.action.mode, about["action_mode"]),
        ("observation", observation, about["observation"]),
    ):
        if mine != theirs:
            raise InvalidInputError(f"the {name} is {mine!r}, that of the data set {theirs!r}")


def demonstrations(
    config: TrainingConfig, data: Sequence[str | Path], held_out: float
) -> tuple[Demonstrations, Demonstrations]:
    """Return demonstrations to learn from and demonstrations to measure on; split by episode.

    Raises:
        InvalidInputError: if a data set does not fit, or there are too few episodes.
    """
    parts: tuple[list[Demonstrations], list[Demonstrations]] = ([], [])
    every = max(2, round(1.0 / held_out)) if held_out > 0.0 else 0
    for folder in data:
        check_dataset(config, folder)
        for i, episode in enumerate(episodes(folder)):
            away = bool(every) and i % every == every - 1
            parts[1 if away else 0].append(_of_episode(config, episode))
    if not parts[0]:
        raise InvalidInputError(f"{', '.join(map(str, data))}: too few episodes to learn from")
    learn, measure = (
        Demonstrations(*(np.concatenate(arrays) for arrays in zip(*part, strict=True)))
        for part in (parts[0], parts[1] or parts[0])
    )
    return learn, measure


def _of_episode(config: TrainingConfig, episode: EpisodeData) -> Demonstrations:
    seen = episode.observations[:-1]
    wanted = episode.actions
    if config.action.output == "chunk":
        return Demonstrations(seen, *action_chunks(wanted, episode.executed, config.action.horizon))
    if config.action.output == "direction":
        angle = np.pi * wanted[:, :1]
        wanted = np.concatenate([np.cos(angle), np.sin(angle)], axis=1).astype(np.float32)
    return Demonstrations(seen, wanted, np.ones((len(seen), 1), np.float32))


def action_chunks(
    wanted: NDArray[np.float32], executed: NDArray[np.float32], horizon: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The wanted actions from each step on.

    An action counts as long as everything before it in its chunk was carried out as wanted: what
    the policy wanted after a disturbance says nothing about what it wants without one.

    Args:
        wanted: (T, n) by the policy.
        executed: (T, n) carried out.
        horizon: actions of a chunk.

    Returns:
        (T, horizon, n) chunks, which repeat the last action beyond the end, and (T, horizon) 1
        where an action counts.
    """
    steps = len(wanted)
    ahead = np.arange(steps)[:, None] + np.arange(horizon)  # (T, horizon)
    inside = np.minimum(ahead, steps - 1)
    as_wanted = (np.abs(executed - wanted) <= _SAME).all(axis=1)[inside]
    before = np.logical_and.accumulate(as_wanted, axis=1)[:, :-1]
    counted = np.concatenate([np.ones((steps, 1), np.bool_), before], axis=1) & (ahead < steps)
    return wanted[inside], counted.astype(np.float32)
