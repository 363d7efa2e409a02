"""`MpcTracker`: follow a path by looking ahead along it."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from pushplan.control.episode_clock import EpisodeClock
from pushplan.control.limits import clamp_twist, driven_twist, ramp_twist
from pushplan.control.mpc.horizon import (
    RecedingHorizon,
    shifted_index,
    time_grid,
    track_of,
)
from pushplan.control.mpc.kernels import Track, Tuning, arc, assemble, errors, locate
from pushplan.control.mpc.mpc_config import MpcConfig
from pushplan.control.pure_pursuit import PurePursuit
from pushplan.world import Drive, Plan, RobotModel, Twist, World
from pushplan.world.checks import FloatArray, expect

_BACK = 0.25  # how far the place on the path may move back from one call to the next [R]
_WINDOW = 2.0  # how far ahead of the last place the next one is looked for [R]


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
        expect("config", self.config, MpcConfig)
        self._robot: RobotModel | None = None
        self._plan: Plan | None = None
        self._track = Track(np.zeros((1, 3)), np.zeros(1), np.zeros(1))
        self._along = 0.0
        self._steps: FloatArray = np.zeros(0)
        self._solution: FloatArray | None = None
        self._solution_steps: FloatArray = self._steps
        self._sent: deque[tuple[float, Twist]] = deque()
        self._clock = EpisodeClock(self.config.period)
        self.fallbacks = 0
        """Calls since the start of the episode in which the solver gave no solution."""

    def reset(self, world: World) -> None:
        """See `pushplan.world.Controller`."""
        self._clock.reset()
        self._robot = None

    def command(self, world: World, plan: Plan) -> Twist:
        """See `pushplan.world.Controller`.

        Past the end of the plan the robot stops; a constant-speed robot drives on
        along the last heading.
        """
        return self._clock.command_for(world, lambda _: self._follow(world, plan))

    def _follow(self, world: World, plan: Plan) -> Twist:
        self._prepare(world, plan)
        robot, track = world.robot, self._track
        pose = self._pose_at_effect(world)
        size = robot.circumscribed_radius
        x, y, theta = (float(value) for value in pose)
        low = max(self._along - _BACK * size, 0.0)
        along, index, fraction = locate(track, x, y, low, self._along + _WINDOW * size)
        self._along = min(along, float(track.lengths[-1]))
        error = errors(track, x, y, theta, index, fraction)[1]
        on_the_spot = robot.drive is Drive.DIFFERENTIAL
        if robot.can_stop and along >= track.lengths[-1] - 1e-9:
            return self._send(world, self._ramped(world, 0.0, 0.0), None)
        if abs(error) > (math.pi / 4 if on_the_spot else math.pi / 2):
            # too far from the path's heading for a linear model: turn towards it first
            turn = math.copysign(robot.max_turn_rate, -error)
            speed = 0.0
            if robot.drive is Drive.CAR:
                speed = min(robot.max_speed, robot.max_turn_rate * robot.min_turning_radius)
            return self._send(world, self._ramped(world, speed, turn), None)
        solution = self._solve(pose)
        if solution is None:
            self.fallbacks += 1
            return self._fall_back(world, plan)
        self._missed = 0
        twist = clamp_twist(robot, float(solution[0, 0]), float(solution[0, 1]))
        return self._send(world, twist, solution)

    def _prepare(self, world: World, plan: Plan) -> None:
        """Start afresh in a new episode, or where the robot is another one."""
        robot, config = world.robot, self.config
        if self._robot != robot:
            self._robot, self._plan = robot, None
            self._tuning = _tuning(robot, config)
            self._program = _program(robot, config)
            self._pursuit = PurePursuit()
            self._missed = self.fallbacks = 0
            self._sent = deque()
            self._last = driven_twist(world)
        span = config.reach * robot.circumscribed_radius / robot.max_speed
        self._steps = time_grid(config.horizon, span, self._clock.held)
        if plan is not self._plan:
            self._plan, self._along = plan, 0.0
            self._track = track_of(plan)
            self._solution = None
        elif self._solution is not None:
            self._shift()

    def _shift(self) -> None:
        """Move the last solution on by the time that has passed since."""
        assert self._solution is not None
        index = shifted_index(self._solution_steps, self._steps, self._clock.held)
        shifted = np.full((len(self._steps), 2), np.nan)
        known = index < len(self._solution_steps)
        shifted[known] = self._solution[index[known]]
        self._solution, self._solution_steps = shifted, self._steps

    def _solve(self, pose: FloatArray) -> FloatArray | None:
        """(N, 2) speeds [m/s] and turn rates [rad/s], or None."""
        config, program = self.config, self._program
        count, n = config.horizon, program.count
        nominal = np.full((count, 2), np.nan) if self._solution is None else self._solution.copy()
        rounds = config.first_iterations if self._solution is None else config.iterations
        hessian, gradient = np.empty((n, n)), np.empty(n)
        last = np.array([self._last.linear, self._last.angular])
        low, high = program.bounds(self._steps, (self._last.linear, self._last.angular))
        low[count:n] = 0.0  # a plan is driven forwards

        def assemble_about(nominal: FloatArray) -> tuple[FloatArray, FloatArray]:
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
            return hessian, gradient

        return program.solve(nominal, low, high, rounds, assemble_about)

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

    def _ramped(self, world: World, linear: float, angular: float) -> Twist:
        return ramp_twist(world.robot, self._last, linear, angular, self._clock.held)

    def _fall_back(self, world: World, plan: Plan) -> Twist:
        """The last solution, moved on; pure pursuit where it has run out."""
        self._missed += 1
        known = self._solution is not None and np.isfinite(self._solution[0]).all()
        if known and self._missed < self.config.horizon:
            assert self._solution is not None
            speed, turn = (float(value) for value in self._solution[0])
            twist = self._ramped(world, speed, turn)
            return self._send(world, twist, self._solution)
        wanted = self._pursuit.command(world, plan)
        return self._send(world, self._ramped(world, wanted.linear, wanted.angular), None)

    def _send(self, world: World, twist: Twist, solution: FloatArray | None) -> Twist:
        """Remember what is sent."""
        self._last, self._solution, self._solution_steps = twist, solution, self._steps
        if self.config.delay > 0.0:
            self._sent.append((world.time, twist))
            while len(self._sent) > 1 and self._sent[1][0] <= world.time - self.config.delay:
                self._sent.popleft()
        return twist


def _optimises_speed(robot: RobotModel, config: MpcConfig) -> bool:
    return config.optimise_speed and robot.drive is Drive.DIFFERENTIAL


def _tuning(robot: RobotModel, config: MpcConfig) -> Tuning:
    return Tuning(
        size=robot.circumscribed_radius,
        max_speed=robot.max_speed,
        max_turn_rate=robot.max_turn_rate,
        max_acceleration=robot.max_acceleration,
        stops=robot.can_stop,
        optimise_speed=_optimises_speed(robot, config),
        heading_weight=config.heading_weight,
        turn_weight=config.turn_weight,
        smoothness=config.smoothness,
        terminal=config.terminal,
        speed_weight=config.speed_weight,
    )


def _program(robot: RobotModel, config: MpcConfig) -> RecedingHorizon:
    return RecedingHorizon(
        robot,
        (1, 0) if _optimises_speed(robot, config) else (1,),
        config.horizon,
        tolerance=config.tolerance,
        iterations=config.solver_iterations,
    )
