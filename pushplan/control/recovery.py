"""`Recovery`: a drive out of a place where the robot does not get on, with an end."""

from __future__ import annotations

import functools

import numpy as np

from pushplan.control.pose_follower import PoseFollower
from pushplan.control.retreat import Retreat
from pushplan.geometry.transforms import arc_step
from pushplan.motion.collision import footprint, obstacles, static_depth
from pushplan.motion.recovery_path import recovery_path
from pushplan.world import Drive, GoalDisc, Movables, StaticMap, Twist, World, box_delivery_robot
from pushplan.world.checks import FloatArray

# distance ahead in which walls are looked for [circumscribed radii], and how often
_LOOK = 0.3
_POSES = 3
_DEEPER = 1e-3  # by how much the robot may get deeper into a wall [circumscribed radii]


class Recovery:
    """Drives back, along a curve or ahead; where no such way is left, along a searched path.

    The ways are those of `Retreat`, the path that of `recovery_path`; a car has the ways alone. It
    ends when the robot has got away, and when nothing is left to try; each part of it ends where
    something stops the robot.

    Args:
        world: where the robot is stuck; a differential drive, or a car that reverses.
        distance: to get away by [m].
        skip: how many ways to leave to the end, because they have not helped before.
        response: time in which an error from the path is driven off [s].
        looks: whether ways into what is static are left out. Objects are never looked at:
            backing away from them is what frees a jam.
    """

    def __init__(
        self,
        world: World,
        distance: float,
        *,
        skip: int = 0,
        response: float = 0.2,
        looks: bool = True,
    ) -> None:
        self._response = response
        self._shape = footprint(world.robot)
        self._walls = obstacles(world.static)
        self._scratch = np.empty_like(self._shape.vertices)
        self._retreat: Retreat | None = Retreat(
            world.robot, world.robot_pose, distance, skip, self._is_closed if looks else None
        )
        self._path: PoseFollower | None = None

    def command(self, world: World, held: float) -> Twist | None:
        """The velocity to drive now; None when it is over.

        Args:
            world: the scene now.
            held: for how long the command will be held [s].
        """
        if self._retreat is not None:
            command = self._retreat.command(world.robot_pose, world.time, held)
            if command is not None:
                return command
            turns = world.robot.drive is Drive.DIFFERENTIAL  # on the spot, as the path asks for
            path = recovery_path(world, 0.0) if turns and not self._retreat.got_away else None
            self._retreat = None
            if path is not None:
                self._path = PoseFollower(world.robot, path, self._response)
        if self._path is None:
            return None
        return self._path.command(world.robot_pose, world.time, held)

    def _is_closed(self, pose: FloatArray, way: Twist) -> bool:
        """Return True if a motion leads deeper into static obstacles than the robot is."""
        size = self._shape.radius
        here = np.array(pose)
        there = np.empty(3)
        x_min, y_min, x_max, y_max = self._walls.bounds
        seconds = _LOOK * size / (abs(way.linear) + size * abs(way.angular))
        allowed = self._depth(here) + _DEEPER * size
        for part in np.linspace(0.0, seconds, _POSES + 1)[1:]:
            arc_step(here, way.linear * part, way.angular * part, there)
            inside = x_min <= there[0] <= x_max and y_min <= there[1] <= y_max
            if not inside or self._depth(there) > allowed:
                return True
        return False

    def _depth(self, pose: FloatArray) -> float:
        return float(static_depth(pose, self._shape, self._walls, self._scratch))


@functools.cache
def warm_up_recovery() -> None:
    """Load the kernels of a recovery: that of a robot between two columns, with no room to turn."""
    square = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
    columns = [square + np.array([-2.2, y]) for y in (-2.7, -1.3)]
    world = World(
        robot=box_delivery_robot(),
        robot_pose=np.array([-2.2, -2.0, 0.0]),
        static=StaticMap.build(polygons=columns, bounds=(-3.0, -3.0, 3.0, 3.0)),
        movables=Movables.from_outlines([2.2 * square], [(-2.2, -0.985, 0.0)]),
        goal=GoalDisc(np.zeros(2), 0.5),
    )
    Recovery(world, world.robot.circumscribed_radius).command(world, 0.1)
    recovery_path(world, 0.0)
