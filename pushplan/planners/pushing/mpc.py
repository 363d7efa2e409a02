"""`PushingMpc`: push a box along a path by looking ahead along it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pushplan.control import clamp_twist
from pushplan.control.mpc.kernels import Track, locate
from pushplan.control.mpc.solver import QuadraticProgram
from pushplan.planners.pushing.bumper import face_towards
from pushplan.planners.pushing.clearance import Clearance
from pushplan.planners.pushing.cost import ROWS, Weights
from pushplan.planners.pushing.estimate import Estimate
from pushplan.planners.pushing.kernels import box_pose, observe
from pushplan.planners.pushing.model import PushModel, PushState
from pushplan.planners.pushing.problem import assemble
from pushplan.planners.pushing.pushing_config import PushingConfig
from pushplan.world import Drive, InvalidInputError, Plan, RobotModel, StaticMap, Twist, World
from pushplan.world.checks import FloatArray, IntArray, expect

_BACK, _WINDOW = 0.5, 2.0
"""How far the box's place may move back or ahead from one call to the next [L]."""
_LEAST = 0.4
"""Least speed of a push that has not ended, as a share of the greatest."""
_LOOK = 4.0
"""Periods for which a command must stay clear of static things, or it is driven more slowly."""
_BESIDE, _AHEAD = 1.5, 2.0
"""Greatest offset [half bumpers] and gap [L] that the problem is solved for."""
_BLOCKED, _ASIDE = 0.5, (0.1, -0.1, 0.3, -0.3, 0.7, -0.7)
"""Share of a command below which others are tried, and their turns [speed / L]."""
_TURNED = math.radians(50.0)
"""Angle at which another face is taken to be the pushed one."""


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
        self._last_time = -math.inf
        self._last = (0.0, 0.0)
        self._missed = 0
        self._nominal: FloatArray | None = None
        self._estimate = Estimate(self.config.trust, self.config.delay)
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
        """Share of the last command that was driven, for the sake of what is static."""
        self.value = math.nan
        """Cost of the nominal commands of the last call, see `PushingConfig`."""

    def command(self, world: World, plan: Plan) -> Twist:
        """See `pushplan.world.Controller`; stops at the end of the path, or if the box has gone.

        Raises:
            InvalidInputError: if the plan names no box, or the robot cannot stop.
        """
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

    def forget(self) -> None:
        """Start afresh with the next call, but remember the commands that are on their way."""
        self._plan = None

    def _prepare(self, world: World, plan: Plan) -> int | None:
        """Start afresh where the clock, the robot or the plan has changed; index of the box."""
        robot, config = expect("world", world, World).robot, self.config
        expect("plan", plan, Plan)
        if robot.drive is not Drive.DIFFERENTIAL:
            raise InvalidInputError("pushing along a path needs a differential drive")
        if not plan.subtasks or not plan.subtasks[0].object_ids:
            raise InvalidInputError(
                "the plan must name the box in its first sub-task, as PushPath.plan does"
            )
        afresh = world.time <= self._last_time
        if afresh:
            self._estimate = Estimate(config.trust, config.delay)
        if afresh or self._robot != robot:
            self._robot, self._plan = robot, None
            self._held, self.fallbacks = config.period, 0
            limited = (
                math.isfinite(robot.max_acceleration),
                math.isfinite(robot.max_turn_acceleration),
            )
            self._program = QuadraticProgram(
                2,
                config.moves,
                limited,
                tolerance=config.tolerance,
                iterations=config.solver_iterations,
            )
            self._last = _speed_of(world)
        else:
            self._held = world.time - self._last_time
        self._last_time = world.time
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
        self._track = Track(plan.poses, plan.arc_lengths, plan.speeds)
        self._take_face(world, k)
        self._estimate.forget()
        self.along, self._missed = 0.0, 0
        self._nominal = None
        n = 2 * config.moves
        self._memory = (
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
            self._estimate.forget()
            observe(self.model.contact, self._guard_face, pose, box, seen)
        contact, size = self.model.contact, self.model.reach
        self._row = self._estimate.observe(contact, seen, world.time, size)
        ahead = self._estimate.at_effect(contact)
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
        config, program = self.config, self._program
        assert self.model is not None
        steps = steps_of(config, self.model.reach, robot.max_speed, self._held)
        rounds = config.iterations
        nominal = self._shifted(steps)
        if nominal is None:
            rounds = config.first_iterations
            nominal = np.tile([robot.max_speed, 0.0], (config.moves, 1))
        units = np.array([robot.max_speed, robot.max_turn_rate])
        low, high = bounds_of(robot, program.rows, config.moves, steps, self._last)
        for _ in range(rounds):
            self.value = self._assemble(robot, start, steps, nominal)
            guess = np.ascontiguousarray((nominal / units).T.ravel())
            found = program.solve(self._memory[2], self._memory[3], low, high, guess)
            if found is None:
                return None
            nominal = np.ascontiguousarray(found.reshape(2, -1).T * units)
        self._solution_steps = steps
        return nominal

    def _assemble(
        self, robot: RobotModel, start: FloatArray, steps: FloatArray, nominal: FloatArray
    ) -> float:
        """Fill the memory for commands (M, 2) [m/s, rad/s]; returns what they cost."""
        assert self.model is not None
        jacobian, residual, hessian, gradient, states = self._memory
        value = assemble(
            self.model.contact,
            self._track,
            self._weights,
            start,
            self.along,
            np.array(self._last),
            np.array([robot.max_speed, robot.max_turn_rate]),
            steps,
            self._groups,
            nominal,
            jacobian,
            residual,
            hessian,
            gradient,
            states,
        )
        return float(value)

    def _shifted(self, steps: FloatArray) -> FloatArray | None:
        """The last solution, moved on by the time since."""
        if self._nominal is None:
            return None
        ends = np.cumsum(self._solution_steps) - self._held
        middles = np.cumsum(steps) - 0.5 * steps
        first = np.searchsorted(self._groups, np.arange(self.config.moves))
        at = np.minimum(np.searchsorted(ends, middles[first]), len(ends) - 1)
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
        look = max(_LOOK * self._held, brake)
        contact, pace = self.model.contact, max(abs(v), abs(w) * self.model.reach)
        self.slowed = self._clearance.free_share(contact, start, v, w, look)
        for turn in _ASIDE if self.slowed < _BLOCKED else ():
            aside = w + turn * pace / self.model.reach
            share = self._clearance.free_share(contact, start, v, aside, look)
            if share > self.slowed + _BLOCKED * abs(turn):
                self.slowed, w = share, aside
                break
        v, w = self.slowed * v, self.slowed * w
        return self._send(world, v, w)

    def _send(self, world: World, v: float, w: float) -> Twist:
        """Within the accelerations, and remembered."""
        robot = world.robot
        dv, dw = robot.max_acceleration * self._held, robot.max_turn_acceleration * self._held
        v = min(max(v, self._last[0] - dv), self._last[0] + dv)
        w = min(max(w, self._last[1] - dw), self._last[1] + dw)
        twist = clamp_twist(robot, v, w)
        self.note(world.time, twist)
        return twist

    def note(self, time: float, twist: Twist) -> None:
        """Remember a command that was sent at a time [s], by whomever."""
        self._last, self._last_time = (twist.linear, twist.angular), time
        self._estimate.send(time, twist)


def _speed_of(world: World) -> tuple[float, float]:
    assert world.robot_twist is not None
    vx, vy, omega = (float(value) for value in world.robot_twist)
    theta = float(world.robot_pose[2])
    twist = clamp_twist(world.robot, vx * math.cos(theta) + vy * math.sin(theta), omega)
    return twist.linear, twist.angular


def groups_of(horizon: int, moves: int) -> IntArray:
    """(N,) which command holds in each step: the first ones for one step, later ones for more."""
    ends = horizon * (np.arange(1, moves + 1) / moves) ** (1.6 if moves < horizon else 1.0)
    ends = np.maximum(np.round(ends), np.arange(1, moves + 1)).astype(np.int64)
    ends = np.minimum(ends, horizon - np.arange(moves - 1, -1, -1))
    return np.searchsorted(ends, np.arange(horizon), side="right").astype(np.int64)


def steps_of(config: PushingConfig, reach: float, speed: float, held: float) -> FloatArray:
    """(N,) how long each step is [s]: the first until the next call."""
    span = config.reach * reach / speed
    steps = np.full(config.horizon, max(held, span / config.horizon))
    steps[0] = held
    return steps


def weights_of(config: PushingConfig, model: PushModel, robot: RobotModel) -> Weights:
    """Prices and scales for one robot and box."""
    stable = model.stable_curvature()
    limit = config.margin * stable if stable * model.reach > 0.02 else -1.0
    return Weights(
        length=model.reach,
        max_speed=robot.max_speed,
        half=model.bumper.half,
        curvature=limit,
        heading=config.heading,
        offset=config.offset,
        rim=config.rim,
        safe=config.safe,
        angle=config.angle,
        grip=config.grip,
        turn=config.turn,
        speed=config.speed,
        smoothness=config.smoothness,
        terminal=config.terminal,
    )


def bounds_of(
    robot: RobotModel, rows: int, moves: int, steps: FloatArray, last: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Bounds of the commands and of their changes, in the units of the problem."""
    low, high = -np.ones(rows), np.ones(rows)
    row = 2 * moves
    limits = (
        robot.max_acceleration / robot.max_speed,
        robot.max_turn_acceleration / robot.max_turn_rate,
    )
    before = (last[0] / robot.max_speed, last[1] / robot.max_turn_rate)
    reach = (limits[0] * steps[0], limits[1] * steps[0])
    # a push goes forwards; where the robot cannot be that fast yet it gets there as it can
    low[:moves] = min(_LEAST, before[0] + reach[0])
    for kind in range(2):
        if math.isfinite(limits[kind]):
            change = np.full(moves, limits[kind] * float(steps[1:].min(initial=steps[0])))
            change[0] = reach[kind]
            low[row : row + moves], high[row : row + moves] = -change, change
            low[row] += before[kind]
            high[row] += before[kind]
            row += moves
    return low, high
