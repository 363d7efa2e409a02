"""`RearrangementPolicy`: what the policies for goals of objects have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np

from pushplan.control import EpisodeClock, ImmediateExecutor
from pushplan.imports.on_demand import need
from pushplan.planners.arguments import check_pusher
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.world import PlanningExecutor, Twist, World
from pushplan.world.checks import expect


class RearrangementPolicy(ABC):
    """Refuses what no push can be made for, and chooses one command for each instant.

    Args:
        config: settings.
    """

    actions = ("velocity",)
    goal_kind = "objects"
    _look_around: Any = None
    """A `LookAround`, once one is needed."""
    _executor: PlanningExecutor = ImmediateExecutor()

    def __init__(self, config: RearrangementConfig | None = None) -> None:
        self.config = expect("config", config or RearrangementConfig(), RearrangementConfig)
        self._forget()

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode."""
        self._forget()
        self._rng = rng

    def act(self, world: World, observation: Any = None) -> Twist:
        """The velocity for this step; stops when nothing is left to be done.

        Raises:
            InvalidInputError: if the goal is one for the robot, or the robot cannot stop.
        """
        self._check(world)  # before the clock takes the snapshot
        return self._clock.command_for(world, self._act_or_look)

    def _act_or_look(self, world: World) -> Twist:
        """The velocity for an instant; looks around where no object is known that can be moved."""
        idle = (world.completed | world.movables.fixed).all() and not world.goal_reached
        if world.unseen is not None and idle:
            if (back := self._recover(world)) is not None:
                return back
            if self._look_around is None:  # it imports what nothing else here needs
                module = need("pushplan.planners.rearrangement.look_around")
                self._look_around = module.LookAround(self._executor, self._rng)
            twist: Twist | None = self._look_around.command(world)
            if twist is not None:
                return twist
        return self._act(world)

    def _check(self, world: World) -> None:
        """Refuse a world that nothing can be done with."""
        check_pusher(world)

    def _forget(self) -> None:
        """Begin an episode."""
        self._clock = EpisodeClock(self.config.response)
        self._look_around = None
        self._rng = np.random.default_rng(0)
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
