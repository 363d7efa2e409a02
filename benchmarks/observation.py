"""Time of one image observation, whole and by channel.

Run with ``python benchmarks/observation.py``.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from pushplan.geometry import distance_field
from pushplan.observation import ImageObservation
from pushplan.world import Drive, GoalDisc, Movables, RobotModel, StaticMap, World, stream

WALLS = [[0, 0, 15, 0], [15, 0, 15, 15], [15, 15, 0, 15], [0, 15, 0, 0], [7.5, 0, 7.5, 10]]


def maze(boxes: int = 10) -> World:
    """A U-shaped maze with boxes anywhere: overlaps do not matter to a picture."""
    rng = stream(0, "benchmark")
    x, y = 0.7, 0.6
    corner = 0.25
    octagon = np.array(
        [
            *((x, -y + corner), (x, y - corner), (x - corner, y), (-x + corner, y)),
            *((-x, y - corner), (-x, -y + corner), (-x + corner, -y), (x - corner, -y)),
        ]
    )
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    poses = rng.uniform([1, 1, -np.pi], [14, 14, np.pi], (boxes, 3))
    return World(
        robot=RobotModel.from_outline(
            octagon, mass=1.0, drive=Drive.CONSTANT_SPEED, max_speed=0.15, max_turn_rate=0.105
        ),
        robot_pose=np.array([11.25, 3.75, 1.2]),
        static=StaticMap.build([], WALLS, 0.5, bounds=[0, 0, 15, 15]),
        movables=Movables.from_outlines([square] * boxes, poses),
        goal=GoalDisc(np.array([3.75, 3.75]), 1.86),
    )


def milliseconds(call: Callable[[], object], repeats: int = 500) -> float:
    """Median time of a call [ms]."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e3 * float(np.median(times))


def main() -> None:
    world = maze()
    whole = ImageObservation()
    whole.observe(world)  # compile
    title, median = f"whole image {whole.shape}", milliseconds(lambda: whole.observe(world))
    print(f"{title:32}{median:8.3f} ms")
    for name in whole.channels:
        one = ImageObservation(channels=(name,))
        print(f"{'  ' + name:32}{milliseconds(lambda one=one: one.observe(world)):8.3f} ms")

    def field() -> None:
        distance_field._field.cache_clear()
        distance_field.geodesic_field(world.static, world.goal, resolution=0.1)

    field()
    print(f"{'goal field, 150 x 150, once':32}{milliseconds(field, 20):8.3f} ms")


if __name__ == "__main__":
    main()
