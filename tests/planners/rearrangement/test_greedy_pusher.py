import time

import numpy as np
import pytest
from conftest import make_boxes, make_u_maze

from pushplan.envs import PushEnv
from pushplan.planners import make_policy
from pushplan.planners.rearrangement.greedy import GreedyPusher, line_up, shortest_path
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.push_starts import initial_heading
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.world import (
    ClearanceArea,
    InvalidInputError,
    Receptacle,
    StaticMap,
    Twist,
    World,
    box_delivery_robot,
    stream,
)

ROOM = [
    [(-6, -6), (6, -6), (6, -5), (-6, -5)],
    [(-6, 5), (6, 5), (6, 6), (-6, 6)],
    [(-6, -5), (-5, -5), (-5, 5), (-6, 5)],
    [(5, -5), (6, -5), (6, 5), (5, 5)],
]
CORNER = Receptacle([(3.0, 3.0), (5.0, 3.0), (5.0, 5.0), (3.0, 5.0)])


def scene(boxes, goal=CORNER, extra=(), pose=(-3.0, -3.0, 0.0), **robot):
    static = StaticMap.build(polygons=[*ROOM, *extra], bounds=(-5, -5, 5, 5))
    return World(
        robot=box_delivery_robot(**robot),
        robot_pose=pose,
        static=static,
        movables=make_boxes(boxes),
        goal=goal,
    )


def run(task, preset, seed, limit, **variations):
    env = PushEnv(
        task=task,
        preset=preset,
        action="velocity",
        observation="state",
        variations=variations,
    )
    policy = make_policy("greedy")
    env.reset(seed=seed)
    policy.reset(env.world, stream(seed, "policy"))
    for _ in range(limit):
        command = policy.act(env.world, None)
        *_, terminated, truncated, info = env.step(env.encode(command))
        if terminated or truncated:
            break
    return env.world, info


def push_scene(world):
    return PushScene(world, RearrangementConfig())


def goal_heading(world):
    return initial_heading(shortest_path(push_scene(world), 0), 0.1)


def test_path_and_place_behind_a_box():
    world = scene([(0.0, 4.0, 0.0)])
    assert goal_heading(world) == pytest.approx(0.0, abs=0.15)
    push = line_up(push_scene(world), 0)
    assert push.shift == 0.0 and push.path.length > 3.0
    end = push.legs.points[-1]
    assert end[0] < -0.5 and end[1] == pytest.approx(4.0, abs=0.3)
    assert push.legs.heading == pytest.approx(goal_heading(world), abs=0.15)
    # behind a box that is flush with the wall the robot does not fit
    low = push_scene(scene([(0.0, -4.49, 0.0)]))
    push = line_up(low, 0)
    assert abs(push.legs.heading - goal_heading(low.world)) > 0.4 or push.shift != 0.0
    assert low.starts.fits(np.array([*push.legs.points[-1], push.legs.heading]))
    around = scene([(0.0, 0.0, 0.0)], extra=[[(1.0, -5.0), (1.5, -5.0), (1.5, 2.0), (1.0, 2.0)]])
    assert goal_heading(around) > 0.9  # up and over the wall


def test_nothing_is_done_about_boxes_that_are_done():
    area = ClearanceArea([(-2, -2), (2, -2), (2, 2), (-2, 2)], [True] * 4)
    world = scene([(2.4, 0.0, 0.0)], goal=area)
    assert goal_heading(world) == pytest.approx(0.0, abs=1e-6)
    assert GreedyPusher().act(world) != Twist(0.0, 0.0)
    done = scene([(2.6, 0.0, 0.0)], goal=area)
    assert GreedyPusher().act(done) == Twist(0.0, 0.0)
    assert GreedyPusher().act(scene([])) == Twist(0.0, 0.0)


def test_closed_edges_are_not_pushed_through():
    area = ClearanceArea([(-2, -2), (2, -2), (2, 2), (-2, 2)], [False, False, True, False])
    assert goal_heading(scene([(1.4, -1.4, 0.0)], goal=area)) == pytest.approx(np.pi / 2, abs=0.01)


@pytest.mark.parametrize("layout", ["clear", pytest.param("walled", marks=pytest.mark.slow)])
def test_it_clears_the_area(layout):
    _, info = run("area_clearing", "testbed", 0, 900, layout=layout)
    assert info["success"] and info["completed"].all()


@pytest.mark.slow
def test_it_delivers_most_boxes_and_the_same_each_time():
    _, info = run("box_delivery", "benchmark", 2, 2500)
    assert info["completed"].sum() >= 8
    assert (
        run("box_delivery", "benchmark", 2, 300)[0] == run("box_delivery", "benchmark", 2, 300)[0]
    )


def test_commands_are_within_limits_and_quick():
    world = scene([(0.0, 0.0, 0.3), (2.0, -4.49, 0.0), (-4.49, 4.0, 0.0)])
    policy = GreedyPusher()
    times = []
    for i in range(60):
        begin = time.thread_time()
        command = policy.act(world)
        times.append(time.thread_time() - begin)
        assert abs(command.linear) <= world.robot.max_speed
        assert abs(command.angular) <= world.robot.max_turn_rate
        world = world.moved(time=0.2 * (i + 1))  # a robot that does not get anywhere
    assert np.median(times) < 0.005


def test_what_it_cannot_do_is_refused():
    with pytest.raises(InvalidInputError, match="goal for the objects"):
        GreedyPusher().act(make_u_maze(robot=box_delivery_robot()))
    with pytest.raises(InvalidInputError, match="differential"):
        GreedyPusher().act(scene([(0.0, 0.0, 0.0)], drive="constant_speed"))
    with pytest.raises(InvalidInputError, match="config"):
        GreedyPusher(0.2)


@pytest.mark.parametrize(
    "boxes",
    [
        [(4.49, -4.49, 0.0)],  # a corner
        [(-3.0, -3.0, 0.0)],  # inside the robot
        [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)],  # on top of each other
        [(5.5, 0.0, 0.0)],  # inside a wall
    ],
)
def test_hostile_scenes_get_a_command(boxes):
    world, policy = scene(boxes), GreedyPusher()
    for i in range(30):
        assert isinstance(policy.act(world), Twist)
        world = world.moved(time=0.2 * (i + 1))


def test_no_way_to_the_goal():
    shut = [
        [(2.0, 2.0), (5.0, 2.0), (5.0, 2.5), (2.0, 2.5)],
        [(2.0, 2.0), (2.5, 2.0), (2.5, 5.0), (2.0, 5.0)],
    ]
    world, policy = scene([(0.0, 0.0, 0.0)], extra=shut), GreedyPusher()
    for i in range(30):
        assert isinstance(policy.act(world), Twist)
        world = world.moved(time=0.2 * (i + 1))
