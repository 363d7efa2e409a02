"""Planning in a scene that opens up while the robot drives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pushplan.control import ImmediateExecutor
from pushplan.envs import PushEnv
from pushplan.evaluation import run_episode
from pushplan.perception import Detector, Lidar, WorldEstimate
from pushplan.planners import make_policy
from pushplan.planners.rearrangement.look_around import LookAround
from pushplan.runtime import CommandStatus, Runner
from pushplan.scenarios import Scenario
from pushplan.world import (
    ClearanceArea,
    GoalDisc,
    Movables,
    StaticMap,
    Unseen,
    World,
    save_world,
    turtlebot3_burger,
)

SQUARE = np.array([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])
SEGMENTS = [  # a wall with two doors, and behind the upper one a room without another way out
    (0.0, 0.0, 4.0, 0.0),
    (4.0, 0.0, 4.0, 3.0),
    (4.0, 3.0, 0.0, 3.0),
    (0.0, 3.0, 0.0, 0.0),
    (1.5, 0.0, 1.5, 0.4),
    (1.5, 0.9, 1.5, 2.0),
    (1.5, 2.5, 1.5, 3.0),
    (1.5, 1.5, 2.6, 1.5),
    (2.6, 1.5, 2.6, 3.0),
]


def two_doors(boxes=()) -> World:
    """A room whose upper door is nearer to the goal as long as nobody has looked through it."""
    poses = np.array(boxes, dtype=float).reshape(-1, 3)
    return World(
        turtlebot3_burger(),
        np.array([0.5, 2.0, 0.0]),
        StaticMap.build(segments=SEGMENTS, radii=0.03, bounds=(0.0, 0.0, 4.0, 3.0)),
        Movables.from_outlines([SQUARE] * len(poses), poses),
        GoalDisc(np.array([3.4, 2.4]), 0.15),
    )


def drive(world: World, policy: str, tmp_path, **sensing):
    path = tmp_path / "world.yaml"
    save_world(world, path)
    variations = {"world_file": str(path), "sensing": "lidar", **sensing}
    env = PushEnv(task="room", variations=variations, observation="state")
    return run_episode(env, make_policy(policy), Scenario("room", variations=variations))


@pytest.mark.parametrize(
    "policy",
    [
        "kinodynamic-rrt",
        pytest.param("push-aware", marks=pytest.mark.slow),
        pytest.param("namo", marks=pytest.mark.slow),
    ],
)
def test_a_robot_does_not_waver_between_two_doors(policy, tmp_path):
    episode = drive(two_doors([(1.9, 1.0, 0.3)]), policy, tmp_path)
    assert episode.success, episode.reason
    x, y = episode.robot_poses[:, :2].T
    upper = y[x < 1.5] > 1.45
    assert np.count_nonzero(upper[1:] != upper[:-1]) <= 1  # it has changed its mind once
    length = np.hypot(*np.diff(episode.robot_poses[:, :2], axis=0).T).sum()
    assert length < 8.0  # of the two ways one after the other, 7.3 m


def test_a_runner_drives_with_what_its_sensors_see():
    true = two_doors([(1.2, 0.6, 0.0)])
    belief = WorldEstimate(true.robot, true.goal, true.static.bounds)
    lidar, detector = Lidar(range=3.5), Detector(range=3.5)

    def look(world: World) -> World:
        belief.add_detections(detector.detect(world))
        belief.add_scan(lidar.scan(world))
        return belief.world(world.robot_pose, world.robot_twist, world.time)

    path = [true.robot_pose]
    with Runner("straight", period=0.2) as runner:
        command = runner.start(look(true))
        for step in range(1, 600):
            belief.sent(command.twist)
            turned = path[-1][2] + 0.2 * command.twist.angular
            ahead = 0.2 * command.twist.linear * np.array([np.cos(turned), np.sin(turned)])
            path.append(np.append(path[-1][:2] + ahead, turned))
            true = true.moved(robot_pose=path[-1], time=0.2 * step)
            runner.update(look(true))
            command = runner.command(0.2 * step)
            if command.status is CommandStatus.DONE:
                break
    assert command.status is CommandStatus.DONE and runner.failures == 0
    assert true.goal_reached


def test_an_object_that_nobody_has_seen_is_looked_for(tmp_path):
    """It stands behind a wall; the area is clear as far as the robot sees."""
    around = [(0, 0, 2, 0), (2, 0, 2, 2), (2, 2, 0, 2), (0, 2, 0, 0), (0.9, 0.9, 1.1, 0.9)]
    world = World(
        turtlebot3_burger("pusher"),
        np.array([1.0, 0.4, np.pi / 2]),
        StaticMap.build(segments=np.array(around, dtype=float), radii=0.02, bounds=(0, 0, 2, 2)),
        Movables.from_outlines([0.4 * SQUARE], [[1.0, 1.1, 0.0]]),
        ClearanceArea(
            np.array([(0.4, 0.4), (1.6, 0.4), (1.6, 1.6), (0.4, 1.6)]), np.ones(4, dtype=bool)
        ),
    )
    save_world(world, tmp_path / "world.yaml")
    variations = {"world_file": str(tmp_path / "world.yaml"), "sensing": "objects"}
    env = PushEnv(task="room", variations=variations, observation="state")
    env.reset(seed=0)
    assert len(env.world.movables) == 0 and env.world.completed.all()
    policy = make_policy("greedy")
    policy.reset(env.world, np.random.default_rng(0))
    for _ in range(60):
        env.step(env.encode(policy.act(env.world)))
        if len(env.world.movables):
            break
    assert len(env.world.movables) == 1


def test_an_object_that_cannot_be_moved_does_not_end_the_search(tmp_path):
    """One box stands in view for good, another one behind a wall."""
    around = [(0, 0, 4, 0), (4, 0, 4, 4), (4, 4, 0, 4), (0, 4, 0, 0), (0, 2.2, 3, 2.2)]
    world = World(
        turtlebot3_burger("pusher"),
        np.array([1.5, 0.6, np.pi / 2]),
        StaticMap.build(segments=np.array(around, dtype=float), radii=0.02, bounds=(0, 0, 4, 4)),
        Movables.from_outlines([SQUARE] * 2, [[1.5, 1.2, 0], [1, 3.2, 0]], fixed=[True, False]),
        ClearanceArea(
            np.array([(0.5, 0.5), (3.5, 0.5), (3.5, 3.5), (0.5, 3.5)]), np.ones(4, dtype=bool)
        ),
    )
    save_world(world, tmp_path / "world.yaml")
    variations = {"world_file": str(tmp_path / "world.yaml"), "sensing": "objects"}
    env = PushEnv(task="room", variations=variations, observation="state")
    env.reset(seed=0)
    policy = make_policy("gtsp-mpc")
    policy.reset(env.world, np.random.default_rng(0))
    for _ in range(700):
        env.step(env.encode(policy.act(env.world)))
        if len(env.world.movables) == 2:
            break
    assert len(env.world.movables) == 2 and env.world.movables.fixed[0]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 7])
def test_a_box_is_pushed_out_of_a_door_that_was_seen_before(seed):
    """The map keeps the posts of the door, whatever leans on them."""
    variations = {"layout": "aside", "sensing": "lidar"}
    env = PushEnv(task="namo", variations=variations, observation="state", action="velocity")
    scenario = Scenario("namo", variations=variations, seed=seed)
    episode = run_episode(env, make_policy("namo"), scenario)
    assert episode.success, episode.reason


@pytest.mark.parametrize("policy", ["greedy", "gtsp-mpc"])
def test_an_area_that_is_not_seen_is_not_done(policy):
    """A runner goes on while there may be objects that nobody has seen."""
    area = ClearanceArea(
        np.array([(0.4, 0.4), (1.6, 0.4), (1.6, 1.6), (0.4, 1.6)]), np.ones(4, dtype=bool)
    )
    robot = turtlebot3_burger("pusher")
    world = World(
        robot,
        np.array([1.0, 0.4, np.pi / 2]),
        StaticMap.build(bounds=(0, 0, 2, 2)),
        Movables.empty(),
        area,
        unseen=Unseen(np.ones((20, 20), dtype=bool), 0.1, np.zeros(2)),
    )
    assert not world.goal_reached and replace(world, unseen=None).goal_reached
    seen = Unseen(np.zeros((20, 20), dtype=bool), 0.1, np.zeros(2))
    assert replace(world, unseen=seen).goal_reached
    with Runner(policy, period=0.1) as runner:
        command = runner.start(world)
        for step in range(1, 8):
            runner.update(world.moved(time=0.1 * step))
            command = runner.command(0.1 * step)
        assert command.status is not CommandStatus.DONE


def test_what_is_known_to_be_solid_hides_nothing():
    column = np.array([(0.8, 0.8), (1.2, 0.8), (1.2, 1.2), (0.8, 1.2)])
    cells = np.zeros((40, 40), dtype=bool)
    cells[16:24, 16:24] = True
    world = replace(
        two_doors(),
        static=StaticMap.build(polygons=[column], bounds=(0, 0, 2, 2)),
        unseen=Unseen(cells, 0.05, np.zeros(2)),
    )
    look = LookAround(ImmediateExecutor(), np.random.default_rng(0))
    assert look.command(world) is None
    assert look.command(replace(world, static=StaticMap.build(bounds=(0, 0, 2, 2)), time=9.0))
