"""The workloads of `benchmarks.speed.paired`, and the process that runs them in one tree.

A worker reads a line of JSON for each question, ``[workload, calls]``, and answers with CPU time
and a digest of the result. It uses only what trees of different ages have in common.
"""

from __future__ import annotations

import gc
import hashlib
import json
import sys
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # before the first import of pushplan: that of PYTHONPATH counts
    tree = Path(sys.argv[1]).resolve()
    if "--not-installed" in sys.argv:
        sys.meta_path[:] = [
            finder for finder in sys.meta_path if "editable" not in finder.__module__
        ]

import numpy as np

import pushplan
from pushplan.control import MpcTracker
from pushplan.envs import PushEnv, make
from pushplan.gtsp import solve_gtsp
from pushplan.interaction import QuasiStatic
from pushplan.planners import make_planner, make_policy
from pushplan.planners.pushing import PushingMpc, PushPath
from pushplan.scenarios import suite
from pushplan.world import (
    FirstSolution,
    GoalDisc,
    MaxIterations,
    Movables,
    Receptacle,
    StaticMap,
    World,
    area_clearing_robot,
    jackal,
)
from pushplan.world.policy_abilities import shown_plan

Call = Callable[[], Iterable[object]]
"""What is timed; gives the parts of its result."""

SQUARE = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def started(name: str, count: int) -> list[PushEnv]:
    """Environments at the first starts of a suite."""
    envs = [make(scenario) for scenario in suite(name, episodes=count).scenarios]
    for env in envs:
        env.reset()
    return envs


def planned(planner: str, worlds: Iterable[World], iterations: int | None) -> list[object]:
    """Parts of the first plans in some worlds; of whole calls where iterations are None."""
    stop = None if iterations is None else FirstSolution() | MaxIterations(iterations)
    parts: list[object] = []
    for world in worlds:
        result = make_planner(planner).plan(world, stop=stop, rng=np.random.default_rng(0))
        parts.append(result.status)
        if result.plan is not None:
            parts += [result.plan.poses, result.plan.cost, result.plan.object_poses]
    return parts


def first_plans(planner: str, name: str, count: int, iterations: int | None = None) -> Call:
    """Plans at the starts of a suite."""
    worlds = [env.world for env in started(name, count)]
    return lambda: planned(planner, worlds, iterations)


def decisions(policy: str, name: str, count: int) -> Call:
    """First decisions of new policies at the starts of a suite, with their plans."""
    worlds = [env.world for env in started(name, count)]

    def call() -> list[object]:
        parts: list[object] = []
        for world in worlds:
            made = make_policy(policy)
            made.reset(world, np.random.default_rng(0))
            parts.append(made.act(world, None))
            plan = shown_plan(made)
            parts.append(None if plan is None else plan.poses)
        return parts

    return call


def tours(boxes: int, count: int) -> Call:
    """Orders of pushes: four nodes for each box, costs that differ by direction."""
    rng = np.random.default_rng(boxes)
    clusters = np.arange(4 * boxes).reshape(boxes, 4).tolist()
    points = rng.uniform(0.0, 10.0, (count, 4 * boxes, 2))
    costs = np.linalg.norm(points[:, :, None] - points[:, None], axis=-1)
    costs += rng.uniform(0.0, 2.0, costs.shape)

    def call() -> list[object]:
        found = [solve_gtsp(matrix, clusters) for matrix in costs]
        return [(tour.nodes, tour.cost) for tour in found]

    return call


def sweeps(objects: int, poses: int, count: int) -> Call:
    """Sweeps of a winding path through boxes on a lattice, and of its beginning if it is short."""
    rng = np.random.default_rng(objects)
    places = np.stack(np.divmod(np.arange(objects), 10), axis=1) * 0.9
    boxes = np.column_stack([places, np.zeros(objects)]) + rng.uniform(-0.15, 0.15, (objects, 3))
    along = 0.05 * np.arange(poses)
    path = np.column_stack([along - 1.0, 4.0 + np.sin(along), np.arctan(np.cos(along))])
    world = World(
        robot=jackal(drive="differential"),
        robot_pose=path[0],
        static=StaticMap.build(bounds=[-20.0, -20.0, 40.0, 40.0]),
        movables=Movables.from_outlines([0.5 * SQUARE] * objects, boxes),
        goal=GoalDisc((30.0, 0.0), 1.0),
    )

    def call() -> list[object]:
        swept = [
            QuasiStatic().sweep(world, path + np.array([0.0, 0.01 * k, 0.0])) for k in range(count)
        ]
        return [part.object_poses for part in swept]

    return call


def tracking() -> Call:
    """Commands along a plan through a maze, from beside it."""
    (env,) = started("maze-2d-3", 1)
    rng = np.random.default_rng(0)
    plan = make_planner("kinodynamic-rrt").plan(env.world, stop=MaxIterations(2000), rng=rng).plan
    assert plan is not None
    seen = [
        env.world.moved(robot_pose=pose + rng.normal(0.0, 0.02, 3), time=time)
        for pose, time in zip(plan.poses, plan.times, strict=True)
    ]

    def call() -> list[object]:
        tracker = MpcTracker()
        tracker.reset(seen[0])
        return [tracker.command(world, plan) for world in seen]

    return call


def pushing() -> Call:
    """Commands for a box that is pushed along an S, robot and box beside where they should be."""
    rng = np.random.default_rng(0)
    robot = area_clearing_robot()
    path = PushPath.arcs(np.zeros(3), [(2.0, 0.0), (5.0, 0.2), (5.0, -0.2), (2.0, 0.0)])
    plan = path.plan(robot, 0)
    heading = path.poses[:, 2]
    behind = path.poses - 1.3 * np.column_stack(
        [np.cos(heading), np.sin(heading), np.zeros(len(heading))]
    )
    start = World(
        robot=robot,
        robot_pose=behind[0],
        static=StaticMap.build(bounds=[-50.0, -50.0, 50.0, 50.0]),
        movables=Movables.from_outlines([SQUARE], path.poses[:1]),
        goal=Receptacle(SQUARE + 40.0),
    )
    seen = [
        start.moved(
            robot_pose=behind[k] + rng.normal(0.0, 0.01, 3),
            movable_poses=path.poses[k : k + 1],
            time=plan.times[k],
        )
        for k in range(len(behind))
    ]

    def call() -> list[object]:
        mpc = PushingMpc()
        mpc.reset(start)
        return [mpc.command(world, plan) for world in seen]

    return call


def steps(name: str, count: int, observed: bool = False) -> Call:
    """Steps from the start of a suite, with the first observation and action of the task.

    Args:
        name: of the suite.
        count: of steps.
        observed: the observations alone, of the worlds at those steps.
    """
    (scenario,) = suite(name, episodes=1).scenarios
    env = make(scenario, observation="image" if observed else None)
    assert env.action_space.shape is not None
    actions = np.random.default_rng(0).uniform(-0.5, 1.0, (count, *env.action_space.shape))
    actions = actions.astype(np.float32)
    worlds: list[World] = []

    def call() -> list[object]:
        env.reset(seed=scenario.seed)
        for action in actions:
            *_, over, late, _ = env.step(action)
            worlds.append(env.world)
            if over or late:
                env.reset(seed=scenario.seed)
        return [env.world.robot_pose, env.world.movables.poses]

    if not observed:
        return lambda: (worlds.clear(), *call())
    call()
    view: Any = env.task.observation("image")
    return lambda: [np.array(view.observe(world)) for world in worlds]


def large_map(planner: str, obstacles: int) -> Call:
    """A first plan across a map that is new each time."""
    side = 2.5 * np.sqrt(obstacles)
    places = np.random.default_rng(0).uniform(2.0, side - 2.0, (obstacles, 1, 2))
    outlines = list(places + 0.4 * SQUARE)
    nothing = started("maze-2d-3", 1)[0].world.movables.empty()

    def call() -> list[object]:
        world = World(
            robot=jackal(drive="differential"),
            robot_pose=(1.0, 1.0, 0.8),
            static=StaticMap.build(outlines, bounds=[0.0, 0.0, side, side]),
            movables=nothing,
            goal=GoalDisc((side - 1.0, side - 1.0), 0.5),
        )
        return planned(planner, [world], 20_000)

    return call


def first_ice() -> Call:
    """Starts of episodes among new floes."""
    (env,) = started("ship-ice-2d-30", 1)

    def call() -> list[object]:
        env.reset(seed=7)
        return [env.world.movables.poses]

    return call


WORKLOADS: dict[str, Callable[[], Call]] = {
    **{
        f"plan: {planner}, {name}": partial(first_plans, planner, name, count, iterations)
        for planner, name, count, iterations in (
            ("straight", "maze-2d-10", 4, None),
            ("geometric-rrt", "maze-2d-10", 8, 20_000),
            ("kinodynamic-rrt", "maze-2d-10", 8, 20_000),
            ("push-aware", "maze-2d-10", 4, 20_000),
            ("namo", "namo-2d-several", 1, None),
            ("skeleton", "ship-ice-2d-30", 1, None),
            ("ship-lattice", "ship-ice-2d-30", 1, None),
            ("ship-lattice-quick", "ship-ice-2d-30", 4, None),
            ("ship-lattice-published", "ship-ice-2d-30", 2, None),
            ("ship-predictive", "ship-ice-2d-30", 1, None),
            ("ship-predictive-network", "ship-ice-2d-30", 1, None),
            ("ship-predictive-published", "ship-ice-2d-30", 1, None),
        )
    },
    **{
        f"decision: {policy}, {name}": partial(decisions, policy, name, count)
        for policy, name, count in (
            ("greedy", "area-clearing-2d-10-walled", 4),
            ("gtsp", "box-delivery-2d-small-columns-10", 1),
            ("gtsp-mpc", "area-clearing-2d-10-walled", 1),
            ("gtsp-mpc", "box-delivery-2d-small-columns-10", 1),
            ("mppi", "maze-2d-10", 1),
        )
    },
    **{f"GTSP: {n} boxes": partial(tours, n, count) for n, count in ((10, 4), (20, 1), (40, 1))},
    **{
        f"sweep: {objects} objects, {poses} poses": partial(sweeps, objects, poses, count)
        for objects, poses, count in ((10, 10, 100), (10, 200, 10), (40, 200, 5), (200, 400, 2))
    },
    "commands: MPC of tracking": tracking,
    "commands: MPC of pushing": pushing,
    **{
        f"observations: {name}": partial(steps, name, 30, True)
        for name in ("maze-2d-10", "box-delivery-2d-large-columns-20", "ship-ice-2d-30")
    },
    **{
        f"steps: {name}": partial(steps, name, count)
        for name, count in (
            ("maze-2d-10", 50),
            ("namo-2d-several", 50),
            ("area-clearing-2d-10-walled", 20),
            ("box-delivery-2d-small-columns-10", 20),
            ("ship-ice-2d-30", 20),
            ("maze-3d-10", 20),
        )
    },
    "start: ship-ice-2d-30": first_ice,
    "large map: straight": partial(large_map, "straight", 1000),
    "large map: kinodynamic-rrt": partial(large_map, "kinodynamic-rrt", 1000),
}


def digest(result: Iterable[object]) -> str:
    """A digest of all bytes of a result."""
    found = hashlib.sha256()
    for part in result:
        found.update(part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode())
    return found.hexdigest()


def answer_questions() -> None:
    """Answer until there are no more questions."""
    answers = sys.stdout
    sys.stdout = sys.stderr  # libraries may print
    prepared = ""
    for line in sys.stdin:
        name, calls = json.loads(line)
        try:
            if name != prepared:
                call = WORKLOADS[name]()
                prepared = name
                gc.collect()
                gc.freeze()
            gc.disable()  # a collection would fall to one tree or the other
            began = time.process_time()
            for _ in range(calls):
                result = call()
            seconds = (time.process_time() - began) / calls
            gc.enable()
            answer = {"seconds": seconds, "digest": digest(result)}
        except Exception as error:  # an older tree may lack what a workload needs
            answer = {"error": f"{type(error).__name__}: {error}"}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    if not Path(pushplan.__file__).resolve().is_relative_to(tree):
        sys.exit(f"pushplan comes from {Path(pushplan.__file__).parents[1]}, not from {tree}")
    answer_questions()
