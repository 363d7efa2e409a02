"""`RearrangementPolicy`: what the policies for goals of objects have in common."""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np

from pushplan.control import EpisodeClock
from pushplan.geometry.transforms import arc_step
from pushplan.planners.arguments import check_pusher
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.planners.warm_up_worlds import warm_up_worlds
from pushplan.world import Twist, World
from pushplan.world.checks import expect

_STEPS = 150
_PERIOD = 0.2  # [s]


class RearrangementPolicy(ABC):
    """Refuses what no push can be made for, and chooses one command for each instant.

    Args:
        config: settings.
    """

    actions = ("velocity",)
    goal_kind = "objects"

    def __init__(self, config: RearrangementConfig | None = None) -> None:
        self.config = expect("config", config or RearrangementConfig(), RearrangementConfig)
        self._forget()

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode."""
        self._forget()

    def warm_up(self) -> None:
        """Load the kernels that an episode may need."""
        _drive_in_small_worlds(type(self))

    def act(self, world: World, observation: Any = None) -> Twist:
        """The velocity for this step; stops when nothing is left to be done.

        Raises:
            InvalidInputError: if the goal is one for the robot, or the robot cannot stop.
        """
        check_pusher(world)  # before the clock takes the snapshot
        return self._clock.command_for(world, self._act)

    def _forget(self) -> None:
        """Begin an episode."""
        self._clock = EpisodeClock(self.config.response)
        self._recovery: Callable[[World, float], Twist | None] | None = None

    def _recover(self, world: World) -> Twist | None:
        """The next command of a recovery; None where none is under way."""
        if self._recovery is None:
            return None
        command = self._recovery(world, self._clock.held)
        if command is None:
            self._recovery = None
        return command

    @abstractmethod
    def _act(self, world: World) -> Twist:
        """The velocity for an instant."""


@functools.cache
def _drive_in_small_worlds(policy: Callable[[], RearrangementPolicy]) -> None:
    """Let a new policy plan and drive for boxes in each kind of task."""
    for world in warm_up_worlds("rearrangement"):
        driven = policy()
        for _ in range(_STEPS):
            twist = driven.act(world)
            pose = np.empty(3)
            # nothing is in the robot's way
            here = np.array(world.robot_pose)
            arc_step(here, _PERIOD * twist.linear, _PERIOD * twist.angular, pose)
            world = world.moved(robot_pose=pose, time=world.time + _PERIOD)
