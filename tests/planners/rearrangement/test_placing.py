"""Pushes of objects to places of their own."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pushplan.control import DelayedExecutor
from pushplan.core import motion as core
from pushplan.envs import PushEnv
from pushplan.motion.collision import footprint, obstacles
from pushplan.planners.rearrangement import GtspMpc, RearrangementConfig
from pushplan.planners.rearrangement.placing.contact import compose, contacts_of, inverse
from pushplan.planners.rearrangement.placing.curves import Turning, is_clear, way_around
from pushplan.planners.rearrangement.placing.place_order import first_push
from pushplan.planners.rearrangement.placing.place_push import PlacingHistory
from pushplan.planners.rearrangement.placing.place_pushes import PlacePushes
from pushplan.planners.rearrangement.placing.placing_scene import PlacingScene
from pushplan.scenarios import generate_rearrangement
from pushplan.world import (
    Drive,
    GoalPose,
    InvalidInputError,
    MaxIterations,
    Movables,
    ObjectGoals,
    StaticMap,
    Twist,
    World,
    racecar,
    turtlebot3_burger,
)
from pushplan.world.outline import transform

BOX = np.array([(-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)])
PUSHER = turtlebot3_burger("pusher", max_speed=0.2)


def room(*, side: float = 1.4) -> StaticMap:
    t = 0.1
    walls = [
        np.array(
            [(-side - t, -side - t), (side + t, -side - t), (side + t, -side), (-side - t, -side)]
        ),
        np.array(
            [(-side - t, side), (side + t, side), (side + t, side + t), (-side - t, side + t)]
        ),
        np.array([(-side - t, -side), (-side, -side), (-side, side), (-side - t, side)]),
        np.array([(side, -side), (side + t, -side), (side + t, side), (side, side)]),
    ]
    return StaticMap.build(walls, bounds=(-side, -side, side, side))


def scene_of(starts: Any, ends: Any, *, robot: Any = PUSHER, **options: Any) -> World:
    poses = np.array(starts, dtype=float)
    places = np.array(ends, dtype=float)
    count = len(places)
    goal = ObjectGoals(
        np.arange(count), places, np.full(count, 0.02), np.full(count, 0.09), np.full(count, 4)
    )
    movables = Movables.from_outlines([BOX] * len(poses), poses, density=10.0)
    return World(robot, np.array([-1.0, -1.0, 0.0]), room(**options), movables, goal)


def drive(
    policy: GtspMpc, seed: int = 0, most: float = math.inf, **variations: Any
) -> tuple[World, list[Twist]]:
    """An episode in 2D of so many steps at most, and its commands."""
    env = PushEnv(task="rearrange", variations=variations, action="velocity", observation="state")
    env.reset(seed=seed)
    policy.reset(env.world, np.random.default_rng(0))
    commands = []
    ended = False
    while not ended and len(commands) < most:
        twist = policy.act(env.world)
        commands.append(twist)
        robot = env.world.robot
        action = np.array([twist.linear / robot.max_speed, twist.angular / robot.max_turn_rate])
        *_, terminated, truncated, _ = env.step(action)
        ended = terminated or truncated
    return env.world, commands


def test_a_place_in_a_wall_is_given_up_and_the_others_are_not() -> None:
    starts = [[0.5, 0.0, 0.0], [-0.5, 0.3, 0.0]]
    inside, leaning = 1.4 + 0.05, 1.4 - 0.04  # the wall is at 1.4 m
    found = {}
    for x in (inside, leaning):
        policy = GtspMpc()
        world = scene_of(starts, [[x, 0.0, 0.0], [0.3, 0.6, 0.0]])
        policy.reset(world, np.random.default_rng(0))
        policy.act(world)
        found[x] = list(policy.given_up), {push.target for push in policy.plan}
    assert found[inside] == ([0], {1})
    assert found[leaning][0] == []
    done = scene_of(starts, [[inside, 0.0, 0.0], starts[1]])  # nothing is left to be done
    policy = GtspMpc()
    policy.reset(done, np.random.default_rng(0))
    assert policy.act(done) == Twist(0.0, 0.0)
    assert "0.1 m inside something static" in policy.given_up[0]


def test_robot_and_object_fit_together_in_contact() -> None:
    movables = Movables.from_outlines([BOX], np.zeros((1, 3)))
    contacts = contacts_of(PUSHER, movables, 0, 0.4)
    assert len(contacts) == 4
    front = float(max(part[:, 0].max() for part in PUSHER.contact_parts))
    for contact in contacts:
        there = np.array([0.3, -0.2, 0.7])
        robot = contact.robot_at(there)
        assert contact.object_at(robot) == pytest.approx(there)
        seen = transform(compose(inverse(robot), there), BOX)
        assert seen[:, 0].min() == pytest.approx(front, abs=1e-6)  # flat on the bumper
        assert seen[:, 1].mean() == pytest.approx(0.0, abs=1e-9)
    # Lynch and Mason: friction 0.4 at the distance of the object's middle, of which 0.7 is used
    reach = contacts[0].model.reach
    assert contacts[0].radius == pytest.approx(reach / (0.7 * 0.4), rel=1e-6)


def test_contacts_beside_the_middle_keep_the_face_on_the_bumper() -> None:
    movables = Movables.from_outlines([BOX], np.zeros((1, 3)), density=10.0)
    middle = contacts_of(PUSHER, movables, 0, 0.4)
    beside = contacts_of(PUSHER, movables, 0, 0.4, beside=True)
    assert len(beside) == 2 * len(middle)
    for contact in beside:
        offset = abs(float(contact.object_pose[1]))
        assert 0.0 < offset and offset + 0.05 <= contact.model.bumper.half
        assert contact.radius == pytest.approx(middle[0].radius + offset)


def test_an_object_beside_others_is_pushed_by_the_side_of_the_bumper() -> None:
    row = [(x, 0.135, 0.0) for x in np.arange(-0.45, 0.85, 0.1)]
    world = scene_of([(0.0, 0.0, 0.0), *row], [(0.4, 0.0, 0.0)])
    middle, everywhere = (
        PlacePushes(PlacingScene(world, 0.4, thorough=thorough), PlacingHistory()).towards_places()
        for thorough in (False, True)
    )
    assert not any(push.free for push in middle)
    assert any(push.free for push in everywhere)


def test_less_friction_makes_wider_curves() -> None:
    movables = Movables.from_outlines([BOX], np.zeros((1, 3)))
    wide, narrow = (contacts_of(PUSHER, movables, 0, mu)[0].radius for mu in (0.2, 0.4))
    assert wide == pytest.approx(2.0 * narrow)


def test_ways_lead_around_what_blocks_the_shortest_curve() -> None:
    static = StaticMap.build(
        [np.array([(-0.1, -0.6), (0.1, -0.6), (0.1, 0.6), (-0.1, 0.6)])], bounds=(-2, -2, 2, 2)
    )
    checker = core.CollisionChecker(footprint(PUSHER), obstacles(static))
    turning = Turning(0.5, False, 0.02)
    start = np.array([-1.5, 0.0, 0.0])
    end = np.array([1.5, 0.0, 0.0])
    assert not is_clear(checker, turning.poses(start, end))
    way = way_around(turning, start, end, checker, static.bounds)
    assert way is not None
    assert is_clear(checker, way)
    assert way[0] == pytest.approx(start)
    assert compose(inverse(end), way[-1])[:2] == pytest.approx(np.zeros(2), abs=1e-9)
    steps = np.diff(way, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    turns = np.abs((steps[:, 2] + math.pi) % math.tau - math.pi)
    assert (turns <= 1.01 * lengths / turning.radius + 1e-9).all()
    assert np.array_equal(way, way_around(turning, start, end, checker, static.bounds))
    assert way_around(turning, start, end, checker, static.bounds, most=2.9) is None


def test_there_is_no_way_into_a_wall() -> None:
    world = scene_of([(0.0, 0.0, 0.0)], [(0.5, 0.0, 0.0)])
    checker = core.CollisionChecker(footprint(PUSHER), obstacles(world.static))
    turning = Turning(0.5, True, 0.02)
    inside = np.array([1.38, 0.0, 0.0])
    assert way_around(turning, world.robot_pose, inside, checker, world.static.bounds) is None


@pytest.mark.parametrize("mpc", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_boxes_get_to_their_places(mpc: bool) -> None:
    world, _ = drive(GtspMpc(mpc=mpc), objects=3)
    assert world.completed.all()


def test_the_same_scene_gives_the_same_commands() -> None:
    _, one = drive(GtspMpc(), 4, 200, objects=2)
    _, other = drive(GtspMpc(), 4, 200, objects=2)
    assert one == other


@pytest.mark.slow
def test_boxes_that_stand_in_each_others_places_swap_them() -> None:
    world, _ = drive(GtspMpc(), objects=2, arrangement="swapped")
    assert world.completed.all()


def test_a_t_gets_to_its_pose() -> None:
    world, _ = drive(GtspMpc(), objects=1, shape="t", tolerance=0.03, heading_tolerance=0.14)
    assert world.completed.all()


def test_a_car_pushes_too() -> None:
    world, commands = drive(GtspMpc(), seed=1, objects=1, robot="racecar", room=5.0)
    assert world.robot.drive is Drive.CAR
    assert world.completed.all()
    curved = [abs(c.angular) / abs(c.linear) for c in commands if abs(c.linear) > 1e-3]
    assert max(curved) <= 1.0 / world.robot.min_turning_radius + 1e-6


def test_an_object_in_the_way_is_moved_first() -> None:
    # the second has no place and stands in that of the first
    world = scene_of([(-0.3, 0.0, 0.0), (0.5, 0.0, 0.0)], [(0.5, 0.0, 0.0)])
    scene = PlacingScene(world, 0.4)
    pushes = PlacePushes(scene, PlacingHistory())
    rng = np.random.default_rng(0)
    assert first_push(scene, pushes.towards_places(), "gtsp", rng) is None
    room = pushes.making_room()
    assert {push.k for push in room} == {1}
    choice = first_push(scene, room, "gtsp", rng)
    assert choice is not None
    moved = choice.push.object_pose
    assert math.dist(moved[:2], (0.5, 0.0)) > 0.1


def test_an_object_whose_place_blocks_another_comes_later() -> None:
    world = scene_of([(0.0, 0.0, 0.0), (0.0, 0.6, 0.0)], [(1.0, 0.0, 0.0), (0.6, 0.0, 0.0)])
    scene = PlacingScene(world, 0.4)
    pushes = PlacePushes(scene, PlacingHistory()).towards_places()
    assert max(push.early for push in pushes if push.k == 0 and push.final) == 0.0
    assert min(push.early for push in pushes if push.k == 1) > 0.0
    choice = first_push(scene, pushes, "gtsp", np.random.default_rng(0))
    assert choice is not None and choice.push.k == 0


def test_an_object_that_has_made_room_waits() -> None:
    world = scene_of([(0.0, 0.0, 0.0), (0.0, 0.6, 0.0)], [(0.5, 0.0, 0.0), (0.5, 0.6, 0.0)])
    pushes = PlacePushes(PlacingScene(world, 0.4), PlacingHistory(waits={0: 1}))
    assert {push.k for push in pushes.towards_places()} == {1}
    assert {push.k for push in pushes.of_waiting()} == {0}


def test_a_stop_rule_leaves_out_what_is_far_away() -> None:
    world = scene_of([(0.8, 0.8, 0.0), (-0.5, -0.6, 0.0)], [(0.5, 0.0, 0.0), (0.0, -0.6, 0.0)])
    scene = PlacingScene(world, 0.4)
    pushes = PlacePushes(scene, PlacingHistory(), MaxIterations(1).start()).towards_places()
    assert {push.k for push in pushes} == {1}
    assert first_push(scene, pushes, "gtsp", np.random.default_rng(0)) is not None


def test_pushes_that_have_failed_are_left_out() -> None:
    world = scene_of([(0.0, 0.0, 0.0)], [(0.5, 0.0, 0.0)])
    scene = PlacingScene(world, 0.4)
    history = PlacingHistory()
    best = min(PlacePushes(scene, history).towards_places(), key=lambda push: push.cost)
    assert best.final
    for _ in range(3):
        history.count(best)
    left = PlacePushes(scene, history).towards_places()
    assert not any(push.final and push.contact is best.contact for push in left)


@pytest.mark.parametrize("order", ["gtsp", "nearest", "random"])
def test_each_order_has_one_push_of_each_object(order: str) -> None:
    world = generate_rearrangement(np.random.default_rng(5), robot=PUSHER, objects=5)
    scene = PlacingScene(world, 0.4)
    pushes = PlacePushes(scene, PlacingHistory()).towards_places()
    choice = first_push(scene, pushes, order, np.random.default_rng(0))
    assert choice is not None
    assert choice.order[0] is choice.push
    assert sorted(push.k for push in choice.order) == sorted({push.k for push in pushes})


def test_a_robot_that_finds_no_push_stands() -> None:
    world = scene_of([(0.0, 0.0, 0.0)], [(0.5, 0.0, 0.0)])
    column = np.array([(-0.12, -0.12), (0.12, -0.12), (0.12, -0.07), (-0.12, -0.07)])
    boxed_in = [
        np.array([(c * x - s * y, s * x + c * y) for x, y in column])
        for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))
    ]
    static = StaticMap.build([*room().polygons, *boxed_in], bounds=(-1.4, -1.4, 1.4, 1.4))
    policy = GtspMpc()
    policy.reset(world, np.random.default_rng(0))
    assert policy.act(replace(world, static=static)) == Twist(0.0, 0.0)


def test_the_robot_goes_to_its_own_goal_in_the_end() -> None:
    world = scene_of([(0.5, 0.0, 0.0)], [(0.5, 0.0, 0.0)])
    assert isinstance(world.goal, ObjectGoals)
    goal = replace(world.goal, robot=GoalPose(np.array([0.8, 0.6]), 0.05, 1.0, 0.1))
    world = replace(world, goal=goal)
    policy = GtspMpc()
    policy.reset(world, np.random.default_rng(0))
    pose = np.array(world.robot_pose)
    for i in range(400):
        twist = policy.act(replace(world, robot_pose=pose, time=0.1 * i))
        out = np.empty(3)
        length = 0.1 * twist.linear
        curvature = twist.angular / twist.linear if twist.linear else 0.0
        core.along_arc(pose, length, curvature, out)
        pose = out if twist.linear else pose + np.array([0.0, 0.0, 0.1 * twist.angular])
    assert replace(world, robot_pose=pose).goal_reached


def test_an_object_that_vanishes_is_left_alone() -> None:
    world = scene_of([(0.0, 0.0, 0.0), (0.4, 0.5, 0.0)], [(0.5, 0.0, 0.0), (0.6, 0.9, 0.0)])
    policy = GtspMpc()
    policy.reset(world, np.random.default_rng(0))
    policy.act(world)
    gone = world.movables.ids[policy._placer._execution.push.k]  # type: ignore[union-attr]
    there = np.flatnonzero(world.movables.ids != gone)
    for i in range(1, 300):
        policy.act(replace(world, movables=world.movables.select(there), time=0.1 * i))


def test_noise_is_heeded() -> None:
    policy = GtspMpc()
    world = scene_of([(0.0, 0.0, 0.0)], [(0.5, 0.0, 0.0)])
    policy.reset(world, np.random.default_rng(0))
    policy.expect_noise(0.01, 0.02)
    assert policy._placer.config.position_noise == 0.01


def test_decisions_may_take_their_time() -> None:
    world = scene_of([(0.0, 0.0, 0.0)], [(0.5, 0.0, 0.0)])
    policy = GtspMpc()
    policy.reset(world, np.random.default_rng(0))
    policy.plan_with(DelayedExecutor(0.3))
    commands = [policy.act(replace(world, time=0.1 * i)) for i in range(4)]
    assert commands[:3] == [Twist(0.0, 0.0)] * 3
    assert commands[3] != Twist(0.0, 0.0)


@pytest.mark.parametrize(
    "robot", [racecar(min_speed=0.0), turtlebot3_burger("pusher", drive="constant_speed")]
)
def test_robots_that_cannot_drive_back_are_refused(robot: Any) -> None:
    world = scene_of([(0.0, 0.0, 0.0)], [(0.5, 0.0, 0.0)], robot=robot)
    policy = GtspMpc()
    policy.reset(world, np.random.default_rng(0))
    with pytest.raises(InvalidInputError, match=r"min_speed below 0 and .*; got min_speed"):
        policy.act(world)


def test_unknown_orders_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="nearest"):
        RearrangementConfig(order="farthest")
    with pytest.raises(InvalidInputError, match="grip"):
        RearrangementConfig(grip=0.0)


@pytest.mark.parametrize("robot", [PUSHER, racecar()])
def test_the_plan_is_what_is_driven(robot: Any) -> None:
    world = scene_of(
        [(0.0, 0.0, 0.0), (0.0, 0.8, 0.0)],
        [(0.7, 0.0, 0.0), (0.7, 0.8, 0.0)],
        robot=robot,
        side=4.0,
    )
    policy = GtspMpc()
    policy.reset(world, np.random.default_rng(0))
    assert policy.plan == () and policy.current_plan is None
    policy.act(world)
    assert len(policy.plan) == 2 and {push.target for push in policy.plan} == {0, 1}
    plan = policy.current_plan
    assert plan is not None
    assert plan.poses[0] == pytest.approx(world.robot_pose)
    assert plan.poses[-1] == pytest.approx(policy.plan[0].poses[-1])
    assert plan.subtasks[0].object_ids == (policy.plan[0].target,)
    moved = plan.object_poses[-1] - world.movables.poses
    assert np.flatnonzero(np.hypot(*moved[:, :2].T) > 0.1).tolist() == [policy.plan[0].target]
