"""Pushing a box along a curve: two controllers under disturbances, and the time of a step.

    python -m benchmarks.accuracy.pushing [--seeds 20] [--only disturbed|time] [--setting Burger]

"Geometric" is the controller that the predictions of pushes assume, `GeometricPusher`; "predictive"
is `PushingMpc` as `gtsp-mpc` uses it; "told" is the same with the delay, and with an observer gain
of 0.3 where poses are noisy. All begin at the same places and meet the same noise. A box is
lost when its centre has left the bumper, it is 0.4 L ahead of it, or it does not get to the end of
its path in twice the time that the path takes. L is the distance from the robot's axle to the
centre of a box on its bumper. Times are processor time of the thread, so that other processes on
the machine do not count.
"""

from __future__ import annotations

import functools
import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely

from benchmarks.reporting import command_line
from pushplan.envs.registry import SIMULATORS
from pushplan.envs.simulators.base import Materials, Simulator
from pushplan.envs.tasks.presets import SOLIDS
from pushplan.imports.on_demand import look_up
from pushplan.planners.pushing import (
    PushingConfig,
    PushingMpc,
    PushModel,
    PushParameters,
    PushPath,
    PushState,
    spread_of,
)
from pushplan.planners.rearrangement.push_controllers import GeometricPusher
from pushplan.planners.rearrangement.push_scene import PushScene
from pushplan.planners.rearrangement.rearrangement_config import RearrangementConfig
from pushplan.world import (
    Controller,
    Movables,
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

SQUARE = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
OPEN = StaticMap.build(bounds=[-100.0, -100.0, 100.0, 100.0])
ELSEWHERE = Receptacle(SQUARE + 90.0)
PERIOD = 0.2
DELAY = 0.1
NOISE = np.array([0.02, 0.02, math.radians(3.0)])
CURVES = {
    "S": [(1.0, 0.0), (2.5, 0.4), (2.5, -0.4), (1.0, 0.0)],
    "sharp S": [(0.5, 0.0), (1.4, 0.9), (1.4, -0.9), (1.0, 0.0)],
}
"""Lengths [L] and curvatures [1/L]."""


@dataclass(frozen=True)
class Setting:
    """A robot, a box and an engine.

    Args:
        name: in the table.
        simulator: name of the engine.
        robot: that pushes.
        side: of the box [m].
        parameters: friction that the controller is told, the true one but for a disturbance.
        mass: of the box [kg].
        nominal: friction of the engine's materials, where light boxes slide as if it were less.
    """

    name: str
    simulator: str
    robot: RobotModel
    side: float
    parameters: PushParameters
    mass: float | None = None
    nominal: float | None = None


@dataclass(frozen=True)
class Disturbance:
    """What differs from what the controllers assume.

    Args:
        name: in the table.
        friction: true friction over the one assumed.
        spread: true pressure radius over the one assumed.
        mass: true mass over that of the setting.
        noisy: whether the poses of robot and box are noisy.
        late: whether a command acts `DELAY` after the poses were measured.
    """

    name: str
    friction: float = 1.0
    spread: float = 1.0
    mass: float = 1.0
    noisy: bool = False
    late: bool = False


DISTURBANCES = (
    Disturbance("none"),
    Disturbance("twice the friction", friction=2.0),
    Disturbance("half the friction", friction=0.5),
    Disturbance("twice mass and pressure radius", spread=2.0, mass=2.0),
    Disturbance("half mass and pressure radius", spread=0.5, mass=0.5),
    Disturbance("noise of 2 cm, 3°", noisy=True),
    Disturbance("delay of 100 ms", late=True),
    Disturbance("all, twice", 2.0, 2.0, 2.0, True, True),
    Disturbance("all, half", 0.5, 0.5, 0.5, True, True),
)


def settings() -> list[Setting]:
    """Robots and boxes of the tasks, with the friction that `gtsp-mpc` assumes."""
    planar = spread_of("inertia", SQUARE)
    corners = spread_of("corners", SQUARE)
    burger = turtlebot3_burger("pusher", max_speed=0.2, max_turn_rate=0.785)
    told = PushParameters(0.2, planar)
    return [
        Setting("area clearing", "pymunk", area_clearing_robot(), 1.0, told),
        Setting("box delivery", "pymunk", box_delivery_robot(), 0.44, told),
        Setting("Burger", "mujoco", burger, 0.08, PushParameters(0.165, corners), 0.075, 0.4),
    ]


def scene(
    setting: Setting, off: Disturbance, path: PushPath, rng: np.random.Generator
) -> tuple[World, Simulator]:
    """The robot right behind the box, a little beside its middle and askew."""
    outline = setting.side * SQUARE
    model = PushModel(setting.robot, outline, setting.parameters)
    offset = rng.uniform(-0.1, 0.1) * model.bumper.half
    state = PushState(np.zeros(3), offset, rng.uniform(-0.15, 0.15), 0.03 * model.reach)
    box = model.box_pose(state)
    shift = path.poses[0, :2] - box[:2]
    masses = None if setting.mass is None else [off.mass * setting.mass]
    world = World(
        robot=setting.robot,
        robot_pose=np.array([*shift, 0.0]),
        static=OPEN,
        movables=Movables.from_outlines([outline], [box + np.array([*shift, 0.0])], masses=masses),
        goal=ELSEWHERE,
    )
    simulator: Simulator = look_up("simulator", SIMULATORS, setting.simulator)()
    solids = SOLIDS["turtlebot3"] if setting.robot.name == "turtlebot3" else None
    friction = off.friction * (setting.nominal or setting.parameters.friction)
    simulator.build(world, Materials(friction, friction, friction, solids=solids))
    return world, simulator


@dataclass(frozen=True)
class Run:
    """One push.

    Args:
        errors: distances of the box from the path [L].
        end: distance of the box from the end of the path at the end [L].
        driven: length that the robot drove [L].
        lost: whether the box was lost.
        times: of the commands [s].
    """

    errors: FloatArray
    end: float
    driven: float
    lost: bool
    times: list[float]


def drive(
    setting: Setting, off: Disturbance, pieces: str, make: Callable[..., Controller], seed: int
) -> Run:
    """Push a box until it is at the end of its path, or lost."""
    rng = np.random.default_rng(seed)
    model = PushModel(setting.robot, setting.side * SQUARE, setting.parameters)
    length = model.reach
    half = model.bumper.half
    path = PushPath.arcs(np.zeros(3), [(a * length, b / length) for a, b in CURVES[pieces]])
    way = shapely.LineString(path.poses[:, :2])
    world, simulator = scene(setting, off, path, rng)
    plan = path.plan(setting.robot, 0)
    controller = make(setting, off, world)
    before = Twist(0.0, 0.0)
    lost = True
    driven = 0.0
    errors = []
    times = []
    for _ in range(round(2.0 * plan.times[-1] / PERIOD)):
        seen = simulator.world()
        if off.noisy:
            noise = NOISE * rng.standard_normal((2, 3))
            seen = seen.moved(
                robot_pose=seen.robot_pose + noise[0], movable_poses=seen.movables.poses + noise[1]
            )
        began = time.thread_time()
        twist = controller.command(seen, plan)
        times.append(time.thread_time() - began)
        was = simulator.robot_pose.copy()
        if off.late:
            simulator.step(before, DELAY)
            before = twist
        simulator.step(twist, PERIOD - (DELAY if off.late else 0.0))
        robot = simulator.robot_pose
        box = simulator.object_poses[0]
        driven += float(np.hypot(*(robot - was)[:2])) / length
        along = way.project(shapely.Point(box[:2]))
        errors.append(way.distance(shapely.Point(box[:2])) / length)
        state = model.state(robot, box)
        lost = along < path.length - 0.02 * length
        if not lost or abs(state.offset) > half or state.gap > 0.4 * length:
            break
    end = float(np.hypot(*(simulator.object_poses[0] - path.poses[-1])[:2])) / length
    return Run(np.array(errors), end, driven, lost, times)


def geometric(setting: Setting, off: Disturbance, world: World) -> Controller:
    return GeometricPusher(PushScene(world, RearrangementConfig()).controller)


def predictive(setting: Setting, off: Disturbance, world: World, **changes: Any) -> Controller:
    spread = setting.parameters.spread / off.spread
    parameters = replace(setting.parameters, spread=spread)
    return PushingMpc(PushingConfig(parameters=parameters, period=PERIOD, **changes))


def told(setting: Setting, off: Disturbance, world: World) -> Controller:
    delay = DELAY if off.late else 0.0
    gain = 0.3 if off.noisy else 1.0
    return predictive(setting, off, world, delay=delay, observer_gain=gain)


CONTROLLERS = {"geometric": geometric, "predictive": predictive, "told": told}


def disturbed(chosen: list[Setting], seeds: int) -> None:
    """Print what becomes of each controller under each disturbance.

    Each cell: boxes lost, rms distance from the path and mean distance from its end of those that
    were not lost [% of L], and the mean length that the robot drove [L].
    """
    columns = " | ".join(f"{curve}: {name}" for curve in CURVES for name in CONTROLLERS)
    print(
        f"| setting | disturbance | {columns} |\n|{'---|' * (2 + len(CURVES) * len(CONTROLLERS))}"
    )
    for setting in chosen:
        for off in DISTURBANCES:
            cells = []
            for curve in CURVES:
                for name, make in CONTROLLERS.items():
                    if name == "told" and not (off.noisy or off.late):
                        cells.append("")
                        continue
                    runs = [drive(setting, off, curve, make, seed) for seed in range(seeds)]
                    kept = [run for run in runs if not run.lost]
                    errors = np.concatenate([run.errors for run in runs])
                    rms = float(np.sqrt((errors**2).mean()))
                    lost = len(runs) - len(kept)
                    end, far = (
                        np.mean([getattr(run, key) for run in kept]) if kept else math.nan
                        for key in ("end", "driven")
                    )
                    cells.append(f"{lost}, {100 * rms:.1f}, {100 * end:.1f}, {far:.2f}")
            print(f"| {setting.name} | {off.name} | {' | '.join(cells)} |", flush=True)


def timing(chosen: list[Setting], seeds: int) -> None:
    """Print the time of whole calls of `PushingMpc`, and how often its solver failed."""
    print("| setting | N | ms, quartile / median / p95 / p99 | solver failed |\n|---|---|---|---|")
    for setting in chosen:
        for horizon in (20, 40):
            config = PushingConfig(
                horizon=horizon,
                reach=0.15 * horizon,
                parameters=setting.parameters,
                period=PERIOD,
                delay=DELAY,
                observer_gain=0.3,
            )
            runs = []
            failed = 0
            for curve, seed in itertools.product(CURVES, range(seeds)):
                mpc = PushingMpc(config)
                make = functools.partial(lambda mpc, *_: mpc, mpc)
                runs.append(drive(setting, DISTURBANCES[-1], curve, make, seed))
                failed += mpc.fallbacks
            times = 1e3 * np.concatenate([run.times[3:] for run in runs])
            quantiles = " / ".join(f"{q:.2f}" for q in np.percentile(times, (25, 50, 95, 99)))
            cells = (setting.name, f"{horizon}", quantiles, f"{failed} of {len(times)}")
            print(f"| {' | '.join(cells)} |", flush=True)


def main() -> None:
    """Print the tables."""
    parser = command_line(__doc__, seeds=20)
    parser.add_argument("--only", choices=("time", "disturbed"))
    parser.add_argument("--setting", default="", help="only settings whose names hold this text")
    options = parser.parse_args()
    chosen = [setting for setting in settings() if options.setting in setting.name]
    if options.only != "time":
        disturbed(chosen, options.seeds)
    if options.only != "disturbed":
        timing(chosen, max(1, options.seeds // 4))


if __name__ == "__main__":
    main()
