"""`PushingMpc`: push a box along a path by looking ahead along it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from pushplan.compiled import owned
from pushplan.control.episode_clock import EpisodeClock
from pushplan.control.limits import driven_twist
from pushplan.control.mpc.horizon import FAILED, remember, send, solve_rounds, track_of
from pushplan.control.mpc.quadratic_program import ProgramSolver
from pushplan.geometry.obstacles import obstacles_of
from pushplan.planners.pushing.model import PushModel, PushState
from pushplan.planners.pushing.path import PushPath
from pushplan.planners.pushing.problem import pushing_horizon, pushing_memory
from pushplan.planners.pushing.push_kernels import (
    ALONG,
    LATERAL,
    SLOWED,
    VALUE,
    PushingMemory,
    assemble_push,
    begin_push,
    drive_push,
    observe_push,
    send_push,
)
from pushplan.planners.pushing.pushing_config import PushingConfig
from pushplan.planners.warm_up_worlds import warm_up_worlds
from pushplan.world import Drive, InvalidInputError, Plan, RobotModel, Twist, World
from pushplan.world.checks import FloatArray, expect


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
        self._out, self._gone = np.zeros(2), True

    @property
    def along(self) -> float:
        """Length of the path that the box has been pushed [m]."""
        return self._told(ALONG)

    @property
    def lateral(self) -> float:
        """Distance of the box from its path, left positive [m]."""
        return self._told(LATERAL)

    @property
    def slowed(self) -> float:
        """Fraction of the last command that was driven, for the sake of what is static."""
        return self._told(SLOWED)

    @property
    def value(self) -> float:
        """Cost of the nominal commands of the last call, see `PushingConfig`."""
        return self._told(VALUE)

    @property
    def fallbacks(self) -> int:
        """Calls since the start of the episode in which the solver gave no solution."""
        return 0 if self._memory is None else int(self._memory.horizon.counts[FAILED])

    @property
    def model(self) -> PushModel | None:
        """Of the box that is pushed."""
        return None if self._memory is None else self._models[int(self._memory.face[0])]

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
        out, held = self._out, self._clock.held
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
        robot, config = world.robot, self.config
        if robot.drive is not Drive.DIFFERENTIAL:
            raise InvalidInputError("pushing along a path needs a differential drive")
        if not plan.subtasks or not plan.subtasks[0].object_ids:
            raise InvalidInputError(
                "the plan must name the box in its first sub-task, as PushPath.plan does"
            )
        if self._robot is not robot and self._robot != robot:
            self._robot, self._plan, self._memory = robot, None, None
            self._horizon = pushing_horizon(robot, config)
            self._solver = ProgramSolver(
                self._horizon.program, config.tolerance, config.solver_iterations
            )
            driven = driven_twist(world)
            self._horizon.last[:] = driven.linear, driven.angular

    def _begin(self, world: World, plan: Plan, k: int) -> None:
        """A new path: which face is pushed, and memory for the problem."""
        self._plan, self._track = plan, track_of(plan)
        self._memory, self._models = pushing_memory(
            world.robot, world.movables.outline(k), self.config, self._horizon
        )
        begin_push(self._memory, float(world.robot_pose[2] - world.movables.poses[k, 2]))

    def _step(self, world: World, pose: FloatArray, box: FloatArray) -> None:
        """Fill the command."""
        memory, time, held, out = self._memory, world.time, self._clock.held, self._out
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
        return math.nan if self._memory is None else float(self._memory.told[place])


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
