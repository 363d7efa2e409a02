"""`PushingMpc`: push a box along a path by looking ahead along it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from pushplan.compiled import owned
from pushplan.control.episode_clock import EpisodeClock
from pushplan.control.limits import driven_twist
from pushplan.control.mpc.horizon import (
    FAILED,
    Horizon,
    make_horizon,
    remember,
    send,
    solve_rounds,
    track_of,
)
from pushplan.control.mpc.quadratic_program import ProgramSolver
from pushplan.geometry.obstacles import obstacles_of
from pushplan.planners.pushing.bumper import faces_of
from pushplan.planners.pushing.clearance_kernels import clearance_problem
from pushplan.planners.pushing.cost_kernels import Weights, assembly_memory
from pushplan.planners.pushing.parameters import PushingConfig
from pushplan.planners.pushing.path import PushPath
from pushplan.planners.pushing.push_kernels import (
    assemble_push,
    begin_push,
    drive_push,
    observe_push,
    send_push,
)
from pushplan.planners.pushing.push_model import PushModel, PushState
from pushplan.planners.pushing.push_observer_kernels import ALONG, SLOWED, Faces, PushingMemory
from pushplan.planners.warm_up_worlds import warm_up_worlds
from pushplan.world import Drive, InvalidInputError, Plan, RobotModel, Twist, World
from pushplan.world.checks import FloatArray, IntArray, expect
from pushplan.world.outline import convex_outline

_NEARER = 1e-6  # distance by which a body within the clearance may come nearer [R]
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
        self._memory: PushingMemory | None = None
        self._clock = EpisodeClock(self.config.period)
        self._out = np.zeros(2)
        self._gone = True

    @property
    def along(self) -> float:
        """Length of the path that the box has been pushed [m]."""
        return self._told(ALONG)

    @property
    def slowed(self) -> float:
        """Fraction of the last command that was driven, for the sake of what is static."""
        return self._told(SLOWED)

    @property
    def fallbacks(self) -> int:
        """Calls since the start of the episode in which the solver gave no solution."""
        if self._memory is None:
            return 0
        return int(self._memory.horizon.counts[FAILED])

    @property
    def model(self) -> PushModel | None:
        """Of the box that is pushed."""
        if self._memory is None:
            return None
        return self._models[int(self._memory.face[0])]

    @property
    def state(self) -> PushState | None:
        """Robot and box as estimated at the last call; None if the box had gone."""
        if self._memory is None or self._gone:
            return None
        return PushState.from_row(self._memory.state)

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
        self._prepare(world, plan)
        found = np.flatnonzero(world.movables.ids == plan.subtasks[0].object_ids[0])
        out = self._out
        held = self._clock.held
        self._gone = len(found) == 0
        if self._gone:
            send(self._horizon, 0.0, 0.0, held, True, out)
            remember(self._horizon, world.time, world.time - 2.0 * self.config.delay - 1.0)
        else:
            k = int(found[0])
            if plan is not self._plan:
                self._begin(world, plan, k)
            self._step(world, owned(world.robot_pose), owned(world.movables.poses[k]))
        return Twist(float(out[0]), float(out[1]))

    def _prepare(self, world: World, plan: Plan) -> None:
        """Start afresh where the episode or the robot has changed."""
        robot = world.robot
        config = self.config
        if robot.drive is not Drive.DIFFERENTIAL:
            raise InvalidInputError("pushing along a path needs a differential drive")
        if not plan.subtasks or not plan.subtasks[0].object_ids:
            raise InvalidInputError(
                "the plan must name the box in its first sub-task, as PushPath.plan does"
            )
        if self._robot is not robot and self._robot != robot:
            self._robot = robot
            self._plan = None
            self._memory = None
            self._horizon = make_horizon(robot, (0, 1), config.horizon, config.moves)
            self._solver = ProgramSolver(
                self._horizon.program, config.tolerance, config.solver_iterations
            )
            driven = driven_twist(world)
            self._horizon.last[:] = driven.linear, driven.angular

    def _begin(self, world: World, plan: Plan, k: int) -> None:
        """A new path: which face is pushed, and memory for the problem."""
        self._plan = plan
        self._track = track_of(plan)
        self._memory, self._models = _pushing_memory(
            world.robot, world.movables.outline(k), self.config, self._horizon
        )
        begin_push(self._memory, float(world.robot_pose[2] - world.movables.poses[k, 2]))

    def _step(self, world: World, pose: FloatArray, box: FloatArray) -> None:
        """Fill the command."""
        memory = self._memory
        time = world.time
        held = self._clock.held
        out = self._out
        assert memory is not None
        if observe_push(memory, self._track, pose, box, time, held):
            solved = self._solve(memory)
            drive_push(memory, obstacles_of(world.static), solved, time, held, out)
        else:
            send_push(memory, 0.0, 0.0, time, held, out)

    def _solve(self, memory: PushingMemory) -> bool:
        return solve_rounds(
            memory.horizon,
            self._solver,
            self.config.iterations,
            self.config.first_iterations,
            partial(assemble_push, memory, self._track, self._clock.held),
        )

    def _told(self, place: int) -> float:
        if self._memory is None:
            return math.nan
        return float(self._memory.told[place])


def groups_of(horizon: int, moves: int) -> IntArray:
    """(N,) which command holds in each step: the first ones for one step, later ones for more."""
    ends = horizon * (np.arange(1, moves + 1) / moves) ** (1.6 if moves < horizon else 1.0)
    ends = np.maximum(np.round(ends), np.arange(1, moves + 1)).astype(np.int64)
    ends = np.minimum(ends, horizon - np.arange(moves - 1, -1, -1))
    return np.searchsorted(ends, np.arange(horizon), side="right").astype(np.int64)


def _pushing_memory(
    robot: RobotModel, outline: FloatArray, config: PushingConfig, horizon: Horizon
) -> tuple[PushingMemory, list[PushModel]]:
    """Parameters and memory of the kernels, and the contact model of each face.

    Args:
        robot: that pushes.
        outline: (N, 2) convex, counter-clockwise corners of the box, origin at the centroid [m].
        config: parameters.
        horizon: memory for commands, which outlasts a path.
    """
    faces, scores = faces_of(convex_outline("outline", outline))
    models = [PushModel(robot, outline, config.parameters, face) for face in faces]
    size = robot.circumscribed_radius
    stable = [(model.stable_curvature(), model.reach) for model in models]
    memory = PushingMemory(
        horizon,
        Weights(
            length=0.0,  # comes with the path, as the curvature does
            max_speed=robot.max_speed,
            half=models[0].bumper.half,
            curvature=-1.0,
            safe=_SAFE_FRACTION,
            **{name: getattr(config, name) for name in Weights._fields if hasattr(config, name)},
        ),
        Faces(
            scores,
            np.array([model.contact for model in models]),
            np.array([model.face.normal for model in models]),
            np.array([config.margin * k if k * reach > 0.02 else -1.0 for k, reach in stable]),
        ),
        assembly_memory(config.horizon, horizon.program.hessian, horizon.program.gradient),
        clearance_problem(robot, models[0].outline, config.clearance * size, _NEARER * size),
        groups_of(config.horizon, config.moves),
        config.reach,
        config.delay,
        config.observer_gain,
        np.zeros(1, dtype=np.int64),
        np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        *(np.zeros(count) for count in (6, 6, 6, 6, 3, 6)),
    )
    return memory, models


def warm_up() -> None:
    """Push a box for three steps.

    Numba compiles a kernel on its first use after an installation (seconds) and loads it from its
    cache on the first use in a process. A controller calls this once when it starts.
    """
    (world,) = warm_up_worlds("pushing")
    plan = PushPath.arcs([0.0, 0.0, 0.0], [(1.0, 0.0), (1.0, 0.2)]).plan(world.robot, 0)
    mpc = PushingMpc()
    for i in range(3):
        pose = [-1.25 + 0.02 * i, 0.0, 0.0]
        mpc.command(world.moved(robot_pose=pose, time=0.1 * i), plan)
