"""What is new in the world of a `Runner`: the robot stops before it, and goes on where it can."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from pushplan.control import DelayedExecutor
from pushplan.geometry.transforms import arc_step
from pushplan.interaction import QuasiStatic
from pushplan.runtime import Command, CommandStatus, Runner
from pushplan.world import (
    ClearanceArea,
    Drive,
    GoalDisc,
    GoalLine,
    Movables,
    Plan,
    RobotModel,
    StaticMap,
    Twist,
    World,
)

PERIOD = 0.05
START, GOAL = (1.5, 3.0), (8.0, 3.0)
BODY = np.array([[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]])
SQUARE = np.array([[0.2, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.2, -0.2]])
ROBOT = RobotModel.from_outline(
    BODY,
    mass=10.0,
    drive=Drive.DIFFERENTIAL,
    max_speed=0.8,
    min_speed=-0.4,
    max_turn_rate=1.5,
    max_acceleration=0.8,
    max_turn_acceleration=4.0,
)
Change = Callable[[World, Command], World | None]


class Ahead:
    """A policy without a plan that looks at nothing."""

    speed = 2.0

    def reset(self, world: World, rng: np.random.Generator) -> None:
        pass

    def act(self, world: World, observation: object = None) -> Twist:
        return Twist(self.speed, 0.0)


def room(robot: RobotModel = ROBOT, objects: Movables | None = None) -> World:
    """10 m by 6 m, the robot on the left and its goal on the right."""
    walls = [[0, 0, 10, 0], [10, 0, 10, 6], [10, 6, 0, 6], [0, 6, 0, 0]]
    return World(
        robot=robot,
        robot_pose=[*START, 0.0],
        static=StaticMap.build(segments=walls, radii=0.1),
        movables=Movables.empty() if objects is None else objects,
        goal=GoalDisc(GOAL, 0.4),
    )


def adding(world: World, *polygons: np.ndarray) -> World:
    """The same room with more that is static."""
    static = world.static
    more = StaticMap((*static.polygons, *polygons), static.segments, static.radii, static.bounds)
    return replace(world, static=more)


def square_at(x: float, y: float) -> np.ndarray:
    return SQUARE + np.array([x, y])


def wall(x: float, low: float = 0.0, high: float = 6.0) -> np.ndarray:
    return np.array([[x, low], [x + 0.1, low], [x + 0.1, high], [x, high]])


def perceived_anew(world: World, rng: np.random.Generator) -> World:
    """The world with each outline a little off."""
    static = world.static
    polygons = [part + 1e-3 * rng.normal(size=2) for part in static.polygons]
    segments = static.segments + 1e-3 * rng.normal(size=static.segments.shape)
    return replace(world, static=StaticMap(polygons, segments, static.radii, static.bounds))


class DrivenRobot:
    """A simulated robot at the wheel of a runner, exact to a fifth of a period.

    Attributes:
        poses: (3,) all that the robot has been at since the last change of the world.
        commands: all that it was given.
    """

    def __init__(
        self,
        policy: object,
        world: World,
        *,
        delay: float = 0.0,
        noise: float = 0.0,
        seed: int = 0,
        latency: float = 0.1,
    ) -> None:
        self.runner = Runner(
            policy,
            period=PERIOD,
            executor=DelayedExecutor(latency),
            delay=delay,
            position_noise=noise,
            heading_noise=noise,
        )
        self.noise, self.rng = noise, np.random.default_rng(seed)
        self.world, self.poses = world, [world.robot_pose]
        self.commands = [self.runner.start(self.seen())]
        self.sent = deque([Twist(0.0, 0.0)] * round(delay / PERIOD))

    def seen(self) -> World:
        return self.world.moved(
            robot_pose=self.world.robot_pose + self.noise * self.rng.normal(size=3)
        )

    def drive(self, steps: int, change: Change = lambda world, command: None) -> Command:
        """Drive until it is done, and change the world on the way."""
        for _ in range(steps):
            self.sent.append(self.commands[-1].twist)
            self.step(self.sent.popleft())
            changed = change(self.world, self.commands[-1])
            if changed is not None:
                self.world, self.poses = changed, [self.world.robot_pose]
            self.runner.update(self.seen())
            self.commands.append(self.runner.command(self.world.time))
            if self.commands[-1].status is CommandStatus.DONE:
                break
        return self.commands[-1]

    def step(self, twist: Twist) -> None:
        speed = math.hypot(twist.linear, twist.lateral)
        bearing = np.array([0.0, 0.0, math.atan2(twist.lateral, twist.linear)])
        for _ in range(5):
            pose = np.empty(3)
            part = PERIOD / 5
            arc_step(self.poses[-1] + bearing, speed * part, twist.angular * part, pose)
            self.poses.append(pose - bearing)
        vx, vy = speed * math.cos(pose[2]), speed * math.sin(pose[2])
        pose = self.poses[-1]
        self.world = self.world.moved(
            robot_pose=pose, robot_twist=[vx, vy, twist.angular], time=self.world.time + PERIOD
        )

    def overlap(self, polygon: np.ndarray) -> float:
        """Greatest area of the robot that was in a polygon since the last change."""
        shape, most = shapely.Polygon(polygon), 0.0
        for pose in self.poses:
            for part in self.world.moved(robot_pose=pose).robot_outline_world():
                most = max(most, shapely.Polygon(part).intersection(shape).area)
        return most


class PushingRobot(DrivenRobot):
    """One that carries the objects before it along."""

    def step(self, twist: Twist) -> None:
        before, begin = self.world, len(self.poses) - 1
        super().step(twist)
        free, solid = ~before.movables.fixed, before.with_fixed_as_static()
        poses = np.array(before.movables.poses)
        path = np.array(self.poses[begin:])
        poses[free] = QuasiStatic().sweep(solid, path).object_poses[-1]
        self.world = self.world.moved(movable_poses=poses)


def when_at(x: float, change: Callable[[World], World]) -> Change:
    """Change the world once, when the robot has come to a place."""
    done = []

    def changed(world: World, command: Command) -> World | None:
        if done or world.robot_pose[0] < x:
            return None
        done.append(True)
        return change(world)

    return changed


def random_robot(rng: np.random.Generator, drive: Drive) -> RobotModel:
    fast, car = rng.uniform(0.3, 1.2), drive is Drive.CAR
    return replace(
        ROBOT,
        drive=drive,
        min_turning_radius=rng.uniform(0.4, 0.8) if car else 0.0,
        max_speed=fast,
        min_speed=-0.5 * fast,
        max_turn_rate=rng.uniform(0.8, 2.5),
        max_acceleration=rng.uniform(0.3, 2.0),
        max_turn_acceleration=rng.uniform(1.5, 6.0),
    )


def comes_into_the_way(rng: np.random.Generator, room_to_brake: float) -> Change:
    """A pillar that stands before the robot, where it can brake, or turn, in time."""
    at, further, side = rng.uniform(1.8, 5.0), rng.uniform(0.0, 1.5), rng.uniform(-0.3, 0.3)

    def change(world: World) -> World:
        robot, speed = world.robot, float(np.hypot(*world.robot_twist[:2]))
        brake = 0.5 * speed * speed / robot.max_acceleration
        if not robot.can_stop:
            turned = 2.0 * robot.max_turn_rate / robot.max_turn_acceleration
            brake = 0.4 + robot.turning_radius + turned * speed
        ahead = 0.55 + brake + room_to_brake * speed + further
        x, y, theta = world.robot_pose.tolist()
        c, s = math.cos(theta), math.sin(theta)
        return adding(world, square_at(x + ahead * c - side * s, y + ahead * s + side * c))

    return when_at(at, change)


@pytest.mark.parametrize("drive", Drive)
def test_a_robot_that_looks_at_nothing_keeps_off_what_comes_into_its_way(drive: Drive) -> None:
    rng = np.random.default_rng(3)
    driven = DrivenRobot(Ahead(), room(random_robot(rng, drive)), noise=0.02)
    driven.drive(200, comes_into_the_way(rng, 2.0 * PERIOD))
    assert driven.overlap(driven.world.static.polygons[0]) == 0.0
    assert CommandStatus.BLOCKED in {command.status for command in driven.commands}


@pytest.mark.slow
@settings(max_examples=12)
@given(
    st.integers(0, 10**6),
    st.booleans(),
    st.sampled_from([0.0, 0.1, 0.2]),
    st.sampled_from(Drive),
)
def test_no_robot_touches_what_comes_into_its_way_where_it_could_brake(
    seed, noisy, delay, drive
) -> None:
    for policy in (Ahead(), "straight"):
        rng = np.random.default_rng(seed)
        robot = random_robot(rng, drive)
        noise = 0.02 if noisy else 0.0
        driven = DrivenRobot(policy, room(robot), delay=delay, noise=noise, seed=seed)
        driven.drive(400, comes_into_the_way(rng, delay + 2.0 * PERIOD))
        assert len(driven.world.static.polygons) == 1
        assert driven.overlap(driven.world.static.polygons[0]) == 0.0


@pytest.mark.parametrize("name", ["straight", pytest.param("push-aware", marks=pytest.mark.slow)])
def test_a_robot_drives_around_a_pillar_that_has_come_into_its_way(name: str) -> None:
    driven = DrivenRobot(name, room())
    pillar = square_at(4.3, 3.0)
    last = driven.drive(900, when_at(3.0, lambda world: adding(world, pillar)))
    assert last.status is CommandStatus.DONE
    assert driven.overlap(pillar) == 0.0
    speeds = [command.twist.linear for command in driven.commands]
    assert max(speeds) == pytest.approx(0.8)


def test_before_a_door_that_shuts_the_robot_waits_with_a_reason_until_it_opens() -> None:
    door, sides = wall(5.0, 2.2, 3.8), (wall(5.0, 0.0, 2.2), wall(5.0, 3.8, 6.0))
    opened = adding(room(), *sides)
    shut = adding(opened, door)
    for begins_open in (True, False):  # what is there at first may go, and come back
        driven = DrivenRobot("straight", opened if begins_open else shut)
        driven.world = replace(driven.world, static=opened.static)
        close = when_at(3.2, lambda world: replace(world, static=shut.static))
        last = driven.drive(300, close)
        assert driven.overlap(door) == 0.0
        assert last.twist == Twist(0.0, 0.0)
        assert last.status in (CommandStatus.WAITING, CommandStatus.BLOCKED) and last.reason
        driven.world = replace(driven.world, static=opened.static)
        assert driven.drive(600).status is CommandStatus.DONE


@pytest.mark.parametrize("name", [pytest.param("push-aware", marks=pytest.mark.slow), "straight"])
def test_an_object_that_turns_out_fixed_is_an_obstacle(name: str) -> None:
    objects = Movables.from_outlines([SQUARE], [[5.0, 3.0, 0.0]], masses=[0.01])
    driven = DrivenRobot(name, room(objects=objects))
    hold = when_at(3.0, lambda world: world.believing([True]))
    assert driven.drive(900, hold).status is CommandStatus.DONE
    assert driven.overlap(square_at(5.0, 3.0)) == 0.0


def test_a_robot_that_stands_at_something_new_drives_away_from_it_and_no_nearer() -> None:
    policy = Ahead()
    driven = DrivenRobot(policy, room())
    block = np.array([[1.75, 2.5], [2.5, 2.5], [2.5, 3.5], [1.75, 3.5]])  # overlaps the front
    driven.world = adding(driven.world, block)
    before = driven.overlap(block)
    last = driven.drive(20)
    assert driven.overlap(block) <= before + 1e-3 and last.status is CommandStatus.BLOCKED
    assert last.twist == Twist(0.0, 0.0) and "(2.12, 3.00)" in last.reason
    policy.speed = -0.4
    last = driven.drive(40)
    assert last.status is CommandStatus.DRIVING and driven.world.robot_pose[0] < 1.3


def test_what_was_there_at_the_start_stops_a_robot_that_does_not_look() -> None:
    block = square_at(3.0, 3.0)
    driven = DrivenRobot(Ahead(), adding(room(), block))
    last = driven.drive(80)
    assert driven.overlap(block) == 0.0
    assert last.status is CommandStatus.BLOCKED and "something static" in last.reason
    assert driven.world.robot_pose[0] > 2.4  # up to it, without a clearance


def test_what_comes_beside_the_plan_is_left_to_the_policy() -> None:
    """A robot that cannot stop has no room to circle between walls that it sees late."""
    car = replace(ROBOT, drive=Drive.CONSTANT_SPEED, max_speed=0.4, min_speed=0.4)
    driven = DrivenRobot("straight", room(car))
    walls = [square_at(x, y) for x in np.arange(3.0, 5.0, 0.45) for y in (2.4, 3.6)]
    change = when_at(2.0, lambda world: adding(world, *walls))
    assert driven.drive(400, change).status is CommandStatus.DONE
    assert all(driven.overlap(one) == 0.0 for one in walls)
    blocked = [one for one in driven.commands if one.status is CommandStatus.BLOCKED]
    assert len(blocked) < 5


class ShowsPlan(Ahead):
    """Drives ahead, and shows a plan of few poses, which may end sooner."""

    speed = 0.8

    def __init__(self, *places: float) -> None:
        poses = np.array([[x, 3.0, 0.0] for x in places])
        times = (poses[:, 0] - poses[0, 0]) / self.speed
        fast, still = np.full(len(places), self.speed), np.zeros(len(places))
        self.current_plan = Plan(times, poses, fast, still, travel_cost=1.0)


@pytest.mark.parametrize("drive", [Drive.DIFFERENTIAL, Drive.CONSTANT_SPEED])
@pytest.mark.parametrize("places", [(1.5, 4.0, 8.0), (1.5, 2.0, 2.5, 3.0, 3.5, 4.1)])
@pytest.mark.parametrize("at", [4.2, 4.6, 5.0])
def test_a_plan_that_is_shown_leads_no_robot_into_a_new_wall(drive, places, at) -> None:
    robot = replace(ROBOT, drive=drive, max_turn_rate=3.0)
    driven = DrivenRobot(ShowsPlan(*places), room(robot))
    post = np.array([[at, 2.6], [at + 0.05, 2.6], [at + 0.05, 3.4], [at, 3.4]])
    driven.drive(200, when_at(3.0, lambda world: adding(world, post)))
    assert driven.overlap(post) == 0.0


@pytest.mark.parametrize("turn", [-1.0, -0.5, 0.5, 1.0])
def test_a_robot_that_is_turned_away_from_its_plan_touches_no_new_wall(turn: float) -> None:
    block = np.array([[4.0, 3.3], [7.0, 3.3], [7.0, 4.0], [4.0, 4.0]])
    driven = DrivenRobot("straight", room())
    driven.drive(42, when_at(1.8, lambda world: adding(world, block)))
    kicked = driven.world.robot_pose + np.array([0.0, 0.0, turn])
    driven.world, driven.poses = driven.world.moved(robot_pose=kicked), [kicked]
    driven.drive(300)
    assert driven.overlap(block) == 0.0


@pytest.mark.parametrize("latency", [0.1, 1.0])
def test_a_robot_beside_its_plan_needs_few_plans(latency: float) -> None:
    driven = DrivenRobot("straight", room(), latency=latency)
    driven.drive(60)
    pushed = driven.world.robot_pose + np.array([0.0, -0.2, 0.0])
    driven.world = driven.world.moved(robot_pose=pushed)
    driven.poses = [pushed]
    assert driven.drive(400).status is CommandStatus.DONE
    assert len(driven.runner.policy.plan_log) <= 4


def test_a_map_that_is_perceived_anew_each_time_costs_no_plan(monkeypatch) -> None:
    rng = np.random.default_rng(0)
    exact = DrivenRobot.seen
    monkeypatch.setattr(DrivenRobot, "seen", lambda one: perceived_anew(exact(one), rng))
    driven = DrivenRobot("straight", adding(room(), wall(5.0, 0.0, 2.7), wall(5.0, 3.3, 6.0)))
    assert driven.drive(400).status is CommandStatus.DONE
    assert len(driven.runner.policy.plan_log) == 1
    assert {command.status for command in driven.commands[5:-1]} == {CommandStatus.DRIVING}


def test_a_robot_whose_policy_asks_for_no_motion_waits() -> None:
    policy = Ahead()
    policy.speed = 0.0
    last = DrivenRobot(policy, room()).drive(3)
    assert last.status is CommandStatus.WAITING and last.reason


def test_a_ship_plans_on_where_open_water_gets_its_first_obstacle() -> None:
    ship = replace(ROBOT, drive=Drive.CONSTANT_SPEED, max_speed=0.4, max_turn_rate=0.8)
    objects = Movables.from_outlines([SQUARE], [[4.0, 3.0, 0.0]], masses=[0.3])
    sea, line = StaticMap.build(bounds=[0, 0, 10, 6]), GoalLine([6.0, 3.0], [1.0, 0.0])
    world = replace(room(ship, objects), static=sea, goal=line)
    driven = DrivenRobot("ship-lattice-quick", world)
    hold = when_at(2.0, lambda world: world.believing([True]))
    assert driven.drive(400, hold).status is CommandStatus.DONE
    assert driven.overlap(square_at(4.0, 3.0)) == 0.0 and driven.runner.failures == 0


@pytest.mark.slow
def test_gtsp_mpc_pushes_what_can_be_pushed_and_waits_with_what_turned_out_fixed() -> None:
    objects = Movables.from_outlines([SQUARE] * 2, [[4.0, 3.0, 0.0], [5.0, 3.7, 0.3]])
    corners = np.array([[3.0, 2.0], [6.0, 2.0], [6.0, 5.0], [3.0, 5.0]])
    area = ClearanceArea(corners, np.ones(4, dtype=bool))
    driven = PushingRobot("gtsp-mpc", replace(room(objects=objects), goal=area))
    held = []

    def change(world: World, command: Command) -> World | None:
        moved = world.movables.poses[:, :2] - objects.poses[:, :2]
        pushed = np.hypot(*moved.T) > 0.1
        if held or not pushed.any():
            return None
        held.extend(pushed.tolist())
        return world.believing(held)

    last = driven.drive(1200, change)
    k = held.index(True)
    driven.poses = driven.poses[-1:]  # it was at the object when that turned out fixed
    assert driven.overlap(driven.world.movables.outline_world(k)) == 0.0
    assert driven.world.completed.tolist() == [n != k for n in range(2)]
    assert last.status is CommandStatus.WAITING and last.reason and not driven.runner.failures
