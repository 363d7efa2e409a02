"""`MpcTracker`: follow a path by looking ahead along it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from pushplan.control.limits import driven_twist
from pushplan.control.staged_controller import StagedController
from pushplan.core import control as core
from pushplan.world import Drive, Plan, RobotModel, Twist, World
from pushplan.world.checked_fields import (
    CheckedFields,
    Limits,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
)
from pushplan.world.checks import expect


@dataclass(frozen=True)
class MpcConfig(CheckedFields):
    """Parameters of `MpcTracker`. R is the robot's circumscribed radius, T = R / max_speed.

    The cost is the integral over time, in units of T, of offset² + ``heading_weight`` heading² +
    ``turn_weight`` (turn rate less that of the path)² + ``smoothness`` (change of turn rate)²,
    with offsets in R, turn rates in 1 / T and their changes in 1 / T².

    Args:
        horizon: N, steps that are looked ahead.
        reach: how far they reach at full speed [R]; the steps are equally long, but never shorter
            than the control period, and the first is the control period itself.
        heading_weight: cost of a heading error [1/rad²].
        turn_weight: cost of turning otherwise than the path does.
        smoothness: cost of changing the turn rate; more is calmer under noise and slower to
            return to the path.
        terminal: factor on the cost of the last step's errors, for what comes after it.
        optimise_speed: let a differential drive depart from the plan's speed.
        speed_weight: cost of doing so, per square of the fraction of ``max_speed``.
        iterations: quadratic programs solved in each call; 1 is the real-time iteration.
        first_iterations: those of the first call on a plan, which has no solution to start from.
        delay: known time between a command and its effect [s]; the pose is predicted over it.
        period: time for which the first command is held [s]; later ones are held for as long as
            the clock of the world shows.
        tolerance: of the solver, absolute and relative.
        solver_iterations: after which the solver gives up.
    """

    horizon: Annotated[int, Limits(2, 100)] = 20
    reach: PositiveFloat = 3.0
    heading_weight: NonNegativeFloat = 0.5
    turn_weight: NonNegativeFloat = 0.02
    smoothness: PositiveFloat = 0.001
    terminal: Annotated[float, Limits(1.0)] = 4.0
    optimise_speed: bool = False
    speed_weight: PositiveFloat = 0.2
    iterations: PositiveInt = 1
    first_iterations: PositiveInt = 4
    delay: NonNegativeFloat = 0.0
    period: PositiveFloat = 0.1
    tolerance: PositiveFloat = 1e-6
    solver_iterations: PositiveInt = 2000


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
        self._tracker: core.Tracker | None = None
        self._earlier = 0  # failures of trackers before

    @property
    def fallbacks(self) -> int:
        """Calls since the start of the episode in which the solver gave no solution."""
        return self._earlier + (self._tracker.failures if self._tracker else 0)

    def reset(self, world: World) -> None:
        """See `pushplan.world.Controller`."""
        self._tracker = None
        self._earlier = 0
        super().reset(world)

    def _begin(self) -> None:
        self._robot = None

    def _follow(self, world: World, plan: Plan) -> Twist:
        """Start afresh in a new episode, on a new plan, or where the robot is another one."""
        if self._robot is not world.robot and self._robot != world.robot:
            self._prepare(world)
        tracker = self._tracker
        assert tracker is not None
        if plan is not self._plan:
            self._plan = plan
            self._track = track_of(plan)
            tracker.begin_track()
        return Twist(*tracker.follow(self._track, world.robot_pose, world.time, self._clock.held))

    def _prepare(self, world: World) -> None:
        """Set up the problem of another robot."""
        robot = world.robot
        config = self.config
        self._robot = robot
        self._plan = None
        self._earlier = self.fallbacks
        driven = driven_twist(world)
        self._tracker = core.Tracker(
            limits_of(robot),
            _tuning(robot, config),
            core.SolverSettings(
                config.tolerance,
                config.solver_iterations,
                config.iterations,
                config.first_iterations,
            ),
            steps=config.horizon,
            span=config.reach * robot.circumscribed_radius / robot.max_speed,
            delay=config.delay,
            v=driven.linear,
            w=driven.angular,
        )


def _tuning(robot: RobotModel, config: MpcConfig) -> core.Tuning:
    return core.Tuning(
        size=robot.circumscribed_radius,
        max_speed=robot.max_speed,
        max_turn_rate=robot.max_turn_rate,
        max_acceleration=robot.max_acceleration,
        stops=robot.can_stop,
        optimise_speed=config.optimise_speed and robot.drive is Drive.DIFFERENTIAL,
        heading_weight=config.heading_weight,
        turn_weight=config.turn_weight,
        smoothness=config.smoothness,
        terminal=config.terminal,
        speed_weight=config.speed_weight,
    )


def track_of(plan: Plan) -> core.ReferencePath:
    """The path of a plan as the core reads it."""
    return core.ReferencePath(plan.poses, plan.arc_lengths, plan.speeds)


def limits_of(robot: RobotModel) -> core.CommandLimits:
    """The limits of a robot as the core reads them."""
    return core.CommandLimits(
        robot.drive is Drive.CONSTANT_SPEED,
        robot.min_speed,
        robot.max_speed,
        robot.max_turn_rate,
        robot.max_acceleration,
        robot.max_turn_acceleration,
        robot.min_turning_radius,
    )
