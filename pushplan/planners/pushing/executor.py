"""`PushExecutor`: get behind a box, push it along a path, and begin again where it is lost."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field, fields

import numpy as np

from pushplan.control import EpisodeClock, LegFollower, Legs, ProgressChecker, Retreat, clamp_twist
from pushplan.planners.pushing import contact_kernels
from pushplan.planners.pushing.approach import find_approach
from pushplan.planners.pushing.clearance import Clearance
from pushplan.planners.pushing.mpc import PushingMpc
from pushplan.planners.pushing.observers import PoseObserver
from pushplan.planners.pushing.path import PushPath
from pushplan.planners.pushing.pushing_config import PushingConfig
from pushplan.world import Drive, InvalidInputError, Plan, StaticMap, Twist, World
from pushplan.world.checks import FloatArray, expect, integer, number

_NOWHERE = contact_kernels.Contact(0.1, 0.1, 0.0, 0.1, -0.1, 0.1, 0.1, 0.0)
"""A box for a robot that pushes none."""
_GAP = 1e9
_MOVED, _TWISTED = 0.2, 0.35
"""A box that was moved by more while the robot drove up to it [R, rad] is approached anew."""
_DETOURS = 4
_END = 1e-3  # length of a path that is not worth another push [circumscribed radii]
_PROGRESS = 0.02  # by which a push has to get on within its patience [circumscribed radii]
_LOOK = 0.2
"""Time for which an approach must stay clear of static things, at least [s]."""


class PushPhase(enum.Enum):
    """What a `PushExecutor` is doing."""

    APPROACH = "approach"
    PUSH = "push"
    RECOVER = "recover"
    DONE = "done"
    FAILED = "failed"

    @property
    def is_over(self) -> bool:
        """Whether nothing is left to do."""
        return self in (PushPhase.DONE, PushPhase.FAILED)


@dataclass(frozen=True)
class PushTask:
    """One box, and where to push it.

    Args:
        box_id: label of the box.
        path: of its centre.
        speed: of the robot while it pushes [m/s]; its greatest if None.
        tolerance: how far before the end of the path it counts as done [m].
    """

    box_id: int
    path: PushPath
    speed: float | None = None
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        integer("box_id", self.box_id)
        expect("path", self.path, PushPath)
        if self.speed is not None:
            number("speed", self.speed, low=0.0, open_low=True)
        number("tolerance", self.tolerance, low=0.0)


@dataclass(frozen=True)
class PushStatus:
    """How a push is going.

    Args:
        phase: what is being done.
        reason: why the last attempt, or the push, ended: ``"end"`` (the box is at the end of its
            path), ``"gone"`` (it has been taken off the map), ``"lost"`` (it slid off),
            ``"astray"`` (too far from its path), ``"stuck"`` (the robot does not move),
            ``"blocked"`` (something static is in the way), ``"no_approach"`` (the robot cannot get
            behind it); empty until then.
        attempts: pushes that were begun since the box last made progress.
        left: length of the path that is left [m].
    """

    phase: PushPhase
    reason: str
    attempts: int
    left: float


@dataclass(frozen=True)
class ExecutorConfig:
    """Settings of `PushExecutor`. R is the robot's circumscribed radius.

    Args:
        mpc: of the push.
        slack: clearance between bumper and box when the push begins [R].
        retreat: how far it backs off before it gets behind the box anew [R].
        attempts: pushes without progress after which it fails.
        progress: what counts as progress [R].
        rim: fraction of the pushed face's half width that has to lie on the bumper beyond the box's
            centre, on either side.
        gap: distance of a lost box from the bumper [R].
        astray: distance of the box from its path at which the path is joined anew [R].
        patience: time without moving after which the robot is stuck [s].
    """

    mpc: PushingConfig = field(default_factory=PushingConfig)
    slack: float = 0.08
    retreat: float = 0.5
    attempts: int = 4
    progress: float = 0.5
    rim: float = 0.15
    gap: float = 0.4
    astray: float = 0.8
    patience: float = 1.5

    def __post_init__(self) -> None:
        expect("mpc", self.mpc, PushingConfig)
        integer("attempts", self.attempts, low=1)
        for item in fields(self):
            if item.name not in ("mpc", "attempts"):
                number(item.name, getattr(self, item.name), low=0.0, open_low=True)


class PushExecutor:
    """Carries out one push after another; `status` says how it goes.

    It drives behind the box, around static things and where it can around other boxes, pushes with
    `PushingMpc`, and when the box slides off, the robot gets stuck or something static is in the
    way it backs off and begins again with what is left of the path. A new task begins with the
    first call that has it. The same worlds give the same commands.

    Args:
        config: settings.
    """

    def __init__(self, config: ExecutorConfig | None = None) -> None:
        self.config = ExecutorConfig() if config is None else config
        expect("config", self.config, ExecutorConfig)
        self.mpc = PushingMpc(self.config.mpc)
        """The controller of the push, with its estimate of the box on the bumper."""
        self._task: PushTask | None = None
        self._phase, self._reason = PushPhase.APPROACH, ""
        self._clock = EpisodeClock(self.config.mpc.period)
        self._observer = PoseObserver(self.config.mpc.observer_gain, self.config.mpc.delay)
        self._forget()

    def reset(self, world: World) -> None:
        """Forget the last episode; ``world`` is the start of the next one."""
        self._task = None
        self._clock.reset()
        self._observer = PoseObserver(self.config.mpc.observer_gain, self.config.mpc.delay)
        self.mpc.reset(world)

    def _forget(self) -> None:
        self._attempts, self._left, self._left_then = 0, math.inf, math.inf
        self._driver: LegFollower | None = None
        self._stopped = False
        self._detours = self._failed_ways = 0
        self._box_then: FloatArray = np.zeros(3)
        self._plan: Plan | None = None
        self._static: StaticMap | None = None
        self._retreat: Retreat | None = None
        self._progress: ProgressChecker | None = None

    @property
    def status(self) -> PushStatus:
        """How the present push is going."""
        left = self._left if math.isfinite(self._left) else 0.0
        return PushStatus(self._phase, self._reason, self._attempts, left)

    def command(self, world: World, task: PushTask) -> Twist:
        """The velocity to drive now; stands when the task is over.

        Args:
            world: the scene as observed.
            task: what to do; a task that is not the one of the last call begins afresh.

        Raises:
            InvalidInputError: if the robot cannot stop, or the task is none.
        """
        expect("task", task, PushTask)
        if expect("world", world, World).robot.drive is not Drive.DIFFERENTIAL:
            raise InvalidInputError("pushing along a path needs a differential drive")
        return self._clock.command_for(world, lambda _: self._execute(world, task))

    def _execute(self, world: World, task: PushTask) -> Twist:
        if task is not self._task:
            self._forget()
            self._task = task
            self._phase, self._reason = PushPhase.APPROACH, ""
        size = world.robot.circumscribed_radius
        pose = self._observer.observe(world.robot_pose, world.time, size)
        k = np.flatnonzero(world.movables.ids == task.box_id)
        if len(k) == 0 and not self._phase.is_over:
            self._end(PushPhase.DONE, "gone")
        twist = Twist(0.0, 0.0)
        for _ in range(4):  # phases that end at once
            phase = self._phase
            if phase.is_over:
                twist = clamp_twist(world.robot, 0.0, 0.0)
                break
            step = {
                PushPhase.APPROACH: self._approach,
                PushPhase.PUSH: self._push,
                PushPhase.RECOVER: self._recover,
            }[phase]
            found = step(world, task, int(k[0]), pose)
            if found is not None:
                twist = found
                break
        self._observer.send(world.time, twist)
        self.mpc.note(world.time, twist)
        return twist

    def _end(self, phase: PushPhase, reason: str) -> None:
        self._phase, self._reason = phase, reason

    def _approach(self, world: World, task: PushTask, k: int, pose: FloatArray) -> Twist | None:
        """Drive behind the box."""
        if self._driver is None:
            self._driver = self._set_out(world, task, k)
        elif self._was_moved(world, k) and self._detours < _DETOURS:
            self._detours += 1
            self._attempts -= 1
            self._driver = self._set_out(world, task, k)
        if self._driver is None:
            return None
        command = self._driver.command(pose, world.time, self._clock.held, stopped=self._stopped)
        self._stopped = False
        if command is None:
            arrived = self._driver.arrived
            self._driver, self._detours = None, 0
            self.mpc.forget()
            least = _PROGRESS * world.robot.circumscribed_radius
            self._progress = ProgressChecker(least, self.config.patience)
            if arrived:
                self._phase = PushPhase.PUSH
            else:
                self._failed_ways += 1
                self._give_up(world, "no_approach", pose)
            return None
        fraction = self._free(world, pose, command)
        self._stopped = fraction < 0.05
        return clamp_twist(world.robot, fraction * command.linear, fraction * command.angular)

    def _set_out(self, world: World, task: PushTask, k: int) -> LegFollower | None:
        """The path behind the box; None if there is nothing to do, or no path."""
        robot, config = world.robot, self.config
        size = robot.circumscribed_radius
        path = self._rest_of(world, task, k)
        if path is None:
            self._end(PushPhase.DONE, "end")
            return None
        self._plan = path.plan(robot, task.box_id, task.speed)
        self._attempts += 1
        if self._attempts > config.attempts:
            self._end(PushPhase.FAILED, self._reason or "stuck")
            return None
        slack = config.slack * size
        found = find_approach(world, k, path, config.mpc.parameters, slack, self._failed_ways)
        if found is None:
            self._end(PushPhase.FAILED, "no_approach")
            return None
        self._box_then = world.movables.poses[k]
        noisy = config.mpc.observer_gain < 1.0
        return LegFollower(
            robot,
            Legs.ahead(found.points, float(found.pose[2])),
            near=(0.06 if noisy else 0.02) * size,
            aligned=math.radians(5.0 if noisy else 2.0),
            escapes=2,
        )

    def _was_moved(self, world: World, k: int) -> bool:
        """Whether the box is no longer where it was when the robot set out for it."""
        change = world.movables.poses[k] - self._box_then
        far = math.hypot(float(change[0]), float(change[1])) / world.robot.circumscribed_radius
        turned = abs(math.remainder(float(change[2]), math.tau))
        return max(far / _MOVED, turned / _TWISTED) > 1.0

    def _push(self, world: World, task: PushTask, k: int, pose: FloatArray) -> Twist | None:
        """Push, as long as the box stays on the bumper and near its path."""
        assert self._plan is not None
        mpc, config = self.mpc, self.config
        twist = mpc.command(world, self._plan)
        state, model = mpc.state, mpc.model
        if state is None or model is None:
            return twist
        size = world.robot.circumscribed_radius
        self._left = max(self._plan.length - mpc.along, 0.0)
        if self._left <= max(task.tolerance, _END * size):
            self._end(PushPhase.DONE, "end")
            return None
        if self._left < self._left_then - config.progress * size:
            self._left_then, self._attempts = self._left, 1
            self._failed_ways = 0
        low, high = contact_kernels.line(model.contact, state.offset)
        face = 0.5 * (model.face.high - model.face.low)
        if min(-low, high) < config.rim * face or state.gap > config.gap * size:
            self._give_up(world, "lost", pose)
            return None
        if abs(mpc.lateral) > config.astray * size:
            self._give_up(world, "astray", pose)
            return None
        assert self._progress is not None
        if not self._progress.update(self._left, world.time):
            self._give_up(world, "blocked" if mpc.slowed < 0.5 else "stuck", pose)
            return None
        return twist

    def _give_up(self, world: World, reason: str, pose: FloatArray) -> None:
        """Back off before the next attempt."""
        self._phase, self._reason = PushPhase.RECOVER, reason
        far = self.config.retreat * world.robot.circumscribed_radius
        self._retreat = Retreat(world.robot, pose, far)

    def _recover(self, world: World, task: PushTask, k: int, pose: FloatArray) -> Twist | None:
        """Drive straight back, or away however there is room."""
        assert self._retreat is not None
        held, stopped = self._clock.held, False
        while (
            command := self._retreat.command(pose, world.time, held, stopped=stopped)
        ) is not None:
            fraction = self._free(world, pose, command)
            if fraction >= 0.25:
                return clamp_twist(
                    world.robot, fraction * command.linear, fraction * command.angular
                )
            stopped = True
        self._phase, self._driver = PushPhase.APPROACH, None
        return None

    def _rest_of(self, world: World, task: PushTask, k: int) -> PushPath | None:
        """What is left of the path, from where the box is; None if nothing is."""
        path = task.path
        box = world.movables.poses[k, :2]
        along, away = path.nearest(box)
        if along >= path.length - max(task.tolerance, _END * world.robot.circumscribed_radius):
            return None
        size = world.robot.circumscribed_radius
        joint = path.length
        if away <= 0.1 * size:
            rest = path.rest_from(along)
        else:
            joint = along + max(1.5 * away, size)
            rest = path.rest_from(joint)
        if rest is None:
            rest = PushPath.straight(box, path.poses[-1, :2])
        elif away > 0.1 * size:
            lead = PushPath.straight(box, rest.poses[0, :2])
            rest = PushPath(np.concatenate([lead.poses[:-1], rest.poses]))
        self._left = rest.length
        self._left_then = min(self._left_then, rest.length)
        return rest

    def _free(self, world: World, pose: FloatArray, command: Twist) -> float:
        """Fraction of a command that the robot alone may drive."""
        robot = world.robot
        if self._static is not world.static:
            self._static = world.static
            least = self.config.mpc.clearance * robot.circumscribed_radius
            self._clearance = Clearance(robot, world.static, least)
        state = np.array([*pose, 0.0, 0.0, _GAP])
        look = max(2.0 * self._clock.held, _LOOK)
        return self._clearance.free_fraction(_NOWHERE, state, command.linear, command.angular, look)
