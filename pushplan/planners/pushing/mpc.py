"""`PushingMpc`: push a box along a path by looking ahead along it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pushplan.control.episode_clock import EpisodeClock
from pushplan.control.limits import clamp_twist, driven_twist
from pushplan.control.mpc.tracker import limits_of, track_of
from pushplan.core import control
from pushplan.core import pushing as core
from pushplan.geometry import gyration_squares
from pushplan.geometry.obstacles import grown_map
from pushplan.planners.pushing.bumper import faces_of
from pushplan.planners.pushing.parameters import PushingConfig
from pushplan.planners.pushing.push_model import PushModel, PushState
from pushplan.world import Drive, InvalidInputError, Movables, Plan, RobotModel, Twist, World
from pushplan.world.checks import FloatArray, IntArray, expect
from pushplan.world.outline import convex_outline, flatten

_NEARER = 1e-6  # distance by which a body within the clearance may come nearer [R]
_WEIGHTS = ("heading", "offset", "rim", "angle", "grip", "turn", "speed", "smoothness", "terminal")
_SAFE_FRACTION = 0.6  # of half the bumper, within which an offset costs no more than ``offset``


@dataclass
class PushingMpc:
    """Model-predictive pushing: commands that keep a box on its path and on the bumper.

    Each call solves one quadratic program, linearised about the last solution. A solution
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
        self._tracker: core.PushTracker | None = None
        self._clock = EpisodeClock(self.config.period)
        self._gone = True

    @property
    def along(self) -> float:
        """Length of the path that the box has been pushed [m]."""
        return math.nan if self._begun is None else self._begun.along

    @property
    def slowed(self) -> float:
        """Fraction of the last command that was driven, for the sake of what is static."""
        return math.nan if self._begun is None else self._begun.slowed

    @property
    def fallbacks(self) -> int:
        """Calls since the start of the episode in which the solver gave no solution."""
        return 0 if self._tracker is None else self._tracker.failures

    @property
    def model(self) -> PushModel | None:
        """Of the box that is pushed."""
        return None if self._begun is None else self._models[self._begun.face]

    @property
    def state(self) -> PushState | None:
        """Robot and box as estimated at the last call; None if the box had gone."""
        if self._begun is None or self._gone:
            return None
        return PushState.from_row(self._begun.state)

    @property
    def _begun(self) -> core.PushTracker | None:
        """The tracker once it has a path."""
        return None if self._plan is None else self._tracker

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
        tracker = self._prepare(world, plan)
        found = np.flatnonzero(world.movables.ids == plan.subtasks[0].object_ids[0])
        self._gone = len(found) == 0
        held = self._clock.held
        if self._gone:
            return Twist(*tracker.stop(world.time, held))
        k = int(found[0])
        if plan is not self._plan:
            self._begin(world, plan, k)
        command = tracker.follow(
            self._track,
            grown_map(world.static).obstacles,
            world.robot_pose,
            world.movables.poses[k],
            world.time,
            held,
        )
        return clamp_twist(world.robot, *command)

    def _prepare(self, world: World, plan: Plan) -> core.PushTracker:
        """Start afresh where the episode or the robot has changed."""
        robot = world.robot
        config = self.config
        if robot.drive is Drive.CONSTANT_SPEED:
            raise InvalidInputError("pushing along a path needs a robot that can stop")
        if not plan.subtasks or not plan.subtasks[0].object_ids:
            raise InvalidInputError(
                "the plan must name the box in its first sub-task, as PushPath.plan does"
            )
        if self._tracker is None or (self._robot is not robot and self._robot != robot):
            self._robot = robot
            self._plan = None
            driven = driven_twist(world)
            weights = {name: getattr(config, name) for name in _WEIGHTS}
            self._tracker = core.PushTracker(
                limits_of(robot),
                core.PushWeights(
                    max_speed=robot.max_speed,
                    safe=_SAFE_FRACTION,
                    # these come with the face
                    length=0.0,
                    half=0.0,
                    curvature=-1.0,
                    **weights,
                ),
                control.SolverSettings(
                    config.tolerance,
                    config.solver_iterations,
                    config.iterations,
                    config.first_iterations,
                ),
                groups_of(config.horizon, config.moves),
                config.reach,
                config.delay,
                gain=config.observer_gain,
                v=driven.linear,
                w=driven.angular,
            )
        return self._tracker

    def _begin(self, world: World, plan: Plan, k: int) -> None:
        """A new path: which face is pushed, and what is kept clear."""
        assert self._tracker is not None
        outline = world.movables.outline(k)
        faces, scores = faces_of(convex_outline("outline", outline))
        parameters = self.config.parameters
        self._plan = plan
        self._track = track_of(plan)
        radius = _radius_of_compound(world.movables, k)
        self._models = [PushModel(world.robot, outline, parameters, face, radius) for face in faces]
        self._tracker.begin(
            [
                _face(world.robot, model, score, self.config)
                for model, score in zip(self._models, scores, strict=True)
            ],
            _clearance(world.robot, self._models[0], self.config),
            float(world.robot_pose[2] - world.movables.poses[k, 2]),
        )


def _radius_of_compound(movables: Movables, k: int) -> float | None:
    """The radius of gyration of an object that is more than its outline [m]; None for others."""
    if len(movables.parts(k)) == 1 and movables.gyration_radii[k] == 0.0:
        return None
    return math.sqrt(gyration_squares(movables.select([k]))[0])


def groups_of(horizon: int, moves: int) -> IntArray:
    """(N,) which command holds in each step: the first ones for one step, later ones for more."""
    ends = horizon * (np.arange(1, moves + 1) / moves) ** (1.6 if moves < horizon else 1.0)
    ends = np.maximum(np.round(ends), np.arange(1, moves + 1)).astype(np.int64)
    ends = np.minimum(ends, horizon - np.arange(moves - 1, -1, -1))
    return np.searchsorted(ends, np.arange(horizon), side="right").astype(np.int64)


def _face(
    robot: RobotModel, model: PushModel, score: FloatArray, config: PushingConfig
) -> core.Face:
    """A side of a box; ``score`` (3,) as `faces_of` gives it."""
    stable = model.stable_curvature()
    curvature = -1.0
    if stable * model.reach > 0.02:
        curvature = config.margin * stable
    if robot.min_turning_radius > 0.0:
        tightest = 1.0 / robot.min_turning_radius
        curvature = min(curvature, tightest) if curvature >= 0.0 else tightest
    return core.Face(score, model.contact, model.face.normal, curvature)


def _clearance(robot: RobotModel, model: PushModel, config: PushingConfig) -> core.Clearance:
    size = robot.circumscribed_radius
    vertices, offsets = flatten([*robot.wall_parts, model.outline])
    far = np.hypot(vertices[:, 0], vertices[:, 1])
    return core.Clearance(
        vertices,
        offsets,
        radii=np.maximum.reduceat(far, offsets[:-1]),
        least=config.clearance * size,
        slack=_NEARER * size,
    )
