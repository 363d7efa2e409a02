"""Making a path cheaper against the predicted interaction, until the stop rule fires."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pushplan.core import planners as core
from pushplan.interaction.path_sweepers import MARGIN, PathSweeper
from pushplan.world import World
from pushplan.world.checks import BoolArray, FloatArray

_PORTION = 8  # poses that are swept between two looks at the stop rule


class ShortcutProblem(NamedTuple):
    """Constraints on a changed path, and the scale of its changes."""

    radius: float  # Least turning radius [m]
    spacing: float  # Greatest distance between two poses [m]
    spread: float  # Typical sideways displacement [m]
    most_turn: float  # Greatest turn of a curve [rad]
    end_fraction: float  # Fraction of the changes that are changes of the end
    goal: FloatArray  # (4,) point x, y and unit normal of the line where the path ends


@dataclass(frozen=True)
class SweptCandidate:
    """A path and what is predicted along it."""

    poses: FloatArray  # (N, 3) [m, m, rad]
    curvatures: FloatArray  # (N,) that lead to them [1/m]
    lengths: FloatArray  # (N,) path length so far [m]
    objects: FloatArray  # (M, K, 3) poses of the objects at the first M poses of the path
    works: FloatArray  # (M,) work so far [kg m]
    cost: float  # travel plus weighted work [kg m], as far as it is predicted


@dataclass(eq=False)
class ShipPathImprover:
    """Finds the costs of paths by sweeps and changes paths at random."""

    sweeper: PathSweeper  # carries the objects
    start: FloatArray  # (K, 3) poses of the objects now
    robot_mass: float  # [kg]
    weight: float  # w, cost of work
    problem: ShortcutProblem  # constraints on changed paths
    ahead: float  # length of a path that is swept [m]
    stopped: Callable[[], bool]  # True if the call has to return now
    free: Callable[[FloatArray], bool]  # True if poses (N, 3) are clear of walls and in bounds
    best: SweptCandidate | None = None

    def consider(
        self,
        poses: FloatArray,  # (N, 3) the path
        curvatures: FloatArray,  # (N,) that lead to its poses [1/m]
        first: int = 0,  # last pose that it shares with ``base``
        base: SweptCandidate | None = None,  # its prediction holds up to there
    ) -> bool:
        """Find the cost of a path; keep it and return True if it is the cheapest so far."""
        moves = np.diff(poses[:, :2], axis=0)
        lengths = np.concatenate([[0.0], np.cumsum(np.sqrt((moves * moves).sum(axis=1)))])
        limit = np.inf if self.best is None else self.best.cost
        own = self.robot_mass * float(lengths[-1])
        if own >= limit:
            return False
        last = int(np.searchsorted(lengths, self.ahead)) + 1
        last = max(min(last, len(poses)), first + 1)
        objects = np.empty((last, len(self.start), 3))
        works = np.zeros(last)
        if base is None or first >= len(base.objects):
            first = 0
            objects[0] = self.start
        else:
            objects[: first + 1] = base.objects[: first + 1]
            works[: first + 1] = base.works[: first + 1]
        here = objects[first].copy()
        at = first
        while at < last - 1:
            if self.stopped():
                return False
            end = min(at + _PORTION, last - 1)
            added = works[at + 1 : end + 1]
            if not self.sweeper(poses[at : end + 1], here, objects[at : end + 1], added):
                return False
            added[:] = works[at] + np.cumsum(added)
            at = end
            if own + self.weight * works[at] >= limit:
                return False
        self.best = SweptCandidate(
            poses, curvatures, lengths, objects, works, own + self.weight * float(works[-1])
        )
        return True

    def shortcut(self, rng: np.random.Generator) -> bool:
        """Try one random change of the best path; return True if it was kept.

        Shortcutting after Geraerts and Overmars, "Creating high-quality paths for motion planning"
        (2007).
        """
        assert self.best is not None
        best = self.best
        count = len(best.poses)
        part = min(count, len(best.objects))
        out = np.empty((2 * part + 60, 3))
        curvatures = np.zeros(2 * part + 60)
        problem = self.problem
        if part < count:  # the end of what is swept is not the end of the path
            problem = problem._replace(end_fraction=0.0)
        first, new, size = core.propose_change(
            best.poses[:part],
            best.curvatures[:part],
            rng.random(4),
            rng.standard_normal(2),
            np.hstack(problem),
            out,
            curvatures,
        )
        if size == 0 or not self.free(out[first + 1 : new]):
            return False
        turns = 2.0 * np.pi * round((out[size - 1, 2] - best.poses[part - 1, 2]) / (2 * np.pi))
        rest = best.poses[part:] + np.array([0.0, 0.0, turns])
        poses = np.concatenate([out[:size], rest])
        curvatures = np.concatenate([curvatures[:size], best.curvatures[part:]])
        return self.consider(poses, curvatures, first, best)


@dataclass(frozen=True)
class NearbyObjects:
    """The part of a world that a sweep of limited length can move."""

    world: World  # with the objects that are near
    which: BoolArray  # (K,) which of all objects they are

    @classmethod
    def around(
        cls,
        world: World,
        normal: FloatArray,  # (2,) direction towards the goal
        ahead: float,  # length of a path that is swept [m]
    ) -> NearbyObjects:
        """The objects from a little behind the robot to a little beyond what is swept."""
        size = world.robot.circumscribed_radius
        along = (world.movables.poses[:, :2] - world.robot_pose[:2]) @ normal
        reach = (1.0 + MARGIN) * size + world.movables.radii
        which = (along > -ahead - reach) & (along < ahead + reach)
        if which.all():
            return cls(world, which)
        near = World(
            world.robot,
            world.robot_pose,
            world.static,
            world.movables.select(which),
            world.goal,
        )
        return cls(near, which)

    def everything(
        self,
        world: World,  # the whole world
        objects: FloatArray,  # (M, N, 3) poses of those that are near
        missing: int,  # number of further poses
    ) -> FloatArray:
        """(M + missing, K, 3) poses of all objects of a world; after the M given ones they rest."""
        count = len(objects)
        out = np.empty((count + missing, len(world.movables), 3))
        out[:] = world.movables.poses
        out[:count, self.which] = objects
        out[count:, self.which] = objects[-1]
        return out
