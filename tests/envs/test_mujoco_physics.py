"""Whether bodies in the MuJoCo simulator move as mechanics says."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from mujoco_scenes import (
    FRONT,
    GROUND,
    JACKAL_GROUND,
    SEA,
    SIDE,
    SQUARE,
    built,
    cluttered,
    jackal,
    room,
    sea,
    turtlebot,
    without_drag,
)

from benchmarks.accuracy.water_coasting import coasting
from pushplan.geometry.convex import convex_penetration
from pushplan.world import Twist

G = 9.81


def kinetic_energy(world, moments):
    """Of the objects [J], with their moments of inertia (K,) [kg m²]."""
    twists = world.movables.twists
    speeds = (twists[:, :2] ** 2).sum(axis=1)
    return 0.5 * float(world.movables.masses @ speeds + moments @ twists[:, 2] ** 2)


@pytest.mark.parametrize(
    ("robot", "materials"),
    [(turtlebot(), GROUND), (jackal(), JACKAL_GROUND)],
    ids=["turtlebot", "jackal"],
)
@pytest.mark.parametrize(("share", "turn"), [(0.9, 0.0), (-0.9, 0.0), (0.0, 0.7), (0.6, -0.4)])
def test_wheels_hold_speed_and_turn_rate_on_free_floor(robot, materials, share, turn):
    """Turning on the spot included, where the caster slides sideways."""
    simulator = built(room(robot=robot, half=12.0), materials)
    command = Twist(share * robot.max_speed, turn * robot.max_turn_rate)
    for _ in range(5):
        simulator.step(command, 0.2)
    poses = np.concatenate([simulator.step(command, 0.2).robot_poses for _ in range(10)])
    seconds = 0.2 * 10 * 79 / 80
    turned = np.unwrap(poses[:, 2])[-1] - poses[0, 2]
    length = np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()
    assert turned / seconds == pytest.approx(command.angular, rel=0.03, abs=1e-3)
    slip = 0.01 * robot.max_speed  # of the axle's middle while turning on the spot
    assert length / seconds == pytest.approx(abs(command.linear), rel=0.015, abs=slip)


def test_robot_gets_under_way_as_fast_as_its_motors_allow():
    simulator = built(room())
    trace = simulator.step(Twist(0.2, 0.0), 0.2)
    speeds = np.diff(trace.robot_poses[:, 0], prepend=0.0) / 0.025
    assert (np.diff(speeds) > 0.0).all()  # neither overshoot nor wheelspin
    assert speeds[0] < 0.13 and speeds[-1] == pytest.approx(0.2, rel=0.02)


def test_robot_that_is_told_to_stand_stands():
    simulator = built(room([(0.2, 0.0, 0.3)], wheeled=[0]))
    for _ in range(50):
        simulator.step(Twist(0.0, 0.0), 0.2)
    np.testing.assert_allclose(simulator.robot_pose, 0.0, atol=1e-3)
    np.testing.assert_array_equal(simulator.object_poses, [(0.2, 0.0, 0.3)])


@pytest.mark.parametrize("direction", [0.0, 0.5, 2.3])
def test_a_sliding_box_stops_after_v_squared_over_two_mu_g(direction):
    speed, mu = 0.5, 0.4
    twist = (speed * math.cos(direction), speed * math.sin(direction), 0.0)
    simulator = built(room([(0.5, 0.0, 0.2)], twists=[twist]))
    for _ in range(5):
        simulator.step(Twist(0.0, 0.0), 0.1)
    way = simulator.object_poses[0, :2] - (0.5, 0.0)
    # the velocity at the end of a step moves the box through it: half a step's way is lost
    lost = 0.5 * speed * simulator.options.time_step
    assert np.hypot(*way) == pytest.approx(speed**2 / (2 * mu * G) - 0.5 * lost, abs=0.7 * lost)
    assert math.atan2(way[1], way[0]) == pytest.approx(direction, abs=0.02)
    assert (simulator.world().movables.twists == 0.0).all()


def test_pushed_box_goes_along_upright_and_stops_by_friction():
    simulator = built(room([(0.2, 0.0, 0.0)], pose=(-1.0, 0.0, 0.0)))
    for _ in range(40):
        simulator.step(Twist(0.2, 0.0), 0.2)
    x, y, theta = simulator.object_poses[0]
    assert x - 0.5 * SIDE == pytest.approx(simulator.robot_pose[0] + FRONT, abs=2e-3)
    assert abs(y) < 2e-3 and abs(theta) < 0.02
    tilt = simulator.save().hidden[9 + 4 : 9 + 6]  # x and y of the box's quaternion
    assert np.abs(tilt).max() < 5e-3  # half a degree
    assert not simulator.held and not simulator.touched_static
    for _ in range(3):
        simulator.step(Twist(-0.2, 0.0), 0.2)
    # all of the box's energy goes into friction, but the robot pushes on while it brakes
    assert 0.0 <= simulator.object_poses[0, 0] - x < 0.2**2 / (2 * 0.4 * G) + 0.01


def test_wheeled_box_rolls_on_with_the_stated_time_constant():
    simulator = built(room([(-0.5, 0.6, 0.4)], wheeled=[0], twists=[(0.2, 0.0, 1.0)]))
    ways, turns = [], []
    for _ in range(40):
        simulator.step(Twist(0.0, 0.0), 0.1)
        ways.append(simulator.object_poses[0, 0] + 0.5)
        turns.append(simulator.object_poses[0, 2] - 0.4)
    times = 0.1 * np.arange(1, 41)
    tau = GROUND.rolling_time
    np.testing.assert_allclose(ways, 0.2 * tau * (1 - np.exp(-times / tau)), atol=0.002)
    np.testing.assert_allclose(turns, tau * (1 - np.exp(-times / tau)), atol=0.02)


@pytest.mark.parametrize(
    "kind", ["robot_object", "object_object", "object_static", "object_ground"]
)
def test_friction_of_each_pair_is_the_stated_one(kind):
    """One body at a time slides along another; its deceleration is mu times the normal force."""
    values = {
        "robot_object": 0.11,
        "object_object": 0.22,
        "object_static": 0.33,
        "object_ground": 0.44,
    }
    materials = replace(GROUND, **values)
    simulator = built(
        room([(FRONT + 0.0399, 0.0, 0.0), (0.2049, 0.0, 0.0)], walls=[((0.2445, -1), (0.3, 1))]),
        materials,
    )
    for _ in range(2):
        simulator.step(Twist(0.1, 0.0), 0.2)
    data, model = simulator._scene.data, simulator._scene.model
    kinds = {"robot_object": ("robot", "object"), "object_object": ("object", "object")}
    kinds |= {"object_static": ("object", "static"), "object_ground": ("ground", "object")}
    found = set()
    for contact in data.contact:
        names = sorted(model.geom(int(geom)).name.split()[0] for geom in contact.geom)
        if tuple(names) == tuple(sorted(kinds[kind])):
            found.add(round(float(contact.friction[0]), 9))
    assert found == {values[kind]}


def test_frictionless_bumper_lets_a_box_slide_off():
    ends = {}
    for mu in (0.0, 0.8):
        simulator = built(room([(0.13, 0.06, 0.0)]), replace(GROUND, robot_object=mu))
        for _ in range(15):
            simulator.step(Twist(0.15, 0.5), 0.2)
        ends[mu] = simulator.object_poses[0]
    assert np.abs(ends[0.0] - ends[0.8])[:2].max() > 0.02


def test_energy_is_never_created_on_the_ground():
    boxes = [(-0.3, 0.5, 0.3), (0.0, 0.52, 0.0), (0.3, 0.5, 0.8), (0.1, 0.9, 0.1)]
    twists = [(1.2, 0.0, 3.0), (0.0, 0.0, 0.0), (-0.8, 0.1, 0.0), (0.0, -0.7, 0.0)]
    simulator = built(room(boxes, wheeled=[1], twists=twists))
    moments = np.full(4, 0.1 * SIDE**2 / 6.0)
    energy = [kinetic_energy(simulator.world(), moments)]
    for _ in range(60):
        simulator.step(Twist(0.0, 0.0), 0.02)
        energy.append(kinetic_energy(simulator.world(), moments))
    assert energy[-1] < 0.02 * energy[0]
    assert np.diff(energy).max() < 0.002 * energy[0]  # a rocking box trades height for speed


def test_floating_bodies_keep_their_momentum_without_drag():
    at = [(-100.0, 200.0, 0.1), (-50.0, 205.0, 0.0)]
    simulator = built(sea(at, [(1.5, 0.0, 0.02), (-0.5, 0.0, 0.0)]), without_drag())
    world = simulator.world()
    masses = world.movables.masses
    moment = masses[0] * 12.0**2 / 4.0 * 0.9  # nearly that of a disc
    before = masses @ world.movables.twists[:, :2]
    energy = [kinetic_energy(world, np.full(2, moment))]
    for _ in range(20):
        simulator.step(Twist(0.0, 0.0), 2.0)
        energy.append(kinetic_energy(simulator.world(), np.full(2, moment)))
    after = simulator.world().movables
    np.testing.assert_allclose(masses @ after.twists[:, :2], before, rtol=1e-9, atol=1e-3)
    assert after.twists[1, 0] > 0.3  # they have met
    assert np.diff(energy).max() < 0.02 * energy[0]
    assert energy[-1] < 0.8 * energy[0]


@pytest.mark.parametrize("direction", [0.0, 0.8])
def test_a_floe_coasts_as_the_drag_law_says(direction):
    twist = (1.5 * math.cos(direction), 1.5 * math.sin(direction), 0.0)
    world = sea([(0.0, 100.0, 0.0)], [twist])
    linear, quadratic = SEA.water.coefficients(world)[1, :2]
    mass = float(world.movables.masses[0])
    time, way = coasting(linear, quadratic, mass, 1.5, 0.5)
    simulator = built(world, SEA)
    for _ in range(20):
        simulator.step(Twist(0.0, 0.0), time / 20)
    assert np.hypot(*(simulator.object_poses[0, :2] - (0.0, 100.0))) == pytest.approx(way, rel=0.01)
    assert np.hypot(*simulator.world().movables.twists[0, :2]) == pytest.approx(0.5, rel=0.01)


def test_a_floe_stops_turning_as_the_drag_law_says():
    world = sea([(0.0, 100.0, 0.0)], [(0.0, 0.0, 0.05)])
    coefficients = SEA.water.coefficients(world)[1]
    outline = world.movables.outline(0)
    x, y = outline[:, 0], outline[:, 1]
    after_x, after_y = np.roll(x, -1), np.roll(y, -1)
    cross = x * after_y - after_x * y
    second = (x * x + x * after_x + after_x**2 + y * y + y * after_y + after_y**2) @ cross / 12.0
    moment = 1080.0 * float(second)
    time, angle = coasting(coefficients[2], coefficients[3], moment, 0.05, 0.02)
    simulator = built(world, SEA)
    for _ in range(20):
        simulator.step(Twist(0.0, 0.0), time / 20)
    assert simulator.object_poses[0, 2] == pytest.approx(angle, rel=0.01)


def test_a_ship_takes_its_time_and_then_holds_its_course():
    simulator = built(sea(), SEA)
    trace = simulator.step(Twist(2.0, 0.0), 4.0)
    speeds = np.diff(trace.robot_poses[:, 0], prepend=0.0) / 0.5
    assert np.diff(speeds).max() / 0.5 <= simulator.options.thrust * 1.01
    for _ in range(10):
        simulator.step(Twist(2.0, 0.0), 4.0)
    twist = simulator.world().robot_twist
    np.testing.assert_allclose(twist, (2.0, 0.0, 0.0), rtol=0.02, atol=1e-6)
    for _ in range(10):
        simulator.step(Twist(2.0, 0.01), 4.0)
    world = simulator.world()
    vx, vy, turn = world.robot_twist
    theta = world.robot_pose[2]
    assert vx * math.cos(theta) + vy * math.sin(theta) == pytest.approx(2.0, rel=0.02)
    assert abs(vy * math.cos(theta) - vx * math.sin(theta)) < 0.05  # it does not slip sideways
    assert turn == pytest.approx(0.01, rel=0.02)


def test_a_ship_loses_what_a_floe_gains():
    simulator = built(sea([(60.0, 0.0, 0.0)], robot_twist=(2.0, 0.0, 0.0)), SEA)
    for _ in range(3):
        simulator.step(Twist(2.0, 0.0), 4.0)
    world = simulator.world()
    assert world.movables.twists[0, 0] > 1.5
    assert 1.5 < world.robot_twist[0] < 2.0
    assert not simulator.held


@pytest.mark.parametrize("seed", range(1))
def test_no_body_is_ever_inside_a_wall(seed):
    world = cluttered(seed, wheeled=(0, 3))
    simulator = built(world)
    rng = np.random.default_rng(seed)
    deepest = touched = 0.0
    command = Twist(0.2, 0.0)
    for i in range(120):
        if i % 8 == 0:
            command = Twist(rng.choice([0.2, 0.2, -0.2]), rng.uniform(-1.0, 1.0))
        trace = simulator.step(command, 0.2)
        touched += simulator.touched_static
        for k in range(len(trace.times)):
            now = world.moved(robot_pose=trace.robot_poses[k], movable_poses=trace.object_poses[k])
            corners = [now.movables.outline_world(j) for j in range(len(now.movables))]
            corners += now.robot_outline_world()
            deepest = max(deepest, max(float(np.abs(c).max()) for c in corners) - 0.6)
    assert touched > 0
    assert deepest < 0.004  # soft contacts, at impact


def test_floes_that_are_pushed_together_do_not_overlap():
    rng = np.random.default_rng(0)
    at = [(60 + 26 * i, 26 * j, rng.uniform(0, 6)) for i in range(4) for j in range(-2, 3)]
    simulator = built(sea(at, radius=12.5), SEA)
    overlap = 0.0
    for _ in range(25):
        simulator.step(Twist(2.0, 0.0), 4.0)
        world = simulator.world()
        shapes = [world.movables.outline_world(k) for k in range(len(at))]
        shapes += world.robot_outline_world()
        near = shapely.STRtree([shapely.Polygon(shape) for shape in shapes])
        for a, b in near.query([shapely.Polygon(s) for s in shapes], predicate="intersects").T:
            if a < b:
                overlap = max(overlap, convex_penetration(shapes[a], shapes[b])[0])
    assert 0.0 < overlap < 0.1


def test_a_tall_box_tips_where_a_low_one_slides():
    """What a planar engine cannot show: friction at the foot, inertia at the middle."""
    steepest = {}
    for height in (0.08, 0.3):
        solids = replace(GROUND.solids, object_height=height)
        world = room([(-0.5, 0.0, 0.0)], pose=(0.0, 1.0, 0.0), twists=[(1.2, 0.0, 0.0)])
        simulator = built(world, replace(GROUND, solids=solids))
        steepest[height] = 0.0
        for _ in range(40):
            simulator.step(Twist(0.0, 0.0), 0.05)
            half_turn = float(np.abs(simulator.save().hidden[13:15]).max())  # x, y of a quaternion
            steepest[height] = max(steepest[height], 2.0 * math.asin(half_turn))
    assert steepest[0.08] < 0.05
    assert steepest[0.3] > 1.0


def test_square_is_the_size_it_says():
    assert np.ptp(SQUARE, axis=0).tolist() == [SIDE, SIDE]
