"""`PlacePushes`: the pushes that may be made in a scene."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from pushplan.core import motion as core
from pushplan.motion.collision import obstacles
from pushplan.planners.rearrangement.placing.curves import is_clear
from pushplan.planners.rearrangement.placing.object_pushes import (
    AGAIN,
    LENGTHS,
    PER_OBJECT,
    ObjectPushes,
)
from pushplan.planners.rearrangement.placing.place_push import PlacePush, PlacingHistory
from pushplan.planners.rearrangement.placing.placing_scene import PlacingScene
from pushplan.world.checks import FloatArray
from pushplan.world.outline import transform
from pushplan.world.stop import StopCheck

# All lengths in circumscribed radii.
_IN_THE_WAY = 18.0  # cost of an end on the place of another object, or in its only way
_DETOUR = 2.0  # several pushes are looked for where the best costs more: times the distance,
_MORE = 10.0  # and so much more
_ROOM_COST = 10.0  # of moving an object out of the way
_NO_RETURN = 30.0  # of one to where others block its push to its place
_SHOVES = 28.0  # cost of a push that carries other objects along
_TIGHT = 2.0  # of one that passes other objects closely
_NEIGHBOURS = 2.5  # distance from the objects that are left, of those that are shoved for them
_SPACE = 1.1  # distance from other objects that is worth something
_SPACE_COST = 7.0  # cost where there is none of it
_DONE = 7.0  # cost of moving an object that is done

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
        self._objects = ObjectPushes(scene, history)
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
        ranked = {k: sorted(own, key=lambda push: push.cost) for k, own in offered.items()}
        for k, own in offered.items():
            others = [theirs for j, theirs in ranked.items() if j != k]
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
        """Pushes that `towards_places` has left out."""
        return self._waiting

    def making_room(self) -> list[PlacePush]:
        """Pushes of objects that are in the way of others, out of it."""
        moves: dict[int, list[PlacePush]] = {}
        found = []
        for pushes in self._blocked.values():
            rooms = []
            for push in pushes:
                room, enough = self._room_for(push, moves)
                rooms.append(room)
                if enough:
                    found += room
                    break
            else:
                found += rooms[0]
        return found

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
            found[k] = self._objects.simple(k)
        for k, (kept, _) in found.items():
            if not any(push.final for push in kept) and not self._ended(found):
                kept += self._objects.around(k)
            least = min((push.cost for push in kept), default=math.inf)
            distance = math.dist(scene.poses[k, :2], scene.goal.poses[scene.places[k], :2])
            far = least > _DETOUR * distance + _MORE * scene.size
            if far and not self._ended(found):
                kept += self._objects.by_several(k)
        for k, (kept, blocked) in found.items():
            if blocked and not kept:
                self._blocked[k] = sorted(blocked[:PER_OBJECT], key=self._cost_of_room)
                kept.append(self._blocked[k][0])
        return {k: found[k][0] for k in scene.left if k in found and found[k][0]}

    def _ended(self, found: _Found) -> bool:
        """True if the stop rule has ended the search, and a free push is known."""
        if self._check is None:
            return False
        least = min((push.cost for kept, _ in found.values() for push in kept), default=math.inf)
        return math.isfinite(least) and self._check(self._objects.count, least)

    def _hindrance(self, k: int, pose: FloatArray, others: list[list[PlacePush]]) -> float:
        """By how much more the other objects cost once object ``k`` is at a pose (3,) [m].

        Args:
            k: index of the object.
            pose: (3,).
            others: the pushes of each other object, the cheapest first.
        """
        most = _IN_THE_WAY * self._scene.size
        total = 0.0
        for pushes in others:
            clear = (push.cost for push in pushes if self._is_clear_of(push, k, pose))
            total += min(next(clear, math.inf) - pushes[0].cost, most)
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

    def _cost_of_room(self, push: PlacePush) -> float:
        """Of a push that others block, after these have been moved out of the way [m]."""
        poses = self._scene.poses
        others = (j for j in range(len(poses)) if j != push.k)
        count = sum(not self._is_clear_of(push, j, poses[j]) for j in others)
        return push.cost + count * _ROOM_COST * self._scene.size

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

    def _moves(self, k: int, shoves: bool = False) -> Iterator[PlacePush]:
        """Pushes of an object to anywhere where there is room."""
        scene = self._scene
        size = scene.size
        others = [shape for j, shape in enumerate(scene.shapes) if j != k]
        lengths = [length * size for length in LENGTHS]
        for contact in scene.first_contacts[k]:
            failed = self._history.cost(scene, k, contact, False)
            if math.isinf(failed):
                continue
            start = contact.robot_at(scene.poses[k])
            for length, target in scene.targets(start, contact, lengths):
                poses = scene.pushes(contact).poses(start, target)
                part = self._objects.part(k, contact, poses)
                if part is None or not (part[0] or shoves):
                    continue
                free, way = part
                there = contact.object_at(poses[-1])
                rest = AGAIN * size
                if scene.places[k] >= 0:
                    found = self._objects.next(k, self._objects.following(k, there))
                    if found is None or (found[0] and not scene.thorough):
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
                yield self._objects.push(k, way, length, rest, cost * size + failed, True)
