import math
from dataclasses import replace

import numpy as np
import pytest
from pushing_scenes import make_simulator, make_world, run

from pushplan.envs import PushEnv
from pushplan.evaluation import push_figure
from pushplan.planners.pushing import (
    ExecutorConfig,
    PushExecutor,
    PushingConfig,
    PushParameters,
    PushPath,
    PushPhase,
    PushTask,
    find_approach,
    push_log,
)
from pushplan.world import (
    Episode,
    InvalidInputError,
    Movables,
    Twist,
    area_clearing_robot,
    box_delivery_robot,
    turtlebot3_burger,
)

AREA = area_clearing_robot()
PERIOD = 0.2
CONFIG = ExecutorConfig(mpc=PushingConfig(period=PERIOD))


def carry_out(world, task, *, friction=0.0, steps=900, config=CONFIG, shove=None, **options):
    """Run a task to its end; the executor, the phases it went through, and the episode."""
    executor, phases = PushExecutor(config), []
    simulator = make_simulator(options.pop("name", "pymunk"), world, friction)

    def command(seen):
        twist = executor.command(seen, task)
        phase = executor.status.phase
        if not phases or phases[-1] is not phase:
            phases.append(phase)
        assert abs(twist.linear) <= world.robot.max_speed
        assert abs(twist.angular) <= world.robot.max_turn_rate
        if shove is not None and shove(executor, simulator):
            state = simulator.save()
            poses = state.object_poses.copy()
            poses[0, :2] += shove.by
            simulator.restore(replace(state, object_poses=poses))
        return None if phase.is_over else twist

    episode = run(simulator, command, PERIOD, steps, **options)
    return executor, phases, episode


def test_it_gets_behind_a_box_and_pushes_it():
    world = make_world(AREA, [3.0, 2.0, 0.0], [[0.0, 0.0, 0.4]])
    path = PushPath.arcs([0.0, 0.0, 0.0], [(2.0, 0.0), (3.0, 0.25)])
    executor, phases, episode = carry_out(world, PushTask(0, path))
    assert phases == [PushPhase.APPROACH, PushPhase.PUSH, PushPhase.DONE]
    status = executor.status
    assert (status.reason, status.attempts) == ("end", 1)
    assert episode.object_poses[-1, 0, :2] == pytest.approx(path.poses[-1, :2], abs=0.15)
    # when it is done it stands, and the same task is not begun again
    later = episode.world_at(-1).moved(time=999.0)
    assert executor.command(later, PushTask(0, path)) == Twist(0.0, 0.0)
    back = PushTask(0, PushPath.straight(path.poses[-1, :2], (0.0, 0.0)))
    assert executor.command(later.moved(time=999.2), back) != Twist(0.0, 0.0)
    # the same worlds, the same commands
    again = carry_out(world, PushTask(0, path))[2]
    assert np.array_equal(again.robot_poses, episode.robot_poses)


class Shove:
    """Moves the box aside once, in the middle of a push."""

    def __init__(self, by, after=0.3):
        self.by, self.after, self.done = np.array(by), after, False

    def __call__(self, executor, simulator):
        begun = executor.status.phase is PushPhase.PUSH and executor.mpc.along > self.after
        if self.done or not begun:
            return False
        self.done = True
        return True


def test_it_begins_again_after_a_loss():
    world = make_world(AREA, [-3.0, 0.0, 0.0], [[0.0, 0.0, 0.0]])
    path = PushPath.straight((0.0, 0.0), (5.0, 0.0))
    executor, phases, episode = carry_out(
        world, PushTask(0, path), shove=Shove((0.4, 1.6)), steps=1500
    )
    assert PushPhase.RECOVER in phases and phases[-1] is PushPhase.DONE
    assert executor.status.reason == "end"
    assert np.hypot(*(episode.object_poses[-1, 0, :2] - [5.0, 0.0])) < 0.3


def test_noise_delay_and_mujoco():
    robot = turtlebot3_burger("pusher", max_speed=0.2, max_turn_rate=0.785)
    world = make_world(robot, [-0.3, -0.3, 1.0], [[0.0, 0.0, 0.5]], 0.08, mass=0.075)
    path = PushPath.arcs([0.0, 0.0, 0.0], [(0.3, 0.0), (0.4, 1.0)])
    mpc = PushingConfig(
        parameters=PushParameters(0.15), period=PERIOD, delay=0.1, observer_gain=0.3, clearance=0.1
    )
    executor, _, episode = carry_out(
        world,
        PushTask(0, path, tolerance=0.01),
        friction=0.4,
        config=ExecutorConfig(mpc=mpc),
        noise=np.random.default_rng(0),
        delay=0.1,
        name="mujoco",
    )
    assert executor.status.phase is PushPhase.DONE and executor.status.attempts <= 2
    end = episode.object_poses[-1, 0, :2]
    assert np.hypot(*(end - path.poses[-1, :2])) < 0.04


def test_two_boxes_at_once():
    robot = box_delivery_robot()
    world = make_world(robot, [-2.0, 0.0, 0.0], [[0.0, 0.23, 0.0], [0.0, -0.23, 0.0]], 0.44)
    path = PushPath.straight((0.0, 0.23), (3.0, 0.23))
    executor, _, episode = carry_out(world, PushTask(0, path))
    assert executor.status.phase is PushPhase.DONE
    assert episode.object_poses[-1, 0, 0] > 2.9
    # both are taken where the path is that of the pair's left one and the robot stands between
    moved = episode.object_poses[-1, 1, 0] - episode.object_poses[0, 1, 0]
    assert moved > 0.0


def test_static_things_are_not_touched():
    wall = [(2.0, -4.0), (2.5, -4.0), (2.5, 4.0), (2.0, 4.0)]
    world = make_world(AREA, [-4.0, 1.0, 0.0], [[-1.0, 0.0, 0.2]], walls=(wall,))
    task = PushTask(0, PushPath.straight((-1.0, 0.0), (4.0, 0.0)))
    executor, phases, episode = carry_out(world, task, steps=1200)
    assert phases[-1] is PushPhase.FAILED and executor.status.reason == "blocked"
    assert episode.about["touched"] == 0
    assert episode.object_poses[:, 0, 0].max() < 1.5 + 1e-6


def test_boxes_that_cannot_be_got_at():
    wall = [(-1.5, -4.0), (-0.55, -4.0), (-0.55, 4.0), (-1.5, 4.0)]
    world = make_world(AREA, [4.0, 0.0, 0.0], [[0.0, 0.0, 0.0]], walls=(wall,))
    path = PushPath.straight((0.0, 0.0), (3.0, 0.0))
    executor, phases, _ = carry_out(world, PushTask(0, path))
    assert phases == [PushPhase.FAILED] and executor.status.reason == "no_approach"
    assert find_approach(world, 0, path, PushParameters(), 0.1) is None
    # along the wall it can be pushed, by the bumper's end
    along = PushPath.straight((0.0, 0.0), (0.0, 3.0))
    assert find_approach(world, 0, along, PushParameters(), 0.1).offset > 0.6
    executor, phases, episode = carry_out(world, PushTask(0, along))
    assert phases == [PushPhase.APPROACH, PushPhase.PUSH, PushPhase.DONE]
    assert episode.object_poses[-1, 0] == pytest.approx([0.0, 3.0, 0.0], abs=0.05)
    assert episode.about["touched"] == 0


def test_ways_around_other_boxes_come_first():
    boxes = [[0.0, 0.0, 0.0], [-5.0, 0.0, 0.0], [-2.0, 3.5, 0.0]]
    world = make_world(AREA, [-8.0, 0.0, 0.0], boxes)
    path = PushPath.straight((0.0, 0.0), (4.0, 0.0))
    _, phases, episode = carry_out(world, PushTask(0, path))
    assert phases[-1] is PushPhase.DONE
    assert np.abs(episode.object_poses[-1, 1:] - np.array(boxes)[1:]).max() < 1e-6


def test_a_box_that_has_gone():
    world = make_world(AREA, [-3.0, 0.0, 0.0], [[0.0, 0.0, 0.0]])
    task = PushTask(0, PushPath.straight((0.0, 0.0), (5.0, 0.0)))
    executor = PushExecutor(CONFIG)
    assert executor.command(world, task).linear > 0.0
    gone = replace(world, movables=Movables.empty(), time=0.2)
    assert executor.command(gone, task) == Twist(0.0, 0.0)
    assert executor.status.phase is PushPhase.DONE and executor.status.reason == "gone"


def test_in_an_environment_by_velocities():
    env = PushEnv(
        task="area_clearing", preset="testbed", action="velocity", observation="state", seed=1000
    )
    env.reset()
    world = env.world
    nearest = int(np.argmin(np.hypot(*(world.movables.poses[:, :2] - world.robot_pose[:2]).T)))
    box = world.movables.poses[nearest, :2]
    outward = PushPath.straight(box, (float(box[0]), -0.5))
    config = ExecutorConfig(mpc=PushingConfig(parameters=PushParameters(0.4), period=PERIOD))
    executor = PushExecutor(config)
    task = PushTask(int(world.movables.ids[nearest]), outward)
    for _ in range(400):
        *_, info = env.step(env.encode(executor.command(env.world, task)))
        if executor.status.phase.is_over:
            break
    assert executor.status.reason == "end" and info["completed"][nearest]


def test_what_makes_no_sense_is_refused():
    path = PushPath.straight((0.0, 0.0), (5.0, 0.0))
    world = make_world(AREA, [-3.0, 0.0, 0.0], [[0.0, 0.0, 0.0]])
    with pytest.raises(InvalidInputError, match="PushTask"):
        PushExecutor().command(world, path)
    with pytest.raises(InvalidInputError, match="PushPath"):
        PushTask(0, [(0, 0), (1, 1)])
    for changes in ({"tolerance": math.nan}, {"speed": 0.0}):
        with pytest.raises(InvalidInputError):
            PushTask(0, path, **changes)
    for changes in ({"attempts": 0}, {"slack": -1.0}, {"mpc": None}, {"patience": math.inf}):
        with pytest.raises(InvalidInputError):
            ExecutorConfig(**changes)
    car = replace(world, robot=area_clearing_robot("constant_speed"))
    with pytest.raises(InvalidInputError, match="differential"):
        PushExecutor().command(car, PushTask(0, path))


@pytest.mark.parametrize(
    "box", [(-3.0, 0.0, 0.0), (1e4, 0.0, 0.0), (59.9, 59.9, 0.0), (0.3, -2.0, 0.0)]
)
def test_hostile_scenes_get_a_command(box):
    wall = [(0.0, -4.0), (0.5, -4.0), (0.5, 4.0), (0.0, 4.0)]
    world = make_world(AREA, [-3.0, 0.0, 0.0], [box], walls=(wall,))
    executor, task = PushExecutor(CONFIG), PushTask(0, PushPath.straight(box[:2], (5.0, 5.0)))
    for i in range(30):
        assert isinstance(executor.command(world, task), Twist)
        world = world.moved(time=PERIOD * (i + 1))  # a robot that does not get anywhere


def test_pictures_of_a_push():
    world = make_world(AREA, [-3.0, 0.3, 0.0], [[0.0, 0.0, 0.3]])
    path = PushPath.arcs([0.0, 0.0, 0.0], [(1.0, 0.0), (2.0, 0.3)])
    _, _, episode = carry_out(world, PushTask(0, path), friction=0.3)
    log = push_log(episode, 0, PushParameters(0.3), path)
    assert 0.2 < log.touching.mean() < 0.9
    assert np.abs(log.offset[log.touching]).max() < 1.0
    assert np.nanmax(np.abs(log.lateral)) < 0.3 and log.margin.max() > 0.9
    figure = push_figure({"a push": log})
    assert len(figure.axes) == 4
    figure = push_figure(push_log(episode, 0))
    assert len(figure.axes) == 3
    with pytest.raises(InvalidInputError, match="box_id 7"):
        push_log(episode, 7)
    with pytest.raises(InvalidInputError, match="PushLog"):
        push_figure({})
    assert isinstance(episode, Episode)
