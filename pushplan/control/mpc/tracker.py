"""`MpcTracker`: follow a path by looking ahead along it."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from pushplan.control.limits import clamp_twist
from pushplan.control.mpc.kernels import Track, Tuning, arc, assemble, errors, locate
from pushplan.control.mpc.mpc_config import MpcConfig
from pushplan.control.mpc.solver import QuadraticProgram
from pushplan.control.pure_pursuit import PurePursuit
from pushplan.world import Drive, Plan, RobotModel, Twist, World
from pushplan.world.checks import FloatArray

_BACK = 0.25
"""How far the place on the path may move back from one call to the next [R]."""
_WINDOW = 2.0
"""How far ahead of the last place the next one is looked for [R]."""


@dataclass
class MpcTracker:
    """Model-predictive path tracking for constant-speed robots and differential drives.

    Each call solves one quadratic program for the turn rates of the next N steps (and the speeds,
    if wanted), linearised about the last solution: linear time-varying MPC as in Falcone et al.
    (IEEE Trans. Control Syst. Technol. 15(3), 2007), with exact arcs for the motion. Because it
    looks ahead it begins to turn before a bend, keeps the limits of turn rate and turn
    acceleration without overshoot, and takes a known delay into account. Use `PathFollower` where
    commands act at once and the pose is exact; it costs a third of the time.

    A solution is used only if the solver says that it is one. Otherwise the last solution is
    followed for the rest of its horizon, then `PurePursuit` takes over; `fallbacks` counts both.

    Args:
        config: parameters.
    """

    config: MpcConfig = field(default_factory=MpcConfig)

    def __post_init__(self) -> None:
        self._robot: RobotModel | None = None
        self._plan: Plan | None = None
        self._track = Track(np.zeros((1, 3)), np.zeros(1), np.zeros(1))
        self._along = 0.0
        self._steps: FloatArray = np.zeros(0)
        self._solution: FloatArray | None = None
        self._solution_steps: FloatArray = self._steps
        self._sent: deque[tuple[float, Twist]] = deque()
        self._last_time = math.inf
        self.fallbacks = 0
        """Calls since the start of the episode in which the solver gave no solution."""

    def command(self, world: World, plan: Plan) -> Twist:
        """See `pushplan.world.Controller`.

        Past the end of the plan a differential drive stops; a constant-speed robot drives on
        along the last heading.
        """
        self._prepare(world, plan)
        robot, track = world.robot, self._track
        pose = self._pose_at_effect(world)
        size = robot.circumscribed_radius
        x, y, theta = (float(value) for value in pose)
        low = max(self._along - _BACK * size, 0.0)
        along, index, share = locate(track, x, y, low, self._along + _WINDOW * size)
        self._along = min(along, float(track.lengths[-1]))
        error = errors(track, x, y, theta, index, share)[1]
        stops = robot.drive is Drive.DIFFERENTIAL
        if stops and along >= track.lengths[-1] - 1e-9:
            return self._send(world, self._ramped(robot, 0.0, 0.0), None)
        if abs(error) > (math.pi / 4 if stops else math.pi / 2):
            # too far from the path's heading for a linear model: turn towards it first
            turn = math.copysign(robot.max_turn_rate, -error)
            return self._send(world, self._ramped(robot, 0.0, turn), None)
        solution = self._solve(pose)
        if solution is None:
            self.fallbacks += 1
            return self._fall_back(world, plan)
        self._missed = 0
        twist = clamp_twist(robot, float(solution[0, 0]), float(solution[0, 1]))
        return self._send(world, twist, solution)

    def _prepare(self, world: World, plan: Plan) -> None:
        """Start afresh where the clock has been set back or the robot is another one."""
        robot, config = world.robot, self.config
        if world.time <= self._last_time or self._robot != robot:
            self._robot, self._plan = robot, None
            self._tuning = _tuning(robot, config)
            self._program = _program(robot, config)
            self._pursuit = PurePursuit()
            self._held, self._missed, self.fallbacks = config.period, 0, 0
            self._sent = deque()
            assert world.robot_twist is not None
            vx, vy, omega = (float(value) for value in world.robot_twist)
            theta = float(world.robot_pose[2])
            speed = vx * math.cos(theta) + vy * math.sin(theta)
            self._last = clamp_twist(robot, speed, omega)
        else:
            self._held = world.time - self._last_time
        self._last_time = world.time
        self._steps = self._grid(robot)
        if plan is not self._plan:
            self._plan, self._along = plan, 0.0
            self._track = _track(plan)
            self._solution = None
        elif self._solution is not None:
            self._shift()

    def _grid(self, robot: RobotModel) -> FloatArray:
        """(N,) how long each command is held [s]: the first until the next call."""
        config = self.config
        span = config.reach * robot.circumscribed_radius / robot.max_speed
        steps = np.full(config.horizon, max(self._held, span / config.horizon))
        steps[0] = self._held
        return steps

    def _shift(self) -> None:
        """Move the last solution on by the time that has passed since."""
        assert self._solution is not None
        ends = np.cumsum(self._solution_steps) - self._held
        middles = np.cumsum(self._steps) - 0.5 * self._steps
        index = np.searchsorted(ends, middles)
        shifted = np.full((len(self._steps), 2), np.nan)
        known = index < len(ends)
        shifted[known] = self._solution[index[known]]
        self._solution, self._solution_steps = shifted, self._steps

    def _solve(self, pose: FloatArray) -> FloatArray | None:
        """(N, 2) speeds [m/s] and turn rates [rad/s], or None."""
        config, robot, program = self.config, self._robot, self._program
        assert robot is not None
        count, n = config.horizon, program.count
        nominal = np.full((count, 2), np.nan) if self._solution is None else self._solution.copy()
        rounds = config.first_iterations if self._solution is None else config.iterations
        hessian, gradient = np.empty((n, n)), np.empty(n)
        last = np.array([self._last.linear, self._last.angular])
        low, high = self._bounds(robot)
        units = np.array([robot.max_speed, robot.max_turn_rate])
        for _ in range(rounds):
            assemble(
                self._track,
                self._tuning,
                pose,
                self._along,
                last,
                self._steps,
                nominal,
                hessian,
                gradient,
            )
            start = (nominal / units)[:, ::-1].T.ravel()[:n]
            found = program.solve(hessian, gradient, low, high, np.ascontiguousarray(start))
            if found is None:
                return None
            nominal[:, 1] = found[:count] * units[1]
            if n > count:
                nominal[:, 0] = found[count:] * units[0]
        return nominal

    def _bounds(self, robot: RobotModel) -> tuple[FloatArray, FloatArray]:
        """Bounds of the inputs and of their changes, in the units of the problem."""
        count, n = self.config.horizon, self._program.count
        low, high = -np.ones(self._program.rows), np.ones(self._program.rows)
        low[count:n] = 0.0  # a plan is driven forwards
        row = n
        last = (self._last.angular / robot.max_turn_rate, self._last.linear / robot.max_speed)
        limits = (
            robot.max_turn_acceleration / robot.max_turn_rate,
            robot.max_acceleration / robot.max_speed,
        )
        for block in range(n // count):
            if math.isfinite(limits[block]):
                reach = limits[block] * self._steps
                low[row : row + count], high[row : row + count] = -reach, reach
                low[row] += last[block]
                high[row] += last[block]
                row += count
        return low, high

    def _pose_at_effect(self, world: World) -> FloatArray:
        """(3,) where the robot will be when a command of now takes effect."""
        pose = np.array(world.robot_pose)
        delay = self.config.delay
        if delay == 0.0:
            return pose
        # the command in force t seconds from now is the one that was sent `delay` before that
        start, end = world.time - delay, world.time
        out = np.empty(9)
        sent = [*self._sent, (end, self._last)]
        for (since, twist), (until, _) in pairwise(sent):
            lasts = min(until, end) - max(since, start)
            if lasts > 0.0:
                x, y, theta = (float(value) for value in pose)
                arc(x, y, theta, twist.linear, twist.angular, lasts, out)
                pose = out[:3].copy()
        return pose

    def _ramped(self, robot: RobotModel, linear: float, angular: float) -> Twist:
        """The nearest twist that the accelerations allow after the last one."""
        dv = robot.max_acceleration * self._held
        dw = robot.max_turn_acceleration * self._held
        linear = min(max(linear, self._last.linear - dv), self._last.linear + dv)
        angular = min(max(angular, self._last.angular - dw), self._last.angular + dw)
        return clamp_twist(robot, linear, angular)

    def _fall_back(self, world: World, plan: Plan) -> Twist:
        """The last solution, moved on; pure pursuit where it has run out."""
        self._missed += 1
        known = self._solution is not None and np.isfinite(self._solution[0]).all()
        if known and self._missed < self.config.horizon:
            assert self._solution is not None
            speed, turn = (float(value) for value in self._solution[0])
            twist = self._ramped(world.robot, speed, turn)
            return self._send(world, twist, self._solution)
        wanted = self._pursuit.command(world, plan)
        return self._send(world, self._ramped(world.robot, wanted.linear, wanted.angular), None)

    def _send(self, world: World, twist: Twist, solution: FloatArray | None) -> Twist:
        """Remember what is sent."""
        self._last, self._solution, self._solution_steps = twist, solution, self._steps
        if self.config.delay > 0.0:
            self._sent.append((world.time, twist))
            while len(self._sent) > 1 and self._sent[1][0] <= world.time - self.config.delay:
                self._sent.popleft()
        return twist


def _track(plan: Plan) -> Track:
    return Track(plan.poses, plan.arc_lengths, plan.speeds)


def _optimises_speed(robot: RobotModel, config: MpcConfig) -> bool:
    return config.optimise_speed and robot.drive is Drive.DIFFERENTIAL


def _tuning(robot: RobotModel, config: MpcConfig) -> Tuning:
    return Tuning(
        size=robot.circumscribed_radius,
        max_speed=robot.max_speed,
        max_turn_rate=robot.max_turn_rate,
        max_acceleration=robot.max_acceleration,
        stops=robot.drive is Drive.DIFFERENTIAL,
        optimise_speed=_optimises_speed(robot, config),
        heading_weight=config.heading_weight,
        turn_weight=config.turn_weight,
        smoothness=config.smoothness,
        terminal=config.terminal,
        speed_weight=config.speed_weight,
    )


def _program(robot: RobotModel, config: MpcConfig) -> QuadraticProgram:
    limited = (math.isfinite(robot.max_turn_acceleration), math.isfinite(robot.max_acceleration))
    return QuadraticProgram(
        2 if _optimises_speed(robot, config) else 1,
        config.horizon,
        limited,
        tolerance=config.tolerance,
        iterations=config.solver_iterations,
    )
