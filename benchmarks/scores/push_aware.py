"""The push-aware planner against the others in the maze, and how good its plans are how soon.

Usage::

    python -m benchmarks.scores.push_aware [--episodes 50] [--suite maze-2d-3,maze-3d-6-z]
    python -m benchmarks.scores.push_aware --times [--worlds 24] [--suite maze-2d-10] [--cpu]

    python -m benchmarks.scores.push_aware --picture docs/images/push-aware.png

The first form drives episodes and prints, for each suite, one row per policy and the differences
of the last policy from the others, scenario by scenario. The second form times planning calls; with
``--cpu`` by the time of the processor, which a busy machine changes less. The third draws a plan
through a door in which a box stands. Tables are Markdown. Seeds begin at ``--seed`` (0).
"""

from __future__ import annotations

import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.reporting import command_line
from pushplan.drawing import Panel, draw_figure, save_figure
from pushplan.envs import RolloutInteraction, make
from pushplan.evaluation import Results, bench, bootstrap_interval, wilson
from pushplan.planners import make_planner, warm_up
from pushplan.planners.push_aware import PushAware
from pushplan.scenarios import suite
from pushplan.world import (
    FirstSolution,
    GoalDisc,
    Movables,
    RobotModel,
    StaticMap,
    Stop,
    StopCheck,
    World,
)

SUITES = tuple(
    f"maze-{dimension}-{boxes}{shape}"
    for dimension in ("2d", "3d")
    for shape in ("", "-z")
    for boxes in (3, 6, 10)
)
POLICIES = (
    "straight",
    "geometric-rrt",
    "kinodynamic-rrt",
    "push-aware-constant-speed",
    "push-aware",
)
METRICS = ("E_nav", "E_nav_to_goal_point", "I_nav")
BUDGETS = (0.02, 0.05, 0.1, 0.25, 1.0)


Clock = Callable[[], float]


@dataclass(frozen=True)
class Until(Stop):
    """A deadline by any clock [s]."""

    seconds: float = 1.0
    clock: Clock = time.perf_counter

    def start(self) -> StopCheck:
        """Arm the rule for one call."""
        end = self.clock() + self.seconds
        return lambda done, cost: self.clock() >= end


def say(line: str) -> None:
    """One line, at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> None:
    """Run what the arguments ask for."""
    parser = command_line(__doc__, episodes=50, workers=2, seed=0)
    parser.add_argument("--suite", default="", help="names of suites, separated by commas")
    parser.add_argument("--policies", default=",".join(POLICIES))
    parser.add_argument("--times", action="store_true", help="time planning calls")
    parser.add_argument("--cpu", action="store_true", help="with --times: of the processor")
    parser.add_argument("--worlds", type=int, default=24, help="with --times: worlds of a suite")
    parser.add_argument("--long", type=float, default=10.0, help="with --times: longest call [s]")
    parser.add_argument("--picture", default="", help="draw the door into this file")
    options = parser.parse_args()
    if options.picture:
        draw_door(options.picture)
        return
    say(f"{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}\n")
    if options.times:
        names = options.suite.split(",") if options.suite else ["maze-2d-3", "maze-2d-10"]
        clock = time.thread_time if options.cpu else time.perf_counter
        anytime(names, options.worlds, options.seed, options.long, clock)
        return
    names = options.suite.split(",") if options.suite else SUITES
    policies = options.policies.split(",")
    quality(names, policies, options.episodes, options.seed, options.workers)


def quality(
    names: list[str] | tuple[str, ...], policies: list[str], episodes: int, seed: int, workers: int
) -> None:
    """Scores of each policy on each suite, and paired differences."""
    say("| suite | policy | success | E_nav | E_nav to goal point | I_nav | plan [ms] |")
    say("|---|---|---|---|---|---|---|")
    differences = []
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            results = bench(
                name, policies, episodes=episodes, seed=seed, workers=workers, out=folder
            )
            values = scores(results, policies)
        for policy in policies:
            say(f"| `{name}` | `{policy}` | {row(values[policy])} |")
        for policy in policies[:-1]:
            differences.append(
                f"| `{name}` | `{policy}` | {paired(values[policy], values[policies[-1]])} |"
            )
    if differences:
        say(f"\n`{policies[-1]}` less each of the others, on the same scenarios:\n")
        say("| suite | less | E_nav | E_nav to goal point | I_nav |")
        say("|---|---|---|---|---|")
        say("\n".join(differences))


def scores(results: Results, policies: list[str]) -> dict[str, dict[str, list[float]]]:
    """For each policy, values by scenario; episodes that failed count as E = 0, I = 1."""
    from pushplan.metrics import compute

    found: dict[str, dict[str, list[float]]] = {}
    for policy in policies:
        columns: dict[str, list[float]] = {key: [] for key in (*METRICS, "success", "ms")}
        mine = sorted((r for r in results.rows if r.policy == policy), key=lambda r: r.seed)
        for one in mine:
            if one.failed:
                values = {"E_nav": 0.0, "E_nav_to_goal_point": 0.0, "I_nav": 1.0}
            else:
                episode = results.episode(one)
                assert episode is not None
                values = compute(episode, METRICS)
            for key in METRICS:
                columns[key].append(values[key])
            columns["success"].append(float(one.success))
            if one.plan_time_median_s is not None:
                columns["ms"].append(1e3 * one.plan_time_median_s)
        found[policy] = columns
    return found


def row(values: dict[str, list[float]]) -> str:
    """Cells of one policy: means with 95 % intervals."""
    good, count = int(sum(values["success"])), len(values["success"])
    share = wilson(good, count)
    cells = [f"{good / count:.2f} [{share.low:.2f}, {share.high:.2f}]"]
    for key in METRICS:
        low, high = bootstrap_interval(values[key])
        cells.append(f"{np.mean(values[key]):.3f} [{low:.3f}, {high:.3f}]")
    cells.append(f"{np.median(values['ms']):.0f}" if values["ms"] else "")
    return " | ".join(cells)


def paired(other: dict[str, list[float]], ours: dict[str, list[float]]) -> str:
    """Cells of the differences, with 95 % intervals."""
    cells = []
    for key in METRICS:
        difference = np.subtract(ours[key], other[key])
        low, high = bootstrap_interval(difference)
        cells.append(f"{difference.mean():+.3f} [{low:+.3f}, {high:+.3f}]")
    return " | ".join(cells)


def worlds(name: str, count: int, seed: int) -> list[World]:
    """The starts of the first scenarios of a suite, for a robot that may slow down."""
    found = []
    for scenario in suite(name, episodes=count, first_seed=seed).scenarios:
        env = make(scenario, observation="state", action="velocity")
        env.reset(seed=scenario.seed)
        found.append(env.world)
    return found


def anytime(names: list[str], count: int, seed: int, longest: float, clock: Clock) -> None:
    """Cost after a time over the cost after the longest, and the time of the first plan."""
    warm_up("push-aware", "kinodynamic-rrt")
    planner = make_planner("push-aware")
    assert isinstance(planner, PushAware)
    say("First plan [ms], one call each:\n")
    say("| suite | planner | median | p95 | p99 | max |")
    say("|---|---|---|---|---|---|")
    scenes = {name: worlds(name, count, seed) for name in names}
    for name in names:
        for label in ("kinodynamic-rrt", "push-aware"):
            times = [first_plan(label, world, i, clock) for i, world in enumerate(scenes[name])]
            cells = (f"{value:.1f}" for value in np.percentile(times, [50, 95, 99, 100]))
            say(f"| `{name}` | `{label}` | {' | '.join(cells)} |")
    say(f"\nCost after a time, over that after {longest:g} s, and its gap to the lower bound:\n")
    heads = " | ".join(f"{1e3 * budget:.0f} ms" for budget in BUDGETS)
    say(f"| suite | | {heads} | gap | expansions/s | shortcuts and edges/s |")
    say("|---|---|" + "---|" * (len(BUDGETS) + 3))
    for name in names:
        planner.plan(scenes[name][0], stop=Until(1.0, clock))  # makes the table of this map
        ratios, gaps, rates = [], [], []
        for i, world in enumerate(scenes[name]):
            found = []
            for budget in (*BUDGETS, longest):
                rng = np.random.default_rng(i)
                result = planner.plan(world, stop=Until(budget, clock), rng=rng)
                found.append(result.stats.detail.get("cost", np.inf))
            if not np.isfinite(found[-1]):
                continue  # nothing to compare with: no plan at all
            stats = result.stats
            ratios.append(np.array(found[:-1]) / found[-1])
            gaps.append(stats.detail["gap"])
            expansions = stats.detail["expansions"]
            rates.append((expansions / longest, (stats.iterations - expansions) / longest))
        rate = np.median(rates, axis=0)
        for label, share in (("median", 50), ("p90", 90)):
            cells = " | ".join(
                f"{value:.3f}" for value in np.percentile(ratios, share, axis=0, method="nearest")
            )
            gap = np.percentile(gaps, share)
            say(f"| `{name}` | {label} | {cells} | {gap:.3f} | {rate[0]:.0f} | {rate[1]:.0f} |")


def draw_door(file: str) -> None:
    """A plan through the only door, in which a box stands, as the simulator drives it."""
    square = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    walls = [[0, 0, 16, 0], [0, 8, 16, 8], [0, 0, 0, 8], [16, 0, 16, 8]]
    door = [[7, 0, 7, 2.9], [7, 5.1, 7, 8]]
    boxes = np.array([[7.0, 4.3, 0.3], [9.2, 3.2, 0.2], [8.9, 5.2, 0.5]])
    world = World(
        robot=RobotModel.from_outline(
            1.4 * square, mass=1.0, drive="constant_speed", max_speed=0.15, max_turn_rate=0.3
        ),
        robot_pose=[2.0, 4.0, 0.0],
        static=StaticMap.build(segments=[*walls, *door], radii=0.2, bounds=[0, 0, 16, 8]),
        movables=Movables.from_outlines([square] * 3, boxes),
        goal=GoalDisc([14.0, 4.0], 0.8),
    )
    plan = make_planner("push-aware").plan(world).plan
    assert plan is not None
    driven = RolloutInteraction().sweep(world, plan.poses)
    say(
        f"planned {plan.length:.2f} m, work {plan.interaction_cost:.2f} kg m predicted, "
        f"{driven.work:.2f} kg m in the simulator, jams: {driven.jammed_at >= 0}"
    )
    panels = []
    for share in (0.0, 0.5, 1.0):
        at = int(share * (len(plan.poses) - 1))
        now = world.moved(robot_pose=plan.poses[at], movable_poses=driven.object_poses[at])
        trails = driven.object_poses[: at + 1]
        path = plan.poses[: at + 1]
        driving = {"trail": path, "object_trails": trails} if at else {"plan": plan}
        panels.append(Panel(now, **driving))
    save_figure(file, draw_figure(*panels, width_in=3.8, columns=1))


def first_plan(name: str, world: World, seed: int, clock: Clock) -> float:
    """Time of a call that returns its first plan [ms]."""
    planner = make_planner(name)
    began = clock()
    planner.plan(world, stop=FirstSolution() | Until(2.0, clock), rng=np.random.default_rng(seed))
    return 1e3 * (clock() - began)


if __name__ == "__main__":
    main()
