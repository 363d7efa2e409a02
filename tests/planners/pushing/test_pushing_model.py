import math
from dataclasses import replace

import casadi
import nonlinear_pushing
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pushing_scenes import SQUARE, in_front, make_simulator

from pushplan.planners.pushing import (
    Bumper,
    PushModel,
    PushParameters,
    PushState,
    face_towards,
    pressure_radius,
    spread_of,
    stable_curvature,
)
from pushplan.world import (
    InvalidInputError,
    RobotModel,
    Twist,
    area_clearing_robot,
    box_delivery_robot,
    maze_robot,
    turtlebot3_burger,
)

FREE, STICK, SLIDE, CORNER_STICK, CORNER_SLIDE = range(5)
PLANAR = spread_of("inertia", SQUARE)
AREA = area_clearing_robot()
PUSHER = turtlebot3_burger("pusher", max_speed=0.2, max_turn_rate=0.785)


def simulated(name, robot, side, friction, commands, dt, offset=0.0, angle=0.0, mass=None):
    """Offset and angle after each command, in a simulator and by the model, in L and rad."""
    world, model = in_front(robot, side, offset, angle, mass)
    model = PushModel(robot, side * SQUARE, PushParameters(friction, PLANAR))
    simulator = make_simulator(name, world, friction)
    seen = []
    for v, w in commands:
        simulator.step(Twist(v, w), dt)
        state = model.state(simulator.robot_pose, simulator.object_poses[0])
        seen.append([state.offset / model.reach, state.angle])
    rows = model.rows(PushState(np.zeros(3), offset, angle), commands, dt)[0][1:]
    return np.array(seen), rows[:, 3:5] / [model.reach, 1.0]


def test_how_the_ground_resists_turning():
    assert pressure_radius(SQUARE) == pytest.approx(0.38260, abs=1e-5)
    assert pressure_radius(3.0 * SQUARE, "inertia") == pytest.approx(3.0 / math.sqrt(6.0))
    assert pressure_radius(SQUARE, "corners") == pytest.approx(math.sqrt(0.5))
    turns = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    disc = 2.0 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    assert pressure_radius(disc) == pytest.approx(4.0 / 3.0, rel=0.005)
    with pytest.raises(InvalidInputError, match="uniform"):
        pressure_radius(SQUARE, "round")


def test_fronts_of_the_robots():
    for robot, front, half in (
        (AREA, 0.7, 1.2),
        (box_delivery_robot(), 0.31, 0.53),
        (maze_robot(), 0.7, 0.5),
    ):
        bumper = Bumper.of(robot)
        assert (bumper.front, bumper.curvature) == (front, 0.0)
        assert bumper.half == pytest.approx(half, abs=0.01)
    assert Bumper.of(turtlebot3_burger("collector")).curvature == pytest.approx(4.0, rel=0.01)
    assert Bumper.of(turtlebot3_burger("navigation")).curvature == pytest.approx(-6.0, rel=0.01)

    def wedge(tip):
        outline = [(tip, 0.0), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)]
        return RobotModel.from_outline(
            outline, mass=1.0, drive="differential", max_speed=1.0, max_turn_rate=1.0
        )

    assert Bumper.of(wedge(0.7)).curvature < -0.5
    with pytest.raises(InvalidInputError, match="pointed"):
        Bumper.of(wedge(1.5))
    behind = RobotModel.from_outline(
        SQUARE - [2.0, 0.0], mass=1.0, drive="differential", max_speed=1.0, max_turn_rate=1.0
    )
    with pytest.raises(InvalidInputError, match="no front"):
        Bumper.of(behind)


def test_which_face_is_pushed():
    assert face_towards(SQUARE, 0.4).normal == pytest.approx(0.0)
    assert face_towards(SQUARE, 1.4).normal == pytest.approx(np.pi / 2)
    plank = SQUARE * [4.0, 1.0]
    face = face_towards(plank, np.pi / 2)
    assert (face.depth, face.low, face.high) == pytest.approx((0.5, -2.0, 2.0))


@pytest.mark.parametrize("friction", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("case", [(AREA, 1.0), (box_delivery_robot(), 0.44), (PUSHER, 0.08)])
def test_it_predicts_what_pymunk_does(friction, case):
    robot, side = case
    reach = PushModel(robot, side * SQUARE).reach
    bends = np.repeat([0.3, -0.5, 0.1, 0.7, -0.2], 6) / reach
    commands = robot.max_speed * np.stack([np.ones(30), bends], axis=1)
    dt = 0.1 * reach / robot.max_speed
    seen, foreseen = simulated("pymunk", robot, side, friction, commands, dt)
    assert np.abs(seen - foreseen).max() < 0.012


def test_it_predicts_boxes_that_lie_askew_or_slide_off():
    turn = np.tile([0.2, 0.2 * 0.9], (45, 1))
    seen, foreseen = simulated("pymunk", AREA, 1.0, 0.0, turn, 0.2)
    half = 1.2 / 1.2  # the bumper, in L
    on = np.abs(seen[:, 0]) < half
    assert 20 < on.sum() < 45
    assert np.abs(seen - foreseen)[on].max() < 0.1
    straight = np.tile([0.2, 0.0], (20, 1))
    seen, foreseen = simulated("pymunk", AREA, 1.0, 0.3, straight, 0.2, offset=0.4, angle=0.3)
    assert np.abs(seen[-1] - foreseen[-1]).max() < 0.05 and abs(seen[-1, 1]) < 1e-2


def test_hollow_bumpers_hold_without_friction():
    collector = turtlebot3_burger("collector", max_speed=0.2, max_turn_rate=0.785)
    turn = np.tile([0.2, 0.2 * 1.5], (20, 1))
    seen, foreseen = simulated("pymunk", collector, 0.08, 0.0, turn, 0.1, mass=0.075)
    flat, _ = simulated("pymunk", PUSHER, 0.08, 0.0, turn, 0.1, mass=0.075)
    assert abs(seen[-1, 0]) < 0.35 * abs(flat[-1, 0])
    assert np.abs(seen - foreseen).max() < 0.1


def test_boxes_slide_in_mujoco_by_as_much_as_the_robot_turns():
    world, _ = in_front(PUSHER, 0.08, mass=0.075)
    model = PushModel(PUSHER, 0.08 * SQUARE)
    simulator = make_simulator("mujoco", world, 0.0)
    simulator.step(Twist(0.2, 0.0), 0.5)  # the wheels take a while to turn as asked
    first = model.state(simulator.robot_pose, simulator.object_poses[0])
    for _ in range(12):
        simulator.step(Twist(0.2, 0.3), 0.1)
    state = model.state(simulator.robot_pose, simulator.object_poses[0])
    turned = state.robot_pose[2] - first.robot_pose[2]
    assert turned > 0.25
    assert (state.offset - first.offset) / model.reach == pytest.approx(-turned, rel=0.2)


@pytest.mark.parametrize(
    "case", [(AREA, 1.0, 0.15), (AREA, 1.0, 0.5), (PUSHER, 0.08, 0.3), (AREA, 1.0, 1.5)]
)
def test_stable_bound_against_simulation(case):
    robot, side, friction = case
    model = PushModel(robot, side * SQUARE, PushParameters(friction, PLANAR))
    bound = model.stable_curvature()
    d, a = model.bumper.front, model.face.depth
    c = model.contact.spread
    assert bound == pytest.approx(
        min(friction / (a + d), 0.5 * side / (c * c + a * (a + d))), rel=1e-9
    )
    slips = []
    for share in (0.93, 1.12):
        w = share * bound * robot.max_speed
        commands = np.tile([robot.max_speed, w], (20, 1))
        dt = 0.05 * model.reach / robot.max_speed
        seen, _ = simulated("pymunk", robot, side, friction, commands, dt)
        slips.append(float(np.abs(seen[-1]).max()))
    assert slips[0] < 0.01 and slips[1] > 2.0 * slips[0] + 0.005


unit = st.floats(-1.0, 1.0)
robots = st.sampled_from([AREA, PUSHER, turtlebot3_burger("collector")])


def made(robot, friction, offset, angle):
    side = 1.0 if robot is AREA else 0.08
    model = PushModel(robot, side * SQUARE, PushParameters(friction))
    return model, 0.8 * offset * model.bumper.half, 0.4 * angle


@settings(max_examples=150)
@given(robots, st.floats(0.0, 1.0), unit, unit, unit)
def test_forces_obey_coulomb_and_the_limit_surface(robot, friction, offset, angle, bend):
    model, s, phi = made(robot, friction, offset, angle)
    contact = model.contact
    v, w = 0.2, 0.2 * 1.5 * bend / model.reach
    out = np.empty(6)
    contact.velocity(s, phi, np.cos(phi), np.sin(phi), v, w, 0.1 * model.reach / v, out)
    vn, vt, omega, y, mode, shear = out
    low, high = contact.line(s)
    assert vn >= -1e-9 and low - 1e-9 <= y <= high + 1e-9
    assert abs(shear) <= friction + 1e-9
    # the force that the limit surface asks for acts at the centre of pressure
    torque = contact.spread**2 * omega
    assert torque == pytest.approx(-contact.depth * vt - y * vn, abs=1e-9)
    if mode in (SLIDE, CORNER_SLIDE):
        assert abs(shear) == pytest.approx(friction, abs=1e-9)
    if contact.curvature == 0.0 and mode in (STICK, SLIDE):
        x = contact.standoff(s, phi)[0]
        ut = math.cos(phi) * w * x - math.sin(phi) * (v - w * s)
        if mode == STICK:
            assert vt == pytest.approx(ut, abs=1e-9)
        else:  # friction drags the box after the bumper
            assert shear * (ut - vt) >= -1e-9


@settings(max_examples=25)
@example(turtlebot3_burger("collector"), 0.75, 0.25, 0.0, 1.0, 3.0)
@given(robots, st.floats(0.0, 1.0), unit, unit, unit, st.floats(0.3, 30.0))
def test_mirrored_and_scaled_pushes(robot, friction, offset, angle, bend, factor):
    model, s, phi = made(robot, friction, offset, angle)
    length = model.reach
    commands = np.tile([0.2, 0.2 * bend / length], (4, 1))
    dt = 0.15 * length / 0.2
    rows, _ = model.rows(PushState(np.zeros(3), s, phi), commands, dt)
    mirrored, _ = model.rows(PushState(np.zeros(3), -s, -phi), commands * [1.0, -1.0], dt)
    assert mirrored == pytest.approx(rows * [1, -1, -1, -1, -1, 1], abs=1e-6 * length + 1e-6)
    b = model.bumper
    large = PushModel(
        replace(b, front=factor * b.front, half=factor * b.half, curvature=b.curvature / factor),
        factor * model.outline,
        model.parameters,
    )
    scaled, _ = large.rows(PushState(np.zeros(3), factor * s, phi), commands * [factor, 1.0], dt)
    lengths = np.array([factor, factor, 1.0, factor, 1.0, factor])
    # rounding may share out a step among one substep more
    assert np.abs(scaled / lengths - rows).max() < 2e-3 * max(length, 1.0)


def test_a_box_that_is_not_touched_stands():
    model = PushModel(AREA, SQUARE)
    state = PushState(np.zeros(3), 0.2, 0.1, gap=0.5)
    box = model.box_pose(state)
    away, _ = model.rows(state, [[-0.2, 0.1], [0.1, -0.3], [0.2, 0.2]], 0.5)
    boxes = [model.box_pose(PushState.from_row(row)) for row in away]
    assert np.array(boxes) == pytest.approx(np.tile(box, (4, 1)), abs=1e-9)
    towards, details = model.rows(state, np.tile([0.2, 0.0], (20, 1)), 0.2)
    assert details[0, 4] == FREE and details[-1, 4] == STICK
    assert model.box_pose(PushState.from_row(towards[-1]))[0] - box[0] == pytest.approx(
        0.8 - 0.5, abs=0.08
    )
    assert model.state(np.zeros(3), box).gap == pytest.approx(0.5)
    assert model.state(np.zeros(3), box).offset == pytest.approx(0.2)


def test_nonlinear_expressions_are_those_of_the_core():
    rng = np.random.default_rng(0)
    for kind in ("pusher", "collector", "navigation"):
        model = PushModel(turtlebot3_burger(kind), 0.08 * SQUARE, PushParameters(0.3))
        x, u = casadi.SX.sym("x", 5), casadi.SX.sym("u", 3)
        made = casadi.Function(
            "f", [x, u], [nonlinear_pushing.step(model.contact, x, u[0], u[1], u[2])]
        )
        for _ in range(60):
            row = np.array([0, 0, 0, 0.06 * rng.uniform(-1, 1), 0.3 * rng.uniform(-1, 1), 0.0])
            v, w = 0.2, rng.uniform(-1.0, 1.0)
            found = np.asarray(made(row[:5], [v, w, 0.1])).ravel()
            for _ in range(2):
                row = model.rows(PushState.from_row(row), [[v, w]], 0.05)[0][1]
            assert found == pytest.approx(row[:5], abs=1e-9)


@pytest.mark.parametrize("kind", ["pusher", "collector", "navigation"])
def test_derivatives_of_the_program_are_those_of_the_reference(kind):
    rng = np.random.default_rng(1)
    model = PushModel(turtlebot3_burger(kind), 0.08 * SQUARE, PushParameters(0.3))
    at = casadi.SX.sym("at", 4)  # offset, angle, speed, turn rate
    start = casadi.vertcat(0.0, 0.0, 0.0, at[0], at[1])
    dt = 0.04  # one substep of `advance`
    after = nonlinear_pushing.step(model.contact, start, at[2], at[3], dt, substeps=1)[3:]
    exact = casadi.Function("f", [at], [casadi.jacobian(after, at)])
    slopes, scales = np.empty((2, 4)), np.full(4, 1e-6)
    for _ in range(60):
        point = np.array([0.06, 0.3, 0.05, 1.0]) * rng.uniform(-1.0, 1.0, 4)
        point[2] += 0.15
        model.contact.linearise(*point, dt, scales, slopes)
        assert slopes == pytest.approx(exact(point).full(), abs=1e-4)


def test_what_makes_no_sense_is_refused():
    with pytest.raises(InvalidInputError, match="friction"):
        PushParameters(friction=-0.1)
    with pytest.raises(InvalidInputError, match="spread"):
        PushParameters(spread=float("nan"))
    with pytest.raises(InvalidInputError, match="depth"):
        stable_curvature(0.3, reach=1.0, depth=0.0, half=1.0, c=0.4)
    assert stable_curvature(0.3, reach=1.0, depth=0.5, half=-0.1, c=0.4) == 0.0
    with pytest.raises(InvalidInputError, match="convex"):
        PushModel(AREA, [(0, 0), (1, 0), (0.2, 0.2), (0, 1)])
    with pytest.raises(InvalidInputError):
        PushState([0.0, np.nan, 0.0], 0.0, 0.0)
    with pytest.raises(InvalidInputError, match="dt"):
        PushModel(AREA, SQUARE).rows(PushState(np.zeros(3), 0, 0), [[0.1, 0.0]], 0.0)
