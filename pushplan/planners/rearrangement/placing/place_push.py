"""`PlacePush`: one push of one object; `PlacingHistory`: a record of those that were made."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from pushplan.planners.rearrangement.placing.contact import Contact
from pushplan.planners.rearrangement.placing.placing_scene import PlacingScene
from pushplan.planners.rearrangement.push import Push
from pushplan.world import World
from pushplan.world.checks import FloatArray

_FAILED = 3.5  # cost of a push for each time that it has failed [circumscribed radii]
_MOST_FAILURES = 3  # after so many it waits until another push has succeeded


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
        finish: (3,) the robot after the last of the pushes that bring the object to its place.
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
    finish: FloatArray
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

    def predicted(self, world: World) -> Push:
        """The same as a push of a plan, in a world in which its object may be elsewhere by now."""
        mine = world.movables.ids == self.label
        ends = np.where(mine[:, None], self.object_pose, world.movables.poses)
        work = float(world.movables.masses[mine].sum()) * self.length
        return Push(
            delivers=(self.label,) if self.final else (),
            target=self.label,
            controller="arc",
            poses=self.poses,
            length=self.length,
            work=work,
            cost=self.cost,
            object_poses=ends,
            relocates=not self.final,
        )


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
