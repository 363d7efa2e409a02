"""`PlacingScene`: one snapshot, with what pushes to places need to know of it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import cached_property

import numpy as np
import shapely

from pushplan.core import motion as core
from pushplan.geometry import VisibilityGraph
from pushplan.geometry.object_ways import blocked_places
from pushplan.motion.collision import footprint, obstacles
from pushplan.planners.rearrangement.placing.contact import (
    MARGIN,
    Contact,
    ahead_of,
    contacts_of,
)
from pushplan.planners.rearrangement.placing.curves import Turning, is_clear
from pushplan.world import Drive, GoalPose, ObjectGoals, StaticMap, World
from pushplan.world.checks import BoolArray, FloatArray, IntArray
from pushplan.world.outline import transform

_STEP = 0.12  # distance of the poses along a push [circumscribed radii]
_HEADINGS = 8  # at the place of an object that are looked at
_TURNING_ROOM = 0.09  # between object and a robot that turns in front of it [circumscribed radii]
_OFF = 0.35  # distance by which a car is off an object before it steers [circumscribed radii]
_RUN = 1.5  # length of the way on which a car comes to an object or leaves it [radii, the same]
_RUN_POSES = 8  # that are looked at on it
_DETOUR = 1.2  # of a drive between pushes, over the straight one or the shortest curve
_TURN = 0.15  # cost of a turn on the spot [circumscribed radii/rad]
_STEERING = 1.1  # turning radius that a car plans with, over its least


class PlacingScene:
    """A world whose goal is one of objects, each with a place.

    Args:
        world: the snapshot, with a goal of `ObjectGoals`.
        friction: Coulomb coefficient between robot and objects.
        thorough: to begin with, objects are also pushed beside the middle of the bumper and in
            curves that do not lead to their places.
    """

    def __init__(self, world: World, friction: float, *, thorough: bool = False) -> None:
        goal = world.goal
        assert isinstance(goal, ObjectGoals)
        self.world = world
        self.goal = goal
        self.robot = world.robot
        self.movables = world.movables
        self.size = world.robot.circumscribed_radius
        self.friction = friction
        self.thorough = thorough
        self.poses: FloatArray = world.movables.poses
        self.walls = obstacles(world.static)
        self._graphs: dict[float, VisibilityGraph] = {}
        self._ends: dict[tuple[int, int], list[FloatArray]] = {}
        self._bodies: dict[int, tuple[core.ConvexObstacles, core.CollisionChecker]] = {}

    @cached_property
    def places(self) -> IntArray:
        """(K,) the place of each object by its number in the goal, -1 for those without one.

        One that is in something static counts as none.
        """
        found = self.goal.assigned(self.movables.ids, self.poses)
        found[np.isin(self.movables.ids, list(blocked_places(self.world)))] = -1
        return found

    @cached_property
    def done(self) -> BoolArray:
        """(K,) which objects are where they should be."""
        return self.goal.reached(self.movables.ids, self.poses)

    @property
    def left(self) -> list[int]:
        """Indices of the objects that are not at their places, but could be."""
        found: list[int] = np.flatnonzero(~self.done & (self.places >= 0)).tolist()
        return found

    @cached_property
    def contacts(self) -> tuple[tuple[Contact, ...], ...]:
        """The contacts of each object in the middle of the bumper."""
        return self._contacts(beside=False)

    @cached_property
    def first_contacts(self) -> tuple[tuple[Contact, ...], ...]:
        """The contacts of each object by which a push may begin."""
        if not self.thorough:
            return self.contacts
        both = zip(self.contacts, self._contacts(beside=True), strict=True)
        return tuple((*middle, *beside) for middle, beside in both)

    def _contacts(self, *, beside: bool) -> tuple[tuple[Contact, ...], ...]:
        return tuple(
            contacts_of(self.robot, self.movables, k, self.friction, beside=beside)
            for k in range(len(self.movables))
        )

    @cached_property
    def is_car(self) -> bool:
        """True if the robot cannot turn on the spot."""
        return self.robot.drive is Drive.CAR

    @cached_property
    def drives(self) -> Turning:
        """Turning of the robot between pushes, if it is a car."""
        radius = _STEERING * self.robot.min_turning_radius
        return Turning(radius, True, _STEP * self.size)

    def drive_costs(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """(N, M) what drives between poses (N, 3) and (M, 3) are thought to cost [m]."""
        if self.is_car:
            curves = [[self.drives.length(start, end) for end in ends] for start in starts]
            return np.asarray(_DETOUR * np.array(curves))
        away = ends[None, :, :] - starts[:, None, :]
        turns = np.abs(np.remainder(away[..., 2] + math.pi, math.tau) - math.pi)
        lengths = np.hypot(away[..., 0], away[..., 1])
        return np.asarray(_DETOUR * lengths + _TURN * self.size * turns)

    def pushes(self, contact: Contact) -> Turning:
        """Turning of robot and object together."""
        return Turning(contact.radius, False, _STEP * self.size)

    def targets(
        self, start: FloatArray, contact: Contact, lengths: Iterable[float]
    ) -> Iterator[tuple[float, FloatArray]]:
        """Pushes that do not lead to a place: length [m], and pose (3,) of the robot after it."""
        curvatures = (0.0, 1.0 / contact.radius, -1.0 / contact.radius)
        for length in lengths:
            for curvature in curvatures if self.thorough else curvatures[:1]:
                target = np.empty(3)
                core.along_arc(start, length, curvature, target)
                yield length, target

    def goal_poses(self, k: int) -> list[FloatArray]:
        """Poses (3,) at which object ``k`` is at its place."""
        place = int(self.places[k])
        pose = self.goal.poses[place]
        count = int(self.goal.symmetries[place])
        if self.goal.heading_tolerances[place] >= math.pi:
            count = max(count, _HEADINGS)
        here = float(self.poses[k, 2])
        found = [pose + np.array([0.0, 0.0, math.tau * i / count]) for i in range(count)]
        found.sort(key=lambda end: abs(math.remainder(float(end[2]) - here, math.tau)))
        return found[:_HEADINGS]

    @property
    def robot_goal(self) -> FloatArray:
        """(3,) pose at which the robot is where it has to be in the end."""
        goal = self.goal.robot
        assert goal is not None
        if isinstance(goal, GoalPose):
            return goal.pose
        dx, dy = (goal.center - self.world.robot_pose[:2]).tolist()
        return np.append(goal.center, math.atan2(dy, dx))

    def ends(self, k: int, contact: Contact) -> list[FloatArray]:
        """Poses (3,) of the robot that has object ``k`` at its place on the bumper."""
        key = k, id(contact)
        if key not in self._ends:
            self._ends[key] = [contact.robot_at(goal) for goal in self.goal_poses(k)]
        return self._ends[key]

    def backed_off(self, k: int, pose: FloatArray, contact: Contact) -> FloatArray:
        """(3,) where the robot is once it has backed off object ``k`` from a pose (3,)."""
        if self.is_car:
            return ahead_of(pose, -_OFF * self.size)
        radius = float(self.movables.radii[k])
        depth = contact.model.face.depth
        front = contact.model.bumper.front
        off = self.size + radius + _TURNING_ROOM * self.size - front - depth
        return ahead_of(pose, -max(off, _OFF * self.size))

    def runs(self, k: int, pose: FloatArray, contact: Contact) -> tuple[bool, FloatArray] | None:
        """Room behind object ``k`` for a robot at a pose (3,): where it comes from and leaves to.

        Returns:
            True if no object is there, and (N, 3) poses from where it has backed off; a car needs
            room to drive on backwards, straight or in a curve. None if something static is there.
        """
        off = self.backed_off(k, pose, contact)
        ways = [off[None]]
        if self.is_car:
            curvatures = (0.0, 1.0 / self.drives.radius, -1.0 / self.drives.radius)
            ways = [self._run(off, curvature) for curvature in curvatures]
        ways = [way for way in ways if is_clear(self.at_walls, way)]
        for way in ways:
            if is_clear(self.alone(k), way):
                return True, way
        return (False, ways[0]) if ways else None

    def _run(self, pose: FloatArray, curvature: float) -> FloatArray:
        """(N, 3) poses of an arc backwards."""
        poses = np.empty((_RUN_POSES, 3))
        for i, row in enumerate(poses):
            core.along_arc(pose, -_RUN * self.size * i / (_RUN_POSES - 1), curvature, row)
        return poses

    def among(self, k: int) -> core.ConvexObstacles:
        """Everything static, and all objects but ``k``; all if it is -1."""
        return self._others(k)[0]

    def objects_but(self, k: int) -> core.ConvexObstacles:
        """All objects but ``k``."""
        return obstacles(self.empty, self._parts_but(k))

    def _parts_but(self, k: int) -> list[FloatArray]:
        """The convex parts of all objects but ``k``; of all if it is -1."""
        others = range(len(self.movables))
        return [part for j in others if j != k for part in self.movables.parts_world(j)]

    def alone(self, k: int) -> core.CollisionChecker:
        """Checks the robot alone, in `among`."""
        return self._others(k)[1]

    def _others(self, k: int) -> tuple[core.ConvexObstacles, core.CollisionChecker]:
        if k not in self._bodies:
            among = obstacles(self.world.static, self._parts_but(k))
            self._bodies[k] = among, core.CollisionChecker(footprint(self.robot), among)
        return self._bodies[k]

    @cached_property
    def alone_wide(self) -> core.CollisionChecker:
        """Checks the robot, grown by what it keeps from things on its way, among everything."""
        return core.CollisionChecker(footprint(self.robot, MARGIN * self.size), self.among(-1))

    @property
    def can_set_out(self) -> bool:
        """True if the robot keeps its distance, and can turn where it stands if it is no car."""
        x, y, _ = self.world.robot_pose.tolist()
        if not self.is_car and self.among(-1).touches_disc(x, y, self.size):
            return False
        return self.alone_wide.is_free(self.world.robot_pose)

    @cached_property
    def alone_body(self) -> core.Footprint:
        """The robot."""
        return footprint(self.robot)

    @cached_property
    def empty(self) -> StaticMap:
        """The bounds of the map, with nothing in it."""
        return StaticMap.build((), bounds=self.world.static.bounds)

    @cached_property
    def at_walls(self) -> core.CollisionChecker:
        """Checks the robot alone among what is static."""
        return core.CollisionChecker(footprint(self.robot), self.walls)

    @cached_property
    def shapes(self) -> list[shapely.Geometry]:
        """The objects."""
        return [self.shape_at(k, self.poses[k]) for k in range(len(self.movables))]

    @cached_property
    def wanted_shapes(self) -> dict[int, shapely.Geometry]:
        """By index: the objects that are left, at their places."""
        return {k: self.shape_at(k, self.goal.poses[self.places[k]]) for k in self.left}

    def shape_at(self, k: int, pose: FloatArray) -> shapely.Geometry:
        """Object ``k`` at a pose (3,)."""
        parts = [shapely.Polygon(transform(pose, part)) for part in self.movables.parts(k)]
        return shapely.union_all(parts)

    def graph(self, clearance: float) -> VisibilityGraph:
        """Ways of a disc around everything, static or not."""
        if clearance not in self._graphs:
            self._graphs[clearance] = self._graph(clearance)
        return self._graphs[clearance]

    def _graph(self, clearance: float) -> VisibilityGraph:
        static = self.world.static
        parts = self._parts_but(-1)
        solid = StaticMap((*static.polygons, *parts), static.segments, static.radii, static.bounds)
        return VisibilityGraph(solid, clearance)
