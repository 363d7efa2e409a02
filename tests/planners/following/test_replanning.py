"""When a plan is replaced, and how the new one is joined to the old."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import make_boxes, make_robot, make_u_maze

from pushplan.control import Progress, SimulatedExecutor
from pushplan.interaction import QuasiStatic
from pushplan.planners.following import plan_fit
from pushplan.planners.following.plan_fit import RestSweep
from pushplan.planners.following.plan_follower import PlanFollower
from pushplan.planners.following.replanning import (
    Reason,
    Replanning,
    cost_of_rest,
    rest_of,
    sweep_rest,
)
from pushplan.planners.following.splicing import joined, passed, world_ahead
from pushplan.world import (
    Drive,
    InvalidInputError,
    Plan,
    PlanResult,
    PlanStats,
    PlanStatus,
    StaticMap,
    World,
)

FLOOR = StaticMap.build(bounds=[-50, -50, 50, 50])
MODEL = QuasiStatic()


def floor(boxes=(), **changes: object) -> World:
    fields: dict[str, object] = {"static": FLOOR, "robot_pose": [0, 0, 0], **changes}
    return make_u_maze(boxes, **fields)


def line_plan(world: World, length: float = 8.0, *, y: float = 0.0, predict: bool = True) -> Plan:
    """Straight along x from the robot, moving over to ``y`` on the way."""
    x = np.linspace(0.0, length, 81)
    over = y * np.clip(x / 3.0, 0.0, 1.0)
    poses = np.column_stack([x, over, np.zeros(81)]) + world.robot_pose
    moves = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    lengths = np.concatenate([[0.0], np.cumsum(moves)])
    swept = MODEL.sweep(world, poses)
    speed = world.robot.max_speed
    return Plan(
        times=lengths / speed,
        poses=poses,
        speeds=np.full(81, speed),
        turn_rates=np.zeros(81),
        travel_cost=float(lengths[-1]) * world.robot.mass,
        interaction_cost=swept.work,
        object_poses=swept.object_poses if predict else None,
    )


class Scripted:
    """Gives one plan after the other; remembers where it was asked from."""

    def __init__(self, *makers) -> None:
        self.makers = list(makers)
        self.asked: list[World] = []

    def plan(self, world, *, stop=None, rng=None):
        self.asked.append(world)
        maker = self.makers[min(len(self.asked), len(self.makers)) - 1]
        if maker is None:
            return PlanResult(PlanStatus.TIMED_OUT, None, PlanStats(0.0))
        return PlanResult(PlanStatus.SOLVED, maker(world), PlanStats(0.0))


def follower(planner, **rule: object) -> PlanFollower:
    policy = PlanFollower(planner, replanning=Replanning(**rule))
    policy.reset(floor(), np.random.default_rng(0))
    return policy


BOX = [[4.0, 0.0, 0.0]]


def surprised(policy: PlanFollower) -> World:
    """A box that was beside the path lies on it now."""
    world = floor([[4.0, 3.0, 0.0]])
    policy.act(world)
    return floor(BOX, robot_pose=[1.0, 0.0, 0.0], time=7.0)


class TestMargin:
    def test_without_one_the_new_plan_is_taken(self):
        planner = Scripted(line_plan, lambda w: line_plan(w, 30.0))
        policy = follower(planner, margin=None)
        policy.act(surprised(policy))
        assert len(planner.asked) == 2
        assert policy.current_plan.length == pytest.approx(30.0)

    def test_a_worse_plan_is_not_taken(self):
        planner = Scripted(line_plan, lambda w: line_plan(w, 30.0))
        policy = follower(planner, margin=0.0, push_weight=1.0)
        policy.act(surprised(policy))
        assert len(planner.asked) == 2
        kept = policy.current_plan
        assert kept.poses[-1, 0] == pytest.approx(8.0)
        # the surprise has been thought about: it is none any more
        policy.act(floor(BOX, robot_pose=[1.2, 0.0, 0.0], time=20.0))
        assert len(planner.asked) == 2

    def test_a_better_plan_is_taken_if_it_is_better_by_the_margin(self):
        for margin, taken in ((0.0, True), (0.5, True), (40.0, False)):
            planner = Scripted(line_plan, lambda w: line_plan(w, 7.0, y=2.5))
            policy = follower(planner, margin=margin, push_weight=3.0)
            policy.act(surprised(policy))
            assert bool(policy.current_plan.poses[-1, 1] > 1.0) is taken

    def test_a_plan_that_jams_goes_whatever_the_margin(self):
        walls = StaticMap.build(polygons=[[[6, -5], [7, -5], [7, 5], [6, 5]]])
        planner = Scripted(lambda w: line_plan(w, 4.9), lambda w: line_plan(w, 2.0))
        policy = follower(planner, margin=1e6)
        policy.act(floor([[4.0, 3.0, 0.0]], static=walls))
        policy.act(floor([[5.0, 0.0, 0.0]], static=walls, robot_pose=[1, 0, 0], time=7.0))
        assert policy.current_plan.poses[-1, 0] == pytest.approx(3.0)

    def test_the_price_counts_travel_interaction_and_what_is_left_to_the_goal(self):
        world = floor(BOX)
        plan = line_plan(world, 6.0)
        swept, path = sweep_rest(world, plan, 0, MODEL)
        to_go = world.goal.distance(6.0, 0.0)
        expected = 6.0 + 3.0 * swept.work + to_go
        assert cost_of_rest(world, path, swept, 3.0) == pytest.approx(expected)

    def test_the_weight_is_that_of_the_planner(self):
        from pushplan.planners import KinodynamicRRT

        planner = KinodynamicRRT()
        assert Replanning().weight(planner) == planner.config.push_weight
        assert Replanning(push_weight=7.0).weight(planner) == 7.0
        assert Replanning().weight(Scripted(None)) == 1.0


class TestPeriod:
    def test_every_so_many_seconds(self):
        planner = Scripted(line_plan)
        policy = follower(planner, every_seconds=5.0)
        for step in range(12):
            policy.act(floor(robot_pose=[0.15 * step, 0, 0], time=float(step)))
        assert [world.time for world in planner.asked] == [0.0, 5.0, 10.0]

    def test_every_so_many_radii(self):
        planner = Scripted(line_plan)
        policy = follower(planner, renewal=0.7 / make_robot().circumscribed_radius)
        for step in range(12):
            policy.act(floor(robot_pose=[0.15 * step, 0, 0], time=float(step)))
        assert [world.time for world in planner.asked] == [0.0, 5.0, 10.0]

    def test_standing_still_meanwhile_is_not_being_stuck(self):
        planner = Scripted(line_plan)
        policy = follower(planner, every_seconds=1.0)
        robot = make_robot(drive="differential")
        for step in range(8):
            twist = policy.act(floor(robot=robot, time=float(step)))
            assert twist.linear > 0.0  # and not backing off


def test_look_ahead_limits_what_is_swept():
    seen = []

    class Counting(QuasiStatic):
        def sweep(self, world, path):
            seen.append(len(path))
            return super().sweep(world, path)

    for look_ahead, count in ((math.inf, 81), (2.0, 17)):
        policy = PlanFollower(
            Scripted(line_plan),
            replanning=Replanning(look_ahead=look_ahead),
            interaction=Counting(),
        )
        policy.act(floor(BOX))
        assert policy.act(floor(BOX, robot_pose=[0.01, 0, 0], time=1.0))
        assert seen[-1] == pytest.approx(count, abs=1)


def test_no_sweep_where_nothing_can_be_a_reason():
    class Broken(QuasiStatic):
        def sweep(self, world, path):
            pytest.fail("not needed")

    rule = Replanning(surprise=math.inf)
    policy = PlanFollower(Scripted(line_plan), replanning=rule, interaction=Broken())
    policy.act(floor(BOX))
    policy.act(floor(BOX, robot_pose=[0.1, 0, 0], time=1.0))


class TestALongRest:
    """It is swept in parts, which find what one sweep finds."""

    @pytest.fixture(params=[10, 37, 1000])
    def look(self, request, monkeypatch):
        """Looks along a plan until the answer is complete; for parts of so many poses."""
        monkeypatch.setattr(plan_fit, "_WHOLE", request.param)
        monkeypatch.setattr(plan_fit, "_PART", request.param)
        monkeypatch.setattr(plan_fit, "_WALLS", 0)
        monkeypatch.setattr(plan_fit, "_LEAST", 5)

        def until_known(world, plan):
            rest = RestSweep()
            for calls in range(1, 30):
                jammed_at, excess = rest.look(world, plan, 0, len(plan.poses), MODEL, True)
                if jammed_at >= 0 or excess > -math.inf:
                    return jammed_at, excess, calls
            return pytest.fail("no end")

        return until_known

    def test_what_a_box_in_the_way_costs(self, look):
        plan = line_plan(floor([[30.0, 0.0, 0.0]]))  # expected out of the way
        world = floor([[5.0, 0.0, 0.0]])
        swept, path = sweep_rest(world, plan, 0, MODEL)
        jammed_at, excess, _ = look(world, plan)
        assert (jammed_at, len(path)) == (-1, 81)
        assert swept.work > 1.0
        assert excess == pytest.approx(swept.work)

    def test_where_it_would_jam(self, look):
        plan = line_plan(floor([[30.0, 0.0, 0.0]]))
        walls = StaticMap.build(polygons=[[[7, -5], [8, -5], [8, 5], [7, 5]]])
        world = floor([[5.0, 0.0, 0.0]], static=walls)
        swept, _ = sweep_rest(world, plan, 0, MODEL)
        assert swept.jammed_at > 10
        assert look(world, plan)[0] == swept.jammed_at

    def test_a_command_sweeps_one_part(self, look):
        world = floor([[30.0, 0.0, 0.0]])
        *_, calls = look(world, line_plan(world))
        assert calls == {10: 16, 37: 4, 1000: 1}[plan_fit._PART]

    def test_what_is_farther_on_waits_until_a_plan_may_be_asked_for(self, monkeypatch):
        monkeypatch.setattr(plan_fit, "_WALLS", 0)
        monkeypatch.setattr(plan_fit, "_WHOLE", 40)
        monkeypatch.setattr(plan_fit, "_PART", 40)
        rest = RestSweep()
        world = floor([[30.0, 0.0, 0.0]])
        plan = line_plan(world)
        answers = [rest.look(world, plan, 0, 81, MODEL, k > 1)[1] for k in range(6)]
        assert answers == [-math.inf] * 5 + [0.0]


class TestStitching:
    def test_the_world_ahead_is_where_the_plan_leads_with_the_objects_pushed(self):
        world = floor([[1.5, 0.0, 0.0]])
        plan = line_plan(world)
        ahead, stretch = world_ahead(world, plan, 0.0, 10.0, MODEL)
        assert ahead.robot_pose == pytest.approx([1.5, 0, 0])
        assert ahead.time == 10.0
        assert ahead.robot_twist == pytest.approx([0.15, 0.0, 0.0])
        assert ahead.movables.poses[0, 0] == pytest.approx(1.5 + 0.7 + 0.5, abs=1e-3)
        assert stretch.times[-1] == pytest.approx(10.0)
        assert stretch.poses[-1] == pytest.approx([1.5, 0, 0])

    def test_a_robot_that_has_left_the_plan_comes_back_to_it(self):
        plan = line_plan(floor())
        world = floor(robot_pose=[0.3, 1.0, 0.5 + math.tau])
        soon, stretch = world_ahead(world, plan, 2.0, 0.1, MODEL, off_plan=True)
        assert stretch.poses[0] == pytest.approx([0.3, 1.0, 0.5])
        assert soon.robot_pose == pytest.approx([0.315, 1.0, 0.5], abs=0.03)
        later, _ = world_ahead(world, plan, 2.0, 30.0, MODEL, off_plan=True)
        assert later.robot_pose == pytest.approx([4.8, 0.0, 0.0], abs=0.01)

    def test_no_latency_is_no_stretch(self):
        world = floor()
        assert world_ahead(world, line_plan(world), 0.0, 0.0, MODEL) == (world, None)

    @pytest.mark.parametrize("drive", list(Drive))
    def test_past_the_end_it_waits(self, drive):
        radius = 2.0 if drive is Drive.CAR else 0.0
        world = floor(robot=make_robot(drive=drive, min_turning_radius=radius))
        ahead, stretch = world_ahead(world, line_plan(world, 1.5), 0.0, 20.0, MODEL)
        x = 3.0 if drive is Drive.CONSTANT_SPEED else 1.5
        assert ahead.robot_pose == pytest.approx([x, 0, 0])
        assert stretch.times[-1] == pytest.approx(20.0)

    def test_without_a_plan_it_waits_too(self):
        ahead, _ = world_ahead(floor(), None, 0.0, 4.0, MODEL)
        assert ahead.robot_pose == pytest.approx([0.6, 0, 0])
        still = floor(robot=make_robot(drive="differential"))
        assert world_ahead(still, None, 0.0, 4.0, MODEL)[0].robot_pose == pytest.approx([0, 0, 0])

    def test_the_joined_plan_has_no_jump(self):
        world = floor(BOX)
        ahead, stretch = world_ahead(world, line_plan(world), 0.0, 7.0, MODEL)
        plan = joined(stretch, line_plan(ahead, y=1.0))
        gaps = np.hypot(*np.diff(plan.poses[:, :2], axis=0).T)
        assert gaps.max() < 0.16
        assert plan.poses[0] == pytest.approx(world.robot_pose)
        assert np.all(np.diff(plan.times) >= 0.0)
        assert plan.length == pytest.approx(plan.travel_cost)
        jumps = np.diff(plan.object_poses[:, 0, :2], axis=0)
        assert np.hypot(*jumps.T).max() < 0.16

    def test_the_policy_plans_from_where_it_will_be(self):
        planner = Scripted(line_plan)
        policy = follower(planner, every_seconds=10.0, latency=2.0)
        policy.act(floor())
        policy.act(floor(robot_pose=[1.5, 0.0, 0.0], time=10.0))
        assert planner.asked[1].robot_pose == pytest.approx([1.8, 0, 0])
        assert policy.current_plan.poses[0] == pytest.approx([1.5, 0, 0])

    def test_a_stretch_on_which_it_jams_is_not_planned_over(self):
        walls = StaticMap.build(polygons=[[[3, -5], [4, -5], [4, 5], [3, 5]]])
        world = floor(static=walls)
        plan = line_plan(floor())
        assert world_ahead(world, plan, 0.0, 30.0, MODEL) == (world, None)

    def test_what_has_been_passed_is_left_out(self):
        world = floor()
        plan = line_plan(world)
        later = floor(robot_pose=[3.04, 0.2, 0.0])
        index = passed(later, plan, 20.3)
        rest = rest_of(plan, index, None)
        assert rest.poses[0, 0] == pytest.approx(3.0)
        assert rest.times[0] == 0.0
        assert rest.travel_cost == pytest.approx(5.0)
        assert rest_of(plan, 0, None) is plan


class Ticks:
    """A clock that shows what it is told."""

    def __init__(self, *durations: float) -> None:
        self.shown = self.now = 0.0
        self.durations = list(durations)
        self.calls = 0

    def __call__(self) -> float:
        self.calls += 1
        if self.calls % 2 == 0:
            self.now += self.durations.pop(0) if len(self.durations) > 1 else self.durations[0]
        return self.now


class TestHonestTime:
    def drive(self, policy: PlanFollower, steps: int, period: float = 1.0, **changes: object):
        """Exact motion; the poses and what was commanded."""
        world = floor(**changes)
        found = []
        for step in range(steps):
            twist = policy.act(world)
            found.append((world.robot_pose[0], twist))
            x = world.robot_pose[0] + twist.linear * period
            world = floor(robot_pose=[x, 0, 0], time=(step + 1) * period, **changes)
        return found

    def test_a_plan_is_there_only_after_the_time_it_took(self):
        policy = follower(Scripted(line_plan), surprise=math.inf)
        policy.plan_with(SimulatedExecutor(10.0, Ticks(0.25)))
        robot = make_robot(drive="differential")
        found = self.drive(policy, 5, robot=robot)
        # 2.5 s: it stands at 0, 1 and 2 s, and drives at 3 s
        assert [twist.linear for _, twist in found] == [0.0, 0.0, 0.0, 0.15, 0.15]

    def test_a_constant_speed_robot_goes_straight_on_and_finds_itself_on_the_plan(self):
        policy = follower(Scripted(line_plan))
        policy.plan_with(SimulatedExecutor(10.0, Ticks(0.25)))
        self.drive(policy, 4)
        assert policy.current_plan.poses[0, 0] == pytest.approx(0.4)  # it was at 0.45

    def test_the_next_plan_starts_where_the_robot_will_be(self):
        planner = Scripted(line_plan)
        policy = follower(planner, every_seconds=5.0)
        policy.plan_with(SimulatedExecutor(10.0, Ticks(0.2)))
        self.drive(policy, 12)
        # asked for at 0, 5, 10 s; 2 s ahead once it is known that it takes 2 s
        asked = [float(world.robot_pose[0]) for world in planner.asked]
        assert asked == pytest.approx([0.0, 0.15 * 7, 0.15 * 12], abs=1e-6)
        assert [world.time for world in planner.asked] == [0.0, 7.0, 12.0]

    def test_a_deadline_says_how_long_the_first_call_takes(self):
        from pushplan.world import Deadline

        planner = Scripted(line_plan)
        policy = PlanFollower(planner, stop=Deadline(0.1))
        policy.reset(floor(), np.random.default_rng(0))
        policy.plan_with(SimulatedExecutor(20.0, Ticks(0.1)))
        policy.act(floor())
        assert planner.asked[0].robot_pose == pytest.approx([0.3, 0, 0])

    def test_a_failed_call_keeps_the_old_plan(self):
        planner = Scripted(line_plan, None)
        policy = follower(planner, every_seconds=3.0)
        policy.plan_with(SimulatedExecutor(1.0, Ticks(0.5)))
        self.drive(policy, 8)
        assert len(planner.asked) > 1
        assert policy.current_plan.poses[-1, 0] == pytest.approx(8.0, abs=0.2)

    def test_it_ends_with_the_episode(self):
        policy = follower(Scripted(line_plan))
        policy.plan_with(SimulatedExecutor(10.0, Ticks(0.25)))
        policy.act(floor())
        policy.reset(floor(), np.random.default_rng(0))
        policy.act(floor())
        assert policy.current_plan is not None


@pytest.mark.parametrize(("drive", "stands"), [("differential", True), ("constant_speed", False)])
def test_a_robot_that_can_stop_stands_before_a_jam_that_no_plan_avoids(drive, stands):
    walls = StaticMap.build(polygons=[[[6, -5], [7, -5], [7, 5], [6, 5]]])
    robot = make_robot(drive=drive)
    planner = Scripted(line_plan, None)
    policy = follower(planner)
    scene = {"robot": robot, "static": walls, "robot_pose": [4.5, 0.0, 0.0]}
    policy.act(floor([[4.0, 3.0, 0.0]], **scene))
    twist = policy.act(floor([[5.4, 0.0, 0.0]], **scene, time=9.0))
    assert len(planner.asked) == 2
    assert (policy.current_plan is None) is stands
    assert (twist.linear < 0.5 * robot.max_speed) is stands  # it brakes


def test_only_the_last_plan_of_the_log_keeps_its_predictions():
    policy = follower(Scripted(line_plan), every_seconds=5.0)
    for step in range(12):
        policy.act(floor([[4.0, 3.0, 0.0]], robot_pose=[0.15 * step, 0, 0], time=float(step)))
    *before, last = (result.plan.object_poses for result in policy.plan_log)
    assert before == [None, None] and last is not None
    assert policy.current_plan.object_poses is not None


@pytest.mark.parametrize(("aside", "is_kept"), [(6.0, False), (14.0, True)])
def test_a_tight_plan_is_not_replaced_by_one_that_is_far_longer(aside, is_kept):
    class Tight(Scripted):
        def plan(self, world, **options):
            found = super().plan(world, **options)
            return replace(found, stats=PlanStats(0.0, detail={"tight": 1.0}))

    policy = follower(Tight(line_plan, lambda world: line_plan(world, y=aside)))
    for step in range(20):
        policy.act(floor(robot_pose=[0.15 * step, 0, 0], time=float(step)))
        if len(policy.planner.asked) == 2:
            break
    assert len(policy.planner.asked) == 2
    assert (policy.current_plan.poses[-1, 1] == 0.0) == is_kept


def test_urgent_reasons():
    assert {reason for reason in Reason if not reason.urgent} == {
        Reason.OBJECTS,
        Reason.TIGHT,
        Reason.SURPRISE,
        Reason.PERIOD,
    }


@pytest.mark.parametrize(
    "changes",
    [
        {"margin": -1.0},
        {"push_weight": math.nan},
        {"every_seconds": 0.0},
        {"renewal": -1.0},
        {"look_ahead": 0.0},
        {"latency": math.inf},
        {"surprise": -1.0},
        {"never": 1},
    ],
)
def test_bad_rules(changes):
    with pytest.raises(InvalidInputError, match=next(iter(changes))):
        Replanning(**changes)


def test_a_progress_has_no_memory_of_another_plan():
    world = floor()
    progress = Progress(window=2.0)
    progress.update(line_plan(world), np.array([3.0, 0.0, 0.0]))
    assert progress.update(line_plan(world, 5.0), np.array([0.5, 0.0, 0.0])) == pytest.approx(0.5)


def test_boxes_that_leave_do_not_stop_the_comparison():
    planner = Scripted(line_plan, lambda w: line_plan(w, 30.0))
    policy = follower(planner, margin=0.0)
    policy.act(floor([[4.0, 3.0, 0.0], [6.0, 3.0, 0.0]]))
    policy.act(floor(make_boxes([[4.0, 3.0, 0.0]]).poses, robot_pose=[0.1, 0, 0], time=1.0))
    assert policy.current_plan.poses[-1, 0] == pytest.approx(8.0)
