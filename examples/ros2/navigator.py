"""`Navigator`: Nav2's ComputePathToPose and FollowPath with pushplan. It imports no ROS."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely
from given_path import GivenPath
from scene import NavigationError, Scene

from pushplan.control import ImmediateExecutor, PoseProgressChecker, Progress, PurePursuit
from pushplan.planners import PlanFollower, make_planner, planner_names
from pushplan.planners.following.replanning import Replanning
from pushplan.ros import Messages, plan_from, time_from
from pushplan.runtime import Command, CommandStatus, RunLog, Runner
from pushplan.world import (
    Deadline,
    GoalDisc,
    GoalPose,
    InvalidInputError,
    OwnBudget,
    Plan,
    PlanStatus,
    Stop,
    Twist,
    UnknownNameError,
    World,
)
from pushplan.world.checks import FloatArray

PLANNERS = planner_names(open_water=False)
"""What plans, and what drives on plans of its own."""
PATH = "path"
"""Controller that drives the path as it was given."""
_DEFAULT = {"planner": ("", "GridBased"), "controller": ("", "FollowPath")}
"""Names that stand for the configured one; Nav2's own files use them."""
_FAR_AWAY = 1e6  # of the goal of a path [m]
_CODES = {
    PlanStatus.TIMED_OUT: "TIMEOUT",
    PlanStatus.CANCELLED: "CANCELED",
    PlanStatus.START_BLOCKED: "START_OCCUPIED",
}


@dataclass(frozen=True)
class Step:
    """What to do in one period.

    Args:
        twist: to send to the robot.
        distance: left along the plan, or straight to the goal where there is none [m].
        outcome: empty while the robot is under way, else ``SUCCEEDED``, ``CANCELED`` or an error
            code of FollowPath; it is given when the robot stands.
        reason: of the outcome, in words.
    """

    twist: Twist
    distance: float
    outcome: str = ""
    reason: str = ""


class Navigator:
    """Plans paths and drives them.

    `compute_path` may be called by any thread at any time; `follow` and `step` by one thread, that
    of the control loop; `see` and `cancel` by any.

    Args:
        scene: what is known.
        messages: makes the paths.
        period: of the control loop [s].
        planner: one of `PLANNERS`, for goals that name none.
        controller: for paths that name none: ``path`` drives the path as it is; one of `PLANNERS`
            drives to the end of the path on plans of its own, which it makes again as objects
            move.
        budget: of a call of `compute_path` [s].
        tolerance: how near to the goal the robot has to come [m]: one half is for the path, the
            other one for driving it.
        heading_tolerance: the same of its heading at the goal [rad]; 0 where that is not asked for.
        patience: after how long without getting on, and without a command that can be driven, a
            path is given up [s].
        max_age: odometry that is older stops the robot [s].
        log: keeps what the robot sees and does.

    Raises:
        NavigationError: if there is no such planner or controller.
    """

    def __init__(
        self,
        scene: Scene,
        messages: Messages,
        *,
        period: float = 0.05,
        planner: str = "push-aware",
        controller: str = PATH,
        budget: float = 1.0,
        tolerance: float = 0.1,
        heading_tolerance: float = 0.0,
        patience: tuple[float, float] = (10.0, 1.0),
        max_age: float = 0.5,
        log: RunLog | None = None,
    ) -> None:
        self.scene, self.messages = scene, messages
        self.planner, self.controller = planner, controller
        self.budget, self.tolerance, self.patience = budget, tolerance, patience
        self.heading_tolerance = heading_tolerance
        self._runner_options: dict[str, Any] = {"period": period, "max_age": max_age, "log": log}
        self._max_age = max_age
        self._runners: dict[str, Runner] = {}
        self._path = GivenPath()
        self._handing_over = threading.Lock()
        self._driven = ""
        self._goal: GoalDisc | None = None
        self._outcome = ("", "")
        for kind in _DEFAULT:
            self._named(kind, "")  # an unknown one is refused before there is a goal

    def _named(self, kind: str, name: str) -> str:
        if name in _DEFAULT[kind]:
            name = self.planner if kind == "planner" else self.controller
        names = PLANNERS if kind == "planner" else (PATH, *PLANNERS)
        if name not in names:
            reason = str(UnknownNameError(kind, name, names))
            raise NavigationError(f"INVALID_{kind.upper()}", reason)
        return name

    def close(self) -> None:
        """End planning."""
        for runner in self._runners.values():
            runner.close()

    def compute_path(
        self, goal: Any, start: Any = None, planner_id: str = "", stop: Stop | None = None
    ) -> tuple[Any, float]:
        """Serve ComputePathToPose.

        Args:
            goal: ``geometry_msgs/PoseStamped``.
            start: the same, or None for where the robot is.
            planner_id: one of `PLANNERS`; the default one if empty or ``GridBased``.
            stop: a token that cancels the call.

        Returns:
            ``nav_msgs/Path`` and the time that planning has taken [s].

        Raises:
            NavigationError: if there is none.
        """
        name = self._named("planner", planner_id)
        end = self._goal_at(self._pose(goal))
        world = self.scene.world(end)
        if start is not None:
            world = world.moved(robot_pose=self._pose(start), robot_twist=np.zeros(3))
        _check_inside(world, "START", world.robot_pose[:2])
        _check_inside(world, "GOAL", end.center)
        rule, began = OwnBudget() | Deadline(self.budget), time.perf_counter()
        try:
            result = make_planner(name).plan(
                world, stop=rule if stop is None else rule | stop, rng=np.random.default_rng(0)
            )
        except InvalidInputError as error:  # not a planner for such a robot or goal
            raise NavigationError("INVALID_PLANNER", str(error)) from error
        status = result.status
        turned = (
            result.plan is not None
            and isinstance(end, GoalPose)
            and abs(end.heading_error(result.plan.poses[-1, 2])) > end.heading_tolerance
        )
        if result.plan is None or turned or status is PlanStatus.APPROXIMATE:
            code = _CODES.get(status, "NO_VALID_PATH")
            if status is PlanStatus.GOAL_UNREACHABLE and _is_occupied(world, end.center):
                code = "GOAL_OCCUPIED"
            raise NavigationError(code, f"{status.label}: {status.remedy}")
        return self.messages.path(result.plan, world.time), time.perf_counter() - began

    def follow(self, path: Any, controller_id: str = "") -> None:
        """Begin to serve FollowPath, or go over to another path while driving.

        Args:
            path: ``nav_msgs/Path``.
            controller_id: ``path`` or one of `PLANNERS`; the default one if empty or
                ``FollowPath``.

        Raises:
            NavigationError: if it cannot be driven; what was driven before goes on.
        """
        name = self._named("controller", controller_id)
        robot = self.scene.robot
        try:
            plan = plan_from(path, robot)
        except InvalidInputError as error:
            raise NavigationError("INVALID_PATH", str(error)) from error
        try:
            plan = replace(plan, poses=self.scene.placed(plan.poses, path))
        except InvalidInputError as error:
            raise NavigationError("TF_ERROR", str(error)) from error
        end = self._goal_at(plan.poses[-1])
        # a path may pass its own end, so that the runner is not told of it: see `_has_arrived`
        goal = GoalDisc(end.center + _FAR_AWAY, end.radius) if name == PATH else end
        world = self.scene.world(goal)
        before = self._runners.get(self._driven)
        if name == self._driven != PATH and self._is_on_its_way_to(goal):
            return
        if name == PATH:
            self._path.given, self._path.made, self._path.left = plan, time_from(path), None
        with self._handing_over:  # what comes in meanwhile has the goal of before
            try:
                runner = self._runner(name)
                runner.start(world)
            except InvalidInputError as error:  # not a policy for such a robot or goal
                raise NavigationError("INVALID_CONTROLLER", str(error)) from error
            self._driven, self._goal, self._outcome = name, goal, ("", "")
        self._end_of_path = end
        if before is not None and before is not runner:
            before.cancel()
        self._checker = PoseProgressChecker(robot)
        self._progress = Progress(2.0 * robot.circumscribed_radius)
        self._clock, self._time, self._planned_at = world.time, 0.0, 0.0
        self._driveable_at = -math.inf
        self.see()

    @property
    def is_driving(self) -> bool:
        """Whether `step` has to be called: from `follow` until the robot stands."""
        return self._goal is not None

    def see(self) -> None:
        """Tell the robot's loop that odometry has come in."""
        if self._handing_over.acquire(blocking=False):
            try:
                if self._goal is not None:
                    self._runners[self._driven].update(self.scene.world(self._goal))
            finally:
                self._handing_over.release()

    def cancel(self) -> None:
        """Bring the robot to a stand; `step` says when it has."""
        self._end("CANCELED", "canceled")

    def step(self, now: float) -> Step:
        """What to drive now; never plans, never waits.

        Args:
            now: by the clock of the messages [s].
        """
        goal, passed = self._goal, now - self._clock
        assert goal is not None, "call follow(path) first"
        command, world = self._runners[self._driven].command(now), self.scene.world(goal)
        left = self._distance_left(command.plan, world)
        # a clock that steps takes away, and adds, no patience
        self._clock, self._time = now, self._time + min(max(passed, 0.0), self._max_age)
        if not self._outcome[0]:
            self._judge(command, world, self._time, left)
        stands = command.twist == Twist(0.0, 0.0)
        outcome = self._outcome if stands else ("", "")
        if outcome[0]:
            self._goal = None
        return Step(command.twist, left, *outcome)

    def _judge(self, command: Command, world: World, now: float, left: float) -> None:
        """End driving where the robot has arrived, or gets nowhere."""
        getting_on, driveable = self.patience
        stale = command.status is CommandStatus.STALE
        failed = stale or command.status is CommandStatus.FAILED
        if not failed or self._driveable_at == -math.inf:
            self._driveable_at = now
        self._checker.update(world.robot_pose, now)
        if command.plan is not None:
            self._planned_at = now
        if command.status is CommandStatus.DONE or self._has_arrived(world, left):
            self._end("SUCCEEDED", "")
        elif now - self._driveable_at > driveable:
            self._end("TF_ERROR" if stale else "NO_VALID_CONTROL", command.reason)
        elif max(self._checker.idle, now - self._planned_at) > getting_on:
            why = self._path.blocked if self._driven == PATH else ""
            why = why or command.reason or "the robot does not move"
            self._end("FAILED_TO_MAKE_PROGRESS", f"no progress for {getting_on:g} s: {why}")

    def _has_arrived(self, world: World, left: float) -> bool:
        """Whether the robot has driven the given path, and is at its end."""
        there = self._end_of_path.reached_by(world.robot_pose)
        return self._driven == PATH and there and left <= self.tolerance

    def _end(self, code: str, reason: str) -> None:
        if self._goal is not None and not self._outcome[0]:
            self._outcome = code, reason
            self._runners[self._driven].cancel(reason)

    def _distance_left(self, plan: Plan | None, world: World) -> float:
        """Along the plan, or straight to the goal where there is none [m]."""
        if plan is None:
            return self._end_of_path.distance(*world.robot_pose[:2].tolist())
        along = self._progress.update(plan, world.robot_pose)
        left = self._progress.total - along
        if self._driven == PATH:
            self._path.left = left
        return left

    def _is_on_its_way_to(self, goal: GoalDisc) -> bool:
        if self._goal is None or self._outcome[0]:
            return False
        turned = 0.0
        if isinstance(self._goal, GoalPose) and isinstance(goal, GoalPose):
            turned = abs(self._goal.heading_error(goal.heading))
        near = math.dist(self._goal.center, goal.center) <= self.tolerance
        return near and turned <= self.heading_tolerance

    def _runner(self, name: str) -> Runner:
        if name not in self._runners:
            if name == PATH:
                never = Replanning(never=True)
                follower = PlanFollower(self._path, PurePursuit(), replanning=never)
                runner = Runner(follower, executor=ImmediateExecutor(), **self._runner_options)
            else:
                runner = Runner(name, **self._runner_options)
            self._runners[name] = runner
        return self._runners[name]

    def _pose(self, message: Any) -> FloatArray:
        try:
            return self.scene.pose(message)
        except InvalidInputError as error:
            raise NavigationError("TF_ERROR", str(error)) from error

    def _goal_at(self, pose: FloatArray) -> GoalDisc:
        if self.heading_tolerance > 0.0:
            return GoalPose(pose[:2], 0.5 * self.tolerance, pose[2], 0.5 * self.heading_tolerance)
        return GoalDisc(pose[:2], 0.5 * self.tolerance)


def _check_inside(world: World, which: str, point: FloatArray) -> None:
    x0, y0, x1, y1 = world.static.bounds.tolist()
    x, y = point.tolist()
    if not (x0 <= x <= x1 and y0 <= y <= y1):
        raise NavigationError(
            f"{which}_OUTSIDE_MAP",
            f"({x:g}, {y:g}) is outside of the map: x {x0:g} to {x1:g}, y {y0:g} to {y1:g}",
        )


def _is_occupied(world: World, point: FloatArray) -> bool:
    """Whether the robot cannot be at a point, whatever its heading."""
    place, clear = shapely.Point(point), world.robot.inscribed_radius
    return any(shapely.Polygon(part).distance(place) < clear for part in world.static.convex_parts)
