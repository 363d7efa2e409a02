"""`NetworkPolicy`: a function from observation to output, with its specification, as a policy."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pushplan.learned.outputs import CHOOSING, BadOutputError
from pushplan.learned.specification import Specification, close
from pushplan.observation import ObservationBuilder
from pushplan.world import InvalidInputError, World
from pushplan.world.checks import FloatArray, IntArray

_STILL = 0.005
_STILL_TURN = 0.02
"""Motion below which nothing has really moved [sides of a map of pixels or heading steps, rad]."""
_REMEMBERED = 1000
"""Latest decisions that are not repeated from the same place."""

Function = Callable[[NDArray[Any]], NDArray[Any]]
"""From one observation, without batch axis, to the output for it."""


class NetworkPolicy:
    """Asks a network what to do, and keeps to each decision for as long as it was trained to.

    A pixel (``pixel_values``) or ``direction`` that was chosen before in the episode, when robot
    and objects were where they are now, is not chosen again, nor are its neighbours, as long as
    others are left: without memory, a network that drives against a wall does so for ever.

    Args:
        function: the network.
        specification: what it sees and what its output means.
        label: what errors call it.
    """

    def __init__(
        self, function: Function, specification: Specification, label: str = "policy"
    ) -> None:
        self.specification = specification
        self.label = label
        self._function = function
        self._ahead: deque[FloatArray] = deque()  # actions that are decided
        self._decisions: deque[_Decision] = deque(maxlen=_REMEMBERED)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.label!r})"

    @property
    def observation(self) -> ObservationBuilder:
        """Builder of the observations that the policy needs."""
        return self.specification.observation

    @property
    def actions(self) -> tuple[str, ...]:
        """The action mode that it needs."""
        return (self.specification.action.mode,)

    @property
    def steps_per_decision(self) -> int:
        """Steps for which a decision stands."""
        return self.specification.action.repeat

    def incompatibility(self, scenario: Any) -> str | None:
        """The task or preset that it was made for, if a scenario has another one."""
        for kind in ("task", "preset"):
            mine = getattr(self.specification, f"{kind}s")
            theirs = getattr(scenario, kind)
            # the name of a user's task is not in the scenario: `check_environment` compares it
            if mine and theirs not in mine and ":" not in theirs:
                return f"made for {kind} {', '.join(mine)}"
        return None

    def check_environment(self, env: Any, scenario: Any = None) -> None:
        """Refuse an environment that it was not made for.

        Only what the environment tells about itself is compared: ``task.name``,
        ``task.control_step``, ``task.waypoint_window``, ``task.heading_step`` and
        ``observation_space``; and ``preset`` of the scenario.

        Raises:
            InvalidInputError: naming what the file says and what the environment has.
        """
        task = getattr(env, "task", None)
        spec = self.specification
        for kind, names, name in (
            ("task", spec.tasks, getattr(task, "name", None)),
            ("preset", spec.presets, getattr(scenario, "preset", None)),
        ):
            if names and isinstance(name, str) and name not in names:
                raise self._mismatch(kind, ", ".join(names), name)
        for kind, length, has in (
            ("control_step [s]", spec.control_step, getattr(task, "control_step", None)),
            ("waypoint_window [m]", spec.action.window, getattr(task, "waypoint_window", None)),
            ("heading_step [m]", spec.action.step, getattr(task, "heading_step", None)),
        ):
            if length and has is not None and not close(length, has):
                raise self._mismatch(kind, f"{length:g}", f"{has:g}")
        space = getattr(env, "observation_space", None)
        if space is not None and space.shape != self.observation.shape:
            raise self._mismatch("observation shape", self.observation.shape, space.shape)

    def _mismatch(self, kind: str, mine: object, theirs: object) -> InvalidInputError:
        return InvalidInputError(
            f"policy {self.label!r} was made for {kind} {mine}, the environment has {theirs}"
        )

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode.

        Raises:
            InvalidInputError: if the robot is another one than the network was made for.
        """
        self._ahead.clear()
        self._decisions.clear()
        if self.specification.robot is None:
            return
        if (difference := self.specification.robot.difference(world.robot)) is not None:
            raise InvalidInputError(f"policy {self.label!r} was made for {difference}")

    def act(self, world: World, observation: Any = None) -> FloatArray:
        """The action for this step.

        With ``pixel_values`` or ``direction``, to be asked for once for each waypoint or heading,
        when the last one was reached or given up: from the same place it gives another one the
        next time.

        Args:
            world: the snapshot.
            observation: what the environment observed; made from ``world`` if None.

        Raises:
            InvalidInputError: if the observation has another shape or type.
            BadOutputError: if the network gives something that is no action.
        """
        if not self._ahead:
            seen = observation
            if seen is None:
                seen = self.observation.observe(world)
            self._check(seen)
            try:
                actions = self._decide(world, seen)
            except BadOutputError as error:
                raise BadOutputError(f"policy {self.label!r}: {error}") from None
            self._ahead.extend(actions.astype(np.float64))
        return self._ahead.popleft()

    def _decide(self, world: World, seen: NDArray[Any]) -> NDArray[np.float32]:
        """(repeat, n) the next actions."""
        spec = self.specification.action
        output = self._function(seen)
        if spec.output not in CHOOSING:
            return spec.steps(output)
        still = _STILL * (spec.window or spec.step)
        tried = [old.choice for old in self._decisions if old.was_made_at(world, still)]
        choice = spec.choose(output, tried)
        objects = world.movables
        self._decisions.append(_Decision(objects.ids, world.robot_pose, objects.poses, choice))
        return spec.chosen(choice)

    def _check(self, seen: Any) -> None:
        shape = self.observation.shape
        dtype = self.observation.dtype
        if isinstance(seen, np.ndarray) and seen.shape == shape and seen.dtype == dtype:
            return
        found = f"{getattr(seen, 'dtype', type(seen).__name__)} of shape {np.shape(seen)}"
        raise InvalidInputError(
            f"policy {self.label!r} was made for observations {dtype} of shape {shape}, "
            f"the environment gave {found}"
        )


class _Decision(NamedTuple):
    """Choice of a pixel or a direction, and where things were at that time."""

    ids: IntArray
    robot: FloatArray
    objects: FloatArray
    choice: Any  # (row, column), or an angle [rad]

    def was_made_at(self, world: World, still: float) -> bool:
        """Return True if robot and objects, still the same ones, have moved less than ``still``."""
        if not np.array_equal(self.ids, world.movables.ids):
            return False
        dx, dy, turn = (world.robot_pose - self.robot).tolist()
        if math.hypot(dx, dy) >= still or abs(math.remainder(turn, math.tau)) >= _STILL_TURN:
            return False
        moves = world.movables.poses - self.objects
        return bool((np.hypot(moves[:, 0], moves[:, 1]) < still).all())
