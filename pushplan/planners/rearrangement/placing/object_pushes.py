"""`ObjectPushes`: the pushes of one object that may bring it to its place."""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.planners.rearrangement.placing.contact import Contact
from pushplan.planners.rearrangement.placing.curves import is_clear, way_around
from pushplan.planners.rearrangement.placing.place_push import Part, PlacePush, PlacingHistory
from pushplan.planners.rearrangement.placing.placing_scene import PlacingScene
from pushplan.world.checks import FloatArray
from pushplan.world.polyline import path_length

# All lengths in circumscribed radii.
LENGTHS = (0.85, 1.8, 3.2, 5.0, 7.5)  # of pushes that do not lead to a place
AGAIN = 1.5  # cost of one more push, besides the drive to it
PER_OBJECT = 4  # free pushes of an object that are kept
_LONGEST = 60.0  # push that is looked at
_LOOKED_AT = 40  # pushes of an object that are checked for them
_AROUND = 3  # pairs of face and heading for which ways around are looked for
_FOLLOWING = 6  # curves after a push that are looked at
_EXPANDED = 60  # poses from which several pushes are looked for
_CELL = 0.1  # poses that are nearer count as the same [circumscribed radii, rad]
_CLOSE_ENOUGH = (0.6, 0.8)  # errors of place and heading, in tolerances, that need no next push


class _Curve(NamedTuple):
    """A curve that is not checked yet; poses are those of the robot."""

    length: float
    contact: Contact
    start: FloatArray
    end: FloatArray


class _Option(NamedTuple):
    """A push that may be made, not checked yet; poses are those of the robot."""

    bound: float  # least cost [m]
    contact: Contact
    start: FloatArray
    target: FloatArray
    length: float
    following: tuple[_Curve, ...]  # the next push, the shortest first
    penalty: float


_Node = tuple[float, int, float, FloatArray, tuple[Part, ...], bool]
"""Of a search: least cost, its number, cost until then [m], the object's pose, pushes, the end."""


class ObjectPushes:
    """The pushes of single objects in a scene.

    Args:
        scene: the scene.
        history: of what was tried.

    Attributes:
        count: pushes that were checked.
    """

    def __init__(self, scene: PlacingScene, history: PlacingHistory) -> None:
        self.count = 0
        self._scene = scene
        self._history = history
        self._checkers: dict[tuple[int, int, bool], core.CollisionChecker] = {}

    def simple(self, k: int) -> tuple[list[PlacePush], list[PlacePush]]:
        """The cheapest free pushes, and cheaper ones that others block."""
        kept: list[PlacePush] = []
        blocked: list[PlacePush] = []
        options = [option for option in self._options(k) if math.isfinite(option.bound)]
        options.sort(key=lambda option: option.bound)
        for option in options[:_LOOKED_AT]:
            self.count += 1
            push = self._checked(k, option)
            if push is not None:
                (kept if push.free else blocked).append(push)
            if len(kept) >= PER_OBJECT:
                break
        return kept, blocked

    def around(self, k: int) -> list[PlacePush]:
        """The push to its place around what is in the way, if one is found."""
        scene = self._scene
        here = scene.poses[k]
        pairs = sorted(
            (scene.pushes(contact).length(contact.robot_at(here), end), i, j)
            for i, contact in enumerate(scene.contacts[k])
            for j, end in enumerate(scene.ends(k, contact))
        )
        tried = 0
        for length, i, j in pairs:
            contact = scene.contacts[k][i]
            start = contact.robot_at(here)
            target = scene.ends(k, contact)[j]
            runs = [scene.runs(k, pose, contact) for pose in (start, target)]
            failed = self._history.cost(scene, k, contact, True)
            if math.isinf(failed) or not all(run is not None and run[0] for run in runs):
                continue
            tried += 1
            most = min(_LONGEST * scene.size, 3.0 * length + 10.0 * scene.size)
            checker = core.CollisionChecker(contact.body, scene.among(k))
            bounds = scene.world.static.bounds
            poses = way_around(scene.pushes(contact), start, target, checker, bounds, most)
            found = None if poses is None else self.part(k, contact, poses)
            if poses is not None and found is not None:
                return [self.push(k, found[1], path_length(poses[:, :2]), 0.0, failed, found[0])]
            if tried == _AROUND:
                break
        return []

    def by_several(self, k: int) -> list[PlacePush]:
        """The first of the pushes that bring an object to its place together, if any are found.

        A best-first search over poses of the object. The last push is the curve to the place.
        """
        scene = self._scene
        numbers = itertools.count()
        heap: list[_Node] = [(0.0, next(numbers), 0.0, scene.poses[k], (), False)]
        seen = set()
        expanded = 0
        while heap and expanded < _EXPANDED:
            _, _, cost, here, way, placed = heapq.heappop(heap)
            if placed:
                first = path_length(way[0].poses[:, :2])
                return [self.push(k, way, first, cost - first, 0.0, True)]
            cell = tuple(
                np.round([*(here[:2] / (_CELL * scene.size)), here[2] / _CELL]).astype(int)
            )
            if cell in seen:
                continue
            seen.add(cell)
            expanded += 1
            contacts = scene.contacts if way else scene.first_contacts
            for contact in contacts[k]:
                if not way and math.isinf(self._history.cost(scene, k, contact, False)):
                    continue
                start = contact.robot_at(here)
                turning = scene.pushes(contact)
                ends = [(turning.length(start, end), end, True) for end in scene.ends(k, contact)]
                elsewhere = self._elsewhere(k, contact, start)
                for length, target, last in (*ends, *((*one, False) for one in elsewhere)):
                    if length > _LONGEST * scene.size:
                        continue
                    found = self.part(k, contact, turning.poses(start, target))
                    if found is None or not found[0]:
                        continue
                    there = contact.object_at(target)
                    known = cost + length
                    bound = known
                    if not last:
                        curves = self.following(k, there)
                        if not curves:
                            continue
                        known += AGAIN * scene.size
                        bound = known + curves[0].length
                    node = bound, next(numbers), known, there, (*way, *found[1]), last
                    heapq.heappush(heap, node)
        return []

    def _options(self, k: int) -> Iterator[_Option]:
        scene = self._scene
        size = scene.size
        here = scene.poses[k]
        for contact in scene.first_contacts[k]:
            start = contact.robot_at(here)
            turning = scene.pushes(contact)
            missed = self._history.cost(scene, k, contact, True)
            for end in scene.ends(k, contact):
                length = turning.length(start, end)
                if length < _LONGEST * size:
                    yield _Option(length + missed, contact, start, end, length, (), missed)
            failed = self._history.cost(scene, k, contact, False)
            for length, target in self._elsewhere(k, contact, start):
                there = contact.object_at(target)
                if self._is_close(k, there):
                    yield _Option(length + missed, contact, start, target, length, (), missed)
                    continue
                nexts = self.following(k, there)
                if nexts:
                    bound = length + failed + nexts[0].length + AGAIN * size
                    yield _Option(bound, contact, start, target, length, nexts, failed)

    def _elsewhere(
        self, k: int, contact: Contact, start: FloatArray
    ) -> Iterator[tuple[float, FloatArray]]:
        """Pushes of several lengths, and until the object is beside its place."""
        size = self._scene.size
        lengths = {length * size for length in LENGTHS}
        goal = self._scene.goal_poses(k)[0]
        heading = np.array([math.cos(start[2]), math.sin(start[2])])
        along = float((goal[:2] - contact.object_at(start)[:2]) @ heading)
        if along > 0.02 * size:
            lengths.add(along)
        return self._scene.targets(start, contact, sorted(lengths))

    def following(self, k: int, there: FloatArray) -> tuple[_Curve, ...]:
        """The shortest curves of object ``k`` from a pose (3,) to its place, not checked."""
        scene = self._scene
        found = []
        for contact in scene.contacts[k]:
            start = contact.robot_at(there)
            for end in scene.ends(k, contact):
                length = scene.pushes(contact).length(start, end)
                found.append(_Curve(length, contact, start, end))
        found.sort(key=lambda curve: curve.length)
        return tuple(curve for curve in found[:_FOLLOWING] if curve.length < _LONGEST * scene.size)

    def next(
        self, k: int, curves: tuple[_Curve, ...]
    ) -> tuple[bool, float, tuple[Part, ...]] | None:
        """The best of some curves: whether objects block it, its length, itself; None without."""
        found = []
        for length, contact, start, end in curves:
            part = self.part(k, contact, self._scene.pushes(contact).poses(start, end))
            if part is not None:
                found.append((not part[0], length, part[1]))
        return min(found, key=lambda one: one[:2], default=None)

    def _checked(self, k: int, option: _Option) -> PlacePush | None:
        """The push, unless something static is in its way, or in that of the next."""
        scene = self._scene
        poses = scene.pushes(option.contact).poses(option.start, option.target)
        first = self.part(k, option.contact, poses)
        if first is None:
            return None
        free, way = first
        rest = 0.0
        if option.following:
            found = self.next(k, option.following)
            if found is None:
                return None
            blocked, length, then = found
            free = free and not blocked
            rest = length + AGAIN * scene.size
            way = (*way, *then)
        return self.push(k, way, option.length, rest, option.penalty, free)

    def push(
        self, k: int, way: tuple[Part, ...], length: float, rest: float, penalty: float, free: bool
    ) -> PlacePush:
        """The push that the first part of a way is; see `PlacePush` for the rest."""
        scene = self._scene
        starts = [scene.backed_off(k, part.poses[0], part.contact) for part in way]
        ends = [scene.backed_off(k, part.poses[-1], part.contact) for part in way]
        for end, start in zip(ends, starts[1:], strict=False):
            rest += float(scene.drive_costs(end[None], start[None])[0, 0])
        label = int(scene.movables.ids[k])
        return PlacePush(k, label, way, length, rest, penalty, free, starts[0], ends[0], ends[-1])

    def part(
        self, k: int, contact: Contact, poses: FloatArray
    ) -> tuple[bool, tuple[Part, ...]] | None:
        """Return if no object is in the way of a push, and the push; None if a wall is."""
        scene = self._scene
        if not is_clear(self._checker(k, contact, False), poses):
            return None
        before = scene.runs(k, poses[0], contact)
        after = scene.runs(k, poses[-1], contact)
        if before is None or after is None:
            return None
        free = before[0] and after[0] and is_clear(self._checker(k, contact, True), poses)
        return free, (Part(contact, poses, np.vstack([before[1], after[1]])),)

    def _checker(self, k: int, contact: Contact, others: bool) -> core.CollisionChecker:
        """Checks robot and object together, among what is static or all other objects."""
        key = k, id(contact), others
        if key not in self._checkers:
            body = contact.wide if others else contact.body
            among = self._scene.objects_but(k) if others else self._scene.walls
            self._checkers[key] = core.CollisionChecker(body, among)
        return self._checkers[key]

    def _is_close(self, k: int, pose: FloatArray) -> bool:
        """True if an object at a pose (3,) is well within its tolerances."""
        goal = self._scene.goal
        place = int(self._scene.places[k])
        distances, turns = goal.errors(pose[None])
        near, aligned = _CLOSE_ENOUGH
        return bool(
            distances[place] < near * goal.radii[place]
            and turns[place] < aligned * goal.heading_tolerances[place]
        )
