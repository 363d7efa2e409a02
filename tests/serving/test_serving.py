"""`PolicyServer`: a policy does through the socket what it does in process, for each client."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from served import HELLO, PolicyClient, Raw, ServeError, Still, maze, maze_dict, served

from pushplan.evaluation import JobSettings, run_episode
from pushplan.planners import make_planner, make_policy
from pushplan.scenarios import suite
from pushplan.serving import PROTOCOL, PolicyServer
from pushplan.world import MaxIterations, Twist, WheelSpeeds, World, stream, world_to_dict

STEP = 0.5  # [s]


def next_world(world: World, linear: float, angular: float) -> World:
    """Where the robot, and the box that it drags along, are after a step."""
    x, y, theta = world.robot_pose
    forward = STEP * linear * np.array([np.cos(theta), np.sin(theta), 0.0])
    poses = np.array(world.movables.poses)
    poses[0] += forward
    return replace(
        world,
        robot_pose=[x + forward[0], y + forward[1], theta + STEP * angular],
        robot_twist=[forward[0] / STEP, forward[1] / STEP, angular],
        movables=world.movables.moved_to(poses),
        time=world.time + STEP,
    )


def in_process(name: str, world: World, seed: int, steps: int) -> list[tuple[float, float]]:
    policy, twists = make_policy(name), []
    policy.reset(world, stream(seed, "policy"))
    for _ in range(steps):
        twist = policy.act(world, None)
        assert isinstance(twist, Twist)
        twists.append((twist.linear, twist.angular))
        world = next_world(world, *twists[-1])
    return twists


def through(
    address: str, world: World, seed: int, steps: int, whole: bool = False
) -> list[tuple[float, float]]:
    twists = []
    with PolicyClient(address, timeout=60.0) as client:
        client.reset(world_to_dict(world), seed)
        for _ in range(steps):
            if whole:
                reply = client.act(world=world_to_dict(world))
            else:
                reply = client.act(
                    time=world.time,
                    robot_pose=world.robot_pose.tolist(),
                    robot_twist=world.robot_twist.tolist(),
                    poses=world.movables.poses.tolist(),
                )
            twists.append((reply["twist"]["linear"], reply["twist"]["angular"]))
            world = next_world(world, *twists[-1])
    return twists


@pytest.mark.parametrize(
    ("name", "steps"),
    [
        ("straight", 30),
        ("random", 30),
        pytest.param("kinodynamic-rrt", 60, marks=pytest.mark.slow),
        pytest.param("push-aware", 120, marks=pytest.mark.slow),
    ],
)
def test_the_same_seed_and_worlds_give_the_same_commands_to_the_bit(name, steps, tmp_path):
    world = maze()
    wanted = in_process(name, world, 3, steps)
    with served(name, tmp_path) as server:
        assert through(server.address, world, 3, steps) == wanted
        assert through(server.address, world, 3, steps, whole=True) == wanted
        if name == "random":
            assert through(server.address, world, 4, steps) != wanted


def test_a_served_plan_is_that_of_the_planner_with_the_same_seed(tmp_path):
    world, stop = maze(), MaxIterations(150)
    planned = make_planner("push-aware").plan(world, stop=stop, rng=stream(3, "policy")).plan
    assert planned is not None
    policy = lambda: make_policy("push-aware", stop=stop)  # noqa: E731
    with served(policy, tmp_path) as server, PolicyClient(server.address, 60.0) as client:
        client.reset(world_to_dict(world), 3)
        plan = client.act(world=world_to_dict(world), with_plan=True)["plan"]
    for name in ("times", "poses", "speeds", "turn_rates"):
        assert plan[name] == getattr(planned, name).tolist()


def test_two_clients_at_once_do_what_each_does_alone(tmp_path):
    worlds = [maze(), maze([[5, 12, 0.0]], robot_pose=[11.25, 5.0, 0.0])]
    wanted = [in_process("random", world, seed, 40) for seed, world in enumerate(worlds)]
    with served("random", tmp_path) as server, ThreadPoolExecutor(2) as pool:
        got = pool.map(lambda k: through(server.address, worlds[k], k, 40), range(2))
        assert list(got) == wanted


def test_the_server_says_what_it_serves(tmp_path):
    with served("straight", tmp_path) as server, PolicyClient(server.address, 0.1) as client:
        assert client.server["protocol"] == PROTOCOL and client.server["policy"] == "straight"
        assert client.server["actions"] == ["turn_rate", "velocity", "omnidirectional"]
        assert client.server["goals"] == ["disc", "pose", "line"] and client.server["period"] == 0.1
        assert client.server["limits"]["message_bytes"] == 4_000_000


def test_plans_are_numbered_and_shown_on_demand(tmp_path):
    world = maze()
    with served("straight", tmp_path) as server, PolicyClient(server.address) as client:
        client.reset(world_to_dict(world))
        reply = client.act(world=world_to_dict(world), with_plan=True)
        assert reply["plan_number"] == 1 and reply["plan_age"] == 0.0 and not reply["done"]
        assert reply["plan"]["poses"][0][:2] == world.robot_pose[:2].tolist()
        assert len(reply["plan"]["times"]) == len(reply["plan"]["speeds"])
        reply = client.act(time=1.0, robot_pose=world.robot_pose.tolist())
        assert reply["plan_age"] == 1.0 and "plan" not in reply
        assert client.act(time=2.0, robot_pose=[3.75, 3.75, 0.0])["done"]


def test_messages_say_only_what_has_changed(tmp_path):
    seen: list[World] = []

    class Looks(Still):
        def act(self, world, observation):
            seen.append(world)
            return Twist(0.0, 0.0)

    world = maze()
    with served(Looks, tmp_path) as server, PolicyClient(server.address) as client:
        robot = world_to_dict(world)["robot"]
        client.reset(world_to_dict(world))
        seen.clear()
        client.act(time=1.0, robot_pose=[1, 2, 0.5])
        client.act(time=2.0, robot_pose=[1, 2, 0.5], ids=[1], poses=[[5, 5, 0]], twists=[[1, 0, 0]])
        added = {"id": 9, "outline": [[-1, -1], [1, -1], [0, 2]], "pose": [9, 9, 0], "mass": 2}
        client.act(time=3.0, robot_pose=[1, 2, 0.5], ids=[0], poses=[[4, 4, 0]], added=[added])
        client.act(
            time=4.0,
            robot_pose=[1, 2, 0.5],
            ids=[9, 0, 1],
            poses=[[1, 1, 0], [2, 1, 0], [3, 1, 0]],
        )
        client.act(time=5.0, robot_pose=[1, 2, 0.5], ids=[], poses=[])
    assert seen[0] == world.moved(robot_pose=[1, 2, 0.5], robot_twist=[0, 0, 0], time=1.0)
    assert [one.movables.ids.tolist() for one in seen[1:]] == [[1], [0, 9], [9, 0, 1], []]
    assert seen[1].movables.twists.tolist() == [[1, 0, 0]]
    assert seen[2].movables.masses[1] == 2.0 and seen[3].movables.poses[0].tolist() == [1, 1, 0]
    assert all(one.static is seen[0].static for one in seen)
    with served(Looks, tmp_path) as server, PolicyClient(server.address, robot=robot) as client:
        short = {**world_to_dict(world), "robot": {"pose": robot["pose"]}}
        client.reset(short)
        client.act(time=0.0, robot_pose=robot["pose"])
    assert seen[-1] == world


def test_wheel_speeds_come_as_they_are(tmp_path):
    class Wheels(Still):
        actions = ("wheels",)
        does = staticmethod(lambda: WheelSpeeds(0.1, 0.3))

    robot = replace(maze().robot, wheel_separation=0.5)
    with served(Wheels, tmp_path) as server, PolicyClient(server.address) as client:
        client.reset(maze_dict())
        reply = client.act(world=maze_dict())
        assert reply["wheels"] == {"left": 0.1, "right": 0.3} and reply["twist"] is None
        reply = client.act(world=world_to_dict(maze(robot=robot)))
        assert reply["twist"] == {"linear": 0.2, "angular": pytest.approx(0.4)}


def test_a_robots_loop_is_driven_beside_planning(tmp_path):
    world = maze()
    with served("straight", tmp_path) as server:
        with PolicyClient(server.address, 0.1, {"max_age": 0.3}) as client:
            first = client.start(world_to_dict(world))
            assert first["type"] == "command" and first["status"] in ("waiting", "driving")
            reply: dict[str, Any] = {}
            end = time.monotonic() + 120.0
            now = 0.0
            while reply.get("status") != "driving" and time.monotonic() < end:
                now += 0.1
                assert client.update(time=now, robot_pose=world.robot_pose.tolist())["taken"]
                reply = client.command(now, with_plan=True)
                time.sleep(0.01)
            assert reply["status"] == "driving" and reply["plan_number"] >= 1
            assert reply["plan"]["poses"] and reply["world_age"] == 0.0
            assert not client.update(time=now, robot_pose=[1, 1, 0])["taken"]
            reply = client.command(now + 0.5)
            assert reply["status"] == "stale" and "0.5 s old" in reply["reason"] and reply["late"]
            client.cancel("somebody is in the way")
            reply = client.command(now + 0.6)
            assert reply["status"] == "cancelled" and reply["reason"] == "somebody is in the way"
            assert client.start(world_to_dict(world))["status"] in ("waiting", "driving")
            client.reset(world_to_dict(world))  # the other kind
            assert client.act(time=0.0, robot_pose=world.robot_pose.tolist())["type"] == "action"


def test_what_a_policy_raises_is_an_error_for_its_client_alone(tmp_path):
    class Fails(Still):
        def act(self, world, observation):
            if world.time == 1.0:
                raise SystemExit("the map\x1b[2J is upside down")
            if world.time == 2.0:
                return "full speed"
            return Twist(0.0, 0.0)

    with served(Fails, tmp_path) as server, PolicyClient(server.address) as client:
        client.reset(maze_dict())
        with pytest.raises(ServeError, match=r"Fails failed: SystemExit: the map\\x1b\[2J is"):
            client.act(time=1.0, robot_pose=[1, 1, 0])
        with pytest.raises(ServeError, match="got str"):
            client.act(time=2.0, robot_pose=[1, 1, 0])
        assert client.act(time=3.0, robot_pose=[1, 1, 0])["twist"]["linear"] == 0.0


def test_requests_may_be_sent_ahead(tmp_path):
    with served("straight", tmp_path) as server, Raw(server) as raw:
        raw.send(HELLO)
        raw.send({"type": "reset", "world": maze_dict()})
        for k in range(50):
            raw.send({"type": "act", "time": 0.1 * k, "robot_pose": [11.25, 3.75, 1.57]})
        raw.send({"type": "close"})
        replies = [raw.receive() for _ in range(54)]
    kinds = [reply["type"] if reply else None for reply in replies]
    assert kinds == ["hello", "reset", *["action"] * 50, "closed", None]


def test_over_tcp_on_this_machine():
    with PolicyServer("straight", "tcp:127.0.0.1:0") as server:
        assert not server.address.endswith(":0")
        assert through(server.address, maze(), 0, 5) == in_process("straight", maze(), 0, 5)
    with pytest.raises(ConnectionRefusedError):
        PolicyClient(server.address)


def test_a_server_can_start_again_after_its_end(tmp_path):
    server = PolicyServer("straight", f"unix:{tmp_path / 's'}")
    for _ in range(2):
        server.start()
        assert through(server.address, maze(), 0, 2)
        assert server.close() and server.close()


@pytest.mark.parametrize(
    ("suite_name", "policy"),
    [
        ("maze-2d-3", "straight"),
        pytest.param("area-clearing-2d-10", "gtsp-mpc", marks=pytest.mark.slow),
        pytest.param("maze-3d-3", "push-aware", marks=pytest.mark.slow),
    ],
)
def test_an_episode_through_the_server_is_that_of_a_batch_to_the_bit(suite_name, policy, tmp_path):
    scenario = suite(suite_name, episodes=1, first_seed=5).scenarios[0]
    env = JobSettings().environment(scenario, make_policy(policy))
    wanted = run_episode(env, make_policy(policy), scenario)
    with served(policy, tmp_path) as server, PolicyClient(server.address) as client:
        env.reset(seed=scenario.seed)
        client.reset(world_to_dict(env.world), scenario.seed)
        actions, over = [], False
        while not over:
            world = env.world
            reply = client.act(
                time=world.time,
                robot_pose=world.robot_pose.tolist(),
                robot_twist=world.robot_twist.tolist(),
                ids=world.movables.ids.tolist(),
                poses=world.movables.poses.tolist(),
                twists=world.movables.twists.tolist(),
            )
            actions.append(env.encode(Twist(**reply["twist"])))
            *_, terminated, truncated, _ = env.step(actions[-1])
            over = terminated or truncated
    assert np.array_equal(np.array(actions), wanted.actions)
    assert env.world.time == wanted.times[-1]
    env.close()
