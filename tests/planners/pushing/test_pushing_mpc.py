import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from conftest import quickest
from hypothesis import given, settings
from hypothesis import strategies as st
from nonlinear_pushing import NonlinearPushingMpc
from pushing_scenes import SQUARE, best_offset, make_simulator, make_world, run

from pushplan.planners.pushing import (
    PushingConfig,
    PushingMpc,
    PushModel,
    PushParameters,
    PushPath,
)
from pushplan.planners.pushing.mpc import groups_of
from pushplan.world import (
    Controller,
    InvalidInputError,
    Movables,
    Twist,
    area_clearing_robot,
    jackal,
    turtlebot3_burger,
)

AREA = area_clearing_robot()
PUSHER = turtlebot3_burger("pusher", max_speed=0.2, max_turn_rate=0.785)
S_SHAPE = [(1.0, 0.0), (2.0, 0.35), (2.0, -0.35), (1.0, 0.0)]


def shaped(robot, side, pieces):
    """A path in units of L, and L."""
    length = PushModel(robot, side * SQUARE).reach
    return PushPath.arcs(np.zeros(3), [(a * length, b / length) for a, b in pieces]), length


def push(
    name, robot, side, pieces, friction, config, *, seed=None, mass=None, controller=None, walls=()
):
    """Errors of the pushed box [L], the last offset [half bumpers], and the episode."""
    path, length = shaped(robot, side, pieces)
    model = PushModel(robot, side * SQUARE, config.parameters)
    offset = best_offset(model, path, robot.max_speed)
    world = make_world(robot, [-1.03 * length, -offset, 0.0], [[0.0, 0.0, 0.1]], side, walls, mass)
    mpc = controller or PushingMpc(config)
    plan = path.plan(robot, 0)

    def command(seen):
        twist = mpc.command(seen, plan)
        return None if mpc.along >= path.length - 1e-9 else twist

    steps = round(3.0 * path.length / robot.max_speed / config.period)
    rng = None if seed is None else np.random.default_rng(seed)
    episode = run(
        make_simulator(name, world, friction),
        command,
        config.period,
        steps,
        noise=rng,
        delay=config.delay,
    )
    errors = shapely.distance(
        shapely.LineString(path.poses[:, :2]), shapely.points(episode.object_poses[:, 0, :2])
    )
    errors = errors / length
    state = model.state(episode.robot_poses[-1], episode.object_poses[-1, 0])
    return errors, state.offset / model.bumper.half, episode, mpc


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_it_follows_an_s_shape(friction):
    config = PushingConfig(parameters=PushParameters(friction), period=0.2)
    errors, offset, _, mpc = push("pymunk", AREA, 1.0, S_SHAPE, friction, config)
    assert errors.max() < 0.08 and errors[-1] < 0.05
    assert mpc.along > 0.99 * shaped(AREA, 1.0, S_SHAPE)[0].length
    assert abs(offset) < 0.6 and mpc.fallbacks == 0
    assert isinstance(mpc, Controller)


@pytest.mark.parametrize("name", ["pymunk", "mujoco"])
def test_it_bears_noise_and_delay(name):
    friction = 0.4 if name == "pymunk" else 0.15
    config = PushingConfig(
        parameters=PushParameters(friction), period=0.2, delay=0.1, observer_gain=0.3
    )
    errors, offset, _, mpc = push(name, PUSHER, 0.08, S_SHAPE, 0.4, config, seed=3, mass=0.075)
    assert errors.max() < 0.25 and np.sqrt((errors**2).mean()) < 0.1
    assert abs(offset) < 0.8 and mpc.fallbacks == 0


@pytest.mark.parametrize(("friction", "bound"), [(0.4, 0.1), (0.0, 0.3)])
def test_a_hollow_bumper(friction, bound):
    robot = turtlebot3_burger("collector", max_speed=0.2, max_turn_rate=0.785)
    config = PushingConfig(period=0.1, parameters=PushParameters(friction))
    errors, offset, _, _ = push("pymunk", robot, 0.08, S_SHAPE, friction, config, mass=0.075)
    assert errors.max() < bound and abs(offset) < 0.6


def test_the_same_again():
    config = PushingConfig(period=0.2, delay=0.1, observer_gain=0.3)
    one = push("pymunk", AREA, 1.0, S_SHAPE[:2], 0.0, config, seed=1)[2]
    two = push("pymunk", AREA, 1.0, S_SHAPE[:2], 0.0, config, seed=1)[2]
    assert np.array_equal(one.robot_poses, two.robot_poses)
    # and one controller for two episodes
    mpc = PushingMpc(config)
    for _ in range(2):
        again = push("pymunk", AREA, 1.0, S_SHAPE[:2], 0.0, config, seed=1, controller=mpc)[2]
        mpc.reset(again.world)
        assert np.array_equal(one.robot_poses, again.robot_poses)


@pytest.mark.slow
def test_the_program_gives_little_away():
    config = PushingConfig(parameters=PushParameters(0.3), period=0.2, horizon=12, moves=8)
    gains = []

    class Noted(NonlinearPushingMpc):
        def _refine(self, robot, last):
            super()._refine(robot, last)
            gains.append(self.gain)

    push("pymunk", AREA, 1.0, [(0.7, 0.0), (1.0, 0.5)], 0.3, config, controller=Noted(config))
    cost = np.array(gains)
    assert len(cost) > 20 and (cost[:, 1] <= cost[:, 0]).all()
    assert cost[:, 0].sum() < 1.05 * cost[:, 1].sum()
    assert (cost[:, 0] > cost[:, 1]).any()  # the reference does find better ones


def wall_ahead(distance, half=1.0):
    return ([(distance, -half), (distance + 1.0, -half), (distance + 1.0, half), (distance, half)],)


@pytest.mark.parametrize("case", [(AREA, 1.0, None), (PUSHER, 0.08, 0.075)])
def test_nothing_static_is_touched(case):
    robot, side, mass = case
    length = PushModel(robot, side * SQUARE).reach
    config = PushingConfig(period=0.2, clearance=0.02)
    walls = wall_ahead(2.0 * length + 0.5 * side, 3.0 * length)
    _, _, episode, mpc = push(
        "pymunk", robot, side, [(4.0, 0.0)], 0.0, config, mass=mass, walls=walls
    )
    assert episode.about["touched"] == 0
    front = walls[0][0][0] - episode.object_poses[-1, 0, 0] - 0.5 * side
    assert 0.0 < front < 0.2 * length and mpc.slowed < 0.05  # as near as it may, and stands
    # a wall beside the path: the robot, wider than the box, comes no nearer either
    beside = [(0.0, 0.7 * side), (9.0 * length, 0.7 * side), (9.0 * length, side), (0.0, side)]
    _, _, episode, _ = push(
        "pymunk", robot, side, [(4.0, 0.0)], 0.0, config, mass=mass, walls=(beside,)
    )
    assert episode.about["touched"] == 0


spots = st.floats(-3.0, 3.0)


@settings(max_examples=25)
@given(spots, spots, st.floats(-4.0, 4.0), spots, spots, st.floats(-4.0, 4.0), st.booleans())
def test_commands_are_always_within_limits(x, y, theta, bx, by, turn, burger):
    robot = PUSHER if burger else jackal("pusher")
    side = 0.08 if burger else 0.3
    length = PushModel(robot, side * SQUARE).reach
    path, _ = shaped(robot, side, S_SHAPE)
    config = PushingConfig(period=0.1, delay=0.1, observer_gain=0.5)
    mpc, plan = PushingMpc(config), path.plan(robot, 0)
    world = make_world(robot, np.zeros(3), [[0.0, 0.0, 0.0]], side)
    last = Twist(0.0, 0.0)
    for step in range(4):  # poses jump about, as no robot does
        scale = length * (1.0, 0.3, 0.1, 5.0)[step]
        world = world.moved(
            robot_pose=[scale * x, scale * y, theta],
            movable_poses=[[scale * bx, scale * by, turn * step]],
            time=0.1 * step,
        )
        twist = mpc.command(world, plan)
        assert robot.min_speed <= twist.linear <= robot.max_speed
        assert abs(twist.angular) <= robot.max_turn_rate
        if not burger:
            assert abs(twist.linear - last.linear) <= 0.1 * robot.max_acceleration + 1e-9
            assert abs(twist.angular - last.angular) <= 0.1 * robot.max_turn_acceleration + 1e-9
        last = twist
    assert mpc.fallbacks <= 2  # the solver may be slow about what no robot meets


def test_where_the_solver_fails_from_the_beginning_the_robot_stands():
    config = PushingConfig(period=0.2, solver_iterations=1, tolerance=1e-300)
    path, length = shaped(AREA, 1.0, S_SHAPE)
    world = make_world(AREA, [-1.01 * length, 0.0, 0.0], [[0.0, 0.0, 0.0]])
    mpc, plan = PushingMpc(config), path.plan(AREA, 0)
    found = [mpc.command(world.moved(time=0.2 * i), plan) for i in range(5)]
    assert found == [Twist(0.0, 0.0)] * 5 and mpc.fallbacks == 5


def test_steps_are_shared_out_among_commands():
    groups = groups_of(20, 10)
    assert groups[0] == 0 and groups[-1] == 9 and len(groups) == 20
    assert (np.diff(groups) >= 0).all() and len(np.unique(groups)) == 10
    assert list(groups_of(7, 7)) == list(range(7))
    for moves in range(2, 33):
        assert len(np.unique(groups_of(32, moves))) == moves


def test_it_is_quick():
    config = PushingConfig(period=0.2)
    path, length = shaped(AREA, 1.0, S_SHAPE)
    world = make_world(AREA, [-1.01 * length, 0.0, 0.0], [[0.0, 0.0, 0.0]])
    mpc, plan = PushingMpc(config), path.plan(AREA, 0)
    seen = iter([world.moved(time=0.2 * n) for n in range(60)])
    assert quickest(lambda: mpc.command(next(seen), plan), 60) < 0.005


def test_a_path_through_points():
    path = PushPath.through([(0, 0), (4, 0), (4, 0), (4, 3)], radius=1.0)
    assert path.length == pytest.approx(7.0 - 2.0 + math.pi / 2, rel=1e-3)
    turns = np.abs(np.diff(path.poses[:, 2]))
    assert turns.max() < 0.2
    assert path.poses[0].tolist() == [0.0, 0.0, 0.0]
    assert path.poses[-1].tolist() == pytest.approx([4.0, 3.0, 0.5 * math.pi])
    for points in ([(0, 0)], [(1, 1), (1, 1)], [(0, np.nan), (1, 1)]):
        with pytest.raises(InvalidInputError):
            PushPath.through(points)
    with pytest.raises(InvalidInputError, match="length"):
        PushPath.arcs([0, 0, 0], [(-1.0, 0.0)])


def test_what_it_cannot_do_is_refused():
    path, length = shaped(AREA, 1.0, S_SHAPE)
    world = make_world(AREA, [-1.01 * length, 0.0, 0.0], [[0.0, 0.0, 0.0]])
    plan = path.plan(AREA, 0)
    with pytest.raises(InvalidInputError, match="first sub-task"):
        PushingMpc().command(world, replace(plan, subtasks=()))
    car = area_clearing_robot("constant_speed")
    with pytest.raises(InvalidInputError, match="can stop"):
        PushingMpc().command(replace(world, robot=car), plan)
    for changes in (
        {"horizon": 1}, {"moves": 30}, {"margin": 0.0}, {"observer_gain": 2.0}, {"delay": math.nan},
        {"offset": -1.0}, {"parameters": 0.4}, {"tolerance": 0.0},
    ):  # fmt: skip
        with pytest.raises(InvalidInputError):
            PushingConfig(**changes)
    gone = replace(world, movables=Movables.empty(), time=1.0)
    mpc = PushingMpc()
    assert mpc.command(gone, plan) == Twist(0.0, 0.0) and mpc.state is None
