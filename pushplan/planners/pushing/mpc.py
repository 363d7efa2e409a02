"""`PushingMpc`: push a box along a path by looking ahead along it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pushplan.control.episode_clock import EpisodeClock
from pushplan.control.limits import driven_twist, ramp_twist
from pushplan.control.mpc.horizon import (
    RecedingHorizon,
    shifted_index,
    time_grid,
    track_of,
)
from pushplan.control.mpc.kernels import locate
from pushplan.planners.pushing.bumper import face_towards
from pushplan.planners.pushing.clearance import Clearance
from pushplan.planners.pushing.contact_kernels import box_pose, observe
from pushplan.planners.pushing.cost_kernels import ROWS, Memory, PushingProblem
from pushplan.planners.pushing.model import PushModel, PushState
from pushplan.planners.pushing.problem import groups_of, weights_of
from pushplan.planners.pushing.problem_kernels import assemble
from pushplan.planners.pushing.push_observer import PushObserver
from pushplan.planners.pushing.pushing_config import PushingConfig
from pushplan.world import Drive, InvalidInputError, Plan, RobotModel, StaticMap, Twist, World
from pushplan.world.checks import FloatArray, expect

_BACK, _WINDOW = 0.5, 2.0
"""How far the box's place may move back or ahead from one call to the next [L]."""
_LEAST = 0.4
"""Least speed of a push that has not ended, as a fraction of the greatest, or of that at which the
robot can turn within the distance to the box."""
_LOOK = 4.0
"""Periods for which a command must stay clear of static things, or it is driven more slowly."""
_BESIDE, _AHEAD = 1.5, 2.0
"""Greatest offset [half bumpers] and gap [L] that the problem is solved for."""
_BLOCKED, _ASIDE = 0.5, (0.1, -0.1, 0.3, -0.3, 0.7, -0.7)
"""Fraction of a command below which others are tried, and their turns [speed / L]."""
_TURNED = math.radians(50.0)  # angle at which another face is taken to be the pushed one


@dataclass
class PushingMpc:
    """Model-predictive pushing: commands that keep a box on its path and on the bumper.

    Each call solves one quadratic program on OSQP, linearised about the last solution. A solution
    is driven only if the solver says that it is one; else the last one is driven on, and where that
    has run out the robot stops. A command that would bring robot or box too near to something
    static is driven more slowly, and not at all in the end.

    The plan comes from `PushPath.plan`: its poses are the box's, its first sub-task names the box.
    Objects that ride along are not looked at.

    Args:
        config: parameters.
    """

    config: PushingConfig = field(default_factory=PushingConfig)

    def __post_init__(self) -> None:
        expect("config", self.config, PushingConfig)
        self._robot: RobotModel | None = None
        self._plan: Plan | None = None
        self._clock = EpisodeClock(self.config.period)
        self._last = Twist(0.0, 0.0)
        self._missed = 0
        self._nominal: FloatArray | None = None
        self._observer = PushObserver(self.config.observer_gain, self.config.delay)
        self.fallbacks = 0
        """Calls since the start of the episode in which the solver gave no solution."""
        self._row: FloatArray | None = None
        self.model: PushModel | None = None
        """Of the box that is pushed."""
        self.along = 0.0
        """Length of the path that the box has been pushed [m]."""
        self.lateral = 0.0
        """Distance of the box from its path, left positive [m]."""
        self.slowed = 1.0
        """Fraction of the last command that was driven, for the sake of what is static."""
        self.value = math.nan
        """Cost of the nominal commands of the last call, see `PushingConfig`."""

    def reset(self, world: World) -> None:
        """See `pushplan.world.Controller`."""
        self._clock.reset()
        self._robot = None

    def command(self, world: World, plan: Plan) -> Twist:
        """See `pushplan.world.Controller`; stops at the end of the path, or if the box has gone.

        Raises:
            InvalidInputError: if the plan names no box, or the robot cannot stop.
        """
        expect("plan", plan, Plan)
        expect("world", world, World)
        return self._clock.command_for(world, lambda _: self._follow(world, plan))

    def _follow(self, world: World, plan: Plan) -> Twist:
        k = self._prepare(world, plan)
        if k is None:
            self._row = None
            return self._send(world, 0.0, 0.0)
        start = self._observe(world, k)
        assert self.model is not None
        if self.along >= self._track.lengths[-1] - 1e-9:
            return self._send(world, 0.0, 0.0)
        nominal = self._solve(world.robot, self._near(start))
        if nominal is None:
            self.fallbacks += 1
            self._missed += 1
            if self._nominal is None or self._missed > self.config.horizon:
                self._nominal = None
                return self._send(world, 0.0, 0.0)
        else:
            self._missed, self._nominal = 0, nominal
        assert self._nominal is not None
        v, w = (float(value) for value in self._nominal[0])
        return self._guarded(world, start, v, w)

    @property
    def state(self) -> PushState | None:
        """Robot and box as estimated at the last call; None if the box had gone."""
        return None if self._row is None else PushState.from_row(self._row)

    def _prepare(self, world: World, plan: Plan) -> int | None:
        """Start afresh where the episode, the robot or the plan has changed; index of the box."""
        robot, config = world.robot, self.config
        if robot.drive is not Drive.DIFFERENTIAL:
            raise InvalidInputError("pushing along a path needs a differential drive")
        if not plan.subtasks or not plan.subtasks[0].object_ids:
            raise InvalidInputError(
                "the plan must name the box in its first sub-task, as PushPath.plan does"
            )
        if self._robot is not robot and self._robot != robot:
            self._observer = PushObserver(config.observer_gain, config.delay)
            self._robot, self._plan = robot, None
            self.fallbacks = 0
            self._program = RecedingHorizon(
                robot,
                (0, 1),
                config.moves,
                tolerance=config.tolerance,
                iterations=config.solver_iterations,
            )
            self._last = driven_twist(world)
        self.slowed = 1.0
        k = np.flatnonzero(world.movables.ids == plan.subtasks[0].object_ids[0])
        if len(k) == 0:
            return None
        if plan is not self._plan:
            self._begin(world, plan, int(k[0]))
        return int(k[0])

    def _begin(self, world: World, plan: Plan, k: int) -> None:
        """A new path: which face is pushed, and memory for the problem."""
        config = self.config
        self._plan = plan
        self._track = track_of(plan)
        self._take_face(world, k)
        self._observer.forget()
        self.along, self._missed = 0.0, 0
        self._nominal = None
        n = 2 * config.moves
        self._memory = Memory(
            np.empty((ROWS * config.horizon, n)),
            np.empty(ROWS * config.horizon),
            np.empty((n, n)),
            np.empty(n),
            np.empty((config.horizon + 1, 6)),
        )
        self._groups = groups_of(config.horizon, config.moves)
        self._solution_steps = np.zeros(0)

    def _take_face(self, world: World, k: int) -> None:
        """Push the face that the robot faces now."""
        robot, outline = world.robot, world.movables.outline(k)
        direction = float(world.robot_pose[2] - world.movables.poses[k, 2])
        face = face_towards(outline, direction)
        self.model = PushModel(robot, outline, self.config.parameters, face)
        self._weights = weights_of(self.config, self.model, robot)
        self._static: StaticMap | None = None
        self._guard_face = face.normal

    def _observe(self, world: World, k: int) -> FloatArray:
        """Estimate the state now; returns the one when a command takes effect."""
        assert self.model is not None
        pose, box = world.robot_pose, world.movables.poses[k]
        seen, at = np.empty(6), np.empty(3)
        observe(self.model.contact, self._guard_face, pose, box, seen)
        if abs(seen[4]) > _TURNED:
            self._take_face(world, k)
            self._observer.forget()
            observe(self.model.contact, self._guard_face, pose, box, seen)
        contact, size = self.model.contact, self.model.reach
        self._row = self._observer.observe(contact, seen, world.time, size)
        ahead = self._observer.at_effect(contact)
        box_pose(contact, ahead, at)
        low = max(self.along - _BACK * size, 0.0)
        found = locate(self._track, at[0], at[1], low, self.along + _WINDOW * size)
        self.along = float(min(found[0], self._track.lengths[-1]))
        path = self._track.poses[min(int(found[1]), len(self._track.poses) - 1)]
        self.lateral = float(
            (at[1] - path[1]) * math.cos(path[2]) - (at[0] - path[0]) * math.sin(path[2])
        )
        return ahead

    def _near(self, start: FloatArray) -> FloatArray:
        """A state with the box no farther away than the model means anything for."""
        assert self.model is not None
        near, far = start.copy(), _BESIDE * self.model.bumper.half
        near[3] = min(max(near[3], -far), far)
        near[5] = min(near[5], _AHEAD * self.model.reach)
        return near

    def _solve(self, robot: RobotModel, start: FloatArray) -> FloatArray | None:
        """(M, 2) speeds [m/s] and turn rates [rad/s], or None."""
        steps = self._steps(robot)
        rounds = self.config.iterations
        nominal = self._shifted(steps)
        if nominal is None:
            rounds = self.config.first_iterations
            nominal = np.tile([robot.max_speed, 0.0], (self.config.moves, 1))
        problem = self._problem(start, steps)

        def assemble_about(nominal: FloatArray) -> tuple[FloatArray, FloatArray]:
            self.value = float(assemble(problem, nominal, self._memory))
            return self._memory.hessian, self._memory.gradient

        nominal = self._program.solve(nominal, *self._bounds(robot, steps), rounds, assemble_about)
        if nominal is not None:
            self._solution_steps = steps
        return nominal

    def _steps(self, robot: RobotModel) -> FloatArray:
        """(N,) how long each step is [s]."""
        assert self.model is not None
        span = self.config.reach * self.model.reach / robot.max_speed
        return time_grid(self.config.horizon, span, self._clock.held)

    def _problem(self, start: FloatArray, steps: FloatArray) -> PushingProblem:
        assert self.model is not None
        return PushingProblem(
            self.model.contact,
            self._track,
            self._weights,
            start,
            self.along,
            np.array([self._last.linear, self._last.angular]),
            self._program.units,
            steps,
            self._groups,
        )

    def _bounds(self, robot: RobotModel, steps: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Bounds of the commands and of their changes, in the units of the problem."""
        assert self.model is not None
        spans = np.full(self.config.moves, float(steps.min()))
        spans[0] = steps[0]
        low, high = self._program.bounds(spans, (self._last.linear, self._last.angular))
        # a push goes forwards; where the robot cannot be that fast yet it gets there as it can
        reach = robot.max_acceleration / robot.max_speed * float(steps[0])
        least = _LEAST * min(1.0, robot.max_turn_rate * self.model.reach / robot.max_speed)
        low[: self.config.moves] = min(least, self._last.linear / robot.max_speed + reach)
        return low, high

    def _shifted(self, steps: FloatArray) -> FloatArray | None:
        """The last solution, moved on by the time since."""
        if self._nominal is None:
            return None
        first = np.searchsorted(self._groups, np.arange(self.config.moves))
        at = shifted_index(self._solution_steps, steps, self._clock.held)[first]
        at = np.minimum(at, len(self._solution_steps) - 1)
        return np.ascontiguousarray(self._nominal[self._groups[at]])

    def _guarded(self, world: World, start: FloatArray, v: float, w: float) -> Twist:
        """Drive a command as fast as what is static allows."""
        assert self.model is not None
        robot = world.robot
        if self._static is not world.static:
            self._static = world.static
            least = self.config.clearance * robot.circumscribed_radius
            self._clearance = Clearance(
                robot, world.static, least, self.model.outline, self._guard_face
            )
        brake = 2.0 * abs(v) / robot.max_acceleration
        look = max(_LOOK * self._clock.held, brake)
        contact, speed = self.model.contact, max(abs(v), abs(w) * self.model.reach)
        self.slowed = self._clearance.free_fraction(contact, start, v, w, look)
        for turn in _ASIDE if self.slowed < _BLOCKED else ():
            aside = w + turn * speed / self.model.reach
            fraction = self._clearance.free_fraction(contact, start, v, aside, look)
            if fraction > self.slowed + _BLOCKED * abs(turn):
                self.slowed, w = fraction, aside
                break
        v, w = self.slowed * v, self.slowed * w
        return self._send(world, v, w)

    def _send(self, world: World, v: float, w: float) -> Twist:
        """Within the accelerations, and remembered."""
        twist = ramp_twist(world.robot, self._last, v, w, self._clock.held)
        self._last = twist
        self._observer.send(world.time, twist)
        return twist
