"""`Runner.start` while planning goes on: no call of one episode reaches the next."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from test_runner import PERIOD, STILL, Straight, drive, in_robots_loop, later, maze, until

from pushplan.planners import make_policy
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.runtime import CommandStatus, Runner, ThreadExecutor
from pushplan.world import ClearanceArea, Deadline, Twist


class Watched(PlanFollower):
    """A policy that notes when two threads are in it, or in its planner, at once."""

    def __init__(self) -> None:
        self.inside = threading.Lock()
        self.clashes = self.resets = 0
        self.hold, self.entered = threading.Event(), threading.Event()
        self.hold.set()
        self.rules = []
        super().__init__(self)

    def plan(self, world, *, stop=None, rng=None):
        with self.inside:
            if not in_robots_loop():  # as `Runner` asks
                self.rules.append(stop)
                self.entered.set()
                self.hold.wait(20.0)
            return Straight().plan(world, stop=stop, rng=rng)

    def reset(self, world, rng):
        self.resets += 1
        if not self.inside.acquire(blocking=False):
            self.clashes += 1
            return
        try:
            super().reset(world, rng)
        finally:
            self.inside.release()


def start_planning(runner, policy, world):
    """Begin an episode, and return when the planning thread is held in the policy."""
    policy.hold.clear()
    policy.entered.clear()
    runner.start(world)
    until(policy.entered.is_set)


def test_a_second_start_waits_with_the_policy_until_no_thread_is_in_it():
    policy, world = Watched(), maze()
    with Runner(policy, period=PERIOD, plan_stop=Deadline(5.0)) as runner:
        start_planning(runner, policy, world)
        resets = policy.resets
        command = runner.start(world.moved(robot_pose=world.robot_pose + 0.1))
        assert command.status is CommandStatus.WAITING and "abandoned" in command.reason
        assert policy.rules[-1].cancelled  # it was told to end
        world, commands = drive(runner, later(world, STILL), 5, wait=False)
        assert {one.twist for one in commands} == {STILL} and policy.resets == resets
        policy.hold.set()
        world, commands = drive(runner, world, 40)
    assert policy.clashes == 0 and policy.resets == resets + 1
    assert commands[-1].status is CommandStatus.DRIVING and runner.failures == 0


def test_the_first_plan_of_an_episode_does_not_queue_behind_those_of_the_last():
    """What waits in the queue of the last episode never begins."""
    policy, world = Watched(), maze()
    with Runner(policy, period=PERIOD, plan_stop=Deadline(5.0)) as runner:
        start_planning(runner, policy, world)
        never = runner._executor.submit(lambda stop: pytest.fail("it has begun"), 0.0)
        runner.start(world)
        policy.hold.set()
        drive(runner, later(world, STILL), 20)
        assert never.ended
        with pytest.raises(Exception, match="abandoned"):
            never.result()
    assert runner.failures == 0


def test_a_planner_that_hangs_stops_the_robot_in_the_next_episode_too():
    policy, world, now = Watched(), maze(), [0.0]
    with Runner(policy, period=PERIOD, plan_stop=Deadline(0.1), clock=lambda: now[0]) as runner:
        start_planning(runner, policy, world)
        runner.start(world)
        now[0] = 0.8
        world, commands = drive(runner, later(world, STILL), 3, wait=False)
        assert {one.status for one in commands} == {CommandStatus.FAILED}
        assert commands[-1].twist == STILL and "0.8 s" in commands[-1].reason
        assert policy.clashes == 0
        policy.hold.set()
        drive(runner, world, 5)


def test_a_policy_that_decides_in_one_go_is_in_one_thread_at_a_time():
    inside, hold, entered, clashes = threading.Lock(), threading.Event(), threading.Event(), []

    class OneGo:
        def reset(self, world, rng):
            clashes.extend([1] * inside.locked())

        def act(self, world, observation=None):
            with inside:
                entered.set()
                if not in_robots_loop():
                    hold.wait(20.0)
                return Twist(0.3, 0.0)

    world = maze()
    with Runner(OneGo(), period=PERIOD) as runner:
        runner.start(world)
        until(entered.is_set)
        runner.start(world)
        drive(runner, later(world, STILL), 3, wait=False)
        hold.set()
        _, commands = drive(runner, later(world, STILL), 10)
    assert not clashes and commands[-1].twist.linear > 0.0


def test_a_policy_that_fails_is_not_reset_while_a_planning_call_runs():
    policy, world = Watched(), maze()
    with Runner(policy, period=PERIOD, plan_stop=Deadline(5.0)) as runner:
        runner.start(world)
        world, _ = drive(runner, later(world, STILL), 20)
        policy.hold.clear()
        policy.entered.clear()
        jump = np.array([1.5, 0.0, 0.0])
        world = world.moved(robot_pose=world.robot_pose + jump)  # off the plan
        for _ in range(20):
            world, _ = drive(runner, world, 1, wait=False)
            if policy.entered.is_set():
                break
        until(policy.entered.is_set)
        policy.controller.command = None  # which is called with the next command
        world, commands = drive(runner, world, 10, wait=False)
        assert {one.status for one in commands[-4:]} == {CommandStatus.WAITING}
        del policy.controller.command
        policy.hold.set()
        world, commands = drive(runner, world, 40)
    assert policy.clashes == 0 and commands[-1].status is CommandStatus.DRIVING


@pytest.mark.parametrize("name", ["straight", "gtsp-mpc", "mppi"])
def test_reset_abandons_what_a_policy_has_asked_for(name):
    abandoned = []

    class Asked:
        def ready(self, time):
            return False

        def abandon(self):
            abandoned.append(self)

    class Never:
        takes_time = True

        def expected(self, stop):
            return 0.1

        def submit(self, call, time, stop=None):
            return Asked()

    world = maze()
    if name == "gtsp-mpc":
        corners = [[4.0, 4.0], [11.0, 4.0], [11.0, 11.0], [4.0, 11.0]]
        area = ClearanceArea(np.array(corners), np.ones(4, dtype=bool))
        world = replace(maze([[7.0, 7.0, 0.3]]), goal=area)
    policy = make_policy(name)
    policy.reset(world, np.random.default_rng(0))
    policy.plan_with(Never())
    policy.act(world)
    assert not abandoned
    policy.reset(world, np.random.default_rng(0))
    assert len(abandoned) == 1


def test_a_thread_that_dies_between_its_calls_takes_none_along():
    executor = ThreadExecutor(Deadline(1.0), lambda: 0.0)
    executor._worker.calls.put(None)
    first = executor.submit(lambda stop: 1, 0.0)  # its thread ends before it
    until(lambda: not executor._worker.is_alive)
    assert executor.running_s == 0.0 and first.ended
    with pytest.raises(Exception, match="thread has died"):
        first.result()
    second = executor.submit(lambda stop: 2, 0.0)
    until(lambda: second.ended)
    assert second.result() == 2
    assert executor.close(5.0)
