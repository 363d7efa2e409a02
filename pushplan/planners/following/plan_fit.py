"""`PlanFit`: how well the rest of the plan that is driven fits the world as it is now."""

from __future__ import annotations

import math

import numpy as np

from pushplan.control.limits import driven_twist
from pushplan.control.tracking import Progress
from pushplan.interaction import InteractionModel
from pushplan.planners.following.replanning import (
    Comparison,
    Reason,
    Replanning,
    free_length,
    sweep_rest,
)
from pushplan.world import Plan, RobotModel, StaticMap, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_lengths

_NEAR = 3  # so many poses ahead a jam lets nothing wait
_TIGHT_PAUSES = 4.0  # after which a tight plan is made anew
_WALLS = 80  # objects that take as long for each pose of the robot as the walls
_WHOLE = 65_536  # poses times objects, walls included, that are swept in one command
_PART = 16_384  # and those of a part of a longer rest: about a millisecond
_LEAST = 32  # poses of a part


class PlanFit:
    """Knows where on its plan a robot is, and compares the rest of the plan with the world.

    Args:
        robot: that drives the plan.
        rule: differences that ask for a new plan.
    """

    def __init__(self, robot: RobotModel, rule: Replanning) -> None:
        self._rule = rule
        self._progress = Progress(window=2.0 * robot.circumscribed_radius)
        self._clear_of: StaticMap | None = None
        """Static map that the present plan is known to be clear of."""
        self._tight = False
        self._rest = RestSweep()

    def take_up(self, static: StaticMap, *, tight: bool) -> None:
        """Begin with another plan.

        Args:
            static: what it was planned for.
            tight: the plan uses the whole turn rate, or keeps little distance.
        """
        self._clear_of = static
        self._tight = tight

    def time_on(self, world: World, plan: Plan) -> float:
        """Time of the plan at the robot's place [s]."""
        self._progress.update(plan, world.robot_pose)
        return self._progress.time

    def is_used_up(self, world: World, plan: Plan) -> bool:
        """Return True if the robot is at the end of the plan."""
        self._progress.update(plan, world.robot_pose)
        return self._progress.is_over

    def free_length(self, world: World, plan: Plan) -> float:
        """Length of the plan's rest before static obstacles that are new to it [m]."""
        if self._clear_of is world.static:
            return math.inf
        index = self._progress.index(self._progress.update(plan, world.robot_pose))
        free = math.inf
        if self._clear_of != world.static:
            path = np.concatenate([world.robot_pose[None], plan.poses[index + 1 :]])
            free = free_length(world, path)
        if free == math.inf:
            self._clear_of = world.static
        return free

    def comparison(
        self, world: World, plan: Plan, interaction: InteractionModel, weight: float
    ) -> Comparison | None:
        """Compares new plans with the rest of the present one; None where any is taken up."""
        if self._rule.margin is None:
            return None
        index = self._progress.index(self._progress.update(plan, world.robot_pose))
        return Comparison(world, plan, index, interaction, weight, self._rule.margin)

    def reason(
        self,
        world: World,
        plan: Plan,
        planned: World,
        interaction: InteractionModel,
        pause: float,
        at_once: bool,
    ) -> Reason | None:
        """A reason to replace a plan that keeps clear of what is static.

        Args:
            world: the scene now.
            plan: the present plan.
            planned: the scene when a plan was last asked for.
            interaction: predicts the objects.
            pause: least time between two plans for the same reason [s].
            at_once: a jam right ahead does not wait for the pause.
        """
        rule = self._rule
        size = world.robot.circumscribed_radius
        waited = world.time - planned.time
        rested = waited >= pause - 1e-9
        x, y = (float(value) for value in world.robot_pose[:2])
        along = self._progress.update(plan, world.robot_pose)
        index = self._progress.index(along)
        here = self._progress.pose(along)
        if rested and np.hypot(x - here[0], y - here[1]) > rule.offset * size:
            return Reason.OFFSET
        if self._progress.is_over:
            return Reason.USED_UP if rested else None
        if self._tight and waited >= _TIGHT_PAUSES * pause:
            return Reason.TIGHT  # there may be a plan that keeps its distance
        driven = np.hypot(*(world.robot_pose[:2] - planned.robot_pose[:2]))
        if waited >= rule.every_seconds - 1e-9 or driven >= rule.renewal * size:
            return Reason.PERIOD
        end = len(plan.poses)
        if np.isfinite(rule.look_ahead):
            end = min(end, self._progress.index(along + rule.look_ahead * size) + 2)
        return self._surprise(world, plan, (index, end), interaction, rested, at_once)

    def _surprise(
        self,
        world: World,
        plan: Plan,
        part: tuple[int, int],
        interaction: InteractionModel,
        rested: bool,
        at_once: bool,
    ) -> Reason | None:
        """A reason to replan if a part of the plan would not do what was predicted."""
        surprise = self._rule.surprise
        if np.isinf(surprise) and not world.static.convex_parts:
            return None  # nothing can jam
        predicted = plan.object_poses
        if predicted is None or predicted.shape[1] != len(world.movables) or not predicted.size:
            return None
        jammed_at, excess = self._rest.look(world, plan, *part, interaction, rested)
        if jammed_at > _NEAR:
            return Reason.JAM if rested else None
        if jammed_at >= 0:
            return Reason.BLOCKED if rested or at_once else None
        allowed = surprise * world.robot.circumscribed_radius * world.robot.mass
        return Reason.SURPRISE if rested and excess > allowed else None


def reaction_length(world: World, latency: float) -> float:
    """Distance driven until a plan that is asked for now can be followed [m].

    Args:
        world: the scene now.
        latency: time that the planning call takes [s].
    """
    robot = world.robot
    speed = abs(driven_twist(world).course[0])
    braking = 0.5 * speed * speed / robot.max_acceleration
    return latency * speed + braking + robot.circumscribed_radius


class RestSweep:
    """Sweeps the rest of a plan from where everything is, and compares that with its prediction.

    A long rest among many objects is swept in parts, so that a command takes bounded time: in turn
    the next part of the way, and one part farther on, from where the part before has left the
    objects.
    """

    def __init__(self) -> None:
        self._plan: Plan | None = None
        """The plan whose farther parts are being swept."""
        self._at = 0
        self._farther_next = False
        self._excess = 0.0
        self._objects: FloatArray

    def look(
        self,
        world: World,
        plan: Plan,
        index: int,
        end: int,
        interaction: InteractionModel,
        farther: bool,
    ) -> tuple[int, float]:
        """Return the number of poses ahead at which the robot would jam, and the excess of work.

        Args:
            world: the scene now.
            plan: the present plan, with predictions for the objects of the world.
            index: of its last pose that the robot has passed.
            end: index after the last pose to look at.
            interaction: predicts the objects.
            farther: go on with the farther parts of a long rest; if False the next part alone.

        Returns:
            -1 for no jam; and the work beyond what was predicted [kg m], -inf until the last part.
        """
        count = len(world.movables) + _WALLS
        near = end
        if (end - index) * count > _WHOLE:
            near = min(end, index + max(_PART // count, _LEAST))
        if farther and self._farther_next and self._plan is plan:
            return self._look_farther(world, plan, index, near - index, end, interaction)
        jammed_at, excess, objects = _part(world, plan, index, near, interaction)
        if near == end or jammed_at >= 0 or not farther:
            self._plan = None
            return jammed_at, excess if near == end else -math.inf
        if self._plan is not plan:
            self._plan = plan
            self._at = near - 1
            self._excess = excess
            self._objects = objects
        self._farther_next = True
        return -1, -math.inf

    def _look_farther(
        self,
        world: World,
        plan: Plan,
        index: int,
        count: int,
        end: int,
        interaction: InteractionModel,
    ) -> tuple[int, float]:
        """Take the next of the farther parts, of ``count`` poses."""
        self._farther_next = False
        first = self._at
        start = world.moved(robot_pose=plan.poses[first], movable_poses=self._objects)
        self._at = min(end, first + count) - 1
        jammed_at, excess, self._objects = _part(start, plan, first, self._at + 1, interaction)
        self._excess += excess
        if jammed_at < 0 and self._at + 1 < end:
            return -1, -math.inf
        self._plan = None
        if jammed_at >= 0:
            return first - index + jammed_at, -math.inf
        return -1, self._excess


def _part(
    world: World, plan: Plan, index: int, end: int, interaction: InteractionModel
) -> tuple[int, float, FloatArray]:
    """Pose at which a part of a plan jams, its excess of work, and the objects after it."""
    assert plan.object_poses is not None
    now, _ = sweep_rest(world, plan, index, interaction, end)
    masses = world.movables.masses
    excess = _work(now.object_poses, masses) - _work(plan.object_poses[index:end], masses)
    return now.jammed_at, excess, now.object_poses[-1]


def _work(objects: FloatArray, masses: FloatArray) -> float:
    """Sum over objects (K,) with poses (N, K, 3) of mass times path length [kg m]."""
    # what was pushed does not come back to the last bit, and most objects of an office rest
    moved = (objects[-1] != objects[0]).any(axis=1)
    return float(path_lengths(objects[:, moved]) @ masses[moved])
