"""`SimulatedSensing`: what a robot in a simulator has seen so far, as a world."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from pushplan.envs.tasks.variations import TaskVariations
from pushplan.perception import Detections, Detector, Lidar, LidarScan, WorldEstimate
from pushplan.perception.lidar import sensor_range
from pushplan.world import Twist, World


class SimulatedSensing:
    """A lidar and a detector on the robot, and the estimate that comes of them.

    The robot knows its own pose, the goal and the bounds of the map; with ``sensing: objects`` the
    walls too. A detector says nothing of which objects can be moved.

    Args:
        variations: of the task: what is seen, how far, and with what noise.
        world: the scene at the start of an episode, which the first call of `look` looks at.
        rng: of all noise.
        beams: least number of beams of the lidar.

    Attributes:
        world: what the robot knows now.
        scan: the last one that it got; None before the first.
    """

    def __init__(
        self, variations: TaskVariations, world: World, rng: np.random.Generator, beams: int = 0
    ) -> None:
        far = sensor_range(world.robot, variations.view_range)
        angle = variations.view_angle
        self._lidar = Lidar(
            beams=max(beams, Lidar.beams),
            field_of_view=angle,
            range=far,
            noise=variations.range_noise,
            drop_out=variations.drop_out,
        )
        self._detector = Detector(
            field_of_view=angle,
            range=far,
            position_noise=variations.object_noise,
            heading_noise=variations.turn_noise,
            miss_rate=variations.drop_out,
        )
        self._interval = 1.0 / (variations.view_rate or math.inf)
        self._delay = variations.view_delay
        self._rng = rng
        known = None
        if variations.sensing == "objects":
            known = world.static
        self._estimate = WorldEstimate(
            world.robot,
            world.goal,
            world.static.bounds,
            known=known,
            unknown_price=variations.unknown_price,
            position_noise=variations.object_noise,
            heading_noise=variations.turn_noise,
            range_noise=variations.range_noise,
            margin=world.margin or None,
        )
        self._inbox: deque[tuple[float, LidarScan, Detections]] = deque()
        self._seen_at = -math.inf
        self.world = world
        self.scan: LidarScan | None = None

    def look(self, world: World, driven: Twist | None = None) -> None:
        """Look at the scene as it is now, and bring `world` up to date.

        Args:
            world: the scene.
            driven: what the robot was told to drive since the last look; nothing by default.
        """
        now = world.time
        is_first = self._seen_at == -math.inf
        if is_first or now >= self._seen_at + max(self._interval, 1e-6) - 1e-9:
            delay = 0.0 if is_first else self._delay  # an episode begins with a reading
            self._seen_at = now
            scan = self._lidar.scan(world, self._rng)
            detections = self._detector.detect(world, self._rng)
            self._inbox.append((now + delay, scan, detections))
        while self._inbox and self._inbox[0][0] <= now + 1e-9:
            _, self.scan, detections = self._inbox.popleft()
            self._estimate.add_detections(detections)
            self._estimate.add_scan(self.scan)
        self._estimate.sent(driven or Twist(0.0, 0.0))
        self.world = self._estimate.world(world.robot_pose, world.robot_twist, now)
