"""Environments of scenarios, and those that Gymnasium makes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from typing import Any

from gymnasium.vector import AutoresetMode

from pushplan.envs.push_env import PushEnv
from pushplan.envs.vector_env import WorkerVectorEnv
from pushplan.observation import ObservationBuilder
from pushplan.scenarios import Scenario
from pushplan.world.checks import integer

_OWN = ("simulator", "preset", "observation", "action", "render_mode")


def make(
    scenario: Scenario,
    *,
    observation: str | ObservationBuilder | None = None,
    action: str | Sequence[str] | None = None,
    render_mode: str | None = None,
) -> PushEnv:
    """The environment of a scenario. Its first `reset` uses the scenario's seed.

    Args:
        scenario: what to run.
        observation: name of one of the task's observations, or a builder; its first if None.
        action: name of the action mode, or several in order of preference; the task's first if
            None.
        render_mode: ``"rgb_array"``, ``"camera"``, ``"human"`` or None.
    """
    return PushEnv(
        task=scenario.task,
        simulator=scenario.simulator,
        preset=scenario.preset,
        variations=scenario.variations,
        observation=observation,
        action=action,
        render_mode=render_mode,
        seed=scenario.seed,
    )


def make_vector(
    scenario: Scenario,
    num_envs: int,
    *,
    workers: int | None = None,
    observation: str | ObservationBuilder | None = None,
    action: str | Sequence[str] | None = None,
    copy: bool = True,
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
) -> WorkerVectorEnv:
    """Environments of a scenario in worker processes, several in each, as one.

    Each has another seed, given to `reset`.

    Args:
        scenario: what to run.
        num_envs: how many environments; four or more for each core.
        workers: processes; by default one for each core, at most one for each environment.
        observation: as in `make`.
        action: as in `make`.
        copy: see `WorkerVectorEnv`.
        autoreset_mode: likewise.
    """
    num_envs = integer("num_envs", num_envs, low=1)
    one = partial(make, scenario, observation=observation, action=action)
    if workers is None:
        workers = min(len(os.sched_getaffinity(0)), num_envs)
    return WorkerVectorEnv(
        [one] * num_envs, workers=workers, copy=copy, autoreset_mode=autoreset_mode
    )


def make_env(*, task: str, **options: Any) -> PushEnv:
    """Make an environment for ``gymnasium.make``; takes variations beside options of `PushEnv`."""
    own = {name: options.pop(name) for name in _OWN if name in options}
    return PushEnv(task=task, variations=options, **own)
