"""The test of footprints against many obstacles agrees with Shapely, however they are grouped."""

import numpy as np
import pytest
import shapely
from conftest import SQUARE

from pushplan.core import motion as core
from pushplan.motion.collision import footprint, obstacles
from pushplan.world import RobotModel, StaticMap
from pushplan.world.outline import transform


@pytest.mark.parametrize("count", [0, 1, 16, 17, 300, 1000])
def test_free_poses_are_those_that_shapely_finds(count: int) -> None:
    rng = np.random.default_rng(count)
    plank = SQUARE * [1.2, 0.5]
    robot = RobotModel.from_outline(
        plank, mass=1.0, drive="differential", max_speed=1.0, max_turn_rate=1.0
    )
    posts = [SQUARE * rng.uniform(0.05, 0.8, 2) + at for at in rng.uniform(0, 30, (count, 2))]
    static = StaticMap.build(posts, bounds=[0, 0, 30, 30])
    checker = core.CollisionChecker(footprint(robot), obstacles(static))
    walls = shapely.union_all([shapely.Polygon(post) for post in posts])
    for pose in rng.uniform([-1, -1, -3], [31, 31, 3], (300, 3)):
        inside = bool(np.all((pose[:2] >= 0.0) & (pose[:2] <= 30.0)))
        hull = shapely.Polygon(transform(pose, plank))
        assert checker.is_free(pose) == (inside and not hull.intersects(walls))


def test_wheels_push_but_do_not_count_at_walls() -> None:
    body = np.array([(-0.5, -0.3), (0.5, -0.3), (0.5, 0.3), (-0.5, 0.3)])
    wheel = np.array([(-0.2, 0.3), (0.2, 0.3), (0.2, 0.5), (-0.2, 0.5)])
    limits = {"mass": 1.0, "drive": "differential", "max_speed": 1.0, "max_turn_rate": 1.0}
    robot = RobotModel(parts=(body, wheel), wheel_parts=1, **limits)  # type: ignore[arg-type]
    whole = RobotModel(parts=(body, wheel), **limits)  # type: ignore[arg-type]
    wall = StaticMap.build(
        polygons=[[(-1, 0.4), (1, 0.4), (1, 0.6), (-1, 0.6)]], bounds=(-2, -2, 2, 2)
    )
    for one, free in ((robot, True), (whole, False)):
        for margin in (0.0, 0.05):
            checker = core.CollisionChecker(footprint(one, margin), obstacles(wall))
            assert checker.is_free(np.zeros(3)) == free
    assert len(robot.vertices) == 8 and robot.circumscribed_radius == whole.circumscribed_radius
