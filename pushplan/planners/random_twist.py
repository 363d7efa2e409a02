"""`RandomTwist`: random commands, the zero of every scale."""

from __future__ import annotations

from typing import Any

import numpy as np

from pushplan.world import Twist, World


class RandomTwist:
    """Draws every command uniformly from the robot's limits: the zero of every scale."""

    actions = ("turn_rate", "velocity")

    def __init__(self) -> None:
        self._rng = np.random.default_rng(0)

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Take the generator of the new episode."""
        self._rng = rng

    def act(self, world: World, observation: Any = None) -> Twist:
        """A random twist."""
        robot = world.robot
        linear = self._rng.uniform(robot.min_speed, robot.max_speed)
        return Twist(linear, self._rng.uniform(-robot.max_turn_rate, robot.max_turn_rate))
