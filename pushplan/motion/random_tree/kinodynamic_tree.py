"""One kinodynamic random tree, grown by OMPL's control-space RRT (LaValle and Kuffner 2001).

OMPL owns the tree, the nearest-neighbour search and the loop; it calls back for targets, for the
motion towards them, and for the goal. Its Python binding offers no constructor for a directed
control sampler, so the sampling of several controls, of which the one that gets nearest to the
target is kept, happens inside the propagator: OMPL's own sample is one of them, and the edges are
written down here, because the control that OMPL stores is only the sample. OMPL counts from the
start, in units in which its distance between two poses is that of `steer`: so its tree is the same
wherever and however large the world is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from ompl import base, control

from pushplan.compiled import copy_into, kernel
from pushplan.motion.collision import ConvexObstacles, Footprint, is_free
from pushplan.motion.dubins import along_arc, step_along
from pushplan.motion.random_tree.ompl_lock import own_state, seeded_ompl
from pushplan.world import NavigationGoal
from pushplan.world.checks import FloatArray


class TreeLimits(NamedTuple):
    """How the tree may grow."""

    max_curvature: float  # greatest |curvature| of an edge [1/m]
    edge_length: float  # longest edge [m]
    spacing: float  # distance between collision checks [m]
    turn_weight: float  # what a radian of heading error is worth in metres
    backward: float  # how far a path may lead back in all [m]


_OMPL_TURN_WEIGHT = 0.5  # what a radian is worth in the distance of its SE(2)
_State = tuple[float, float, float]


@kernel(allocates=True)
def steer(
    start: FloatArray,  # (3,)
    target: FloatArray,  # (3,)
    sampled: float,  # a random curvature [1/m]; the others are spread evenly or aim at the target
    limits: TreeLimits,
    shape: Footprint,
    among: ConvexObstacles,
    scratch: FloatArray,  # memory for the footprint's corners
    out: FloatArray,  # (3,) receives the end of the arc
) -> tuple[float, float]:
    """Curvature and length of the free arc nearest to a target, of seven; length 0: blocked.

    Where it may lead back there are seven more, whose lengths are negative.
    """
    bound, longest, spacing, turn_weight, backward = limits
    dx, dy = target[0] - start[0], target[1] - start[1]
    side = -np.sin(start[2]) * dx + np.cos(start[2]) * dy
    aimed = 2.0 * side / max(dx * dx + dy * dy, 1e-12)  # the circle through both, tangent here
    best, best_curvature, best_length = np.inf, 0.0, 0.0
    pose = np.empty(3)
    for arc in range(14 if backward > 0.0 else 7):
        i = arc % 7
        signed = longest if arc < 7 else -min(longest, backward)
        if i == 0:
            curvature = sampled
        elif i == 1:
            curvature = min(max(aimed, -bound), bound)
        else:
            curvature = bound * (0.5 * (i - 2) - 1.0)
        steps = int(np.ceil(abs(signed) / step_along(curvature, spacing)))
        for step in range(1, steps + 1):
            length = signed * step / steps
            along_arc(start, length, curvature, pose)
            if not is_free(pose, shape, among, scratch):
                break
            turn = abs((pose[2] - target[2] + np.pi) % (2.0 * np.pi) - np.pi)
            miss = np.sqrt((pose[0] - target[0]) ** 2 + (pose[1] - target[1]) ** 2)
            miss += turn_weight * turn
            if miss < best:
                best, best_curvature, best_length = miss, curvature, length
                copy_into(out, pose)
    return best_curvature, best_length


@dataclass(eq=False)
class TreeGrowth:
    """A tree that grows from ``start`` to ``goal``: the state behind OMPL's callbacks."""

    start: FloatArray  # (3,) pose
    goal: NavigationGoal
    targets: Callable[[], FloatArray]  # gives the next (3,) pose to grow towards
    limits: TreeLimits  # of the edges
    shape: Footprint  # of the robot
    among: ConvexObstacles  # what it must not touch

    def __post_init__(self) -> None:
        self.start = np.array([self.start[0], self.start[1], _wrap(self.start[2])])
        self.unit = self.limits.turn_weight / _OMPL_TURN_WEIGHT
        self.root = self.state_of(self.start)
        self.poses = {self.root: self.start}
        self.backed = {self.root: 0.0}  # how far the way to each state leads back [m]
        self.scratch = np.empty_like(self.shape.vertices)
        self.end, self.target = np.empty(3), np.empty(3)
        self.moved = True  # OMPL asks whether the start is valid before anything moves
        self.reached: _State | None = None
        # end of each edge -> its start, length and curvature
        self.edges: dict[_State, tuple[_State, float, float]] = {}

    def state_of(self, pose: FloatArray) -> _State:
        """A pose (3,) as OMPL has it."""
        x, y, yaw = (float(value) for value in pose)
        return (x - self.start[0]) / self.unit, (y - self.start[1]) / self.unit, yaw

    def grow(
        self, seed: int, done: Callable[[], bool], stopped: Callable[[], bool]
    ) -> FloatArray | None:
        """Grow until the goal is reached or ``done()`` says so, which is asked once an iteration.

        Args:
            seed: of OMPL's generator, positive.
            done: whether to end.
            stopped: asked while another thread uses OMPL.

        Returns:
            (E, 2) length [m] and curvature [1/m] of the arcs from start to goal, or None.
        """
        with seeded_ompl(seed, stopped) as ready:
            return self._run(done) if ready else None

    def _run(self, done: Callable[[], bool]) -> FloatArray | None:
        space = base.SE2StateSpace()
        bounds = base.RealVectorBounds(2)
        limits = (self.among.bounds - np.tile(self.start[:2], 2)) / self.unit
        for axis in range(2):
            bounds.setLow(axis, float(limits[axis]))
            bounds.setHigh(axis, float(limits[axis + 2]))
        space.setBounds(bounds)
        controls = control.RealVectorControlSpace(space, 1)
        curvatures = base.RealVectorBounds(1)
        curvatures.setLow(-self.limits.max_curvature)
        curvatures.setHigh(self.limits.max_curvature)
        controls.setBounds(curvatures)
        info = control.SpaceInformation(space, controls)
        info.setStatePropagator(self._propagate)
        info.setStateValidityChecker(self._is_valid)
        info.setPropagationStepSize(1.0)
        info.setMinMaxControlDuration(1, 1)
        info.setup()
        problem = base.ProblemDefinition(info)
        state = own_state(base.SE2StateSpace)
        _write(self.root, state)
        problem.addStartState(state)
        region = _Region(info, self)
        problem.setGoal(region)
        planner = control.RRT(info)
        planner.setGoalBias(1.0)  # every target comes from `targets`
        planner.setProblemDefinition(problem)
        planner.setup()
        finished = base.PlannerTerminationCondition(lambda: self.reached is not None or done())
        planner.solve(finished)
        return self._trace() if self.reached is not None else None

    def sample(self) -> FloatArray:
        """The next target, remembered for the propagation that follows."""
        self.target[:] = self.targets()
        return self.target

    def distance(self, state: _State) -> float:
        """Distance [m] of a state of the tree to the goal, which is then reached where it is 0."""
        away = float(self.goal.distance(*self.poses[state][:2]))
        if away == 0.0 and state in self.edges:
            self.reached = state
        return away

    def _propagate(
        self, state: base.State, action: control.Control, duration: float, result: base.State
    ) -> None:
        origin, limits = _read(state), self.limits
        if limits.backward > 0.0:
            limits = limits._replace(backward=limits.backward - self.backed[origin])
        curvature, length = steer(
            self.poses[origin],
            self.target,
            action[0],
            limits,
            self.shape,
            self.among,
            self.scratch,
            self.end,
        )
        self.moved = length != 0.0
        if not self.moved:
            return
        self.end[2] = _wrap(self.end[2])
        end = self.state_of(self.end)
        _write(end, result)
        if end not in self.poses:
            self.poses[end] = self.end.copy()
            self.edges[end] = (origin, length, curvature)
            self.backed[end] = self.backed[origin] - min(length, 0.0)

    def _is_valid(self, state: base.State) -> bool:
        return self.moved

    def _trace(self) -> FloatArray:
        arcs: list[tuple[float, float]] = []
        at = self.reached
        while at is not None and at != self.root:
            at, length, curvature = self.edges[at]
            arcs.append((length, curvature))
        return np.array(arcs[::-1]).reshape(-1, 2)


class _Region(base.GoalSampleableRegion):
    """Hands OMPL our targets, and tells it when a state is in the goal."""

    def __init__(self, info: control.SpaceInformation, growth: TreeGrowth) -> None:
        super().__init__(info)
        self.growth = growth

    def sampleGoal(self, state: base.State) -> None:
        _write(self.growth.state_of(self.growth.sample()), state)

    def maxSampleCount(self) -> int:
        return 1_000_000_000

    def distanceGoal(self, state: base.State) -> float:
        return self.growth.distance(_read(state))


def _read(state: base.State) -> _State:
    return state.getX(), state.getY(), state.getYaw()


def _write(values: _State, state: base.State) -> None:
    state.setX(values[0])
    state.setY(values[1])
    state.setYaw(values[2])


def _wrap(angle: float) -> float:
    # `wrap_angle` differs in last bits, from which other trees grow
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)
