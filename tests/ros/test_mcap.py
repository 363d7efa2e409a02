"""Episodes and robots' logs as MCAP files, and back."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import make_boxes, make_u_maze
from mcap.reader import make_reader
from mcap.well_known import MessageEncoding, Profile, SchemaEncoding
from mcap.writer import CompressionType, IndexType, Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from pushplan.cli import main
from pushplan.evaluation import JobSettings, run_episode
from pushplan.metrics import compute
from pushplan.planners import make_policy
from pushplan.ros import McapLog, load_episode, plan_from, save_episode, twist_from
from pushplan.runtime import Command, CommandStatus, Runner
from pushplan.scenarios import Scenario
from pushplan.world import Episode, GoalDisc, InvalidInputError, Plan, SchemaError, Twist, World
from pushplan.world.outline import signed_area


def recorded(task: str) -> Episode:
    navigates = task in ("maze", "ship_ice")
    scenario = Scenario(task=task, simulator="pymunk", preset="benchmark", seed=3)
    policy = make_policy("straight" if navigates else "greedy")
    env = JobSettings().environment(scenario, policy)
    try:
        return run_episode(env, policy, scenario)
    finally:
        env.close()


def same(a: Episode, b: Episode) -> None:
    assert a == b
    assert a.world.time == b.world.time and a.about == b.about
    for key in ("act_times_s", "plan_times_s", "actions", "object_poses", "robot_poses"):
        left, right = getattr(a, key), getattr(b, key)
        assert left.shape == right.shape and left.tobytes() == right.tobytes(), key
    assert compute(a) == compute(b)


@pytest.fixture(scope="module")
def maze() -> Episode:
    return recorded("maze")


@pytest.mark.parametrize(
    "task",
    [
        "maze",
        pytest.param("ship_ice", marks=pytest.mark.slow),
        pytest.param("box_delivery", marks=pytest.mark.slow),
        pytest.param("area_clearing", marks=pytest.mark.slow),
    ],
)
def test_every_metric_of_an_episode_is_that_of_its_mcap_file(tmp_path: Path, task: str) -> None:
    episode, path = recorded(task), tmp_path / "episode.mcap"
    save_episode(episode, path)
    assert len(compute(episode)) > 5 and len(episode.times) > 10
    same(episode, load_episode(path))


def logged(path: Path, worlds: list[World], end: CommandStatus) -> Episode:
    plan = Plan(np.array([0.0, 1.0]), np.zeros((2, 3)), np.ones(2), np.zeros(2), travel_cost=1.0)
    with McapLog(path) as log:
        for world in worlds:
            log.world(world)
            log.world(world)  # the runner may tell it once more
            log.plan(plan, world.time)
            log.command(Command(world.time, Twist(0.1, 0.2), end, plan=plan))
    return load_episode(path)


def test_a_robots_log_is_an_episode(tmp_path: Path) -> None:
    start = make_u_maze([[3, 3, 0], [5, 5, 0.5]])
    few = start.movables.select(np.array([True, False]))
    goal = [*start.goal.center, 0.0]
    worlds = [
        replace(start, movables=few, time=1.0),
        start.moved(movable_poses=[[3, 3.25, 0], [5, 5, 0.5]], time=1.5),
        start.moved(robot_pose=goal, movable_poses=[[3, 4, 0], [6, 5, 0.7]], time=2.0),
        replace(start, movables=few, robot_pose=goal, time=2.5),
    ]
    episode = logged(tmp_path / "log.mcap", worlds, CommandStatus.DRIVING)
    assert episode.times.tolist() == [1.0, 1.5, 2.0, 2.5]
    assert episode.object_poses[:, 1].tolist() == [[5, 5, 0.5]] * 2 + [[6, 5, 0.7]] * 2
    assert episode.object_poses[:, 0, 1].tolist() == [3, 3.25, 4, 3]
    assert episode.actions.tolist() == [[0.1, 0.2]] * 4
    assert episode.success and episode.reason == "goal"
    assert episode.world.movables.ids.tolist() == start.movables.ids.tolist()
    assert compute(episode)["interaction_work_kg_m"] == pytest.approx(3.0)
    short = logged(tmp_path / "short.mcap", worlds[:2], CommandStatus.STALE)
    assert not short.success and short.reason == "stale"


def test_an_object_that_comes_with_another_goal_is_in_the_episode(tmp_path: Path) -> None:
    start = make_u_maze([[3, 3, 0], [5, 5, 0.5]])
    few = replace(start, movables=start.movables.select(np.array([True, False])))
    worlds = [few, replace(start, goal=GoalDisc([4.0, 4.0], 1.0), time=1.0)]
    episode = logged(tmp_path / "log.mcap", worlds, CommandStatus.DRIVING)
    assert episode.object_poses[:, 1].tolist() == [[5, 5, 0.5]] * 2
    assert episode.world.goal == start.goal


def test_an_independent_reader_finds_messages_of_ros(tmp_path: Path) -> None:
    start = make_u_maze([[3, 3, 0]])
    path = tmp_path / "log.mcap"
    moved = start.moved(movable_poses=[[4, 3, 0]], time=1.0)
    logged(
        path,
        [start, moved, replace(moved, movables=make_boxes([]), time=2.0)],
        CommandStatus.DRIVING,
    )
    found: dict[str, list] = {}
    with AnyReader([path]) as reader:
        connections = [c for c in reader.connections if not c.topic.startswith("/pushplan/")]
        for connection, stamp, data in reader.messages(connections=connections):
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((stamp, message))
    assert {topic: len(each) for topic, each in found.items()} == {
        "/tf": 3, "/scene": 1, "/objects": 2, "/plan": 3, "/cmd_vel": 3
    }  # fmt: skip
    assert [stamp for stamp, _ in found["/tf"]] == [0, 10**9, 2 * 10**9]
    frames = {t.child_frame_id: t.transform.translation.x for t in found["/tf"][1][1].transforms}
    assert frames == {"base_link": start.robot_pose[0], "object_0": 4.0}
    assert twist_from(found["/cmd_vel"][0][1]) == Twist(0.1, 0.2)
    assert plan_from(found["/plan"][1][1], start.robot).duration == 1.0
    walls = next(m for m in found["/scene"][0][1].markers if m.ns == "static")
    triangles = np.array([[p.x, p.y] for p in walls.points]).reshape(-1, 3, 2)
    sides = triangles[:, 1:] - triangles[:, :1]
    area = 0.5 * np.abs(np.linalg.det(sides)).sum()
    assert area == pytest.approx(sum(signed_area(part) for part in start.static.convex_parts))
    assert [m.action for m in found["/objects"][1][1].markers] == [2]  # gone


def test_a_file_is_what_foxglove_documents(tmp_path: Path) -> None:
    """What docs.foxglove.dev (3D panel) and mcap.dev (registry of the format) ask for.

    Every message is decoded by the definitions in the file alone, by another decoder than the one
    that wrote them.
    """
    start, path = make_u_maze([[3, 3, 0], [5, 5, 0.5]]), tmp_path / "log.mcap"
    moved = start.moved(movable_poses=[[3, 3.1, 0], [5, 5, 0.6]], time=1.0)
    gone = replace(moved, movables=moved.movables.select(np.array([True, False])), time=2.0)
    logged(path, [start, moved, gone], CommandStatus.DRIVING)
    known_since: dict[str, float] = {"map": 0.0}
    shown: list[tuple[str, float]] = []
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == Profile.ROS2
        summary = reader.get_summary()
        assert summary.chunk_indexes and summary.statistics.channel_count == 9
        for channel in summary.channels.values():
            schema = summary.schemas[channel.schema_id]
            assert channel.message_encoding == MessageEncoding.CDR
            assert schema.encoding == SchemaEncoding.ROS2
        for schema, channel, record, message in reader.iter_decoded_messages():
            if channel.topic.startswith("/pushplan/"):
                continue
            assert schema.name == SCHEMAS[channel.topic]
            inside = getattr(message, "transforms", getattr(message, "markers", [message]))
            for one in inside:
                stamp = one.header.stamp.sec + 1e-9 * one.header.stamp.nanosec
                assert stamp == 1e-9 * record.log_time == 1e-9 * record.publish_time
                if channel.topic == "/tf":
                    assert one.header.frame_id == "map"
                    known_since.setdefault(one.child_frame_id, stamp)
                else:
                    shown.append((one.header.frame_id, stamp))
    assert len(shown) > 8 and {"map", "base_link", "object_0", "object_1"} == set(known_since)
    assert all(known_since[frame] <= stamp for frame, stamp in shown)


SCHEMAS = {
    "/tf": "tf2_msgs/msg/TFMessage",
    "/scene": "visualization_msgs/msg/MarkerArray",
    "/objects": "visualization_msgs/msg/MarkerArray",
    "/plan": "nav_msgs/msg/Path",
    "/cmd_vel": "geometry_msgs/msg/TwistStamped",
}


def test_a_runner_is_logged_and_scored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, world = tmp_path / "log.mcap", make_u_maze()
    with McapLog(path) as log, Runner("straight", period=0.1, log=log) as runner:
        command = runner.start(world)
        for step in range(1, 20):
            pose = world.robot_pose + np.array([0.0, 0.01 * step, 0.0])
            runner.update(world.moved(robot_pose=pose, time=0.1 * step))
            command = runner.command(0.1 * step)
            time.sleep(0.005)
    episode = load_episode(path)
    assert len(episode.times) == 20 == len(episode.actions)
    assert episode.actions[-1].tolist() == [command.twist.linear, command.twist.angular]
    assert main(["score", str(path)]) == 0
    assert (
        f"path_length_m           {compute(episode)['path_length_m']:.6g}"
        in capsys.readouterr().out
    )


def test_a_log_that_cannot_keep_up_drops_and_counts(tmp_path: Path) -> None:
    path, world = tmp_path / "log.mcap", make_u_maze()
    log, disk = McapLog(path, backlog=3), threading.Event()
    write = log._writer.world
    log._writer.world = lambda world: (disk.wait(), write(world))  # a disk that hangs
    log.world(world)
    while log._tasks.qsize():
        time.sleep(0.001)
    began = time.thread_time()
    for step in range(1, 101):
        log.world(world.moved(time=0.1 * step))
    assert log.dropped == 97 and time.thread_time() - began < 0.5
    disk.set()
    log.close()
    episode = load_episode(path)
    np.testing.assert_allclose(episode.times, [0.0, 0.1, 0.2, 0.3], atol=1e-12)
    assert episode.about["dropped"] == 97
    with pytest.raises(InvalidInputError, match="backlog must be at least 1, got 0"):
        McapLog(path, backlog=0)


def test_commands_write_and_score_mcap(
    tmp_path: Path, maze: Episode, capsys: pytest.CaptureFixture[str]
) -> None:
    plain, log, again = (str(tmp_path / name) for name in ("a.npz", "a.mcap", "b.npz"))
    maze.save(plain)
    assert main(["score", plain, "--out", log]) == 0
    before = capsys.readouterr().out.replace(f"{plain}: ", "").replace(f"wrote {log}\n", "")
    assert main(["score", log, "--out", again]) == 0
    assert before == capsys.readouterr().out.replace(f"{log}: ", "").replace(f"wrote {again}\n", "")
    same(maze, Episode.load(again))
    assert main(["score", plain, log, "--out", log]) == 2
    assert "--out writes one episode" in capsys.readouterr().err


@pytest.mark.parametrize(
    "cut",
    [0, 0.5, -1, *(pytest.param(cut, marks=pytest.mark.slow) for cut in (8, 30, 5000, -40))],
)
def test_a_truncated_file_is_one_clear_error(tmp_path: Path, maze: Episode, cut: float) -> None:
    path = tmp_path / "cut.mcap"
    save_episode(maze, path)
    data = path.read_bytes()
    path.write_bytes(data[: int(cut * len(data)) if cut == 0.5 else int(cut)])
    with pytest.raises(SchemaError, match=r"cut\.mcap is not a whole MCAP file") as caught:
        load_episode(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "compression",
    [
        None,
        CompressionType.ZSTD,
        pytest.param(CompressionType.LZ4, marks=pytest.mark.slow),
        pytest.param(CompressionType.NONE, marks=pytest.mark.slow),
    ],
)
def test_a_file_without_a_summary_is_read(
    tmp_path: Path, maze: Episode, compression: CompressionType | None
) -> None:
    path, again = tmp_path / "closed.mcap", tmp_path / "plain.mcap"
    save_episode(maze, path)
    writer = Writer(
        str(again),
        compression=compression or CompressionType.NONE,
        use_chunking=compression is not None,
        chunk_size=20_000,
        index_types=IndexType.NONE,
        use_summary_offsets=False,
        use_statistics=False,
        repeat_channels=False,
        repeat_schemas=False,
    )
    writer.start(profile="ros2", library="another")
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        schemas = {
            one.id: writer.register_schema(one.name, one.encoding, one.data)
            for one in summary.schemas.values()
        }
        channels = {
            one.id: writer.register_channel(
                one.topic, one.message_encoding, schemas[one.schema_id], one.metadata
            )
            for one in summary.channels.values()
        }
        for _, channel, one in reader.iter_messages():
            writer.add_message(channels[channel.id], one.log_time, one.data, one.publish_time)
    writer.finish()
    same(maze, load_episode(again))
    data = again.read_bytes()
    for cut in (len(data) // 2, len(data) - 20):
        again.write_bytes(data[:cut])  # as a recorder leaves it that was killed
        with pytest.raises(SchemaError, match="its recorder was stopped before it could close it"):
            load_episode(again)


def test_a_damaged_file_is_one_clear_error(tmp_path: Path, maze: Episode) -> None:
    path, rng = tmp_path / "bad.mcap", np.random.default_rng(5)
    save_episode(maze, path)
    data, refused = path.read_bytes(), 0
    for _ in range(15):
        damaged = bytearray(data)
        place = int(rng.integers(len(data)))
        damaged[place] ^= 0x55
        path.write_bytes(bytes(damaged))
        try:
            same(maze, load_episode(path))  # where it does not matter
        except SchemaError as error:
            assert "\n" not in str(error)
            refused += 1
    assert refused > 7


def test_another_mcap_file_is_refused_by_its_topics(tmp_path: Path) -> None:
    path = tmp_path / "camera.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("Image", "jsonschema", b"{}")
        channel = writer.register_channel("/camera", "json", schema)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    with pytest.raises(SchemaError, match=r"needs topic /pushplan/world .* found /camera"):
        load_episode(path)
    with pytest.raises(SchemaError, match=r"cannot read .*none\.mcap"):
        load_episode(tmp_path / "none.mcap")
    McapLog(path).close()
    with pytest.raises(SchemaError, match="holds no world"):
        load_episode(path)


def test_bad_input_of_a_log_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="cannot write"):
        McapLog(tmp_path / "none" / "log.mcap")
    log = McapLog(tmp_path / "log.mcap")
    with pytest.raises(InvalidInputError, match="world"):
        log.world("world")
    log.command(Command(-1.0, Twist(0, 0), CommandStatus.DRIVING))
    with pytest.raises(InvalidInputError, match=r"cannot write the log: time must .* got -1"):
        log.close()
    with pytest.raises(InvalidInputError, match="closed"):
        log.world(make_u_maze())
