"""World files as environments, one by one and as suites."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from pushplan.envs import PushEnv
from pushplan.envs.registry import goal_kind
from pushplan.envs.tasks.room import SMALL_ROOM
from pushplan.evaluation import Experiment, bench
from pushplan.scenarios import Scenario, world_suite
from pushplan.world import (
    ClearanceArea,
    Drive,
    GoalDisc,
    GoalLine,
    Receptacle,
    RobotModel,
    ScenarioError,
    SchemaError,
    StaticMap,
    World,
    load_world,
    save_world,
)
from pushplan.world.goals import Goal

ROOM = Path(__file__).parents[2] / "examples" / "room.yaml"


def room(path: Path | None = None, **variations: object) -> PushEnv:
    named = {} if path is None else {"world_file": str(path)}
    return PushEnv(task="room", variations={**named, **variations}, observation="state")


def start(env: PushEnv, seed: int = 0) -> World:
    env.reset(seed=seed)
    return env.world


def test_the_file_says_what_there_is(tmp_path: Path) -> None:
    given = replace(load_world(SMALL_ROOM), time=7.0, margin=0.03)
    save_world(given, tmp_path / "a.yaml")
    world = start(room(tmp_path / "a.yaml"), 5)
    assert world == replace(given, time=0.0)
    assert start(room(tmp_path / "a.yaml", max_speed=0.1)).robot.max_speed == 0.1


@pytest.mark.parametrize("simulator", ["pymunk", "mujoco"])
def test_a_policy_gets_there(simulator: str, tmp_path: Path) -> None:
    shutil.copy(ROOM, tmp_path)
    worlds = world_suite(tmp_path, simulator=simulator, preset="testbed")
    results = bench(list(worlds.scenarios), ["straight"], workers=0)
    assert [row.reason for row in results.rows] == ["goal"]


def bodies(world: World) -> list[shapely.Geometry]:
    objects = [world.movables.outline_world(k) for k in range(len(world.movables))]
    return [shapely.Polygon(one) for one in (*world.robot_outline_world(), *objects)]


def test_a_spread_moves_bodies_a_little_and_never_onto_each_other() -> None:
    spread, plain = 0.3, load_world(SMALL_ROOM)
    env = room(spread=spread)
    starts = [start(env, seed) for seed in range(20)]
    assert start(env, 3) == starts[3] and starts[3] != starts[4]
    column = shapely.Polygon(plain.static.polygons[0])
    for world in starts:
        shapes = bodies(world)
        for i, shape in enumerate(shapes):
            assert not shape.intersects(column)
            assert not any(shape.intersects(other) for other in shapes[:i])
        moved = world.movables.poses - plain.movables.poses
        assert (np.hypot(moved[:, 0], moved[:, 1]) <= spread).all()
        assert (np.abs(moved[:, 2]) * world.movables.radii <= spread + 1e-12).all()


def test_the_reward_is_progress_less_work() -> None:
    env = room()
    world = start(env)
    total = 0.0
    for _ in range(20):
        _, reward, *_, info = env.step(np.array([1.0, 0.0], np.float32))
        total += reward
    assert info["work"] == 0.0 and env.world.robot_pose[0] > world.robot_pose[0] + 0.3
    assert 10.0 < total < 50.0


def test_time_runs_out() -> None:
    env = room(time_limit=0.5)
    start(env)
    ends = [env.step(np.zeros(2, np.float32))[3] for _ in range(5)]
    assert ends == [False, False, False, False, True]


@pytest.mark.parametrize(
    ("goal", "action", "words"),
    [
        (GoalDisc(np.array([0.6, 0.6]), 0.2), "velocity", "starts in the goal"),
        (GoalDisc(np.array([1.5, 1.5]), 0.1), "velocity", "no way leads to the goal"),
        (GoalLine(np.array([1.5, 2.5]), np.array([0.0, 1.0])), "wheels", None),
    ],
)
def test_what_makes_no_sense_is_said(
    tmp_path: Path, goal: GoalDisc, action: str, words: str | None
) -> None:
    save_world(replace(load_world(SMALL_ROOM), goal=goal), tmp_path / "a.yaml")
    options = {"task": "room", "variations": {"world_file": str(tmp_path / "a.yaml")}}
    if words is None:
        env = PushEnv(**options, action=action)
        env.reset(seed=0)
        env.step(np.full(2, 0.5, np.float32))
    else:
        with pytest.raises(ScenarioError, match=words):
            PushEnv(**options, action=action)


def test_a_file_that_is_not_there() -> None:
    with pytest.raises(ScenarioError, match="cannot read world file"):
        room(Path("nothere.yaml"))


SQUARE = np.array([(1.0, 0.0), (3.0, 0.0), (3.0, 1.2), (1.0, 1.2)])


def boxes_ahead(goal: Goal, path: Path) -> PushEnv:
    """The small room without its column and one box ahead of the robot."""
    plain = load_world(SMALL_ROOM)
    static = replace(plain.static, polygons=())
    world = replace(plain, static=static, movables=plain.movables.select([0]), goal=goal)
    save_world(world, path)
    return room(path, idle_limit=30.0)


@pytest.mark.parametrize(
    ("goal", "leaves"),
    [
        (ClearanceArea(np.array([(1, 0.2), (2, 0.2), (2, 1), (1, 1)]), [True] * 4), False),
        (Receptacle(np.array([(2.2, 0), (3, 0), (3, 1.2), (2.2, 1.2)])), True),
    ],
)
def test_objects_have_goals_too(tmp_path: Path, goal: Goal, leaves: bool) -> None:
    env = boxes_ahead(goal, tmp_path / "a.json")
    assert env.task.goal_kind == "objects"
    world = start(env)
    scores, total, over = [], 0.0, False
    while not over and len(scores) < 300:
        _, reward, over, late, info = env.step(np.array([1.0, 0.0], np.float32))
        total += reward
        scores.append(info["completed"].tolist())
        assert not late
    assert info["success"] and info["reason"] == "done" and scores[-1] == [True]
    assert len(env.world.movables) == (0 if leaves else 1) and len(world.movables) == 1
    assert total == pytest.approx(150.0 + 10.0 + 200.0, abs=8.0)


def test_without_progress_it_ends(tmp_path: Path) -> None:
    env = boxes_ahead(Receptacle(SQUARE + np.array((1.2, 1.5))), tmp_path / "a.json")
    start(env)
    while not env.step(np.zeros(2, np.float32))[3]:
        pass
    assert env.world.time == pytest.approx(30.0)


def test_rows_of_rooms_have_the_metrics_of_their_goal(tmp_path: Path) -> None:
    boxes_ahead(Receptacle(SQUARE + np.array((0.0, 1.5))), tmp_path / "a.json")
    variations = {"world_file": str(tmp_path / "a.json"), "time_limit": 1.0}
    results = bench([Scenario("room", variations=variations)], ["greedy"], workers=0)
    good = [row for row in results.rows if row.policy == "greedy"]
    assert "E_manip" in good[0].metrics and "E_nav" not in good[0].metrics
    assert goal_kind("room", variations) == "objects" and goal_kind("room") == "robot"


def test_open_water_ends_at_its_sides(tmp_path: Path) -> None:
    ship = RobotModel.from_outline(
        0.1 * np.array([(1, 0), (-1, 1), (-1, -1)]),
        mass=1.0,
        drive=Drive.CONSTANT_SPEED,
        max_speed=0.5,
        max_turn_rate=1.0,
    )
    world = replace(
        load_world(SMALL_ROOM),
        robot=ship,
        static=StaticMap.build(bounds=(0.0, 0.0, 1.0, 9.0)),
        goal=GoalLine(np.array([0.5, 3.0]), np.array([0.0, 1.0])),
    )
    for theta, reason in ((np.pi / 2, "goal"), (0.0, "left_map")):
        save_world(world.moved(robot_pose=[0.6, 0.6, theta]), tmp_path / "a.json")
        env = room(tmp_path / "a.json")
        start(env)
        over = False
        while not over:
            *_, over, late, info = env.step(np.zeros(2, np.float32))
            assert not late
        assert info["reason"] == reason and info["success"] == (reason == "goal")


class TestSuites:
    @pytest.fixture
    def folder(self, tmp_path: Path) -> Path:
        folder = tmp_path / "rooms"
        folder.mkdir()
        save_world(load_world(SMALL_ROOM), folder / "b.yaml")
        save_world(replace(load_world(SMALL_ROOM), margin=0.05), folder / "a.json")
        (folder / "map.yaml").write_text("image: map.pgm\n")
        (folder / "notes.txt").write_text("no world")
        return folder

    def test_a_folder_is_a_suite(self, folder: Path) -> None:
        found = world_suite(folder, episodes=3, first_seed=7)
        assert found.name == "rooms"
        files = [Path(str(one.variations["world_file"])).name for one in found.scenarios]
        assert files == ["a.json", "b.yaml"] * 3
        assert [one.seed for one in found.scenarios] == [7, 7, 8, 8, 9, 9]
        assert len(world_suite(folder)) == 2

    def test_folders_without_worlds(self, folder: Path) -> None:
        (folder / "a.json").unlink()
        (folder / "b.yaml").unlink()
        with pytest.raises(SchemaError, match="in it says schema: pushplan-world"):
            world_suite(folder)
        with pytest.raises(SchemaError, match="no such file or folder"):
            world_suite(folder / "none")

    def test_in_an_experiment_a_changed_file_is_run_again(
        self, folder: Path, tmp_path: Path
    ) -> None:
        data = {
            "schema": "pushplan-experiment/1",
            "suites": [{"worlds": "rooms", "variations": {"time_limit": 0.4}}],
            "policies": ["straight"],
        }
        ran = []

        def run() -> int:
            experiment = Experiment.from_dict(data, tmp_path)
            experiment.run(
                tmp_path / "out", workers=0, progress=lambda done, total, row: ran.append(row)
            )
            return sum(row is not None for row in ran)

        assert run() == 2
        assert run() == 2
        save_world(replace(load_world(SMALL_ROOM), margin=0.06), folder / "b.yaml")
        assert run() == 3

    def test_unknown_keys_are_named(self, folder: Path) -> None:
        data = {"schema": "pushplan-experiment/1", "policies": ["straight"]}
        for entry, words in (
            ({"worlds": "rooms", "suite": "maze-2d-3"}, "either 'suite'"),
            ({"suite": "maze-2d-3", "simulator": "mujoco"}, "simulator"),
            ({"worlds": "nothere"}, "no such file or folder"),
        ):
            with pytest.raises(SchemaError, match=words):
                Experiment.from_dict({**data, "suites": [entry]}, folder.parent)


def test_bodies_are_spread_on_their_side_of_the_walls(tmp_path: Path) -> None:
    world = load_world(SMALL_ROOM)
    save_world(world, tmp_path / "a.yaml")
    env = room(tmp_path / "a.yaml", spread=1.0)
    low, high = world.static.bounds[:2], world.static.bounds[2:]
    moved = 0
    for seed in range(30):
        after = start(env, seed)
        places = np.vstack([after.robot_pose, after.movables.poses])[:, :2]
        assert (places > low).all() and (places < high).all()
        moved += int(np.abs(after.robot_pose - world.robot_pose).max() > 0.01)
    assert moved > 10


def test_goals_for_objects_that_nothing_can_reach_are_refused(tmp_path: Path) -> None:
    world = load_world(SMALL_ROOM)
    corner = np.array([(0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5)]) + world.static.bounds[:2]
    empty = replace(world, goal=Receptacle(corner), movables=world.movables.select([]))
    save_world(empty, tmp_path / "empty.yaml")
    with pytest.raises(ScenarioError, match="needs an object"):
        room(tmp_path / "empty.yaml")
    polygons = [
        *world.static.polygons,
        corner + np.array([(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)]),
    ]
    shut = replace(world.static, polygons=tuple(polygons))
    save_world(replace(world, goal=Receptacle(corner), static=shut), tmp_path / "shut.yaml")
    with pytest.raises(ScenarioError, match="no way leads to the goal"):
        room(tmp_path / "shut.yaml")
