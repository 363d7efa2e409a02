"""A planner with a controller and a replanning rule is a policy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pushplan.control import PathFollower, clamp_twist
from pushplan.control.tracking import Progress
from pushplan.interaction import InteractionModel, QuasiStatic
from pushplan.planners.recovery import back_off
from pushplan.world import (
    Controller,
    InvalidInputError,
    Plan,
    Planner,
    PlanResult,
    Stop,
    Twist,
    World,
)
from pushplan.world.checks import number


@dataclass(frozen=True)
class Replanning:
    """When a plan no longer fits the world. Lengths in units of the circumscribed radius R.

    Args:
        offset: distance from the path that makes a new plan necessary [R].
        surprise: how much more the rest of the plan may cost than was predicted, in units of
            driving R further.
        interval: least time between two plans for the same reason [s of travel of R at full
            speed]; a plan on which the robot would jam is replaced at once.
        never: follow the first plan to its end, as the paper's RRT does.
    """

    offset: float = 0.3
    surprise: float = 0.1
    interval: float = 0.5
    never: bool = False

    def __post_init__(self) -> None:
        for name in ("offset", "surprise", "interval"):
            number(name, getattr(self, name), low=0.0)


class PlanFollower:
    """Plans, drives the plan, and plans again when the world departs from the prediction.

    At every step the rest of the plan is swept again from where everything is now; where that
    costs more than was predicted, or jams, or the robot has left the path, or the plan is used
    up, a new plan is made. If none is found the old one is kept. A differential drive that has no
    plan, or does not get on with its plans, backs off.

    Args:
        planner: makes the plans.
        controller: drives them; `pushplan.control.PathFollower` by default.
        replanning: when to plan again.
        interaction: predicts what the rest of a plan will do; quasi-static by default.
        stop: stop rule of each planning call; the planner's own default if None.
    """

    actions = ("turn_rate", "velocity")

    def __init__(
        self,
        planner: Planner,
        controller: Controller | None = None,
        *,
        replanning: Replanning | None = None,
        interaction: InteractionModel | None = None,
        stop: Stop | None = None,
    ) -> None:
        self.planner = planner
        self.controller = PathFollower() if controller is None else controller
        self.replanning = Replanning() if replanning is None else replanning
        self.interaction = QuasiStatic() if interaction is None else interaction
        self.stop = stop
        self._progress: Progress | None = None
        self._forget(np.random.default_rng(0))

    def reset(self, world: World, rng: np.random.Generator) -> None:
        """Forget the last episode."""
        self._forget(rng)
        self._progress = Progress(window=2.0 * world.robot.circumscribed_radius)

    def _forget(self, rng: np.random.Generator) -> None:
        self.plan_log: list[PlanResult] = []
        """Every planning call since the last reset."""
        self.current_plan: Plan | None = None
        self._rng = rng
        self._planned_at = -np.inf
        self._planned_from = np.full(2, np.nan)
        self._planned_ids = np.zeros(0, dtype=np.int64)
        self._tight = False
        self._in_vain = 0

    def act(self, world: World, observation: Any = None) -> Twist:
        """The twist for this step; plans first where that is necessary."""
        if self._progress is None:
            self.reset(world, self._rng)
        if self._needs_plan(world):
            result = self.planner.plan(world, stop=self.stop, rng=self._rng)
            self.plan_log.append(result)
            moved = float(np.hypot(*(world.robot_pose[:2] - self._planned_from)))
            stuck = moved < 0.05 * world.robot.circumscribed_radius or result.plan is None
            self._in_vain = self._in_vain + 1 if stuck else 0
            self._planned_at, self._planned_from = world.time, world.robot_pose[:2]
            self._planned_ids = world.movables.ids
            if result.plan is not None:
                self.current_plan = result.plan
                self._tight = result.stats.detail.get("tight", 0.0) > 0.0
        if self.current_plan is None or self._in_vain > 3:
            away = back_off(world)
            if away is not None:
                return away
        if self.current_plan is None:
            return clamp_twist(world.robot, 0.0, 0.0)
        return self.controller.command(world, self.current_plan)

    def _needs_plan(self, world: World) -> bool:
        plan, rule = self.current_plan, self.replanning
        size = world.robot.circumscribed_radius
        waited = world.time - self._planned_at
        # a robot that stays stuck thinks less and less often, so that the episode ends in time
        patience: float = rule.interval * 2 ** min(max(self._in_vain - 20, 0), 6)
        rested = waited >= patience * size / world.robot.max_speed - 1e-9
        if plan is None:
            return rested
        if rule.never:
            return False
        if not np.array_equal(world.movables.ids, self._planned_ids):
            return True  # something was delivered, lost or found
        assert self._progress is not None
        x, y = (float(value) for value in world.robot_pose[:2])
        along = self._progress.update(plan, x, y)
        index = self._progress.index(along)
        here = self._progress.pose(along)
        if rested and np.hypot(x - here[0], y - here[1]) > rule.offset * size:
            return True
        if along >= self._progress.total - 1e-9:
            return rested
        if self._tight and waited >= 4.0 * patience * size / world.robot.max_speed:
            return True  # out of the tight place there may be a plan that keeps its distance
        predicted = plan.object_poses
        if predicted is None or predicted.shape[1] != len(world.movables) or not predicted.size:
            return False
        rest = np.concatenate([world.robot_pose[None], plan.poses[index + 1 :]])
        now = self.interaction.sweep(world, rest)
        if now.jammed_at >= 0:
            return rested or (now.jammed_at <= 3 and self._in_vain < 20)
        steps = np.diff(predicted[index:, :, :2], axis=0)
        expected = float(np.hypot(steps[..., 0], steps[..., 1]).sum(axis=0) @ world.movables.masses)
        return rested and now.work - expected > rule.surprise * size * world.robot.mass


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


def policy_for(planner: Planner) -> PlanFollower:
    """The default policy around a planner: follow its plans, plan again when they do not fit.

    Raises:
        InvalidInputError: if the object has no ``plan`` method.
    """
    if not isinstance(planner, Planner):
        raise InvalidInputError(
            f"a planner needs a method plan(world, *, stop, rng), {type(planner).__name__} has none"
        )
    return PlanFollower(planner)
