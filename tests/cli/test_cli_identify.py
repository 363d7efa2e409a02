"""``pushplan identify``: from the log of a robot's loop to parameters that the loop takes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pushplan.cli import main
from pushplan.cli.common import load_episode
from pushplan.control import ImmediateExecutor
from pushplan.interaction import ContactParameters, QuasiStatic, find_pushes, identify
from pushplan.perception import Detector, Lidar, WorldEstimate
from pushplan.ros import McapLog
from pushplan.runtime import Runner
from pushplan.world import (
    Episode,
    GoalDisc,
    Movables,
    RobotModel,
    StaticMap,
    Twist,
    World,
)

SQUARE = 0.1 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
PERIOD = 0.1


class Winding:
    """Drives ahead in curves."""

    def reset(self, world: World, rng: np.random.Generator) -> None:
        pass

    def act(self, world: World, observation: object = None) -> Twist:
        return Twist(0.2, 0.6 * np.cos(1.5 * world.time))


def scene() -> World:
    robot = RobotModel.from_outline(
        SQUARE, mass=1.0, drive="differential", max_speed=0.2, max_turn_rate=1.0
    )
    return World(
        robot=robot,
        robot_pose=(0.0, 0.0, 0.0),
        static=StaticMap.build(bounds=(-9.0, -9.0, 9.0, 9.0)),
        movables=Movables.from_outlines([SQUARE], [(0.4, 0.05, 0.2)], ids=[5]),
        goal=GoalDisc((8.0, 8.0), 0.1),
    )


def drive(path: Path, seen: Callable[[World], World] = lambda world: world) -> Path:
    """Record of a `Runner` that pushed a box, which moved as a model says.

    Args:
        path: of the log.
        seen: what is known of a scene.
    """
    model = QuasiStatic(friction=0.5, gyration_scale=1.4)
    world = scene()
    with (
        McapLog(path) as kept,
        Runner(Winding(), period=PERIOD, log=kept, executor=ImmediateExecutor()) as runner,
    ):
        command = runner.start(seen(world))
        for _ in range(120):
            x, y, theta = world.robot_pose
            turn = command.twist.angular * PERIOD
            along = command.twist.linear * PERIOD
            pose = [
                x + along * np.cos(theta + turn / 2),
                y + along * np.sin(theta + turn / 2),
                theta + turn,
            ]
            swept = model.sweep(world, [world.robot_pose, pose]).object_poses[-1]
            world = world.moved(robot_pose=pose, movable_poses=swept, time=world.time + PERIOD)
            runner.update(seen(world))
            command = runner.command(world.time)
    return path


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Record of a robot that was told the scene."""
    return drive(tmp_path_factory.mktemp("log") / "robot.mcap")


@pytest.mark.slow
def test_a_robots_log_gives_parameters_for_the_next_run(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", str(log)]) == 0
    text = capsys.readouterr().out
    assert "pushes, predicted ends miss by" in text
    assert "friction at walls, not observed" in text
    assert main(["identify", str(log), "--objects", "5", "--json"]) == 0
    kept = tmp_path / "contact.json"
    kept.write_text(capsys.readouterr().out)
    found = ContactParameters.load(kept)
    assert found.pushes >= 3
    assert found.gyration_scale == pytest.approx(1.4, rel=0.2)
    assert found.friction == pytest.approx(0.5, abs=0.25)
    with Runner("push-aware", period=PERIOD, contact=found) as runner:
        assert runner.policy.planner.interaction == found.model()


@pytest.mark.slow
def test_pushes_that_a_robot_has_seen_itself_give_them_too(tmp_path: Path) -> None:
    """The box comes into view on the way; nobody has told the robot of it."""
    start = scene()
    noise = 0.001
    lidar = Lidar(range=3.0, noise=noise)
    detector = Detector(range=0.2, position_noise=noise, heading_noise=noise)
    estimate = WorldEstimate(
        start.robot, start.goal, (-2, -2, 4, 4), position_noise=noise, range_noise=noise
    )
    rng = np.random.default_rng(0)
    seen: list[int] = []

    def look(world: World) -> World:
        estimate.add_detections(detector.detect(world, rng))
        estimate.add_scan(lidar.scan(world, rng))
        known = estimate.world(world.robot_pose, world.robot_twist, world.time)
        seen.append(len(known.movables))
        return known

    found = identify(find_pushes(load_episode(str(drive(tmp_path / "robot.mcap", look)))))
    assert seen[0] == 0 and seen[-1] == 1
    assert found.gyration_scale == pytest.approx(1.4, rel=0.1)
    assert found.friction == pytest.approx(0.5, abs=0.1)


def one_line(capsys: pytest.CaptureFixture[str]) -> str:
    text = capsys.readouterr().err
    assert text.startswith("pushplan: ") and text.count("\n") == 1
    return text


def test_a_log_that_cannot_be_used_is_one_line(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", str(log), "--objects", "3"]) == 2
    assert "no object 3, its objects: 5" in one_line(capsys)
    assert main(["identify", str(tmp_path / "none.mcap")]) == 2
    assert "none.mcap" in one_line(capsys)
    world = scene()
    still = Episode(
        world=world,
        times=np.array([0.0, 1.0]),
        robot_poses=np.zeros((2, 3)),
        object_poses=np.array([world.movables.poses] * 2),
        success=False,
        reason="time_limit",
    )
    path = tmp_path / "still.npz"
    still.save(path)
    assert main(["identify", str(path)]) == 2
    assert "holds no push" in one_line(capsys)
    broken = replace(still)
    poses = np.array(still.object_poses)
    poses[1, 0, 0] = np.nan
    object.__setattr__(broken, "object_poses", poses)
    broken.save(path)
    assert main(["identify", str(path)]) == 2
    assert "object_poses must be finite" in one_line(capsys)
