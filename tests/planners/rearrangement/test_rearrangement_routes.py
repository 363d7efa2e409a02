"""Routes to the start of a push, driven as the policy drives them: nothing static is touched."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from conftest import make_boxes

from pushplan.control import LegFollower
from pushplan.planners import make_policy
from pushplan.planners.rearrangement import (
    PushScene,
    RearrangementConfig,
    push_choice,
    relocation_search,
)
from pushplan.planners.rearrangement.approach import (
    approach_tree,
    find_route,
    poses_along,
    simulate_route,
)
from pushplan.world import Receptacle, StaticMap, World, box_delivery_robot
from pushplan.world.outline import transform
from pushplan.world.polyline import path_lengths

CORNER = Receptacle([(3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0)])
COLUMNS = [shapely.box(x, -0.5, x + 1.0, 0.5) for x in (-2.7, -0.6, 1.5)]
WALLS = [
    shapely.box(-5.2, -2.7, 5.2, -2.5),
    shapely.box(-5.2, 5.0, 5.2, 5.2),
    shapely.box(-5.2, -2.5, -5.0, 5.0),
    shapely.box(5.0, -2.5, 5.2, 5.0),
]
STATIC = shapely.union_all([*COLUMNS, *WALLS])


def among_columns(pose):
    world = World(
        robot=box_delivery_robot(),
        robot_pose=pose,
        static=StaticMap.build(
            polygons=[part.exterior.coords[:-1] for part in [*COLUMNS, *WALLS]],
            bounds=(-5, -2.5, 5, 5),
        ),
        movables=make_boxes([(4.0, -1.0, 0.0)]),
        goal=CORNER,
    )
    return PushScene(world, RearrangementConfig())


def driven(scene, route):
    """Poses of a robot that does exactly as it is told."""
    pose, period = np.array(scene.world.robot_pose), 0.2
    near = 0.004 * scene.size
    driver = LegFollower(scene.world.robot, route, near=near, aligned=math.radians(0.4))
    found = [pose.copy()]
    for step in range(1000):
        twist = driver.command(pose, step * period, period)
        if twist is None:
            return np.array(found)
        for _ in range(5):
            pose[2] += 0.1 * period * twist.angular
            pose[:2] += 0.2 * period * twist.linear * np.array([np.cos(pose[2]), np.sin(pose[2])])
            pose[2] += 0.1 * period * twist.angular
            found.append(pose.copy())
    raise AssertionError("the driver does not come to an end")


def touched(scene, poses):
    """How deep the robot has been in what is static [m^2], at most."""
    bodies = [
        shapely.union_all(
            [shapely.Polygon(transform(pose, part)) for part in scene.world.robot.parts]
        )
        for pose in poses
    ]
    return float(shapely.area(shapely.intersection(STATIC, bodies)).max())


@pytest.mark.slow
def test_ways_among_columns_touch_nothing():
    rng = np.random.default_rng(3)
    found = asked = 0
    while asked < 40:
        pose = np.array([*rng.uniform((-4.5, -2.0), (4.5, 1.5)), rng.uniform(-math.pi, math.pi)])
        scene = among_columns(pose)
        target = np.array([*rng.uniform((-4.5, -2.0), (3.0, 1.5)), rng.uniform(-math.pi, math.pi)])
        if not (
            scene.starts.fits(pose) and scene.starts.is_clear(pose) and scene.starts.fits(target)
        ):
            continue
        asked += 1
        route = find_route(scene, approach_tree(scene), target)
        if route is None:
            continue
        found += 1
        poses = driven(scene, route)
        assert touched(scene, poses) < 1e-5
        if np.allclose(route.points[-1], target[:2]):
            assert math.dist(poses[-1][:2], target[:2]) < 0.05
        assert abs(math.remainder(poses[-1][2] - target[2], 2.0 * math.pi)) < 0.02
    assert found >= 36


@pytest.mark.parametrize("y", [-1.94, 1.08])
@pytest.mark.parametrize(("heading", "to", "turn"), [(0.0, 3.1, 1), (0.0, -3.1, 1), (3.1, 0.0, -1)])
def test_where_there_is_room_to_turn_one_way_only_it_is_taken(y, heading, to, turn):
    """Near a wall, or a column: its wide bumper cannot pass on the side that is near."""
    scene = among_columns((-0.1, y, heading))
    route = find_route(scene, approach_tree(scene), np.array([-0.1, y, to]))
    assert np.ptp(route.points, axis=0).max() < 0.1
    assert route.turns[-1] in (0, turn)
    poses = driven(scene, route)
    assert touched(scene, poses) < 1e-6
    assert math.copysign(1.0, poses[-1, 2] - heading) == turn


def test_the_way_that_is_predicted_is_the_one_that_is_driven():
    scene = among_columns((-0.1, -1.94, 0.0))
    route = find_route(scene, approach_tree(scene), np.array([-0.1, -1.94, -3.0]))
    predicted, poses = poses_along(scene, route), driven(scene, route)
    assert np.abs(predicted[-1] - poses[-1]).max() < 0.05


def test_out_of_a_wall_but_not_into_it():
    """A robot whose bumper overlaps a column a little drives away from it."""
    robot = box_delivery_robot()
    reach = float(robot.vertices[:, 0].max())
    scene = among_columns((-0.1, 0.5 + reach - 0.005, -0.5 * math.pi))
    route = find_route(scene, approach_tree(scene), np.array([-0.1, 2.5, 0.0]))
    poses = driven(scene, route)
    assert touched(scene, poses) <= touched(scene, poses[:1]) + 1e-9
    assert touched(scene, poses[-1:]) == 0.0


@pytest.mark.parametrize("heading", [0.0, 0.4, 2.0, -2.5])
@pytest.mark.parametrize("to", [(-3.5, 1.5, 2.0), (3.5, 1.5, -0.5), (0.0, 4.0, 0.3)])
def test_a_robot_drives_off_the_box_that_it_has_pushed_before_it_turns(heading, to):
    ahead = np.array([math.cos(heading), math.sin(heading)])
    alone = among_columns((0.0, 2.0, heading))
    at = alone.world.robot_pose[:2] + (alone.front + 0.5) * ahead
    world = replace(alone.world, movables=make_boxes([(*at, heading)]))
    scene = PushScene(world, RearrangementConfig())
    route = find_route(scene, approach_tree(scene), np.array(to))
    simulated = simulate_route(scene, route)
    assert simulated is not None
    assert path_lengths(simulated[1]).max() < 0.02


def test_a_robot_that_stands_in_a_wall_gets_out_before_it_looks_for_routes(monkeypatch):
    """All of its routes jam where they begin: a search through them took most of a minute."""
    front = box_delivery_robot().vertices[:, 0].max()
    searches = []

    def counted(*arguments):
        searches.append(arguments)
        return find_route(*arguments)

    for module in (push_choice, relocation_search):
        monkeypatch.setattr(module, "find_route", counted)
    for inside in (0.02, -0.3):
        scene = among_columns((-2.7 - front + inside, 0.2, 0.0))
        policy = make_policy("gtsp-mpc")
        policy.reset(scene.world, np.random.default_rng(0))
        twist = policy.act(scene.world, None)
        assert (twist.linear, twist.angular) != (0.0, 0.0)
        assert bool(searches) == (inside < 0.0)
