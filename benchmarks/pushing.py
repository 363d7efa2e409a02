"""Pushing along a path: friction found, time and cost of a step, tracking error, boxes lost.

    python benchmarks/pushing.py [--seeds 10] [--only time|tracking|fit] [--figure pushes.png]

Lengths are in percent of L, the distance from the robot's axle to the centre of a box on its
bumper. A box is lost when its centre has left the bumper or it is 0.4 L ahead of it. "Noisy" is
noise of 1 cm and 2 degrees (standard deviations) on the poses of robot and box, and commands that
act 100 ms after the poses were measured, which `PushingMpc` was told. The baseline is the robot
following the path by pure pursuit without looking at the box. Times are processor time of the
thread, so that other processes on the machine do not count.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from pushplan.control import PurePursuit
from pushplan.envs.registry import SIMULATORS
from pushplan.envs.simulators.base import Materials, Simulator
from pushplan.envs.tasks.materials import SOLIDS
from pushplan.evaluation import push_figure
from pushplan.planners.pushing import (
    NonlinearPushingMpc,
    PushingConfig,
    PushingMpc,
    PushModel,
    PushParameters,
    PushPath,
    PushState,
    best_offset,
    identify,
    push_log,
    spread_of,
    warm_up,
)
from pushplan.world import (
    Controller,
    Episode,
    Movables,
    Plan,
    Receptacle,
    RobotModel,
    StaticMap,
    Twist,
    World,
    area_clearing_robot,
    box_delivery_robot,
    turtlebot3_burger,
)
from pushplan.world.checks import FloatArray
from pushplan.world.lazy_names import look_up

SQUARE = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
FLOOR = StaticMap.build(bounds=[-100.0, -100.0, 100.0, 100.0])
ELSEWHERE = Receptacle(SQUARE + 90.0)
DELAY = 0.1
NOISE = np.array([0.01, 0.01, math.radians(2.0)])


@dataclass(frozen=True)
class Setting:
    """A robot, a box and an engine.

    Args:
        name: in the table.
        simulator: name of the engine.
        robot: that pushes.
        side: of the box [m].
        friction: between bumper and box, in the engine.
        parameters: that the controller is told.
        period: between two commands [s].
        mass: of the box [kg].
    """

    name: str
    simulator: str
    robot: RobotModel
    side: float
    friction: float
    parameters: PushParameters
    period: float
    mass: float | None = None


def settings() -> list[Setting]:
    """The frictions and robots of the tasks. MuJoCo's light boxes chatter: fitted parameters."""
    planar = spread_of("inertia", SQUARE)
    corners = spread_of("corners", SQUARE)
    area, delivery = area_clearing_robot(), box_delivery_robot()
    pusher, collector = (
        turtlebot3_burger(bumper, max_speed=0.2, max_turn_rate=0.785)
        for bumper in ("pusher", "collector")
    )
    told = PushParameters
    chattering = told(0.15, corners)
    return [
        Setting("area-clearing", "pymunk", area, 1.0, 0.0, told(0.0, planar), 0.2),
        Setting("area-clearing", "pymunk", area, 1.0, 0.5, told(0.5, planar), 0.2),
        Setting("box-delivery", "pymunk", delivery, 0.44, 0.0, told(0.0, planar), 0.2),
        Setting("Burger, pusher", "pymunk", pusher, 0.08, 0.4, told(0.4, planar), 0.2, 0.075),
        Setting("Burger, pusher", "mujoco", pusher, 0.08, 0.4, chattering, 0.2, 0.075),
        Setting(
            "Burger, collector", "mujoco", collector, 0.08, 0.4, told(0.13, corners), 0.2, 0.075
        ),
    ]


def paths(length: float) -> dict[str, PushPath]:
    """Box paths, of a robot whose L is ``length`` [m]."""
    start = np.zeros(3)
    shapes = {
        "straight": [(6.0, 0.0)],
        "curved": [(2.0, 0.0), (4.0, 0.3)],
        "S": [(1.0, 0.0), (2.5, 0.4), (2.5, -0.4), (1.0, 0.0)],
    }
    return {
        name: PushPath.arcs(start, [(run * length, bend / length) for run, bend in pieces])
        for name, pieces in shapes.items()
    }


def scene(setting: Setting, path: PushPath, rng: np.random.Generator) -> tuple[World, Simulator]:
    """The robot right behind the box, at the best offset but for a tenth of half the bumper."""
    outline = setting.side * SQUARE
    model = PushModel(setting.robot, outline, setting.parameters)
    offset = best_offset(model, path, setting.robot.max_speed)
    offset += rng.uniform(-0.1, 0.1) * model.bumper.half
    state = PushState(np.zeros(3), offset, rng.uniform(-0.15, 0.15), 0.03 * model.reach)
    box = model.box_pose(state)
    shift = path.poses[0, :2] - box[:2]
    masses = None if setting.mass is None else [setting.mass]
    world = World(
        robot=setting.robot,
        robot_pose=np.array([*shift, 0.0]),
        static=FLOOR,
        movables=Movables.from_outlines([outline], [box + np.array([*shift, 0.0])], masses=masses),
        goal=ELSEWHERE,
    )
    simulator: Simulator = look_up("simulator", SIMULATORS, setting.simulator)()
    solids = SOLIDS["turtlebot3"] if setting.robot.name == "turtlebot3" else None
    friction = setting.friction
    simulator.build(world, Materials(friction, friction, friction, solids=solids))
    return world, simulator


@dataclass(frozen=True)
class Run:
    """One push: distances from the path [m], whether the box was lost, times of commands [s]."""

    errors: FloatArray
    lost: bool
    times: list[float]
    episode: Episode


def drive(
    setting: Setting, path: PushPath, plan: Plan, controller: Controller, noisy: bool, seed: int
) -> Run:
    """Push a box until it is at the end of its path, or lost."""
    rng = np.random.default_rng(seed)
    world, simulator = scene(setting, path, rng)
    model = PushModel(setting.robot, setting.side * SQUARE, setting.parameters)
    before, lost = Twist(0.0, 0.0), True
    errors, times = [], []
    robots, boxes = [simulator.robot_pose.copy()], [simulator.object_poses.copy()]
    for _ in range(round(4.0 * path.length / setting.robot.max_speed / setting.period)):
        seen = simulator.world()
        if noisy:
            noise = NOISE * rng.standard_normal((2, 3))
            seen = seen.moved(
                robot_pose=seen.robot_pose + noise[0], movable_poses=seen.movables.poses + noise[1]
            )
        began = time.thread_time()
        twist = controller.command(seen, plan)
        times.append(time.thread_time() - began)
        if noisy:
            simulator.step(before, DELAY)
            before = twist
        simulator.step(twist, setting.period - (DELAY if noisy else 0.0))
        robots.append(simulator.robot_pose.copy())
        boxes.append(simulator.object_poses.copy())
        state = model.state(robots[-1], boxes[-1][0])
        along, away = path.nearest(boxes[-1][0, :2])
        errors.append(away)
        if along >= path.length - 1e-9:
            lost = False
            break
        if abs(state.offset) > model.bumper.half or state.gap > 0.4 * model.reach:
            break
    clock: FloatArray = setting.period * np.arange(float(len(robots)))
    episode = Episode(world, clock, np.array(robots), np.array(boxes), not lost, "end")
    return Run(np.array(errors), lost, times, episode)


def config_of(setting: Setting, noisy: bool, horizon: int = 20) -> PushingConfig:
    return PushingConfig(
        horizon=horizon,
        moves=10,
        reach=3.0 * horizon / 20.0,
        parameters=setting.parameters,
        period=setting.period,
        delay=DELAY if noisy else 0.0,
        observer_gain=0.3 if noisy else 1.0,
    )


def tracking(seeds: int, say: Callable[[str], object]) -> None:
    """Table of errors and losses."""
    names = list(paths(1.0))
    say("\nrms / max distance from the path [% of L], and boxes lost of runs\n\n")
    say("| setting | engine | μ | | " + " | ".join(f"{n}: MPC | {n}: open loop" for n in names))
    say(" |\n|" + "---|" * (4 + 2 * len(names)) + "\n")
    for setting in settings():
        model = PushModel(setting.robot, setting.side * SQUARE)
        for noisy in (False, True):
            row = [setting.name, setting.simulator, f"{setting.friction:g}"]
            row.append("noisy" if noisy else "exact")
            for path in paths(model.reach).values():
                for make in (mpc_run, open_loop_run):
                    found = [make(setting, path, model, noisy, seed) for seed in range(seeds)]
                    errors = 100.0 * np.concatenate([run.errors for run in found]) / model.reach
                    lost = sum(run.lost for run in found)
                    rms = float(np.sqrt((errors**2).mean()))
                    row.append(f"{rms:.1f} / {errors.max():.1f}, {lost} of {seeds}")
            say("| " + " | ".join(row) + " |\n")
            sys.stdout.flush()


def mpc_run(setting: Setting, path: PushPath, model: PushModel, noisy: bool, seed: int) -> Run:
    controller = PushingMpc(config_of(setting, noisy))
    return drive(setting, path, path.plan(setting.robot, 0), controller, noisy, seed)


def open_loop_run(
    setting: Setting, path: PushPath, model: PushModel, noisy: bool, seed: int
) -> Run:
    """The robot's own path: up to where the box was, and on along the box's path."""
    ahead = np.array([math.cos(path.poses[0, 2]), math.sin(path.poses[0, 2])])
    behind = path.poses[0, :2] - 1.1 * model.reach * ahead
    lead = PushPath.straight(behind, path.poses[0, :2])
    whole = PushPath(np.concatenate([lead.poses[:-1], path.poses]))
    plan = whole.plan(setting.robot, 0)
    return drive(setting, path, plan, PurePursuit(), noisy, seed)


class _Compared(NonlinearPushingMpc):
    """Drives the quadratic program's commands and notes what the nonlinear problem would gain."""

    every = 5

    def __post_init__(self) -> None:
        super().__post_init__()
        self.gains: list[tuple[float, float]] = []
        self.seconds: list[float] = []
        self._calls = 0

    def _solve(self, robot: RobotModel, start: FloatArray) -> FloatArray | None:
        found = PushingMpc._solve(self, robot, start)
        self._calls += 1
        if found is not None and self._calls % self.every == 2 % self.every:
            steps = self._steps(robot)
            self._nonlinear(robot)
            began = time.thread_time()
            self._refined(robot, start, steps, found)
            self.seconds.append(time.thread_time() - began)
            self.gains.append(self.gain)
            self._solution_steps = steps
        return found


def timing(seeds: int, say: Callable[[str], object]) -> None:
    """Table of times and of the cost that the quadratic program gives away."""
    say("\n| setting | engine | μ | N | QP ms quartile / median / p95 / p99 | NMPC ms median | ")
    say("ratio | cost above NMPC, total / p95 | solver failed |\n|" + "---|" * 9 + "\n")
    for setting in settings():
        model = PushModel(setting.robot, setting.side * SQUARE)
        for horizon in (20, 40):
            times, slow, failed = [], [], 0
            gains: list[tuple[float, float]] = []
            for path in paths(model.reach).values():
                plan = path.plan(setting.robot, 0)
                for seed in range(seeds):
                    quick = PushingMpc(config_of(setting, True, horizon))
                    times += drive(setting, path, plan, quick, True, seed).times[3:]
                    failed += quick.fallbacks
                compared = _Compared(config_of(setting, True, horizon))
                drive(setting, path, plan, compared, True, 0)
                gains += compared.gains
                slow += compared.seconds
            clock, nonlinear = 1e3 * np.array(times), 1e3 * np.array(slow)
            cost = np.array(gains)
            above = 100.0 * (cost[:, 0] / np.maximum(cost[:, 1], 1e-9) - 1.0)
            total = 100.0 * (cost[:, 0].sum() / cost[:, 1].sum() - 1.0)
            cells: Iterable[str] = (
                setting.name,
                setting.simulator,
                f"{setting.friction:g}",
                f"{horizon}",
                " / ".join(f"{np.percentile(clock, p):.2f}" for p in (25, 50, 95, 99)),
                f"{np.median(nonlinear):.1f}",
                f"{np.median(nonlinear) / np.median(clock):.0f}",
                f"{total:.2f} % / {np.percentile(above, 95):.2f} %",
                f"{failed} of {len(times)}",
            )
            say("| " + " | ".join(cells) + " |\n")
            sys.stdout.flush()


def recorded(setting: Setting, friction: float, seed: int) -> Episode:
    """A push with random turns, until the box is near the bumper's end."""
    rng = np.random.default_rng(seed)
    setting = replace(setting, friction=friction)
    reach = PushModel(setting.robot, setting.side * SQUARE).reach
    path = PushPath.straight((0.0, 0.0), (4.0 * reach, 0.0))
    turns = rng.uniform(-0.9, 0.9, 12) / reach
    world, simulator = scene(setting, path, rng)
    model = PushModel(setting.robot, setting.side * SQUARE)
    period = 0.1 * reach / setting.robot.max_speed
    robots, boxes = [simulator.robot_pose.copy()], [simulator.object_poses.copy()]
    for i in range(48):
        speed = setting.robot.max_speed
        simulator.step(Twist(speed, speed * turns[i // 4]), period)
        robots.append(simulator.robot_pose.copy())
        boxes.append(simulator.object_poses.copy())
        if abs(model.state(robots[-1], boxes[-1][0]).offset) > 0.8 * model.bumper.half:
            break
    clock: FloatArray = period * np.arange(float(len(robots)))
    return Episode(world, clock, np.array(robots), np.array(boxes), True, "end")


def identification(seeds: int, say: Callable[[str], object]) -> None:
    """Table of identified friction."""
    frictions = (0.0, 0.2, 0.4, 0.6)
    say("\nfriction ± standard error, and rms error of the model [% of L]\n\n| setting | engine | ")
    say(" | ".join(f"μ = {friction:g}" for friction in frictions))
    say(" |\n|" + "---|" * (2 + len(frictions)) + "\n")
    chosen = settings()
    burger = replace(chosen[5], simulator="pymunk")
    for setting in (chosen[0], chosen[3], burger, chosen[4], chosen[5]):
        row = [setting.name, setting.simulator]
        for friction in frictions:
            fit = identify([recorded(setting, friction, seed) for seed in range(seeds)])
            error = f"{fit.friction_error:.3f}" if math.isfinite(fit.friction_error) else "?"
            found = f"{fit.parameters.friction:.3f} ± {error}"
            row.append(f"{found}, {100.0 * fit.rms:.1f}")
        say("| " + " | ".join(row) + " |\n")


def picture(path: str) -> None:
    """Draw noisy pushes along the S."""
    chosen = settings()
    logs = {}
    for setting in (chosen[0], chosen[1], chosen[4]):
        model = PushModel(setting.robot, setting.side * SQUARE)
        shape = paths(model.reach)["S"]
        run = mpc_run(setting, shape, model, True, 0)
        name = f"{setting.name}, {setting.simulator}, μ = {setting.friction:g}"
        log = push_log(run.episode, 0, setting.parameters, shape)
        pace = model.reach / setting.robot.max_speed  # so that they fit on one axis
        logs[name] = replace(log, times=log.times / pace, lateral=log.lateral / model.reach)
    figure = push_figure(logs)
    figure.axes[-1].set_xlabel("time [L / speed]")
    figure.axes[-1].set_ylabel("distance from\nthe path [L]")
    figure.savefig(path, dpi=130)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, help="runs of each path")
    parser.add_argument("--only", choices=("time", "tracking", "fit"))
    parser.add_argument("--figure", help="only draw pushes along the S into this file")
    options = parser.parse_args()
    warm_up()
    if options.figure:
        picture(options.figure)
        return
    if options.only in (None, "fit"):
        identification(options.seeds, sys.stdout.write)
    if options.only in (None, "time"):
        timing(max(1, options.seeds // 5), sys.stdout.write)
    if options.only in (None, "tracking"):
        tracking(options.seeds, sys.stdout.write)


if __name__ == "__main__":
    main()
