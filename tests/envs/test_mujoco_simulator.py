"""The simulator's contract, as MuJoCo keeps it."""

import hashlib
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from conftest import quickest
from mujoco_scenes import (
    FRONT,
    GROUND,
    SEA,
    SIDE,
    SQUARE,
    built,
    cluttered,
    floe,
    room,
    sea,
    turtlebot,
)

from pushplan.envs import PushEnv
from pushplan.envs.registry import SIMULATORS
from pushplan.envs.simulators.mujoco_bodies import drag_damping, planar_rows
from pushplan.envs.simulators.mujoco_model import MujocoOptions
from pushplan.envs.simulators.mujoco_shapes import as_rectangle, prism_inertia
from pushplan.envs.simulators.mujoco_simulator import MujocoSimulator
from pushplan.envs.simulators.mujoco_sleep import rest_cycles
from pushplan.imports.on_demand import look_up
from pushplan.world import (
    InvalidInputError,
    Movables,
    PushplanError,
    Twist,
)


def ice(count=12, seed=0):
    rng = np.random.default_rng(seed)
    at = [(70 + 27 * (k // 4), 27 * (k % 4) - 40, rng.uniform(0, 6)) for k in range(count)]
    return sea(at)


def random_commands(seed, count, fast, turn):
    rng = np.random.default_rng(seed)
    for i in range(count):
        if i % 6 == 0:
            command = Twist(rng.choice([fast, fast, -fast]), rng.uniform(-turn, turn))
        yield command


SCENES = {
    "ground": (cluttered(0, wheeled=(0, 5)), GROUND, 0.2, (0.2, 1.0)),
    "water": (ice(), SEA, 4.0, (2.0, 0.01)),
}


def test_name_is_in_the_registry():
    assert look_up("simulator", SIMULATORS, "mujoco") is MujocoSimulator
    assert MujocoSimulator.name == "mujoco"


@pytest.mark.parametrize("kind", SCENES)
def test_simulator_is_memoryless(kind):
    """The same state and commands give the same bytes, whatever happened before."""
    world, materials, step, limits = SCENES[kind]
    one, other = built(world, materials), built(world, materials)
    rng = np.random.default_rng(1)
    asleep = 0
    for command in random_commands(2, 60, *limits):
        state, snapshot = one.save(), one.world()
        trace = one.step(command, step)
        flags = one.held, one.touched_static
        for _ in range(rng.integers(0, 3)):
            other.step(Twist(-command.linear, -command.angular), step)
        if rng.random() < 0.2:
            other.build(world, materials)
        other.restore(state)
        assert other.world() == snapshot
        assert other.save() == state
        assert other.step(command, step) == trace
        assert (other.held, other.touched_static) == flags
        assert other.save() == one.save()
        asleep += int((state.hidden[-len(world.movables) :] >= 0).sum())
    moved = np.abs(one.object_poses - world.movables.poses)[:, :2].max()
    assert moved > SIDE and asleep > 60  # boxes were pushed, and others slept


PROGRAM = """
import sys
sys.path.insert(0, {folder!r})
from test_mujoco_simulator import digest
print(digest())
"""


def digest():
    """Hash of the bytes of a drive in each scene."""
    total = hashlib.sha256()
    for world, materials, step, limits in SCENES.values():
        simulator = built(world, materials)
        for command in random_commands(5, 40, *limits):
            trace = simulator.step(command, step)
            total.update(trace.robot_poses.tobytes() + trace.object_poses.tobytes())
        total.update(simulator.save().hidden.tobytes())
    return total.hexdigest()


@pytest.mark.slow
def test_another_process_gives_the_same_bytes():
    here = Path(__file__).parent
    program = PROGRAM.format(folder=str(here))
    found = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(here.parent)!r})\n{program}"],
        capture_output=True,
        text=True,
        check=True,
    )
    simulator = built(SCENES["ground"][0])
    simulator.step(Twist(0.2, 1.0), 0.4)  # other activity in this one
    assert found.stdout.strip() == digest()


def test_a_scene_of_the_same_shapes_is_placed_without_compiling():
    first, second = cluttered(0), cluttered(1)
    simulator = built(first)
    bodies = simulator._scene
    simulator.step(Twist(0.2, 0.0), 0.2)
    simulator.build(second, GROUND)
    assert simulator._scene is bodies
    placed = simulator.object_poses - second.movables.poses
    placed[:, 2] = np.remainder(placed[:, 2] + math.pi, 2 * math.pi) - math.pi
    np.testing.assert_allclose(placed, 0.0, atol=1e-12)
    assert (simulator.world().movables.twists == 0.0).all()
    assert quickest(lambda: simulator.build(first, GROUND)) < 0.005
    trace = simulator.step(Twist(0.2, 0.3), 0.2)
    assert built(first).step(Twist(0.2, 0.3), 0.2) == trace
    simulator.build(cluttered(0, count=5), GROUND)
    assert simulator._scene is not bodies


def test_two_simulators_share_nothing():
    world = cluttered(3)
    one, other = built(world), built(world)
    before = other.save()
    for _ in range(10):
        one.step(Twist(0.2, 0.5), 0.15)
    assert other.save() == before
    assert one._scene.model is not other._scene.model


def test_trace_has_even_samples_and_ends_now():
    simulator = built(cluttered(0))
    simulator.step(Twist(0.1, 0.0), 0.15)
    trace = simulator.step(Twist(0.2, 0.1), 0.2)
    np.testing.assert_allclose(trace.times, 0.15 + 0.025 * np.arange(1, 9))
    world = simulator.world()
    assert world.time == trace.times[-1] == pytest.approx(0.35)
    np.testing.assert_array_equal(trace.robot_poses[-1], simulator.robot_pose)
    np.testing.assert_array_equal(trace.object_poses[-1], simulator.object_poses)
    np.testing.assert_array_equal(world.robot_pose, simulator.robot_pose)
    np.testing.assert_array_equal(world.movables.poses, simulator.object_poses)


def test_robot_is_held_by_a_wall_and_says_so():
    simulator = built(room(pose=(1.2, 0.0, 0.0)))
    touched = []
    for _ in range(10):
        simulator.step(Twist(0.2, 0.0), 0.2)
        touched.append((simulator.touched_static, simulator.robot_pose[0] + FRONT))
    assert [hit for hit, _ in touched] == sorted(hit for hit, _ in touched)
    assert all(front < 1.5 for hit, front in touched if not hit)
    assert touched[-1] == (True, pytest.approx(1.5, abs=0.001))
    assert simulator.held
    simulator.step(Twist(-0.2, 0.0), 0.2)
    simulator.step(Twist(-0.2, 0.0), 0.2)
    assert not simulator.held and not simulator.touched_static


def test_a_box_between_robot_and_wall_holds_the_robot():
    simulator = built(room([(1.3, 0.0, 0.0)], pose=(1.0, 0.0, 0.0)))
    for _ in range(12):
        simulator.step(Twist(0.2, 0.0), 0.2)
    assert simulator.held and not simulator.touched_static
    assert simulator.robot_pose[0] == pytest.approx(1.5 - SIDE - FRONT, abs=0.003)
    simulator.step(Twist(0.0, 0.0), 0.2)
    assert not simulator.held  # nothing is asked of it


def test_removed_objects_are_gone_and_the_others_go_on():
    world = room([(0.2, 0.0, 0.0), (-0.5, 0.5, 0.0), (0.6, 0.6, 0.3)], wheeled=[2])
    simulator, other = built(world), built(world)
    for _ in range(5):
        simulator.step(Twist(0.2, 0.0), 0.2)
        other.step(Twist(0.2, 0.0), 0.2)
    before = simulator.world()
    simulator.remove([1])
    after = simulator.world()
    assert after.movables.ids.tolist() == [0, 2]
    np.testing.assert_array_equal(after.movables.poses, before.movables.poses[[0, 2]])
    np.testing.assert_array_equal(after.movables.twists, before.movables.twists[[0, 2]])
    np.testing.assert_array_equal(after.robot_twist, before.robot_twist)
    simulator.step(Twist(0.2, 0.0), 0.2)
    other.step(Twist(0.2, 0.0), 0.2)
    np.testing.assert_allclose(simulator.object_poses[0], other.object_poses[0], atol=1e-4)
    with pytest.raises(InvalidInputError, match=r"valid ids: \[0, 2\]"):
        simulator.remove([1])
    simulator.remove([0, 2])
    assert simulator.step(Twist(0.2, 0.0), 0.2).object_poses.shape == (8, 0, 3)


def test_follow_drives_the_path_and_reports_the_jam():
    along = np.linspace(0.0, 0.7, 15)
    line = np.stack([along, 0 * along, 0 * along], axis=1)
    simulator = built(room([(0.3, 0.01, 0.0)]))
    found = simulator.follow(line)
    assert found.jammed_at == -1 and found.object_poses.shape == (15, 1, 3)
    np.testing.assert_array_equal(found.object_poses[0], [(0.3, 0.01, 0.0)])
    np.testing.assert_allclose(simulator.robot_pose, line[-1], atol=0.01)
    assert found.object_poses[-1, 0, 0] - 0.5 * SIDE == pytest.approx(0.7 + FRONT, abs=0.01)
    assert found.work == pytest.approx(0.1 * (0.7 + FRONT + 0.5 * SIDE - 0.3), rel=0.05)
    turn = 1.4 * np.linspace(0.0, 1.0, 30)
    arc = np.stack([0.5 * np.sin(turn), 0.5 * (1 - np.cos(turn)), turn], axis=1)
    simulator = built(room())
    assert simulator.follow(arc).jammed_at == -1
    np.testing.assert_allclose(simulator.robot_pose, arc[-1], atol=0.02)
    jam = built(room([(1.2, 0.0, 0.0)], pose=(0.9, 0, 0))).follow(line + np.array([0.9, 0.0, 0.0]))
    assert jam.jammed_at in (9, 10, 11, 12)  # half its radius behind the reference
    assert (jam.object_poses[jam.jammed_at :] == jam.object_poses[-1]).all()


@pytest.mark.parametrize("path", [[], [[0.0, 0.0]], [[0.0, math.nan, 0.0]], "line"])
def test_bad_paths_are_refused(path):
    with pytest.raises(InvalidInputError, match="path"):
        built(room()).follow(path)


def test_what_cannot_be_built_is_refused():
    with pytest.raises(InvalidInputError, match="solids"):
        built(room(), replace(GROUND, solids=None))
    with pytest.raises(InvalidInputError, match="wheel_separation"):
        built(room(robot=turtlebot(wheel_separation=0.0)))
    simulator = MujocoSimulator()
    with pytest.raises(InvalidInputError, match="build"):
        simulator.step(Twist(0.1, 0.0), 0.1)
    with pytest.raises(InvalidInputError, match="build"):
        simulator.world()
    simulator.build(room([(0.3, 0.0, 0.0)]), GROUND)
    for duration in (0.0, -1.0, math.nan, "long"):
        with pytest.raises(InvalidInputError, match="duration"):
            simulator.step(Twist(0.1, 0.0), duration)
    with pytest.raises(InvalidInputError, match="another scene"):
        simulator.restore(built(room()).save())


@pytest.mark.parametrize(
    "changes",
    [{"time_step": 0.0}, {"water_time_step": 2.0}, {"samples": 0}, {"impedance": 1.0}],
)
def test_options_are_checked(changes):
    with pytest.raises(InvalidInputError, match=next(iter(changes))):
        MujocoOptions(**changes)


def test_a_simulation_that_diverges_is_an_error(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    simulator = built(room())
    simulator._scene.qvel[0] = math.nan
    with pytest.raises(PushplanError, match="diverged"):
        simulator.step(Twist(0.1, 0.0), 0.1)
    assert not list(tmp_path.iterdir())  # MuJoCo would write its warnings to a file
    simulator.build(room(), GROUND)
    simulator.step(Twist(0.1, 0.0), 0.1)


def test_a_step_that_the_engine_refuses_is_made_with_all_awake(monkeypatch):
    world = cluttered(0)
    simulator, other = built(world), built(world)
    bodies = simulator._scene
    advance, failed = bodies.advance, []

    def refuse_once(interval):
        if not failed:
            failed.append(1)
            raise mujoco.FatalError("contact involves sleeping geom")
        advance(interval)

    monkeypatch.setattr(bodies, "advance", refuse_once)
    trace = simulator.step(Twist(0.2, 0.0), 0.2)
    expected = other.step(Twist(0.2, 0.0), 0.2)
    np.testing.assert_allclose(trace.robot_poses, expected.robot_poses, atol=1e-3)
    np.testing.assert_allclose(trace.object_poses, expected.object_poses, atol=1e-3)


def test_overlaps_at_the_start_do_not_blow_up():
    boxes = [(0.05, 0.0, 0.0), (0.06, 0.02, 0.4), (1.49, 0.0, 0.0)]
    simulator = built(room(boxes))
    for _ in range(10):
        simulator.step(Twist(0.2, 0.0), 0.2)
    assert np.abs(simulator.object_poses[:, :2]).max() < 1.6


def test_objects_of_any_convex_shape():
    shapes = [floe(0.05, corners) for corners in (3, 4, 6)] + [SQUARE]
    start = room()
    poses = np.array([(0.25, 0.0, 0.2), (0.42, 0.02, 0.0), (0.6, 0.0, 1.0), (0.8, 0.0, 0.0)])
    movables = Movables.from_outlines(
        shapes, poses, masses=[0.1] * 4, wheeled=[False, True, True, False]
    )
    simulator = built(replace(start, movables=movables))
    for _ in range(20):
        simulator.step(Twist(0.2, 0.0), 0.2)
    assert (simulator.object_poses[:, 0] > poses[:, 0] + 0.05).all()


def test_the_maze_runs_on_it():
    env = PushEnv(task="maze", simulator="mujoco", observation="state", variations={"boxes": 3})
    first, _ = env.reset(seed=2)
    actions = [np.array([0.5 * math.sin(i)], dtype=np.float32) for i in range(40)]
    poses = [env.step(action)[0] for action in actions]
    again, _ = env.reset(seed=2)
    np.testing.assert_array_equal(first, again)
    for action, expected in zip(actions, poses, strict=True):
        np.testing.assert_array_equal(env.step(action)[0], expected)


def test_planar_rows_agree_with_the_engine():
    rng = np.random.default_rng(0)
    bodies = rng.normal(size=(4, 3, 7))
    bodies[..., 3:] /= np.linalg.norm(bodies[..., 3:], axis=-1, keepdims=True)
    out = planar_rows(bodies)
    for row, body in zip(out.reshape(-1, 3), bodies.reshape(-1, 7), strict=True):
        matrix = np.empty(9)
        mujoco.mju_quat2Mat(matrix, body[3:])
        assert row[2] == pytest.approx(math.atan2(matrix[3], matrix[0]))
        assert row[:2].tolist() == body[:2].tolist()


def test_drag_damping_agrees_with_the_law():
    rng = np.random.default_rng(0)
    v, drag = rng.normal(size=(5, 3)), rng.uniform(0, 9, (5, 4))
    out = drag_damping(v, drag)
    speed = np.hypot(v[:, 0], v[:, 1])
    np.testing.assert_allclose(out[:, 0], drag[:, 0] + drag[:, 1] * speed)
    np.testing.assert_array_equal(out[:, 0], out[:, 1])
    np.testing.assert_allclose(out[:, 2], drag[:, 2] + drag[:, 3] * np.abs(v[:, 2]))


def test_objects_that_may_touch_sleep_together():
    """0 and 1 touch, 2 is alone, 3 and 4 touch and 4 moves."""
    at = [(0.0, 0.0, 0.0), (0.0802, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.05, 0.06, 0.5)]
    movables = Movables.from_outlines([SQUARE] * 5, at)
    quiet = np.array([True, True, True, True, False])
    shapes = (movables.vertices, movables.offsets, movables.radii)
    asleep = rest_cycles(movables.poses, *shapes, quiet, 0.0005)
    assert asleep.tolist() == [-11, 2, 1, 3, -11, -11]


def test_inertia_of_a_prism():
    sides = np.array([0.3, 0.2])
    corners = 0.5 * sides * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    center, inertia = prism_inertia(corners + np.array([0.5, -0.1]), 0.4, 2.0)
    np.testing.assert_allclose(center, (0.5, -0.1))
    squares = 2.0 / 12.0 * np.array([0.2**2 + 0.4**2, 0.3**2 + 0.4**2, 0.3**2 + 0.2**2])
    np.testing.assert_allclose(inertia, [*squares, 0.0, 0.0, 0.0], atol=1e-15)
    turn = np.array([(math.cos(0.6), math.sin(0.6)), (-math.sin(0.6), math.cos(0.6))])
    _, turned = prism_inertia(corners @ turn, 0.4, 2.0)
    tensor = np.diag(squares[:2])
    expected = turn.T @ tensor @ turn
    np.testing.assert_allclose(turned[[0, 1, 3]], expected[[0, 1, 0], [0, 1, 1]])


def test_every_body_has_its_own_moment_of_inertia_about_the_vertical():
    simulator = built(ice(2), SEA)
    model, world = simulator._scene.model, simulator.world()
    _, inertia = prism_inertia(world.movables.outline(0), 0.0, float(world.movables.masses[0]))
    assert model.dof_M0[5] == pytest.approx(inertia[2])
    ground = built(cluttered(0))._scene.model
    assert ground.body_mass[1:].sum() == pytest.approx(1.07 + 8 * 0.1)


def test_rectangles_are_recognised():
    turn = np.array([(math.cos(0.3), math.sin(0.3)), (-math.sin(0.3), math.cos(0.3))])
    corners = np.array([(-2.0, -1.0), (2.0, -1.0), (2.0, 1.0), (-2.0, 1.0)])
    box = as_rectangle(corners @ turn + np.array([5.0, 6.0]))
    assert box is not None
    np.testing.assert_allclose(box[0], (5.0, 6.0))
    np.testing.assert_allclose(box[1], (2.0, 1.0))
    assert box[2] == pytest.approx(0.3)
    assert as_rectangle(corners * np.array([(1, 1), (1, 1), (0.5, 1), (1, 1)])) is None
    assert as_rectangle(floe(1.0)) is None
