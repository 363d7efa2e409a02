"""`PushCostToGo`: straight paths in the open, and a price where the robot does not fit behind."""

import numpy as np

from pushplan.planners.rearrangement.object_paths import PushCostToGo
from pushplan.world import Receptacle, StaticMap, box_delivery_robot

ROBOT = box_delivery_robot()
SIZE = ROBOT.circumscribed_radius
CORNER = Receptacle([(3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0)])
COLUMN = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]


def cost_to_go(polygons=(), goal=CORNER, **changes):
    static = StaticMap.build(polygons=list(polygons), bounds=(-5, -5, 5, 5))
    return PushCostToGo(
        ROBOT,
        static,
        goal,
        radius=0.3,
        half_width=0.5,
        slack=0.03,
        margin=0.0,
        **changes,
    )


def test_in_the_open_it_is_the_length_of_the_path():
    costs, rng = cost_to_go(), np.random.default_rng(0)
    for x, y in rng.uniform(-2.0, 2.0, (50, 2)):
        shortest = np.hypot(*(np.array([3.3, 3.3]) - (x, y)))
        # sixteen directions are up to 3 % longer; the goal's cells reach a little out of it
        assert shortest - 0.2 <= costs.at(np.array([x, y, 0.7])) <= 1.03 * shortest + 0.2


def test_it_is_nothing_at_the_goal():
    assert cost_to_go().at(np.array([4.0, 4.0, 0.0])) == 0.0


def test_only_where_the_robot_does_not_fit_behind_a_metre_costs_more():
    cheap, dear = cost_to_go(drag_cost=2.0), cost_to_go(drag_cost=10.0)
    corner, free = (np.array([x, x, 0.0]) for x in (-4.65, -3.0))
    assert cheap.at(free) == dear.at(free)
    more = [costs.at(corner) - costs.at(free) for costs in (cheap, dear)]
    assert np.hypot(1.65, 1.65) < more[0] < more[1]


def test_it_leads_round_a_column():
    plain, around = cost_to_go(), cost_to_go([COLUMN])
    point = np.array([-1.5, -1.5, 0.0])
    assert around.at(point) > plain.at(point)
    assert np.isfinite(around.along(np.random.default_rng(1).uniform(-5, 5, (200, 3)))).all()
