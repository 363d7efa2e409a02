import time

import numpy as np
import pytest
import shapely

from pushplan.envs.tasks.layout import FreeSpace, squares
from pushplan.world import ScenarioError, StaticMap


def room(side):
    w = side
    lines = [(0, 0, w, 0), (w, 0, w, w), (w, w, 0, w), (0, w, 0, 0)]
    return StaticMap.build(segments=lines, radii=0.5, bounds=(0.0, 0.0, w, w))


@pytest.mark.parametrize("random_yaw", [False, True])
def test_placed_squares_overlap_nothing(random_yaw):
    static, hole = room(10.0), shapely.Point(3.0, 3.0)
    for seed in range(10):
        rng = np.random.default_rng(seed)
        poses = FreeSpace(static).place_squares(
            rng, 12, 1.0, keep_off=[(hole, 1.5)], gap=0.01, random_yaw=random_yaw
        )
        shapes = shapely.polygons(squares(poses, 1.0))
        apart = [a.distance(b) for i, a in enumerate(shapes) for b in shapes[:i]]
        assert min(apart) >= 0.0099
        assert min(shape.distance(hole) for shape in shapes) >= 1.51
        for line in static.segments:
            assert min(s.distance(shapely.LineString(line.reshape(2, 2))) for s in shapes) >= 0.51


@pytest.mark.parametrize("random_yaw", [False, True])
def test_dense_requests_are_met_and_impossible_ones_refused(random_yaw):
    free_space = FreeSpace(room(9.0))  # 8 x 8 m of free floor
    rng = np.random.default_rng(0)
    poses = free_space.place_squares(rng, 45, 1.0, random_yaw=random_yaw)
    shapes = shapely.polygons(squares(poses, 1.0))
    assert max(a.intersection(b).area for i, a in enumerate(shapes) for b in shapes[:i]) < 1e-9
    begin = time.thread_time()
    for count in (70, 1000):
        with pytest.raises(ScenarioError, match=f"{count} boxes of 1 m do not fit"):
            free_space.place_squares(rng, count, 1.0, random_yaw=random_yaw)
    assert time.thread_time() - begin < 2.0
