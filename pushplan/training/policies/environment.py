"""`TrainingEnv`: a task as a learner sees it, one decision a step."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import NDArray

from pushplan.envs import PushEnv
from pushplan.learned.describing import specification_of
from pushplan.learned.outputs import MODES, ActionSpec
from pushplan.learned.specification import Specification, builder_from_dict
from pushplan.observation import ObservationBuilder
from pushplan.training.policies.config import TrainingConfig
from pushplan.world import InvalidInputError, World, stream

TRAINING_SEEDS = 2**20
"""Layouts of training have seeds from here on; those below are for validation and scoring."""
VALIDATION_SEEDS = 500_000
PATIENCE = 4
"""Factor by which a validation episode may last longer than one of training."""
_SEED_COUNT = 2**30


class _Blank:
    """In place of a builder: steps between two decisions need not be observed."""

    def __init__(self, builder: ObservationBuilder) -> None:
        self.shape = builder.shape
        self.dtype = builder.dtype
        self.low = builder.low
        self.high = builder.high
        self.beams = getattr(builder, "beams", 0)  # of the lidar of the environment
        self._nothing = np.zeros(self.shape, self.dtype)

    def observe(self, world: World) -> NDArray[Any]:
        """Always the same zeros."""
        return self._nothing


def environments(config: TrainingConfig, observation: Any, action: Any) -> list[PushEnv]:
    """An environment for each scenario of a training or of its data set."""
    return [
        PushEnv(
            task=config.task,
            simulator=config.simulator,
            preset=config.preset,
            variations=dict(variations),
            observation=observation,
            action=action,
        )
        for variations in config.scenarios
    ]


class TrainingEnv(gymnasium.Env[NDArray[Any], Any]):
    """Draws a scenario for each episode, repeats each decision, scales the reward.

    Observations are those of the configuration; actions are outputs of the network in [-1, 1]
    (`ActionSpec`), or with spatial action maps the number of a pixel. ``info`` at the end of an
    episode holds ``is_success`` and ``share``, how many of the sub-tasks are done.
    """

    def __init__(self, config: TrainingConfig) -> None:
        self.config = config
        self._builder = builder_from_dict(config.observation)
        blank: Any = _Blank(self._builder)
        self._envs = environments(config, blank, config.action.mode)
        self._env = self._envs[0]
        self.action = action_spec(config, self._env)
        for env in self._envs[1:]:
            if (other := action_spec(config, env)) != self.action:
                raise InvalidInputError(
                    f"the scenarios of one network must have actions alike, got {self.action} and "
                    f"{other}"
                )
        self.observation_space: Any = self._env.observation_space
        self._pixels = self.action.output == "pixel_values"  # actions are numbers of pixels
        self.action_space: Any = Box(-1.0, 1.0, self.action.shape, np.float32)
        if self._pixels:
            self.action_space = Discrete(int(np.prod(self.action.shape)))
        self._rng = stream(config.seed, "starts")
        self._decisions = 0
        self._limit = config.limit

    @property
    def specification(self) -> Specification:
        """Specification of a network that has learned here."""
        config = self.config
        facts = {
            "algorithm": config.algorithm,
            "scenarios": [dict(one) for one in config.scenarios],
            "steps": config.steps,
            "seed": config.seed,
        }
        return specification_of(self._env.task, self._builder, self.action, facts)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: begins another sequence of starts.
            options: ``{"layout": N}`` asks for the N-th validation start.
        """
        super().reset(seed=seed)
        if seed is not None:
            self._rng = stream(seed, "starts")
        if options is not None and "layout" in options:
            index = int(options["layout"])
            layout = VALIDATION_SEEDS + index
            patience = PATIENCE
        else:
            index = int(self._rng.integers(len(self._envs)))
            layout = TRAINING_SEEDS + int(self._rng.integers(_SEED_COUNT))
            patience = 1
        self._env = self._envs[index % len(self._envs)]
        self._limit = patience * self.config.limit
        self._decisions = 0
        self._env.reset(seed=layout)
        return self.observe(), {}

    def step(self, action: Any) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Carry out one decision."""
        if self._pixels:
            commands = self.action.chosen(divmod(int(action), self.action.shape[1]))
        else:
            commands = self.action.steps(action)
        total = 0.0
        for command in commands:
            _, reward, terminated, truncated, info = self._env.step(command)
            total += reward
            if terminated or truncated:
                break
        self._decisions += 1
        if self._limit and self._decisions >= self._limit and not terminated:
            truncated = True
        told: dict[str, Any] = {}
        if terminated or truncated:
            success = bool(info["success"])
            done = info.get("completed")
            told = {
                "is_success": success,
                "share": float(success) if done is None else float(np.mean(done)),
            }
        return self.observe(), self.config.reward_scale * total, terminated, truncated, told

    def observe(self) -> NDArray[Any]:
        """Return the network's observation of the present scene."""
        return self._env.observed(self._builder)

    def close(self) -> None:
        """Close the environments."""
        for env in self._envs:
            env.close()


def action_spec(config: TrainingConfig, env: PushEnv) -> ActionSpec:
    """Return the meaning of the network's output in an environment."""
    output = config.action.output
    mode = config.action.mode
    shapes = {"direction": (2,), "chunk": (config.action.horizon, MODES[mode])}
    shape: tuple[int, ...] = shapes.get(output, (MODES[mode],))
    window = 0.0
    if output == "pixel_values":
        view = builder_from_dict(config.observation)
        side = env.task.waypoint_window
        if getattr(view, "window", None) != (side, side) or getattr(view, "north_up", False):
            raise InvalidInputError(
                f"a spatial action map needs an image around the robot with a window of "
                f"{side:g} x {side:g} m, which waypoints reach, got {config.observation}"
            )
        shape = view.shape[1:]
        window = side
    return ActionSpec(
        mode=mode,
        output=output,
        shape=shape,
        repeat=config.action.repeat,
        window=window,
        step=env.task.heading_step if mode == "heading" else 0.0,
    )
