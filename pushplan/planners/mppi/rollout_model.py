"""`RolloutModel`: everything that rollouts from one snapshot need, and what they give."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pushplan.control.limits import driven_twist
from pushplan.core import motion
from pushplan.core import planners as core
from pushplan.interaction import InteractionModel, QuasiStatic, SweepsMany
from pushplan.interaction.compiled_model import CompiledInteraction
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.motion.collision import footprint, goal_numbers, obstacles
from pushplan.motion.keep_out import keep_out
from pushplan.planners.mppi.mppi_config import MppiConfig
from pushplan.world import Drive, GoalDisc, GoalLine, RobotModel, World
from pushplan.world.checks import FloatArray, IntArray

SPEED = 0
TURN = 1
"""Columns of controls: speed and turn rate, as fractions of the greatest ones."""


@dataclass(frozen=True, eq=False)
class ControlSequence:
    """Controls that change linearly from knot to knot.

    Args:
        begins: time of the first knot [s].
        horizon: time from the first to the last knot [s].
        knots: (M, 2) speed and turn rate at each, as fractions of the greatest ones.
    """

    begins: float
    horizon: float
    knots: FloatArray

    def at(self, times: FloatArray) -> FloatArray:
        """(T, 2) controls at times (T,) [s]; before and after, those of the first and last knot."""
        grid = self.begins + self.horizon * np.linspace(0.0, 1.0, len(self.knots))
        return np.column_stack([np.interp(times, grid, column) for column in self.knots.T])

    def later(self, time: float) -> ControlSequence:
        """The same from a later time on, with the last controls held beyond its end."""
        grid = time + self.horizon * np.linspace(0.0, 1.0, len(self.knots))
        return ControlSequence(time, self.horizon, self.at(grid))


def interpolation(steps: int, knots: int) -> FloatArray:
    """(H, M) matrix that gives the controls in the middle of each step from those at the knots."""
    places = (np.arange(steps) + 0.5) / steps * (knots - 1)
    left = np.minimum(places.astype(np.int64), knots - 2)
    rows = np.arange(steps)
    share = places - left
    matrix = np.zeros((steps, knots))
    matrix[rows, left] = 1.0 - share
    matrix[rows, left + 1] = share
    return matrix


def least_controls(robot: RobotModel) -> FloatArray:
    """(2,) the least speed and turn rate, as fractions of the greatest ones."""
    return np.array([robot.min_speed / robot.max_speed, -1.0])


def resting(
    robot: RobotModel, config: MppiConfig, begins: float, horizon: float
) -> ControlSequence:
    """Standing, or straight on where the robot cannot stand."""
    knots = np.zeros((config.knots, 2))
    knots[:, SPEED] = 0.0 if robot.can_stop else 1.0
    return ControlSequence(begins, horizon, knots)


def first_spread(robot: RobotModel, config: MppiConfig) -> FloatArray:
    """(M, 2) standard deviation of the noise at the knots."""
    spread = np.tile([config.speed_noise, config.turn_noise], (config.knots, 1))
    if robot.drive is Drive.CONSTANT_SPEED:
        spread[:, SPEED] = 0.0
    return spread


def draw(
    rng: np.random.Generator,
    mean: FloatArray,  # (M, 2) controls at the knots
    spread: FloatArray,  # (M, 2) standard deviation of the noise
    low: FloatArray,  # (2,) the least controls
    config: MppiConfig,
) -> FloatArray:
    """(S, M, 2) random knots: the mean itself, arcs of any curvature, and the mean with noise."""
    noise = rng.standard_normal((config.samples, *mean.shape))
    samples = np.clip(mean + spread * noise, low, 1.0)
    arcs = 1 + round(config.exploring * (config.samples - 1))
    constant = rng.uniform(low, 1.0, (config.samples, 1, 2))
    samples[1:arcs] = constant[1:arcs]
    samples[0] = mean
    return samples


_TURN = 0.35  # greatest turn from pose to pose [rad]
_LENGTH = 0.3  # greatest length from pose to pose [circumscribed radii]
_NEAR = 1.5  # objects so much farther away than the robot gets are left out [R]
_FEW = 40  # objects that are few enough to keep them all
DRIVEN = 0
REACHED = 1
BLOCKED = 2
"""Ends of a rollout: at the horizon, in the goal, or at something static or jammed."""


class Rollouts(NamedTuple):
    """S rollouts of N + 1 poses among K objects."""

    paths: FloatArray  # (S, N + 1, 3) poses of the robot; the last one again after the end
    twists: FloatArray  # (S, H, 2) speed [m/s] and turn rate [rad/s] of each step
    ends: IntArray  # (S,) index of the last pose that is reached
    outcomes: IntArray  # (S,) `DRIVEN`, `REACHED` or `BLOCKED`
    objects: FloatArray  # (S, K, 3) poses of the objects there
    works: FloatArray  # (S,) sum of mass times path length of the objects [kg m]


def make_rollouts(samples: int, steps: int, substeps: int, objects: int) -> Rollouts:
    """Memory for rollouts."""
    return Rollouts(
        np.empty((samples, steps * substeps + 1, 3)),
        np.empty((samples, steps, 2)),
        np.zeros(samples, np.int64),
        np.zeros(samples, np.int64),
        np.empty((samples, objects, 3)),
        np.zeros(samples),
    )


def default_model(world: World) -> InteractionModel:
    """Ice contacts where a robot goes through open water, else quasi-static ones.

    For a robot that cannot back out, walls hold what is squeezed against them.
    """
    if isinstance(world.goal, GoalLine) and not world.static.convex_parts:
        return IceInteraction()
    held = 0.0 if world.robot.can_stop else 0.5
    return QuasiStatic(friction=0.1, static_friction=held, step=0.3, iterations=6)


def step_length(world: World, config: MppiConfig) -> float:
    """Time between two steps of a rollout [s]."""
    if config.step is not None:
        return config.step
    return config.stride * world.robot.circumscribed_radius / world.robot.max_speed


class RolloutModel:
    """Rolls out control sequences from one snapshot.

    Args:
        world: the snapshot.
        config: settings.
        interaction: predicts the objects; `default_model` if None. One in compiled form rolls
            all samples in the core; any other one is asked for each sample's path.
    """

    def __init__(
        self, world: World, config: MppiConfig, interaction: InteractionModel | None = None
    ) -> None:
        self.config = config
        self.period = step_length(world, config)
        self.world = _nearby(world, config.steps * self.period)
        self.interaction = default_model(world) if interaction is None else interaction
        self.compiled = None
        if isinstance(self.interaction, CompiledInteraction) and len(self.world.movables):
            self.compiled = self.interaction.compiled(self.world)
        self._matrix = interpolation(config.steps, config.knots)
        self._objects = self.world.movables.poses
        driven = driven_twist(world)
        self._twist = (driven.linear, driven.angular)
        self.substeps = _substeps(world, self.period)
        self._problem = _problem(world, config, self.period, self.substeps)

    @property
    def horizon(self) -> float:
        """Time from the beginning to the end of a rollout [s]."""
        return self.config.steps * self.period

    def roll(self, knots: FloatArray) -> Rollouts:
        """Roll out S sequences.

        Args:
            knots: (S, M, 2) controls at the knots, as fractions of the greatest ones.
        """
        controls = np.ascontiguousarray(np.einsum("hm,smc->shc", self._matrix, knots))
        config = self.config
        rollouts = make_rollouts(len(knots), config.steps, self.substeps, len(self._objects))
        memory = core.Rollouts(*rollouts)
        core.roll_robots(controls, self.world.robot_pose, *self._twist, self._problem, memory)
        if self.compiled is not None:
            core.roll_objects(self.compiled, self._objects, memory)
        elif len(self._objects):
            self._ask(rollouts)
        # a path stays where it has ended, so that costs need not know the ends
        kept = np.minimum(np.arange(rollouts.paths.shape[1]), rollouts.ends[:, None])
        rollouts.paths[:] = np.take_along_axis(rollouts.paths, kept[..., None], axis=1)
        return rollouts

    def _ask(self, rollouts: Rollouts) -> None:
        """Have the model itself carry the objects along each path."""
        paths = [
            path[: end + 1]
            for path, end in zip(rollouts.paths, rollouts.ends.tolist(), strict=True)
        ]
        model = self.interaction
        if isinstance(model, SweepsMany):
            swept = model.sweep_many(self.world, paths)
        else:
            swept = [model.sweep(self.world, path) for path in paths]
        for s, one in enumerate(swept):
            rollouts.objects[s] = one.object_poses[-1]
            rollouts.works[s] = one.work
            if one.jammed_at >= 0:
                rollouts.ends[s] = max(one.jammed_at - 1, 0)
                rollouts.outcomes[s] = BLOCKED


def _nearby(world: World, horizon: float) -> World:
    """The world with those objects only that the robot may move within the horizon.

    Where objects have a goal all of them stay: the costs are of all.
    """
    movables = world.movables
    robot = world.robot
    if len(movables) <= _FEW or not isinstance(world.goal, GoalDisc | GoalLine):
        return world
    reach = horizon * robot.max_speed + (1.0 + _NEAR) * robot.circumscribed_radius
    away = np.hypot(*(movables.poses[:, :2] - world.robot_pose[:2]).T)
    near = away < reach + movables.radii
    return World(
        robot,
        world.robot_pose,
        world.static,
        movables.select(near),
        world.goal,
        world.robot_twist,
        world.time,
        world.margin,
    )


def _substeps(world: World, period: float) -> int:
    """Poses in a step of a rollout."""
    robot = world.robot
    turn = robot.max_turn_rate * period
    length = max(robot.max_speed, -robot.min_speed) * period / robot.circumscribed_radius
    return max(1, math.ceil(max(turn / _TURN, length / _LENGTH) - 1e-9))


def _problem(world: World, config: MppiConfig, period: float, substeps: int) -> core.RolloutProblem:
    robot = world.robot
    limits = np.array(
        [
            robot.min_speed,
            robot.max_speed,
            robot.max_turn_rate,
            robot.max_acceleration * period,
            robot.max_turn_acceleration * period,
            robot.min_turning_radius,
        ]
    )
    walls = obstacles(keep_out(world))
    for margin in (config.margin * robot.circumscribed_radius, 0.0):
        shape = footprint(robot, margin)
        checker = motion.CollisionChecker(shape, walls)
        if checker.is_free(world.robot_pose):
            break
    has_goal = isinstance(world.goal, GoalDisc | GoalLine)
    goal = np.zeros(5)  # not read where the robot has none
    if has_goal:
        goal = goal_numbers(world.place_goal, 0.0)
    return core.RolloutProblem(
        period,
        substeps,
        limits,
        shape,
        walls,
        goal,
        has_goal,
        allowed=checker.depth(world.robot_pose),
    )
