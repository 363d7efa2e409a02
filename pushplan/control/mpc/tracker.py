"""`MpcTracker`: follow a path by looking ahead along it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from pushplan.compiled import owned
from pushplan.control.limits import driven_twist
from pushplan.control.mpc.assembly_kernels import assembly_memory
from pushplan.control.mpc.horizon import FAILED, make_horizon, solve_rounds, track_of
from pushplan.control.mpc.mpc_config import MpcConfig
from pushplan.control.mpc.quadratic_program import ProgramSolver
from pushplan.control.mpc.tracker_kernels import (
    TrackerMemory,
    assemble_step,
    begin_step,
    begin_track,
    finish_step,
)
from pushplan.control.mpc.tracking_kernels import Tuning
from pushplan.control.staged_controller import StagedController
from pushplan.world import Drive, Plan, RobotModel, Twist, World
from pushplan.world.checks import expect


@dataclass
class MpcTracker(StagedController):
    """Model-predictive path tracking for constant-speed robots, differential drives and cars.

    Each call solves one quadratic program for the turn rates of the next N steps (and the speeds,
    if wanted), linearised about the last solution: linear time-varying MPC as in Falcone et al.
    (IEEE Trans. Control Syst. Technol. 15(3), 2007), with exact arcs for the motion. Because it
    looks ahead it begins to turn before a bend, keeps the limits of turn rate and turn
    acceleration without overshoot, and takes a known delay into account. Use `PathFollower` where
    commands act at once and the pose is exact; it takes about 0.6 of the time.

    A solution is used only if the solver says that it is one. Otherwise the last solution is
    followed for the rest of its horizon, then pure pursuit takes over; `fallbacks` counts both.

    Args:
        config: parameters.
    """

    config: MpcConfig = field(default_factory=MpcConfig)

    def __post_init__(self) -> None:
        expect("config", self.config, MpcConfig)
        self._robot: RobotModel | None = None
        self._plan: Plan | None = None
        self._hold_commands(self.config.period)
        self._out = np.zeros(2)
        self._memory: TrackerMemory | None = None
        self._earlier = 0  # failures of memories before

    @property
    def fallbacks(self) -> int:
        """Calls since the start of the episode in which the solver gave no solution."""
        if self._memory is None:
            return self._earlier
        return self._earlier + int(self._memory.horizon.counts[FAILED])

    def reset(self, world: World) -> None:
        """See `pushplan.world.Controller`."""
        self._memory = None
        self._earlier = 0
        super().reset(world)

    def _begin(self) -> None:
        self._robot = None

    def _follow(self, world: World, plan: Plan) -> Twist:
        """Start afresh in a new episode, on a new plan, or where the robot is another one."""
        if self._robot is not world.robot and self._robot != world.robot:
            self._robot = world.robot
            self._plan = None
            self._earlier = self.fallbacks
            self._memory = tracker_memory(world.robot, self.config)
            program = self._memory.horizon.program
            self._solver = ProgramSolver(
                program, self.config.tolerance, self.config.solver_iterations
            )
            driven = driven_twist(world)
            self._memory.horizon.last[:] = driven.linear, driven.angular
        memory = self._memory
        out = self._out
        assert memory is not None
        if plan is not self._plan:
            self._plan = plan
            self._track = track_of(plan)
            begin_track(memory)
        pose = owned(world.robot_pose)
        time = world.time
        held = self._clock.held
        if begin_step(memory, self._track, pose, time, held, out):
            solved = solve_rounds(
                memory.horizon,
                self._solver,
                self.config.iterations,
                self.config.first_iterations,
                partial(assemble_step, memory, self._track),
            )
            finish_step(memory, self._track, pose, time, held, solved, out)
        return Twist(float(out[0]), float(out[1]))


def tracker_memory(robot: RobotModel, config: MpcConfig) -> TrackerMemory:
    """Parameters and memory of the kernels for one robot."""
    columns = (1, 0) if _optimises_speed(robot, config) else (1,)
    return TrackerMemory(
        make_horizon(robot, columns, config.horizon, config.horizon),
        _tuning(robot, config),
        config.reach * robot.circumscribed_radius / robot.max_speed,
        config.delay,
        np.zeros(3),
        np.zeros(1),
        assembly_memory(len(columns) * config.horizon),
    )


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
