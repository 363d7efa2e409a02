"""Environments of scenarios, and those that Gymnasium makes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pushplan.envs.push_env import PushEnv
from pushplan.observation import ObservationBuilder
from pushplan.scenarios import Scenario

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


def make_env(*, task: str, **options: Any) -> PushEnv:
    """What ``gymnasium.make`` calls: variations are keyword arguments beside those of `PushEnv`."""
    own = {name: options.pop(name) for name in _OWN if name in options}
    return PushEnv(task=task, variations=options, **own)
