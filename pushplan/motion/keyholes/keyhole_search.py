"""`KeyholeSearch`: which object to push, and which way, so that a closed way opens."""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from pushplan.core import motion as core
from pushplan.interaction import InteractionModel
from pushplan.motion.collision import footprint, obstacles
from pushplan.motion.keyholes.disc_space import DiscSpace, DiscState
from pushplan.motion.keyholes.keyhole_config import KeyholeConfig
from pushplan.motion.keyholes.line_pushes import (
    CONTACT,
    SPACING,
    line_pushes,
    push_path,
    straight_poses,
)
from pushplan.motion.time_slicing import go_on, never
from pushplan.world import Drive, GoalPose, World
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length, path_lengths

_MOST_OBJECTS = 40  # among more, no keyholes are looked for
_MOST_CELLS = 400_000  # of the configuration space
_SAME_HEADING = 0.3  # scenes whose objects differ by less count as one [rad]
_TURNS_IN = 1.02  # free disc in which the robot turns to its goal's heading [R]
_LEAVING = 2.5  # length of a straight drive to where its disc is free [circumscribed radii]


@dataclass(frozen=True, eq=False)
class KeyholeEnd:
    """A scene after some pushes, with the robot where it can turn.

    Args:
        state: where the robot gets to then.
        cost: of the way there: l₀ + w Σ mᵢ lᵢ / m₀, and what it closes [m].
        before: the scene before the last push; None at the start.
        drive: (N, 2) corners of the drive from there to the start of the push [m].
        path: (N, 3) the push, or how the robot got free at the start; ahead, then back.
    """

    state: DiscState
    cost: float
    before: KeyholeEnd | None
    drive: FloatArray
    path: FloatArray

    def chain(self) -> list[KeyholeEnd]:
        """The scenes that have led to this one, from the start on."""
        if self.before is None:
            return [self]
        return [*self.before.chain(), self]


def suits_keyholes(world: World, config: KeyholeConfig) -> bool:
    """Return True if a `KeyholeSearch` suits: walls, few objects, a robot that turns and reverses.

    Args:
        world: the scene.
        config: parameters.
    """
    robot = world.robot
    static = world.static
    goal = world.goal
    if isinstance(goal, GoalPose):
        x, y = goal.center
        if not obstacles(static).can_turn(x, y, _TURNS_IN * robot.circumscribed_radius):
            return False
    sides = (static.bounds[2:] - static.bounds[:2]) / (config.cell * robot.circumscribed_radius)
    return (
        robot.drive is Drive.DIFFERENTIAL
        and robot.min_speed < 0.0
        and 0 < len(world.movables) <= _MOST_OBJECTS
        and bool(static.convex_parts)
        and float(np.prod(sides)) <= _MOST_CELLS
    )


def nearest_free_pose(world: World, config: KeyholeConfig) -> FloatArray:
    """(3,) the pose nearest to the robot's in which the disc of a `KeyholeSearch` is free.

    The robot's own pose where there is none.
    """
    space = _disc_space(world, config)
    return DiscState(space, world.movables.poses).nearest_free(world.robot_pose)


def _disc_space(
    world: World, config: KeyholeConfig, stopped: Callable[[], bool] = never
) -> DiscSpace:
    size = world.robot.circumscribed_radius
    radius = config.clearance * size
    cell = config.cell * size
    return DiscSpace(world, radius, cell, config.closed_cost, stopped)


class KeyholeSearch:
    """Best-first search over pushes that connect components of the robot's free space.

    A state is where the objects are and in which component the robot is. It is expanded in ranks:
    first with the object that the cheapest path through objects meets first, the choice of
    Stilman and Kuffner ("Navigation among movable obstacles: real-time reasoning in complex
    environments", IJHR 2005), then with the others on that path and those that were in the way of
    the pushes, at last with all. Ends of pushes that connect more floor, and in the later ranks
    those that only move something out of the way, are new states: that is the recursion where an
    object needs another to go first.

    Args:
        world: the scene; objects that are fixed are among what is static.
        config: parameters.
        interaction: predicts the pushes.
        stopped: ends the search, asked with the number of pushes after each and every few
            milliseconds.
    """

    def __init__(
        self,
        world: World,
        config: KeyholeConfig,
        interaction: InteractionModel,
        stopped: Callable[[int], bool],
    ) -> None:
        self.world = world
        self.config = config
        self.interaction = interaction
        self.expansions = 0
        count = self._count = [0]  # apart, so that the space does not hold the search
        size = world.robot.circumscribed_radius
        self._size = size
        self._longest = config.longest * size
        self._space = _disc_space(world, config, lambda: stopped(count[0]))
        walls = obstacles(world.static)
        self._checker = core.CollisionChecker(footprint(world.robot, config.margin * size), walls)
        self._bare = core.CollisionChecker(footprint(world.robot), walls)
        self._numbers = itertools.count()
        self._open: list[tuple[float, int, int, KeyholeEnd]] = []
        """Priority, running number, rank and scene."""
        self._seen: set[bytes] = set()

    @property
    def pushes(self) -> int:
        """Number of pushes simulated."""
        return self._count[0]

    def run(self) -> KeyholeEnd | None:
        """The cheapest scene found from which the goal is reached; None if there is none.

        Raises:
            Stopped: if the stop rule fires before.
        """
        start = self._start()
        if start is None:
            return None
        self._put(start)
        while self._open:
            priority, _, rank, end = heapq.heappop(self._open)
            if end.state.is_open:
                return end
            self.expansions += 1
            for new in self._expand(end, rank):
                self._put(new)
            go_on(self._space.stopped)
            if rank < 2:
                later = priority + self.config.rank_cost * self._size
                heapq.heappush(self._open, (later, next(self._numbers), rank + 1, end))
        return None

    def _start(self) -> KeyholeEnd | None:
        """The scene now, with the robot driven straight to where its disc is free."""
        robot = self.world.robot_pose
        state = DiscState(self._space, self.world.movables.poses)
        steps = np.arange(0.0, _LEAVING, self.config.cell)
        for length in sorted([*steps, *-steps[1:]], key=abs):
            go_on(self._space.stopped)
            along = np.linspace(0.0, length * self._size, 2 + int(abs(length) / SPACING))
            path = straight_poses(robot, along)
            if not state.is_free(path[-1]) or self._hits_wall(path):
                continue
            if length < 0.0 or self.interaction.sweep(self.world, path).work == 0.0:
                state.robot = path[-1]
                cost = abs(length) * self._size
                return KeyholeEnd(state, cost, None, robot[None, :2], path)
        return None

    def _hits_wall(self, path: FloatArray) -> bool:
        """Return True if the robot gets deeper into walls on poses (N, 3) than at the first."""
        first, *others = (self._bare.depth(pose) for pose in path)
        return any(depth > first + 1e-9 for depth in others)

    def _put(self, end: KeyholeEnd) -> None:
        state = end.state
        cell = 2.0 * self._space.cell
        label = np.flatnonzero(state.reached.ravel())[:1]
        key = np.rint(state.poses / (cell, cell, _SAME_HEADING)).tobytes() + label.tobytes()
        if key in self._seen:
            return
        self._seen.add(key)
        left, _ = state.relaxed
        if math.isfinite(left):
            heapq.heappush(self._open, (end.cost + left, next(self._numbers), 0, end))

    def _expand(self, end: KeyholeEnd, rank: int) -> Iterator[KeyholeEnd]:
        """The scenes that one push leads to, of the objects of a rank."""
        _, on_path = end.state.relaxed
        everyone = range(len(self.world.movables))
        chosen: list[int] = on_path[:1]
        if rank == 1:
            chosen = [*on_path[1:], *(k for k in everyone if self._is_near(end, k, on_path))]
        if rank == 2:
            chosen = [k for k in everyone if k not in on_path]
        for k in dict.fromkeys(chosen):
            pose = end.state.poses[k]
            clearance = self._space.radius + self._space.cell
            starts = line_pushes(self.world, k, pose, clearance, self.config.offsets)
            for start, lead in starts:
                if end.state.gets_to(start):
                    path = push_path(start, lead, self._longest, self._size)
                    yield from self._push(end, k, path, rank)
                    go_on(self._space.stopped)

    def _is_near(self, end: KeyholeEnd, k: int, on_path: list[int]) -> bool:
        """Return True if object ``k`` is in the way of pushes of the first object on the path."""
        if not on_path or k in on_path:
            return False
        here = end.state.poses[k, :2]
        there = end.state.poses[on_path[0], :2]
        reach = self.world.movables.radii[k] + self.world.movables.radii[on_path[0]]
        return math.dist(here, there) < float(reach) + 2.0 * self._size

    def _push(self, end: KeyholeEnd, k: int, path: FloatArray, rank: int) -> Iterator[KeyholeEnd]:
        """The scenes after a push of object ``k``, ended where it opens one, or in a later rank."""
        self._count[0] += 1
        config = self.config
        size = self._size
        free = self._checker.first_blocked(path)
        scene = self.world.moved(robot_pose=path[0], movable_poses=end.state.poses)
        swept = self.interaction.sweep(scene, path[: max(free, 1)])
        last = free - 1 if swept.jammed_at < 0 else swept.jammed_at - 1
        step = max(1, round(config.step / SPACING))
        ends = list(range(CONTACT + step, last + 1, step))
        left = 2  # the first place that is open, and one beyond
        for n in ends:
            go_on(self._space.stopped)
            new = self._after(end, k, path[: n + 1], swept.object_poses[: n + 1])
            if new is None:
                continue
            if new.state.is_open or self._gain(end, new) > config.gain * size**2:
                left -= 1
                yield new
                if left == 0:
                    return
            elif rank and (n == ends[-1] or n == ends[len(ends) // 2]):
                yield new

    def _after(
        self, end: KeyholeEnd, k: int, path: FloatArray, poses: FloatArray
    ) -> KeyholeEnd | None:
        """The scene after a push (N, 3) of object ``k``, objects (N, K, 3); the robot backs off."""
        config = self.config
        moved = poses[-1]
        if np.array_equal(moved[k], end.state.poses[k]):
            return None
        cell = self._space.cell
        driven = path_length(path)
        state = DiscState(self._space, moved)
        for back in np.arange(cell, driven, cell):
            away = straight_poses(path[-1], -np.linspace(0.0, back, int(back / cell) + 2)[1:])
            if not state.is_free(away[-1]):
                continue
            state.robot = away[-1]
            work = float(self.world.movables.masses @ path_lengths(poses))
            cost = end.cost + end.state.length_to(path[0]) + driven + back
            cost += config.push_weight * work / self.world.robot.mass
            return KeyholeEnd(
                state,
                cost + self._closing_cost(end, state),
                end,
                end.state.path_to(path[0, :2]),
                np.concatenate([path, away]),
            )
        return None

    def _gain(self, end: KeyholeEnd, new: KeyholeEnd) -> float:
        """Floor that the robot gets to and did not before [m²]."""
        fresh = new.state.reached & ~end.state.reached & (end.state.free.labels > 0)
        return float(fresh.sum()) * self._space.cell**2

    def _closing_cost(self, end: KeyholeEnd, state: DiscState) -> float:
        """A penalty where floor is free still, and cut off now [m]."""
        lost = end.state.reached & ~state.reached & (state.free.labels > 0)
        closed = float(lost.sum()) * self._space.cell**2 > self.config.closing * self._size**2
        return self.config.closing_cost * self._size if closed else 0.0
