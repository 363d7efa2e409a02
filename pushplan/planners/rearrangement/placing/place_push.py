"""`PlacePush`: one push of one object, and the pushes that may be made in a scene."""

from __future__ import annotations

import heapq
import itertools
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.collision import obstacles
from pushplan.planners.rearrangement.placing.contact import Contact
from pushplan.planners.rearrangement.placing.curves import is_clear, way_around
from pushplan.planners.rearrangement.placing.placing_scene import PlacingScene
from pushplan.world.checks import FloatArray
from pushplan.world.outline import transform
from pushplan.world.polyline import path_length
from pushplan.world.stop import StopCheck

# All lengths in circumscribed radii.
_LENGTHS = (0.85, 1.8, 3.2, 5.0, 7.5)  # of pushes that do not lead to a place
_AGAIN = 3.5  # cost of one more push
_LONGEST = 60.0  # push that is looked at
_PER_OBJECT = 4  # free pushes of an object that are kept
_LOOKED_AT = 40  # pushes of an object that are checked for them
_FAILED = 3.5  # cost of a push for each time that it has failed
_MOST_FAILURES = 3  # after so many it waits until another push has succeeded
_IN_THE_WAY = 18.0  # cost of an end on the place of another object, or in its only way
_ROOM_COST = 10.0  # of moving an object out of the way
_NO_RETURN = 30.0  # of one to where others block its push to its place
_SHOVES = 28.0  # cost of a push that carries other objects along
_TIGHT = 2.0  # of one that passes other objects closely
_NEIGHBOURS = 2.5  # distance from the objects that are left, of those that are shoved for them
_SPACE = 1.1  # distance from other objects that is worth something
_SPACE_COST = 7.0  # cost where there is none of it
_DONE = 7.0  # cost of moving an object that is done
_AROUND = 3  # pairs of face and heading for which ways around are looked for
_FOLLOWING = 6  # curves after a push that are looked at
_EXPANDED = 60  # poses from which several pushes are looked for
_CELL = 0.1  # poses that are nearer count as the same [circumscribed radii, rad]
_CLOSE_ENOUGH = (0.6, 0.8)  # errors of place and heading, in tolerances, that need no next push


class Part(NamedTuple):
    """Robot and object on a part of the object's way."""

    contact: Contact
    poses: FloatArray  # (N, 3) of the robot
    runs: FloatArray  # (M, 3) of it before contact and after the push

    def passes(self, pose: FloatArray, radius: float) -> bool:
        """True if robot or object may come so near to a point [m]."""
        reach = radius + self.contact.wide.radius
        x, y = pose[:2].tolist()
        return any(
            float(((poses[:, 0] - x) ** 2 + (poses[:, 1] - y) ** 2).min()) < reach * reach
            for poses in (self.poses, self.runs)
        )


@dataclass(frozen=True, eq=False)
class PlacePush:
    """A push of one object by one face, along a curve that it can follow without slipping.

    Args:
        k: index of the object.
        label: its id.
        way: the push, and the one after it where that does not end at the object's place.
        length: of the push [m].
        rest: cost of bringing the object to its place from there [m]; 0 where the push does.
        penalty: further cost [m].
        early: cost of beginning with it, because the object's place is in the way of others [m].
        free: nothing is in the way.
        favours: id of the object for which it makes room; None if it does not.
        start: (3,) the robot before contact.
        end: (3,) the robot once it has backed off.
    """

    k: int
    label: int
    way: tuple[Part, ...]
    length: float
    rest: float
    penalty: float
    free: bool
    start: FloatArray
    end: FloatArray
    early: float = 0.0
    favours: int | None = None

    @property
    def contact(self) -> Contact:
        """By which the object is pushed."""
        return self.way[0].contact

    @property
    def poses(self) -> FloatArray:
        """(N, 3) of the robot, from contact on."""
        return self.way[0].poses

    @property
    def final(self) -> bool:
        """The object is at its place after it."""
        return self.rest == 0.0

    @property
    def cost(self) -> float:
        """[m]."""
        return self.length + self.rest + self.penalty

    @property
    def object_pose(self) -> FloatArray:
        """(3,) the object after the push."""
        return self.contact.object_at(self.poses[-1])


@dataclass
class PlacingHistory:
    """Record of what has been tried.

    Args:
        failures: pushes that did not do what they were for, by object, face and purpose.
        waits: by the id of an object that has made room, the id of that for which it did.
    """

    failures: Counter[tuple[int, float, bool]] = field(default_factory=Counter)
    waits: dict[int, int] = field(default_factory=dict)

    def count(self, push: PlacePush) -> None:
        """A push has failed, or was not the last one of its object."""
        self.failures[_key(push.label, push.contact, push.final)] += 1

    def cost(self, scene: PlacingScene, k: int, contact: Contact, final: bool) -> float:
        """Return what to add to the cost of a push [m]; inf if it has been tried too often."""
        count = self.failures[_key(int(scene.movables.ids[k]), contact, final)]
        if count >= _MOST_FAILURES:
            return math.inf
        return _FAILED * scene.size * count

    def waits_for(self, scene: PlacingScene, k: int) -> bool:
        """True if object ``k`` has made room for one that is not at its place yet."""
        other = self.waits.get(int(scene.movables.ids[k]))
        return other in scene.movables.ids[scene.left].tolist()


def _key(label: int, contact: Contact, final: bool) -> tuple[int, float, bool]:
    """Key by which pushes count as the same."""
    return label, round(contact.model.face.normal, 3), final


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
_Found = dict[int, tuple[list[PlacePush], list[PlacePush]]]
"""By object: free pushes, and pushes that others block."""


class PlacePushes:
    """The pushes of a scene.

    Args:
        scene: the scene.
        history: of what was tried.
        check: ends the search for pushes once one is known; iterations are pushes that are checked.
    """

    def __init__(
        self, scene: PlacingScene, history: PlacingHistory, check: StopCheck | None = None
    ) -> None:
        self._scene = scene
        self._history = history
        self._check = check
        self._count = 0
        self._checkers: dict[tuple[int, int, bool], core.CollisionChecker] = {}
        self._blocked: dict[int, list[PlacePush]] = {}
        self._waiting: list[PlacePush] = []

    def towards_places(self) -> list[PlacePush]:
        """Pushes of the objects that are left, to their places or not.

        Pushes elsewhere are followed by others: they bring an object to where the curve to its
        place is clear (pre-relocation, Ahn and Mavrogiannis, "ReloPush", ICRA 2025), or mend what
        the last push has missed. Objects that have made room wait, see `of_waiting`.
        """
        scene = self._scene
        offered = self._offered()
        self._waiting = []
        pushes = []
        for k, own in offered.items():
            others = [theirs for j, theirs in offered.items() if j != k]
            at_place = self._hindrance(k, scene.goal.poses[scene.places[k]], others)
            mine = []
            for push in own:
                early = at_place
                if not push.final:
                    early = max(early, self._hindrance(k, push.object_pose, others))
                mine.append(replace(push, early=early))
            if self._history.waits_for(scene, k):
                self._waiting += mine
            else:
                pushes += mine
        return pushes

    def of_waiting(self) -> list[PlacePush]:
        """What `towards_places` has left out."""
        return self._waiting

    def _hindrance(self, k: int, pose: FloatArray, others: list[list[PlacePush]]) -> float:
        """By how much more the other objects cost once object ``k`` is at a pose (3,) [m]."""
        most = _IN_THE_WAY * self._scene.size
        total = 0.0
        for pushes in others:
            ranked = sorted(pushes, key=lambda push: push.cost)
            least = ranked[0].cost
            clear = (push.cost for push in ranked if self._is_clear_of(push, k, pose))
            total += min(next(clear, math.inf) - least, most)
        return total

    def _is_clear_of(self, push: PlacePush, k: int, pose: FloatArray) -> bool:
        """True if a push and the next are clear of object ``k`` at a pose (3,)."""
        scene = self._scene
        radius = float(scene.movables.radii[k])
        near = [part for part in push.way if part.passes(pose, radius)]
        if not near:
            return True
        there = obstacles(scene.empty, [transform(pose, part) for part in scene.movables.parts(k)])
        alone = core.CollisionChecker(scene.alone_body, there)
        return all(
            is_clear(core.CollisionChecker(part.contact.wide, there), part.poses)
            and is_clear(alone, part.runs)
            for part in near
        )

    def _offered(self) -> dict[int, list[PlacePush]]:
        """Free pushes of the objects that are left; where there are none, one that is blocked.

        The objects near the robot come first, and ways around after all that is simpler, so that a
        stop rule leaves out what matters least.
        """
        scene = self._scene
        away = np.hypot(*(scene.poses - scene.world.robot_pose)[:, :2].T)
        found: _Found = {}
        for k in sorted(scene.left, key=lambda k: (away[k], k)):
            if self._ended(found):
                break
            found[k] = self._of_object(k)
        for k, (kept, _) in found.items():
            if not any(push.final for push in kept) and not self._ended(found):
                kept += self._around(k)
            if self._scene.thorough and not kept and not self._ended(found):
                kept += self._by_several(k)
        for k, (kept, blocked) in found.items():
            if blocked and not kept:
                self._blocked[k] = sorted(blocked[:_PER_OBJECT], key=self._cost_of_room)
                kept.append(self._blocked[k][0])
        return {k: found[k][0] for k in scene.left if k in found and found[k][0]}

    def _ended(self, found: _Found) -> bool:
        """True if the stop rule has ended the search, and a free push is known."""
        costs = [push.cost for kept, _ in found.values() for push in kept]
        if self._check is None or not costs:
            return False
        return self._check(self._count, min(costs))

    def _of_object(self, k: int) -> tuple[list[PlacePush], list[PlacePush]]:
        """The cheapest free pushes, and cheaper ones that others block."""
        kept: list[PlacePush] = []
        blocked: list[PlacePush] = []
        options = [option for option in self._options(k) if math.isfinite(option.bound)]
        options.sort(key=lambda option: option.bound)
        for option in options[:_LOOKED_AT]:
            self._count += 1
            push = self._checked(k, option)
            if push is not None:
                (kept if push.free else blocked).append(push)
            if len(kept) >= _PER_OBJECT:
                break
        return kept, blocked

    def _cost_of_room(self, push: PlacePush) -> float:
        """Of a push that others block, after these have been moved out of the way [m]."""
        poses = self._scene.poses
        others = (j for j in range(len(poses)) if j != push.k)
        count = sum(not self._is_clear_of(push, j, poses[j]) for j in others)
        return push.cost + count * _ROOM_COST * self._scene.size

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
                nexts = self._following(k, there)
                if nexts:
                    bound = length + failed + nexts[0].length + _AGAIN * size
                    yield _Option(bound, contact, start, target, length, nexts, failed)

    def _elsewhere(
        self, k: int, contact: Contact, start: FloatArray
    ) -> Iterator[tuple[float, FloatArray]]:
        """Pushes of several lengths, and until the object is beside its place."""
        size = self._scene.size
        lengths = {length * size for length in _LENGTHS}
        goal = self._scene.goal_poses(k)[0]
        heading = np.array([math.cos(start[2]), math.sin(start[2])])
        along = float((goal[:2] - contact.object_at(start)[:2]) @ heading)
        if along > 0.02 * size:
            lengths.add(along)
        return self._scene.targets(start, contact, sorted(lengths))

    def _following(self, k: int, there: FloatArray) -> tuple[_Curve, ...]:
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

    def _next(
        self, k: int, curves: tuple[_Curve, ...]
    ) -> tuple[bool, float, tuple[Part, ...]] | None:
        """The best of some curves: whether objects block it, its length, itself; None without."""
        found = []
        for length, contact, start, end in curves:
            part = self._part(k, contact, self._scene.pushes(contact).poses(start, end))
            if part is not None:
                found.append((not part[0], length, part[1]))
        return min(found, key=lambda one: one[:2], default=None)

    def _checked(self, k: int, option: _Option) -> PlacePush | None:
        """The push, unless something static is in its way, or in that of the next."""
        scene = self._scene
        poses = scene.pushes(option.contact).poses(option.start, option.target)
        first = self._part(k, option.contact, poses)
        if first is None:
            return None
        free, way = first
        rest = 0.0
        if option.following:
            found = self._next(k, option.following)
            if found is None:
                return None
            blocked, length, then = found
            free = free and not blocked
            rest = length + _AGAIN * scene.size
            way = (*way, *then)
        return self._push(k, way, option.length, rest, option.penalty, free)

    def _push(
        self, k: int, way: tuple[Part, ...], length: float, rest: float, penalty: float, free: bool
    ) -> PlacePush:
        scene = self._scene
        contact = way[0].contact
        poses = way[0].poses
        start = scene.backed_off(k, poses[0], contact)
        end = scene.backed_off(k, poses[-1], contact)
        label = int(scene.movables.ids[k])
        return PlacePush(k, label, way, length, rest, penalty, free, start, end)

    def _part(
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

    def _around(self, k: int) -> list[PlacePush]:
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
            found = None if poses is None else self._part(k, contact, poses)
            if poses is not None and found is not None:
                return [self._push(k, found[1], path_length(poses[:, :2]), 0.0, failed, found[0])]
            if tried == _AROUND:
                break
        return []

    def _by_several(self, k: int) -> list[PlacePush]:
        """The first of the pushes that bring an object to its place together, if any are found.

        A best-first search over poses of the object. The last push is the curve to the place.
        """
        scene = self._scene
        again = _AGAIN * scene.size
        numbers = itertools.count()
        heap: list[_Node] = [(0.0, next(numbers), 0.0, scene.poses[k], (), False)]
        seen = set()
        expanded = 0
        while heap and expanded < _EXPANDED:
            _, _, cost, here, way, placed = heapq.heappop(heap)
            if placed:
                first = path_length(way[0].poses[:, :2])
                return [self._push(k, way, first, cost - first, 0.0, True)]
            cell = tuple(
                np.round([*(here[:2] / (_CELL * scene.size)), here[2] / _CELL]).astype(int)
            )
            if cell in seen:
                continue
            seen.add(cell)
            expanded += 1
            for contact in (scene.contacts if way else scene.first_contacts)[k]:
                if not way and math.isinf(self._history.cost(scene, k, contact, False)):
                    continue
                start = contact.robot_at(here)
                turning = scene.pushes(contact)
                ends = [(turning.length(start, end), end, True) for end in scene.ends(k, contact)]
                elsewhere = self._elsewhere(k, contact, start)
                for length, target, last in (*ends, *((*one, False) for one in elsewhere)):
                    if length > _LONGEST * scene.size:
                        continue
                    found = self._part(k, contact, turning.poses(start, target))
                    if found is None or not found[0]:
                        continue
                    there = contact.object_at(target)
                    curves = () if last else self._following(k, there)
                    if not last and not curves:
                        continue
                    known = cost + length + (0.0 if last else again)
                    bound = known + (0.0 if last else curves[0].length)
                    node = bound, next(numbers), known, there, (*way, *found[1]), last
                    heapq.heappush(heap, node)
        return []

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

    def making_room(self) -> list[PlacePush]:
        """Pushes of objects that are in the way of others, out of it."""
        moves: dict[int, list[PlacePush]] = {}
        found = []
        for pushes in self._blocked.values():
            rooms = [self._room_for(push, moves) for push in pushes]
            found += next((room for room, enough in rooms if enough), rooms[0][0])
        return found

    def _room_for(
        self, push: PlacePush, moves: dict[int, list[PlacePush]]
    ) -> tuple[list[PlacePush], bool]:
        """Moves out of the way of a push, and if there is one for all that is in its way."""
        scene = self._scene
        found = []
        enough = True
        for k in range(len(scene.movables)):
            if k == push.k or self._is_clear_of(push, k, scene.poses[k]):
                continue
            if k not in moves:
                moves[k] = list(self._moves(k))
            room = [move for move in moves[k] if self._is_clear_of(push, k, move.object_pose)]
            enough = enough and len(room) > 0
            found += [replace(move, favours=push.label) for move in room]
        return found, enough

    def shoves(self) -> list[PlacePush]:
        """Pushes of objects that are left or near these, whatever they carry along."""
        scene = self._scene
        found = []
        for k in range(len(scene.movables)):
            away = np.hypot(*(scene.poses[scene.left] - scene.poses[k])[:, :2].T)
            near = int(np.argmin(away))
            if away[near] < _NEIGHBOURS * scene.size:
                favours = None
                if k not in scene.left:
                    favours = int(scene.movables.ids[scene.left[near]])
                found += [replace(push, favours=favours) for push in self._moves(k, shoves=True)]
        return found

    def _moves(self, k: int, shoves: bool = False) -> Iterator[PlacePush]:
        """Pushes of an object to anywhere where there is room."""
        scene = self._scene
        size = scene.size
        others = [shape for j, shape in enumerate(scene.shapes) if j != k]
        lengths = [length * size for length in _LENGTHS]
        for contact in scene.first_contacts[k]:
            failed = self._history.cost(scene, k, contact, False)
            if math.isinf(failed):
                continue
            start = contact.robot_at(scene.poses[k])
            for length, target in scene.targets(start, contact, lengths):
                poses = scene.pushes(contact).poses(start, target)
                part = self._part(k, contact, poses)
                if part is None or not (part[0] or shoves):
                    continue
                free, way = part
                there = contact.object_at(poses[-1])
                rest = _AGAIN * size
                if scene.places[k] >= 0:
                    found = self._next(k, self._following(k, there))
                    if found is None:
                        continue
                    rest += found[1] + found[0] * _NO_RETURN * size
                shape = scene.shape_at(k, there)
                space = min((shape.distance(other) for other in others), default=math.inf)
                cost = _SPACE_COST * max(0.0, 1.0 - space / (_SPACE * size))
                if not free:
                    touched = not is_clear(
                        core.CollisionChecker(contact.body, scene.among(k)), poses
                    )
                    cost += _SHOVES if touched else _TIGHT
                if scene.done[k]:
                    cost += _DONE
                wanted = scene.wanted_shapes.items()
                if any(j != k and shape.distance(s) < 0.2 * size for j, s in wanted):
                    cost += _IN_THE_WAY
                yield self._push(k, way, length, rest, cost * size + failed, True)
