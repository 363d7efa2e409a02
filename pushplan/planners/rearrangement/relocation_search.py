"""`RelocationSearch`: a best-first search for drives after which an object can be pushed home.

Its states are poses of robot and objects. Drives begin behind the object and all round it and go
along arcs ahead, back and on the spot, one after another where one is not enough, each in the
interaction model.
"""

from __future__ import annotations

import heapq
import itertools
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pushplan.core import rearrangement as core
from pushplan.planners.rearrangement.approach import (
    ApproachTree,
    approach_tree,
    arrival_poses,
    find_route,
    simulate_route,
)
from pushplan.planners.rearrangement.candidates import GAIN, attempts
from pushplan.planners.rearrangement.push_scene import PushScene, pose_distance
from pushplan.planners.rearrangement.push_simulator import PushAttempt, end_of, simulate
from pushplan.planners.rearrangement.push_starts import initial_heading
from pushplan.planners.rearrangement.rollout_cache import Primitive, RolloutCache
from pushplan.world.checks import FloatArray

_Cell = tuple[float, ...]

# Lengths are in circumscribed radii of the robot.
_CURVATURES = (0.0, 0.7, -0.7, 1.6, -1.6)
"""Curvatures of the arcs, times the robot's circumscribed radius."""
_ARC_LENGTH = 1.6  # of one arc
_DEPTH = 3  # so many arcs follow one another at most
_EXPANSIONS = 400  # so many states are driven on from, starts not counted
_LITTLE_GAIN = 0.25  # part of the gain that helps too where nothing else does
# sides of a box of like poses of the object [circumscribed radii, rad]
_PLACE = 0.2
_TURN = 0.5
_MOST_ALIKE = 3  # so many states with the object in the same place are driven on from
_MOST_EXTRA = 2.0
"""Greatest extra cost over the best drive found of others that are still looked at."""
_ENOUGH_MARGINS = 24
"""Margins, over all sides from which a drive helps, after which the search ends."""
_MOST_SIDES = 20  # so many drives are kept, each from another side
_HORIZON = 3.0
"""Length of a push that shows that the object can be delivered."""
_LEAST_MOVE = 0.15  # by so much an object has to be moved for it to count
_SPACING = 0.05  # distance that an object moves on until it is looked at anew
_ADVANCE = 0.6
"""Least progress of an object that can be pushed at all, as a fraction of the robot's path."""
_ERRORS = np.array([[0.08, 0.08, 0.15], [-0.08, 0.08, -0.15], [0.0, -0.1, 0.0]])
"""Errors of the prediction that a push home afterwards has to tolerate: x, y [circumscribed
radii], and heading [rad]."""
MARGINS = (1.0, 2.0, 3.0)
"""Factors on them; a relocation costs a radius more for each that it does not tolerate."""


@dataclass(frozen=True, eq=False)
class _State:
    """State that some arcs have led to.

    Args:
        before: where the last arc began; None for a start.
        track: (N, 3) of the robot along the last arc, without its beginning; (1, 3) of a start.
        poses: (K, 3) of the objects.
        depth: how many arcs that were.
        driven: length of them, and what it costs to get to the start [m].
        rest: what is left to be done with the object [m].
    """

    before: _State | None
    track: FloatArray
    poses: FloatArray
    depth: int
    driven: float
    rest: float

    @property
    def cost(self) -> float:
        """Of the drive, and of what it leaves to be done [m]."""
        return self.driven + self.rest

    def chain(self) -> list[_State]:
        """The states that have led here, from the start on."""
        earlier = [] if self.before is None else self.before.chain()
        return [*earlier, self]

    @property
    def start(self) -> FloatArray:
        """(3,) where the robot begins."""
        start: FloatArray = self.chain()[0].track[0]
        return start


class RelocationSearch:
    """The search for one object of a scene.

    Args:
        scene: the scene.
        k: index of the object.
        approach: from where the robot is.
        thorough: look for drives that cost much more than the best one too.

    Attributes:
        interrupted: the budget has ended the search, which may be gone on with.
    """

    def __init__(self, scene: PushScene, k: int, approach: ApproachTree, thorough: bool) -> None:
        self._scene = scene
        self._k = k
        self._approach = approach
        self._thorough = thorough
        self._slack = math.inf if thorough else _MOST_EXTRA * scene.size
        self._horizon = _HORIZON * scene.size
        self._cost_to_go = scene.push_cost_to_go(k)
        step = scene.controller.step
        turn = scene.controller.turn
        signs = [1.0]
        if scene.world.robot.min_speed != 0.0:
            signs.append(-1.0)
        arcs = [
            (sign * step, curvature * step / scene.size)
            for sign in signs
            for curvature in _CURVATURES
        ]
        self._arcs = np.array([*arcs, (0.0, 0.1), (0.0, -0.1)])
        """(A, 2) distance [m], negative backward, and turn [rad] of one step of each arc."""
        self._arcs[:, 1] = np.clip(self._arcs[:, 1], -turn, turn)
        self._steps = max(2, math.ceil(_ARC_LENGTH * scene.size / step))
        self._open: list[tuple[float, int, _State]] = []
        self._seen: set[_Cell] = set()
        self._states: list[_State] = []
        self._failing: dict[_Cell, int] = {}
        """Number of the margins that a push home from a place does not tolerate, by place."""
        self._now = float(self._rest(scene.poses[[k]])[0])
        self._horizon_known = False
        self._starts = itertools.chain(self._behind(), scene.starts.around(k))
        self._best = math.inf
        self._expansions = 0
        self._sides = Counter[_Cell]()
        self._alike = Counter[_Cell]()
        self._interrupted_rollouts = RolloutCache()
        self.interrupted = True

    def run(self) -> list[Primitive]:
        """Go on with the search; drives, each with the cost of what it leaves to be done [m]."""
        scene = self._scene
        most = len(MARGINS)
        scene.budget.start_part()
        self.interrupted = not self._begin()
        while (
            not self.interrupted
            and self._open
            and self._expansions < _EXPANSIONS
            and self._sides.total() < _ENOUGH_MARGINS
        ):
            if scene.budget.part_is_over:
                self.interrupted = scene.budget.is_over
                break
            entry = heapq.heappop(self._open)
            if entry[2].cost > self._best + self._slack:
                heapq.heappush(self._open, entry)
                break
            self._look_at(entry[2])
            if scene.budget.is_over:
                self.interrupted = True
                heapq.heappush(self._open, entry)  # some of it may have been left out
        if self.interrupted and scene.budget.stopped:  # no time to choose among what is found
            return []
        now = self._now
        found = [
            (self._failing[self._place(state)] * scene.size, state)
            for state in self._states
            if state.depth and self._failing.get(self._place(state), most) < most
        ]
        """Ends of drives after which the object can be pushed home, with what that costs [m]."""
        if self._thorough or not found:  # also those after which less is left to be done than now
            gain = GAIN * (_LITTLE_GAIN if self._thorough else 1.0)
            shortest = scene.object_paths.remaining
            found += [
                (state.rest - float(shortest(state.poses[[self._k]])[0]) + 2.0 * scene.size, state)
                for state in self._states
                if state.rest < now - gain * scene.size
            ]
        return self._from_all_sides(found)

    def _begin(self) -> bool:
        """Note the places to begin in; False if the budget has ended that."""
        scene = self._scene
        if not self._horizon_known:
            if can_be_pushed(scene, self._k, self._horizon):  # but not as far as home
                self._horizon = scene.longest
            elif scene.budget.is_over:
                return False
            self._horizon_known = True
        for start in self._starts:
            nodes, extra = arrival_poses(scene.fine.grid, start)
            away = float((self._approach.costs[nodes] + extra).min(initial=math.inf))
            if math.isfinite(away):
                self._put(_State(None, start[None], scene.poses, 0, away, self._now))
            if scene.budget.is_over:
                return False
        return True

    def _look_at(self, state: _State) -> None:
        """See whether a state helps, and drive on from it if not."""
        scene = self._scene
        k = self._k
        most = len(MARGINS)
        if self._thorough and not state.depth:
            arrived = self._arrived(state)
            if arrived is None:
                return
            state = arrived
        if state.depth:
            if pose_distance(state.poses[k], scene.poses[k], scene.size) < _LEAST_MOVE:
                return
            side = self._side(state)
            place = self._place(state)
            if self._sides[side] < most and place not in self._failing:
                cache = None
                if scene.budget.has_rule:
                    cache = self._interrupted_rollouts
                failing = failing_margins(scene, k, state.poses, self._horizon, cache)
                if scene.budget.is_over:
                    return
                self._interrupted_rollouts = RolloutCache()
                self._failing[place] = failing
            stands = most - self._failing.get(place, most)
            self._sides[side] = max(self._sides[side], stands)
            if stands:
                self._best = min(self._best, state.cost + (most - stands) * scene.size)
            if stands or state.depth == _DEPTH or self._alike[place] >= _MOST_ALIKE:
                return
            self._alike[place] += 1
        self._expansions += state.depth > 0
        self._expand(state)

    def _put(self, state: _State) -> None:
        heapq.heappush(self._open, (state.cost, len(self._states), state))
        self._states.append(state)

    def _from_all_sides(self, found: list[tuple[float, _State]]) -> list[Primitive]:
        """The best drives that begin in different places, of states with their extra cost [m]."""
        sides: dict[_Cell, Primitive] = {}
        for extra, state in sorted(found, key=lambda entry: entry[0] + entry[1].cost):
            side = self._side(state)
            if side not in sides:
                chain = state.chain()
                path = np.concatenate([one.track for one in chain])
                poses = chain[0].poses
                moved = (poses != self._scene.poses).any(axis=1)
                ids = self._scene.movables.ids[moved].tolist()
                sides[side] = path, extra, dict(zip(ids, poses[moved], strict=True))
            if len(sides) == _MOST_SIDES:
                break
        return list(sides.values())

    def _arrived(self, state: _State) -> _State | None:
        """A start as the route to it leaves robot and objects; None if there is none."""
        if self._scene.is_jammed:
            return None
        for tree in (self._approach, self._around_object):
            route = find_route(self._scene, tree, state.start, self._k)
            if route is None:
                continue
            driven = simulate_route(self._scene, route)
            if driven is not None:
                path, objects = driven
                return replace(state, track=path[-1:], poses=objects[-1].copy())
        return None

    @cached_property
    def _around_object(self) -> ApproachTree:
        """Paths on which the object is not moved."""
        return approach_tree(self._scene, self._k)

    def _expand(self, state: _State) -> None:
        """Drive on from a state along every arc; each place that the object gets to is a state."""
        scene = self._scene
        k = self._k
        tracks, poses, marks = core.sweep_arcs(
            scene.contacts(),
            state.track[-1],
            state.poses,
            self._arcs,
            self._steps,
            k,
            scene.size,
            _SPACING,
        )
        arcs, ends = marks.T
        places = self._cells(poses[arcs, ends, k], _PLACE, _TURN)
        robots = self._cells(tracks[arcs, ends], 0.3, 0.5)
        rests = self._rest(poses[arcs, ends, k]).tolist()
        for (a, end), place, robot, rest in zip(marks.tolist(), places, robots, rests, strict=True):
            if place + robot in self._seen:
                continue
            self._seen.add(place + robot)
            driven = state.driven + scene.controller.step * end
            ahead = tracks[a, 1 : end + 1]
            self._put(_State(state, ahead, poses[a, end], state.depth + 1, driven, rest))

    def _rest(self, poses: FloatArray) -> FloatArray:
        """(N,) what is left to be done with the object at poses (N, 3) [m]."""
        gone = poses[:, 0] >= 0.5 * core.REMOVED
        return np.where(gone, 0.0, self._cost_to_go.along(poses))

    def _side(self, state: _State) -> _Cell:
        """The box of poses that a drive begins in."""
        return self._cells(state.start[None], 0.8, 0.8)[0]

    def _place(self, state: _State) -> _Cell:
        """The box of poses that a drive gets the object to."""
        return self._cells(state.poses[[self._k]], _PLACE, _TURN)[0]

    def _cells(self, poses: FloatArray, side: float, turn: float) -> list[_Cell]:
        """The boxes of poses (N, 3), sides in circumscribed radii and [rad]."""
        units = np.array([side * self._scene.size, side * self._scene.size, turn])
        return [tuple(cell) for cell in np.rint(poses / units).tolist()]

    def _behind(self) -> Iterator[FloatArray]:
        """Poses (3,) behind and beside the object, by the rows of arcs of the table."""
        scene = self._scene
        k = self._k
        radius = float(scene.movables.radii[k])
        path = scene.object_paths.path(scene.poses[k, :2], radius, 0.0)
        if path is None:
            return
        towards = initial_heading(path, scene.controller.ahead)
        for row in scene.config.primitives:
            if row.controller == "arc":
                for lean, shift in itertools.product(row.leans, row.shifts):
                    heading = towards + math.radians(lean)
                    pose = scene.starts.behind(k, heading, shift * scene.half)
                    if scene.starts.fits(pose) and scene.starts.is_clear(pose):
                        yield pose


def can_be_pushed(scene: PushScene, k: int, horizon: float) -> bool:
    """Return True if some push delivers object ``k``, or advances it where the goal is far away.

    Args:
        scene: the scene.
        k: index of the object.
        horizon: how far the robot drives at most to see that [m].
    """
    target = int(scene.movables.ids[k])
    costs = scene.push_cost_to_go(k)
    now = costs.at(scene.poses[k])

    def gets_on(attempt: PushAttempt) -> bool:
        if now <= horizon:
            return any(target in push.delivers for push in simulate(scene, attempt))
        end = end_of(scene, replace(attempt, limit=min(attempt.limit, horizon)))
        return bool(end[0] >= 0.5 * core.REMOVED or costs.at(end) <= now - _ADVANCE * horizon)

    return any(
        not scene.budget.is_over
        and all(gets_on(replace(attempt, friction=one)) for one in (None, *row.frictions))
        for row in scene.config.primitives
        if row.controller != "arc" and not row.deep and not row.partners
        for attempt in attempts(scene, k, row)
    )


def failing_margins(
    scene: PushScene,
    k: int,
    poses: FloatArray,
    horizon: float,
    cache: RolloutCache | None = None,
) -> int:
    """Count the margins that a push of an object home does not tolerate.

    Args:
        scene: the scene.
        k: index of the object.
        poses: (K, 3) where the objects are to be pushed from.
        horizon: see `can_be_pushed`.
        cache: rollouts of a count that was interrupted.
    """
    units = np.array([scene.size, scene.size, 1.0])

    def delivers(error: FloatArray) -> bool:
        displaced = np.array(poses)
        if displaced[k, 0] < 0.5 * core.REMOVED:
            displaced[k] += error * units
        after = scene.with_objects_at(displaced, cache)
        return bool(after.done[k]) or can_be_pushed(after, k, horizon)

    if not delivers(np.zeros(3)):
        return len(MARGINS)
    for n, margin in enumerate(MARGINS):
        if not all(delivers(margin * error) for error in _ERRORS):
            return len(MARGINS) - n
    return 0
