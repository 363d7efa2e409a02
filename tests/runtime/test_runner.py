"""`Runner`: commands that keep the robot's limits, whatever comes in and whatever planning does."""

from __future__ import annotations

import gc
import json
import math
import subprocess
import sys
import threading
import time
import weakref
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_boxes, make_robot, make_u_maze
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.geometry.transforms import arc_step
from pushplan.planners import make_planner
from pushplan.runtime import CommandStatus, Runner
from pushplan.world import (
    Deadline,
    Drive,
    InvalidInputError,
    StaticMap,
    Twist,
    UnknownNameError,
    World,
)

PERIOD = 0.05
STILL = Twist(0.0, 0.0)
ROBOT = make_robot(
    drive=Drive.DIFFERENTIAL,
    max_speed=0.5,
    min_speed=-0.3,
    max_turn_rate=1.0,
    max_acceleration=0.6,
    max_turn_acceleration=2.0,
)


def maze(boxes=(), **changes: object) -> World:
    return make_u_maze(boxes, robot=ROBOT, **changes)


def later(world: World, twist, period: float = PERIOD) -> World:
    """Where the robot is after it has driven a twist for a period."""
    pose = np.empty(3)
    arc_step(np.array(world.robot_pose), twist.linear * period, twist.angular * period, pose)
    velocity = [
        twist.linear * math.cos(pose[2]),
        twist.linear * math.sin(pose[2]),
        twist.angular,
    ]
    return world.moved(robot_pose=pose, robot_twist=velocity, time=world.time + period)


def in_robots_loop() -> bool:
    return threading.current_thread() is threading.main_thread()


def until(condition, limit: float = 20.0) -> None:
    """Wait for another thread."""
    end = time.monotonic() + limit
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.001)


def drive(runner: Runner, world: World, steps: int, *, wait: bool = True):
    """Close the loop for some steps; the last world and all commands."""
    commands = []
    for _ in range(steps):
        if wait:  # as if the robot were slow: planning is done by its next step
            until(lambda: not runner._executor.running_s)
        runner.update(world)
        commands.append(runner.command(world.time))
        world = later(world, commands[-1].twist)
    return world, commands


class Straight:
    """The planner `straight`, which does on the way what a test tells it to."""

    def __init__(self) -> None:
        self.planner = make_planner("straight")
        self.calls = 0
        self.does = lambda: None

    def plan(self, world, *, stop=None, rng=None):
        self.calls += 1
        self.does()
        return self.planner.plan(world, stop=stop, rng=rng)


def test_a_planner_by_name_brings_the_robot_to_its_goal_past_boxes():
    world = maze([[11, 9, 0.3], [7, 12.5, 0.0]])
    with Runner("push-aware", period=PERIOD, plan_stop=Deadline(5.0)) as runner:
        runner.start(world)
        world = replace(world, time=PERIOD)
        for _ in range(2000):
            world, commands = drive(runner, world, 1)
            if commands[-1].status is CommandStatus.DONE:
                break
    assert world.goal.distance(*world.robot_pose[:2]) == 0.0
    assert runner.failures == 0
    assert commands[-1].plan is not None


def test_a_class_in_place_of_an_object_is_refused():
    with pytest.raises(InvalidInputError, match="must be an object, got the class Straight"):
        Runner(Straight, period=PERIOD)


def test_a_planner_that_raises_stops_the_robot_with_a_reason_and_is_asked_again():
    planner = Straight()
    world = maze()

    def fail():
        raise ValueError("the map is upside down")

    planner.does = fail
    with Runner(planner, period=PERIOD) as runner:
        runner.start(world)
        world, commands = drive(runner, later(world, STILL), 3)
        assert commands[-1].status is CommandStatus.FAILED
        assert "the map is upside down" in commands[-1].reason
        assert commands[-1].twist.linear == 0.0
        planner.does = lambda: None
        world, commands = drive(runner, world, 20)
    assert commands[-1].status is CommandStatus.DRIVING
    assert commands[-1].twist.linear > 0.0
    assert runner.failures >= 1


def test_a_call_that_fails_keeps_nothing_of_its_worlds():
    """Else memory grows with each failure until the garbage collector comes round."""
    kept = []

    class Fails(Straight):
        def plan(self, world, *, stop=None, rng=None):
            kept.append(weakref.ref(world))
            raise ValueError("no")

    world = maze()
    with Runner(Fails(), period=PERIOD) as runner:
        gc.disable()
        try:
            runner.start(world)
            drive(runner, later(world, STILL), 60)
            assert len(kept) > 3
            assert sum(ref() is not None for ref in kept) <= 2
        finally:
            gc.enable()


@pytest.mark.parametrize("death", [SystemExit, KeyboardInterrupt, MemoryError])
def test_a_planning_thread_that_dies_midway_is_survived(death):
    planner = Straight()
    world = maze()
    with Runner(planner, period=PERIOD) as runner:
        runner.start(world)
        world, commands = drive(runner, later(world, STILL), 40)
        assert commands[-1].twist.linear > 0.0

        def die():
            planner.does = lambda: None
            raise death

        planner.does, calls = die, planner.calls
        # off the plan: it has to plan anew
        world = world.moved(robot_pose=world.robot_pose + np.array([1.5, 0.0, 0.0]))
        statuses = []
        for _ in range(60):
            world, commands = drive(runner, world, 1)
            statuses.append(commands[-1].status)
    assert planner.calls > calls + 1
    assert runner.failures == 1
    assert CommandStatus.FAILED in statuses
    assert statuses[-1] is CommandStatus.DRIVING


def test_a_planner_that_overruns_stops_the_robot_until_it_returns():
    planner = Straight()
    held = threading.Event()
    now = [0.0]
    world = maze()
    with Runner(planner, period=PERIOD, plan_stop=Deadline(0.1), clock=lambda: now[0]) as runner:
        planner.does = lambda: in_robots_loop() or held.wait(20.0)
        runner.start(world)
        now[0] = 0.5
        world, (command,) = drive(runner, later(world, STILL), 1, wait=False)
        assert command.status is CommandStatus.WAITING
        now[0] = 0.8
        world, (command,) = drive(runner, world, 1, wait=False)
        assert command.status is CommandStatus.FAILED
        assert "0.8 s" in command.reason and "0.1 s" in command.reason
        held.set()
        world, commands = drive(runner, world, 20)
    assert commands[-1].status is CommandStatus.DRIVING


def test_equal_and_older_worlds_are_counted_and_change_nothing():
    world = maze()
    with Runner(Straight(), period=PERIOD) as runner:
        runner.start(world)
        world, commands = drive(runner, later(world, STILL), 60)
        driven = commands[-1].twist.linear
        assert driven > 0.2
        for n in range(20):  # perception at half the rate of the loop
            if n % 2 == 0:
                seen = world
                assert runner.update(seen)
            assert not runner.update(seen)
            assert not runner.update(seen.moved(time=seen.time - 1.0))
            command = runner.command(world.time)
            assert command is runner.command(world.time)
            assert command.status is CommandStatus.DRIVING
            world = later(world, command.twist)
    assert runner.ignored == 40
    assert command.twist.linear > 0.2


def test_a_world_that_grows_old_stops_the_robot_within_its_acceleration():
    world = maze()
    with Runner(Straight(), period=PERIOD, max_age=0.3) as runner:
        runner.start(world)
        world, commands = drive(runner, later(world, STILL), 60)
        runner.update(world)
        speed, now = commands[-1].twist.linear, world.time
        seen = []
        for n in range(1, 40):
            command = runner.command(now + n * PERIOD)
            seen.append((command.world_age > 0.3 + 1e-9, command.status, command.twist.linear))
    assert all((status is CommandStatus.STALE) == old for old, status, _ in seen)
    speeds = np.array([speed, *(linear for *_, linear in seen)])
    assert np.abs(np.diff(speeds)).max() <= 0.6 * PERIOD + 1e-12
    assert speeds[-1] == 0.0


def test_a_robot_that_is_to_continue_drives_on_blindly_for_a_minute_at_most():
    world = maze()
    with Runner(Straight(), period=PERIOD, max_age=0.3, on_stale="continue") as runner:
        runner.start(world)
        world, _ = drive(runner, later(world, STILL), 20)
        runner.update(world)
        assert runner.command(world.time + 1.0).status is CommandStatus.DRIVING
        assert runner.command(world.time + 1e6).status is CommandStatus.STALE


def test_cancel_from_another_thread_brakes_and_start_begins_anew():
    world, before = maze(), set(threading.enumerate())
    with Runner(Straight(), period=PERIOD) as runner:
        runner.start(world)
        world, _ = drive(runner, later(world, STILL), 60)
        thread = threading.Thread(target=runner.cancel, args=("a person is in the way",))
        thread.start()
        thread.join()
        world, commands = drive(runner, world, 40)
        assert {one.status for one in commands} == {CommandStatus.CANCELLED}
        assert commands[0].reason == "a person is in the way"
        assert commands[0].twist.linear > 0.0 == commands[-1].twist.linear
        runner.start(world)
        world, commands = drive(runner, later(world, STILL), 40)
        assert commands[-1].status is CommandStatus.DRIVING
    assert runner.close()
    assert set(threading.enumerate()) <= before


def test_a_log_that_raises_is_left_alone_and_nothing_else_is():
    class Log:
        def __init__(self):
            self.seen = []

        def world(self, world):
            self.seen.append("world")

        def plan(self, plan, time):
            self.seen.append("plan")

        def command(self, command):
            self.seen.append("command")
            if len(self.seen) > 10:
                raise OSError("disk full")

    log, world = Log(), maze()
    with Runner(Straight(), period=PERIOD, log=log) as runner:
        runner.start(world)
        with pytest.warns(RuntimeWarning, match="disk full"):
            _, commands = drive(runner, later(world, STILL), 40)
    assert {"world", "plan", "command"} == set(log.seen)
    assert len(log.seen) <= 12
    assert commands[-1].status is CommandStatus.DRIVING


STEPS = st.tuples(
    st.sampled_from(["drive", "skip", "jump", "repeat", "back", "fail", "turn"]),
    st.floats(0.005, 0.4),
)


@settings(max_examples=10)
@given(st.lists(STEPS, min_size=5, max_size=60), st.integers(0, 2**32 - 1))
def test_no_stream_of_worlds_leads_to_a_command_beyond_the_limits(steps, seed):
    rng = np.random.default_rng(seed)
    planner = Straight()
    world = maze([[11, 9, 0.3]])
    last = None
    with Runner(planner, period=PERIOD, position_noise=0.02, heading_noise=0.05) as runner:
        command = runner.start(world)
        newest = world.time
        for what, period in steps:
            last, before = command.twist, command.time
            world = later(world, last, period)
            if what == "jump":
                world = world.moved(robot_pose=world.robot_pose + rng.normal(size=3))
            elif what == "turn":  # perception that says the robot drives otherwise
                world = world.moved(robot_twist=rng.normal(size=3))
            elif what == "fail":
                planner.does = lambda: 1 / 0
            if what == "back":
                assert not runner.update(world.moved(time=newest - 1.0))
            elif what != "skip":
                assert runner.update(world)
                newest = world.time
            if what == "repeat":
                runner.update(world)
            command = runner.command(world.time)
            planner.does = lambda: None
            twist, held = command.twist, command.time - before
            assert -0.3 <= twist.linear <= 0.5
            assert abs(twist.angular) <= 1.0
            assert abs(twist.linear - last.linear) <= 0.6 * held + 1e-9
            assert abs(twist.angular - last.angular) <= 2.0 * held + 1e-9
            assert math.isfinite(twist.linear) and math.isfinite(twist.angular)


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        ({"policy": 3}, "policy must be a policy"),
        ({"period": 0.0}, "period"),
        ({"period": math.nan}, "period"),
        ({"max_age": -1.0}, "max_age"),
        ({"on_stale": "hope"}, "on_stale"),
        ({"plan_stop": 0.5}, "plan_stop"),
        ({"observer_gain": 2.0}, "observer_gain"),
        ({"position_noise": -0.1}, "position_noise"),
    ],
)
def test_arguments_without_sense_are_named(arguments, what):
    with pytest.raises(InvalidInputError, match=what):
        Runner(**{"policy": Straight(), "period": PERIOD, **arguments})


def test_a_policy_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(UnknownNameError, match="push-aware"):
        Runner("push-awear", period=PERIOD)


def test_commands_need_a_start_a_number_and_worlds():
    world = maze()
    with Runner(Straight(), period=PERIOD) as runner:
        with pytest.raises(InvalidInputError, match="start"):
            runner.command(0.0)
        runner.start(world)
        runner.command(1.0)
        with pytest.raises(InvalidInputError, match="now"):
            runner.command("noon")
        with pytest.raises(InvalidInputError, match="World"):
            runner.update("world")


def test_prediction_costs_what_has_passed_and_goes_along_what_was_commanded():
    """Without any world for a long time the 600th command is as quick as the 20th."""
    world = maze()
    options = {"max_age": 50.0, "on_stale": "continue"}
    with Runner(Straight(), period=0.01, **options) as runner:
        runner.start(world)
        world, _ = drive(runner, later(world, STILL, 0.01), 50)
        runner.update(world)
        took = []
        for n in range(1, 601):
            began = time.thread_time()
            runner.command(world.time + 0.01 * n)
            took.append(time.thread_time() - began)
    assert min(took[-200:]) < 3.0 * min(took[20:220]) + 1e-4  # the least: others load the machine


LOOP = """
import json, sys
from pushplan.evaluation import JobSettings
from pushplan.runtime import Runner
from pushplan.scenarios import suite

policy, title = sys.argv[1:]
scenario = suite(title, episodes=1).scenarios[0]
runner = Runner(policy, period=0.1)
env = JobSettings().environment(scenario, runner.policy)
env.reset(seed=scenario.seed)
twist = runner.start(env.world).twist
there = set(sys.modules)
for _ in range(80):
    *_, terminated, truncated, _ = env.step(env.encode(twist))
    if terminated or truncated:
        break
    runner.update(env.world)
    twist = runner.command(env.world.time).twist
runner.close(20.0)
print(json.dumps([runner.worlds, runner.failures, sorted(set(sys.modules) - there)]))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("policy", "title"),
    [
        ("push-aware", "maze-2d-5"),
        ("kinodynamic-rrt", "maze-2d-5"),
        ("gtsp-mpc", "area-clearing-2d-10"),
        ("greedy", "box-delivery-2d-small-empty-10"),
        ("ship-predictive", "ship-ice-2d-20"),
        ("ship-lattice", "ship-ice-2d-20"),
    ],
)
def test_nothing_is_imported_after_start(policy, title):
    done = subprocess.run(
        [sys.executable, "-c", LOOP, policy, title], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    worlds, failures, imported = json.loads(done.stdout)
    assert worlds > 10
    assert failures == 0
    assert imported == []


def test_objects_that_come_and_go_are_no_failure():
    boxes = [[4, 9, 0.3], [10, 12, 0.0], [13, 8, 0.7]]
    world = maze(boxes)
    fewer = make_boxes(boxes[:1])
    with Runner(Straight(), period=PERIOD) as runner:
        runner.start(world)
        world = later(world, STILL)
        for movables in (fewer, world.movables, make_boxes([]), world.movables):
            world, _ = drive(runner, replace(world, movables=movables), 3)
    assert runner.failures == 0


def test_a_map_that_changes_is_seen():
    world = maze()
    with Runner(Straight(), period=PERIOD) as runner:
        runner.start(world)
        world, _ = drive(runner, later(world, STILL), 5)
        empty = StaticMap.build(bounds=[0, 0, 15, 15])
        world, commands = drive(runner, replace(world, static=empty), 40)
    assert runner.failures == 0
    assert commands[-1].status is CommandStatus.DRIVING


SETTINGS = """
import gc, sys
from pushplan.envs import PushEnv
from pushplan.planners import make_policy
from pushplan.runtime import Runner

env = PushEnv(task="maze", observation="state")
env.reset(seed=0)
before = sys.getswitchinterval(), gc.get_freeze_count()
runners = [Runner(make_policy("straight"), period=0.1) for _ in range(2)]
for runner in runners:
    runner.start(env.world)
runners[0].close()
assert sys.getswitchinterval() < before[0] and gc.get_freeze_count() > before[1]
runners[1].close()
assert (sys.getswitchinterval(), gc.get_freeze_count()) == before
"""


def test_runners_of_one_process_share_the_settings_of_the_interpreter() -> None:
    """In a process of its own: a runner of another test may still be open in this one."""
    subprocess.run([sys.executable, "-c", SETTINGS], check=True)
