import math

import numpy as np
import pytest
import shapely

from pushplan.envs.simulators import pymunk_bodies
from pushplan.envs.simulators.base import Materials
from pushplan.envs.simulators.pymunk_simulator import PymunkOptions, PymunkSimulator
from pushplan.world import (
    Drive,
    GoalDisc,
    InvalidInputError,
    MissingDependencyError,
    Movables,
    RobotModel,
    StaticMap,
    Twist,
    World,
)

SQUARE = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
GRIP = Materials(robot_object=0.0, object_object=1.0, object_static=0.5, rolling_time=1.0)


def make_world(boxes, *, wheeled=(), walls=(), pose=(0.0, 0.0, 0.0), side=8.0):
    robot = RobotModel.from_outline(
        [(-0.7, -0.5), (0.7, -0.5), (0.7, 0.5), (-0.7, 0.5)],
        mass=1.0,
        drive=Drive.DIFFERENTIAL,
        max_speed=0.15,
        min_speed=-0.15,
        max_turn_rate=0.105,
    )
    boxes = np.asarray(boxes, dtype=float).reshape(-1, 3)
    return World(
        robot=robot,
        robot_pose=np.asarray(pose),
        static=StaticMap.build(segments=walls, radii=0.5, bounds=(-side, -side, side, side)),
        movables=Movables.from_outlines(
            [SQUARE] * len(boxes), boxes, wheeled=np.isin(np.arange(len(boxes)), wheeled)
        ),
        goal=GoalDisc(np.zeros(2), 1.0),
    )


def built(world, materials=GRIP, options=None):
    simulator = PymunkSimulator(options)
    simulator.build(world, materials)
    return simulator


def cluttered(seed, count=10, wheeled=()):
    """Boxes in a ring around the robot in a walled room of 9 m."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(0.0, 2 * math.pi, count, endpoint=False) + rng.uniform(0, 1)
    radii = 2.6 + 0.5 * (np.arange(count) % 2)
    boxes = np.stack([radii * np.cos(angles), radii * np.sin(angles), angles], axis=1)
    w = 5.0
    walls = [(-w, -w, w, -w), (w, -w, w, w), (w, w, -w, w), (-w, w, -w, -w)]
    return make_world(boxes, wheeled=wheeled, walls=walls)


def wall_depth(world):
    """Deepest reach of any body into a wall [m]."""
    shapes = [shapely.Polygon(world.movables.outline_world(k)) for k in range(len(world.movables))]
    shapes += [shapely.Polygon(part) for part in world.robot_outline_world()]
    return max(
        float(radius) - shape.distance(shapely.LineString(line.reshape(2, 2)))
        for shape in shapes
        for line, radius in zip(world.static.segments, world.static.radii, strict=True)
    )


def test_robot_drives_exact_arcs():
    simulator = built(make_world([]))
    trace = simulator.step(Twist(0.15, 0.1), 4.0)
    expected = (1.5 * math.sin(0.4), 1.5 * (1 - math.cos(0.4)), 0.4)
    np.testing.assert_allclose(simulator.world().robot_pose, expected, atol=1e-12)
    np.testing.assert_allclose(trace.robot_poses[-1], expected, atol=1e-12)
    assert trace.times[-1] == simulator.world().time == 4.0
    assert (np.diff(trace.times) > 0).all() and trace.times[0] > 0


def test_centred_push_carries_a_box_along_and_it_stops_at_once():
    simulator = built(make_world([(1.5, 0.0, 0.0)]))
    for _ in range(10):
        simulator.step(Twist(0.15, 0.0), 0.8)
    front = simulator.world().robot_pose[0] + 0.7
    x, y, theta = simulator.world().movables.poses[0]
    assert x - 0.5 == pytest.approx(front, abs=0.006)
    assert abs(y) < 1e-6 and abs(theta) < 1e-6
    for _ in range(5):
        simulator.step(Twist(-0.15, 0.0), 0.8)
    assert simulator.world().movables.poses[0, 0] == pytest.approx(x, abs=0.006)


def test_wheeled_box_rolls_on_for_speed_times_time_constant():
    plain = built(make_world([(1.25, 0.0, 0.0)]))
    rolling = built(make_world([(1.25, 0.0, 0.0)], wheeled=[0]))
    for simulator in (plain, rolling):
        for command in [Twist(0.15, 0.0)] * 3 + [Twist(0.0, 0.0)] * 10:
            simulator.step(command, 0.8)
    further = rolling.world().movables.poses[0, 0] - plain.world().movables.poses[0, 0]
    assert further == pytest.approx(0.15 * 1.0, rel=0.05)
    assert np.abs(rolling.world().movables.twists).max() < 1e-4


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.slow
def test_nothing_is_ever_pressed_into_a_wall(seed):
    world = cluttered(seed, wheeled=(0, 3, 6))
    simulator = built(world)
    limit = simulator.options.tolerance * world.movables.radii.min() * 1.01
    rng = np.random.default_rng(seed)
    held = 0
    for i in range(150):
        if i % 10 == 0:
            command = Twist(rng.choice([0.15, 0.15, -0.15]), rng.uniform(-0.105, 0.105))
        trace = simulator.step(command, 0.8)
        held += simulator.held
        for k in range(len(trace.times)):
            now = world.moved(robot_pose=trace.robot_poses[k], movable_poses=trace.object_poses[k])
            assert wall_depth(now) <= limit
    assert held > 0  # else the test has not reached a jam


def test_box_between_robot_and_wall_holds_the_robot_still():
    world = make_world([(1.3, 0.0, 0.0)], walls=[(2.5, -4.0, 2.5, 4.0)])
    simulator = built(world)
    for _ in range(10):
        simulator.step(Twist(0.15, 0.0), 0.8)
    assert simulator.held and not simulator.touched_static
    stopped = simulator.world()
    assert stopped.robot_pose[0] == pytest.approx(0.3, abs=0.03)
    trace = simulator.step(Twist(0.15, 0.0), 0.8)
    assert trace.object_lengths(stopped.movables.poses).max() < 1e-9  # held means still
    simulator.step(Twist(-0.15, 0.0), 0.8)
    assert not simulator.held
    assert simulator.world().robot_pose[0] < stopped.robot_pose[0] - 0.1


def test_a_held_robot_can_turn_itself_free():
    """A car that only drives forward gives way to the box that holds it while it turns."""
    world = make_world([(1.3, 0.0, 0.0)], walls=[(2.5, -9.0, 2.5, 9.0)])
    simulator = built(world)
    for _ in range(10):
        simulator.step(Twist(0.15, 0.0), 0.8)
    assert simulator.held
    for _ in range(40):
        simulator.step(Twist(0.15, 0.105), 0.8)
    assert not simulator.held and not simulator.touched_static
    assert simulator.world().robot_pose[2] > 1.5


def test_robot_stops_at_a_wall_and_says_so():
    simulator = built(make_world([], walls=[(2.0, -4.0, 2.0, 4.0)]))  # face at x = 1.5
    touched = []
    for _ in range(9):
        simulator.step(Twist(0.15, 0.0), 0.8)
        touched.append((simulator.touched_static, simulator.world().robot_pose[0] + 0.7))
    assert all(front >= 1.5 if hit else front < 1.5 for hit, front in touched)
    assert touched[-1][0] and touched[-1][1] == pytest.approx(1.5, abs=0.01)


def test_fast_robot_does_not_tunnel_through_a_thin_wall():
    world = make_world([], walls=[])
    thin = StaticMap.build(segments=[(2.0, -4.0, 2.0, 4.0)], radii=0.0, bounds=(-9, -9, 9, 9))
    world = World(world.robot, world.robot_pose, thin, world.movables, world.goal)
    simulator = built(world)
    simulator.step(Twist(0.15, 0.0), 60.0)
    assert simulator.touched_static
    assert simulator.world().robot_pose[0] + 0.7 < 2.02


@pytest.mark.parametrize("seed", range(3))
def test_simulator_is_memoryless(seed):
    """The same snapshot and commands give the same bytes, whatever happened before."""
    world = cluttered(seed, wheeled=(1, 4))
    one, other = built(world), built(world)
    rng = np.random.default_rng(seed)
    for _ in range(25):
        command = Twist(0.15, rng.uniform(-0.105, 0.105))
        state, snapshot = one.save(), one.world()
        trace = one.step(command, 0.8)
        for _ in range(rng.integers(0, 3)):
            other.step(Twist(-0.15, 0.1), 0.8)
        other.restore(state)
        assert other.world() == snapshot
        assert other.step(command, 0.8) == trace
        assert built(snapshot).step(command, 0.8) == trace
        assert other.save() == one.save()


def test_positions_are_converged():
    """A substep ten times shorter moves boxes by less than 2 % of their size in 40 s of pushing."""
    ends = []
    for scale in (1.0, 0.1):
        default = PymunkOptions()
        options = PymunkOptions(
            travel=default.travel * scale, slop=default.slop * scale, iterations=40
        )
        world = make_world([(1.6, 0.2, 0.0), (2.9, -0.2, 0.1), (1.9, 1.5, 0.3)])
        simulator = built(world, options=options)
        length = np.zeros(3)
        for i in range(50):
            before = simulator.save().object_poses
            trace = simulator.step(Twist(0.15, 0.05 * math.sin(i / 6)), 0.8)
            length += trace.object_lengths(before)
        ends.append((simulator.save().object_poses, length))
    (coarse, work), (fine, fine_work) = ends
    assert fine_work.sum() > 5.0
    assert np.abs(coarse - fine)[:, :2].max() < 0.02
    assert work.sum() == pytest.approx(fine_work.sum(), rel=0.005)


def test_friction_at_the_bumper_is_the_stated_one():
    """With grip a box that is pushed off centre turns with the bumper and slides less sideways."""
    moved = {}
    for mu in (0.0, 1.0):
        simulator = built(make_world([(1.25, 0.3, 0.0)]), Materials(robot_object=mu))
        for _ in range(10):
            simulator.step(Twist(0.1, 0.08), 0.8)
        moved[mu] = simulator.world().movables.poses[0]
    assert np.abs(moved[0.0] - moved[1.0])[:2].max() > 0.05


def test_follow_reports_poses_and_the_jam():
    world = make_world([(1.3, 0.0, 0.0)], walls=[(2.5, -4.0, 2.5, 4.0)])
    path = np.stack([np.linspace(0.0, 1.0, 11), np.zeros(11), np.zeros(11)], axis=1)
    found = built(world).follow(path)
    assert found.object_poses.shape == (11, 1, 3)
    np.testing.assert_array_equal(found.object_poses[0], world.movables.poses)
    assert found.jammed_at in (3, 4)
    assert (found.object_poses[found.jammed_at :] == found.object_poses[-1]).all()
    assert found.object_poses[-1, 0, 0] == pytest.approx(1.5, abs=0.02)
    free = built(make_world([(1.3, 0.0, 0.0)])).follow(path)
    assert free.jammed_at == -1
    assert free.work == pytest.approx(0.9, abs=0.01)


def test_removed_object_is_gone():
    simulator = built(make_world([(1.5, 0.0, 0.0), (3.5, 0.0, 0.0)]))
    simulator.remove([0])
    assert simulator.world().movables.ids.tolist() == [1]
    simulator.step(Twist(0.15, 0.0), 4.0)
    assert simulator.world().movables.poses[0, 0] == 3.5
    with pytest.raises(InvalidInputError, match=r"\[7\], valid ids: \[1\]"):
        simulator.remove([7])


def test_overlaps_in_a_perceived_scene_do_not_hold_the_robot():
    world = make_world([(2.1, 0.0, 0.0), (-3.0, 0.0, 0.0)], walls=[(3.0, -4.0, 3.0, 4.0)])
    simulator = built(world)  # the first box reaches 10 cm into the wall
    simulator.step(Twist(-0.15, 0.0), 0.8)
    assert not simulator.held
    assert simulator.world().robot_pose[0] == pytest.approx(-0.12)


@pytest.mark.parametrize(
    "bad", [{"travel": 0.0}, {"slop": 0.5}, {"iterations": 0}, {"tolerance": 0.002}]
)
def test_bad_options_are_refused(bad):
    with pytest.raises(InvalidInputError, match=next(iter(bad))):
        PymunkOptions(**bad)
    with pytest.raises(InvalidInputError, match="robot_object"):
        Materials(robot_object=-1.0)


def test_a_pymunk_without_access_to_its_engine_is_named(monkeypatch):
    monkeypatch.setattr(pymunk_bodies, "_FUNCTIONS", ("cpSpaceStep", "cpNoSuchFunction"))
    with pytest.raises(MissingDependencyError, match=r"cpNoSuchFunction.*7\.3,<8"):
        built(make_world([(2.0, 0.0, 0.0)]))
