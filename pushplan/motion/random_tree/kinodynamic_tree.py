"""One kinodynamic random tree, grown by OMPL's control-space RRT (LaValle and Kuffner 2001).

OMPL owns the tree, the nearest-neighbour search and the loop; it calls back for targets, for the
motion towards them, and for the goal. A control is a curvature. Its Python binding (2.0.1) offers
no constructor for a directed control sampler, so the propagator tries several curvatures and puts
the one that gets nearest to the target in the place of OMPL's sample. The length of the arc, and
how far the way leads back in all, are part of the state that it leads to, with no weight in the
distance of two states, which is that of the core's `Steering`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from ompl import base, control, util

from pushplan.core import motion as core
from pushplan.motion.random_tree.ompl_calls import (
    GoalRegion,
    grow_to,
    ompl_alone,
    own_state,
    plane_bounds,
)
from pushplan.world import NavigationGoal
from pushplan.world.checks import FloatArray


class TreeLimits(NamedTuple):
    """Limits on the growth of the tree."""

    max_curvature: float  # greatest |curvature| of an edge [1/m]
    edge_length: float  # longest edge [m]
    spacing: float  # distance between collision checks [m]
    turn_weight: float  # length that a radian of heading error is worth [m]
    backward: float  # greatest total length that a path may lead back [m]


_PLACE, _HEADING, _DRIVEN = range(3)  # the parts of a state, of which the last is:
_LENGTH, _BACK = range(2)  # length of the arc that led there, and of all that leads back [m]


@dataclass(eq=False)
class TreeGrowth:
    """A tree that grows from ``start`` to ``goal``: what OMPL's callbacks need."""

    start: FloatArray  # (3,) pose
    goal: NavigationGoal
    targets: Callable[[], FloatArray]  # gives the next (3,) pose to grow towards
    limits: TreeLimits  # of the edges
    bounds: FloatArray  # (4,) of the workspace [m]
    shape: core.Footprint  # of the robot
    among: core.ConvexObstacles  # obstacles that it must not touch

    def __post_init__(self) -> None:
        limits = self.limits
        self.steering = core.Steering(
            limits.max_curvature,
            limits.edge_length,
            limits.spacing,
            limits.turn_weight,
            self.shape,
            self.among,
        )
        self.origin = np.empty(3)
        self.end = np.empty(3)
        self.target = np.empty(3)
        self.moved = True  # OMPL asks whether the start is valid before anything moves

    def grow(
        self, seed: int, done: Callable[[], bool], stopped: Callable[[], bool]
    ) -> FloatArray | None:
        """Grow until the goal is reached or ``done()`` says so, which is asked once an iteration.

        Args:
            seed: of OMPL's generator, positive.
            done: returns True when it has to end.
            stopped: asked while another thread uses OMPL.

        Returns:
            (E, 2) length [m] and curvature [1/m] of the arcs from start to goal, or None.
        """
        with ompl_alone(stopped) as ready:
            return self._run(seed, done) if ready else None

    def _run(self, seed: int, done: Callable[[], bool]) -> FloatArray | None:
        space = _state_space(self.limits.turn_weight)
        space.getSubspace(_PLACE).setBounds(plane_bounds(self.bounds))
        controls = control.RealVectorControlSpace(space, 1)
        curvatures = base.RealVectorBounds(1)
        curvatures.setLow(-self.limits.max_curvature)
        curvatures.setHigh(self.limits.max_curvature)
        controls.setBounds(curvatures)
        info = control.SpaceInformation(space, controls)
        info.setStatePropagator(self._propagate)
        info.setStateValidityChecker(lambda state: self.moved)
        info.setPropagationStepSize(1.0)
        info.setMinMaxControlDuration(1, 1)
        info.setup()
        start = own_state(_state_space)
        _write(self.start, start)
        start[_HEADING].value = _wrap(self.start[2])
        start[_DRIVEN][_LENGTH] = start[_DRIVEN][_BACK] = 0.0
        planner = control.RRT(info)
        planner.setGoalBias(1.0)  # every target comes from `targets`
        util.RNG.setSeed(seed)  # for the samplers, which are made from here on
        path = grow_to(GoalRegion(info, self._aim, self._distance), planner, start, done)
        if path is None:
            return None
        ends = path.getStates()[1:]
        return np.array(
            [
                [end[_DRIVEN][_LENGTH], driven[0]]
                for end, driven in zip(ends, path.getControls(), strict=True)
            ]
        )

    def _propagate(
        self, state: base.State, action: control.Control, duration: float, result: base.State
    ) -> None:
        """Drive towards the target; the control becomes the curvature that was driven."""
        back = state[_DRIVEN][_BACK]
        self.origin[0] = state[_PLACE][0]
        self.origin[1] = state[_PLACE][1]
        self.origin[2] = state[_HEADING].value
        curvature, length = self.steering.steer(
            self.origin, self.target, action[0], self.limits.backward - back, self.end
        )
        self.moved = length != 0.0
        if not self.moved:
            return
        self.end[2] = _wrap(self.end[2])
        _write(self.end, result)
        result[_DRIVEN][_LENGTH] = length
        result[_DRIVEN][_BACK] = back - min(length, 0.0)
        action[0] = curvature

    def _aim(self, state: base.State) -> None:
        """Write the next target, which `_propagate` drives towards."""
        self.target[:] = self.targets()
        _write(self.target, state)

    def _distance(self, state: base.State) -> float:
        return self.goal.distance(state[_PLACE][0], state[_PLACE][1])


def _state_space(turn_weight: float = 1.0) -> base.CompoundStateSpace:
    space = base.CompoundStateSpace()
    space.addSubspace(base.RealVectorStateSpace(2), 1.0)
    space.addSubspace(base.SO2StateSpace(), turn_weight)
    driven = base.RealVectorStateSpace(2)
    driven.setBounds(plane_bounds(np.array([-1.0, -1.0, 1.0, 1.0])))  # OMPL wants some
    space.addSubspace(driven, 0.0)
    return space


def _write(pose: FloatArray, state: base.State) -> None:
    state[_PLACE][0] = float(pose[0])
    state[_PLACE][1] = float(pose[1])
    state[_HEADING].value = float(pose[2])


def _wrap(angle: float) -> float:
    # `wrap_angle` differs in last bits, from which other trees grow
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)
