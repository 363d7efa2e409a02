"""`LidarObservation`: a laser scan, and where the goal is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from pushplan.observation.builder import LimitedVector
from pushplan.observation.state import goal_point
from pushplan.perception.lidar import Lidar, LidarScan, sensor_range
from pushplan.world import RobotModel, World
from pushplan.world.checked_fields import CheckedFields, Limits, PositiveFloat
from pushplan.world.checks import expect


@dataclass(frozen=True)
class LidarObservation(LimitedVector, CheckedFields):
    """The scan of a lidar around the robot as a vector.

    First the distances that ``beams`` beams measure, beginning ahead and going left, in units of
    the range, 1 where they meet nothing; then x and y of the goal in the robot's frame in the same
    unit, and the robot's velocity ahead [m/s] and turn rate [rad/s]. Beams meet walls and objects.
    In an environment with sensors it is their last scan, with their noise and field of view.

    Args:
        beams: in a full circle.
        range: of the beams [m].
        limit: values are clipped to it.
    """

    is_sensor: ClassVar[bool] = True
    """It is made of the scene as it is, or of a scan, and not of what is known of the scene."""

    beams: Annotated[int, Limits(4, 4096)] = 180
    range: PositiveFloat = 10.0
    limit: PositiveFloat = 10.0

    @property
    def shape(self) -> tuple[int]:
        """Length of the vector."""
        return (self.beams + 4,)

    def observe(self, world: World) -> NDArray[np.float32]:
        """The vector, of a scan without noise of the scene."""
        lidar = Lidar(beams=max(self.beams, Lidar.beams), range=self.range)
        return self.observe_scan(lidar.scan(world), world)

    def observe_scan(self, scan: LidarScan, world: World) -> NDArray[np.float32]:
        """The vector of a scan, of whatever bearings; the nearest distance of each direction.

        Args:
            scan: of the robot's lidar.
            world: where the robot is and has to go.
        """
        expect("scan", scan, LidarScan)
        expect("world", world, World)
        nearest = np.ones(self.beams)
        beam = np.rint(scan.bearings * (self.beams / math.tau)).astype(np.int64) % self.beams
        np.fmin.at(nearest, beam, scan.ranges / self.range)
        x, y, theta = world.robot_pose.tolist()
        turn = complex(math.cos(theta), -math.sin(theta))
        goal = complex(*(goal_point(world) - (x, y)).tolist()) * turn / self.range
        assert world.robot_twist is not None
        speed = (complex(*world.robot_twist[:2].tolist()) * turn).real
        rest = [goal.real, goal.imag, speed, float(world.robot_twist[2])]
        out = np.concatenate([nearest, rest])
        clipped: NDArray[np.float32] = np.clip(out, -self.limit, self.limit).astype(np.float32)
        return clipped


def builder_for(robot: RobotModel, far: float | None) -> LidarObservation:
    """The observation of a robot whose sensors see so far [m]."""
    return LidarObservation(range=sensor_range(robot, far))
