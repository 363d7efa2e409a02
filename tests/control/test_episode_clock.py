import numpy as np
import pytest

from pushplan.control import EpisodeClock, MpcTracker, PathFollower, PurePursuit
from pushplan.envs import PushEnv
from pushplan.planners import make_planner
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.rearrangement.greedy import GreedyPusher
from pushplan.world import InvalidInputError, Twist, World


def start(task="maze"):
    env = PushEnv(task=task, action="velocity", observation="state")
    env.reset(seed=3)
    return env.world


CONTROLLERS = [PathFollower, PurePursuit, MpcTracker]


def test_it_measures_how_long_commands_are_held():
    world, clock = start(), EpisodeClock(0.1)
    assert clock.advance(world) and clock.held == 0.1
    assert not clock.advance(world)
    assert clock.advance(world.moved(time=0.25)) and clock.held == 0.25
    clock.reset()
    assert clock.advance(world) and clock.held == 0.1


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, "x"])
def test_a_bad_period_is_refused(bad):
    with pytest.raises(InvalidInputError, match="period"):
        EpisodeClock(bad)


def policies():
    planner = make_planner("straight")
    return [lambda: PlanFollower(planner), GreedyPusher]


@pytest.mark.parametrize("k", [0, 1])
def test_policies_give_one_command_for_one_instant(k):
    policy, world = policies()[k](), start("maze" if k == 0 else "box_delivery")
    policy.reset(world, np.random.default_rng(0))
    first = policy.act(world, None)
    assert policy.act(world, None) == first
    later = world.moved(robot_pose=world.robot_pose + 0.01, time=0.1)
    second = policy.act(later, None)
    for _ in range(3):  # perception is slower than the loop
        assert policy.act(later, None) == second
    with pytest.raises(InvalidInputError, match="went back"):
        policy.act(world, None)
    with pytest.raises(InvalidInputError, match="stands at"):
        policy.act(later.moved(robot_pose=world.robot_pose + 0.02), None)
    policy.reset(world, np.random.default_rng(0))
    assert policy.act(world, None) == first


@pytest.mark.parametrize("kind", CONTROLLERS)
def test_seeing_a_world_twice_makes_no_difference(kind):
    world = start()
    plan = make_planner("straight").plan(world).plan
    driven = []
    for often in (1, 3):
        controller, here, poses = kind(), world, []
        for step in range(40):
            for _ in range(often):
                twist = controller.command(here, plan)
            x, y, theta = here.robot_pose
            moved = [x + 0.1 * twist.linear * np.cos(theta), y + 0.1 * twist.linear * np.sin(theta)]
            pose = [*moved, theta + 0.1 * twist.angular]
            here = here.moved(robot_pose=pose, time=0.1 * (step + 1))
            poses.append(pose)
        driven.append(np.array(poses))
    assert np.array_equal(*driven)


@pytest.mark.parametrize("kind", CONTROLLERS)
def test_controllers_refuse_a_clock_that_is_wrong(kind):
    world, controller = start().moved(time=1.0), kind()
    plan = make_planner("straight").plan(world).plan
    controller.command(world, plan)
    with pytest.raises(InvalidInputError, match=r"world.time went back from 1 s to 0.5 s"):
        controller.command(world.moved(time=0.5), plan)
    with pytest.raises(InvalidInputError, match="stands at 1 s while things move"):
        controller.command(world.moved(robot_pose=world.robot_pose + 0.1), plan)
    controller.reset(world)
    assert isinstance(controller.command(world.moved(time=0.0), plan), Twist)


def test_a_moved_world_keeps_the_twist_of_its_robot():
    world = World(**{**vars(start()), "robot_twist": np.array([0.1, 0.0, 0.2])})
    assert world.moved(robot_pose=[1.0, 1.0, 0.0]).robot_twist.tolist() == [0.1, 0.0, 0.2]
    still = world.moved(robot_pose=[1.0, 1.0, 0.0], robot_twist=(0.0, 0.0, 0.0))
    assert not still.robot_twist.any()
