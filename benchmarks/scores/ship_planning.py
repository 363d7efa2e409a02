"""The ship planners: quality in closed loop, or times of planning calls, as tables in Markdown.

Usage::

    python -m benchmarks.scores.ship_planning [--episodes 50] [--seed 0] [--workers 2] [--ice 10,30]
    python -m benchmarks.scores.ship_planning --full-scale [--episodes 10]
    python -m benchmarks.scores.ship_planning --times [--fields 20]
    python -m benchmarks.scores.ship_planning --picture docs/images/ship-planners.png [--seed 1003]

Quality: Ship-Ice 2D, goal line at 9 m, every policy on the same fields; 95 % bootstrap intervals.
The ratio of work to that of `ship-lattice-published` is the ratio of the means, resampled in pairs.
No work at all counts as less than straight, also where straight ahead has none either.
Full scale: the 76 m ship at 30 %, Pymunk and MuJoCo. Times: first plan of an episode, no stop rule.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.reporting import command_line
from pushplan.drawing.palette import DASHES, SERIES
from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.evaluation import ResultRow, bench
from pushplan.evaluation.statistics.estimates import estimate
from pushplan.motion.speed_profile import turning_radius
from pushplan.motion.state_lattice.lattice_builder import LatticeBuilder
from pushplan.motion.state_lattice.lattice_search import open_search
from pushplan.planners import make_planner, warm_up
from pushplan.planners.ship_lattice import ShipLatticeConfig
from pushplan.planners.ship_lattice.floe_costs import floe_costs
from pushplan.scenarios import Scenario
from pushplan.world import World, stream

BASE = "ship-lattice-published"
FLOOR = "straight"
POLICIES = (
    FLOOR,
    "skeleton",
    "geometric-rrt",
    BASE,
    "ship-lattice-quick",
    "ship-lattice",
    "ship-predictive",
    "ship-predictive-network",
)
TIMED = ("skeleton", BASE, "ship-lattice-quick", "ship-lattice", "ship-predictive")
ICE = (10, 20, 30, 40, 50)


def main() -> None:
    """The command."""
    parser = command_line(__doc__, episodes=50, seed=0, workers=2)
    parser.add_argument("--ice", default=",".join(map(str, ICE)), help="concentrations [%%]")
    parser.add_argument("--policies", default=",".join(POLICIES))
    parser.add_argument("--full-scale", action="store_true")
    parser.add_argument("--times", action="store_true")
    parser.add_argument("--fields", type=int, default=20, help="fields in each row of times")
    parser.add_argument("--picture", type=Path, help="draw the first plans on one field instead")
    options = parser.parse_args()
    if options.picture:
        picture(options.picture, options.seed)
        return
    shares = [int(text) for text in options.ice.split(",")]
    if options.times:
        times(shares, options.fields, options.seed)
        return
    names = options.policies.split(",")
    runs = [(f"{ice} %", "pymunk", "benchmark", ice) for ice in shares]
    if options.full_scale:
        names = [name for name in names if name in (FLOOR, BASE, "ship-lattice", "ship-predictive")]
        runs = [(f"30 %, {engine}", engine, "full_scale", 30) for engine in ("pymunk", "mujoco")]
    print(
        "| ice | policy | success | E_nav | I_nav | work | work / published | less than straight |"
    )
    print("|---|---|---|---|---|---|---|---|", flush=True)
    for title, simulator, preset, ice in runs:
        scenarios = [
            Scenario("ship_ice", simulator, preset, {"concentration": ice / 100.0}, seed)
            for seed in range(options.seed, options.seed + options.episodes)
        ]
        results = bench(scenarios, names, workers=options.workers)
        for name in results.policies:
            print(f"| {title} | `{name}` | {quality(results.rows, name)} |", flush=True)


def quality(rows: Sequence[ResultRow], name: str) -> str:
    """The cells of one policy."""
    mine = {row.seed: row for row in rows if row.policy == name}
    done = [row for row in mine.values() if not row.failed]
    share = sum(row.success for row in mine.values()) / len(mine)
    if not done:
        return f"{share:.2f} | | | | |"
    cells = [f"{share:.2f}"]
    for score in ("E_nav", "I_nav", "interaction_work_kg_m"):
        found = estimate([getattr(row, score) for row in done])
        numbers = [figure(value) for value in (found.mean, found.low, found.high)]
        cells.append(f"{numbers[0]} ({numbers[1]}-{numbers[2]})")
    works = {
        other: {row.seed: row.interaction_work_kg_m for row in rows if row.policy == other}
        for other in (BASE, FLOOR, name)
    }
    cells.append(ratio(works[name], works[BASE]))
    pairs = paired(works[name], works[FLOOR] if name != FLOOR else {})
    better = (pairs[:, 0] < pairs[:, 1]) | (pairs.max(axis=1, initial=0.0) == 0.0)
    cells.append(f"{int(better.sum())} of {len(pairs)}" if len(pairs) else "")
    return " | ".join(cells)


def figure(value: float) -> str:
    """A number with three digits after the point, or three significant ones."""
    return f"{value:.3f}" if value < 1.0 else f"{value:.3g}"


def paired(first: dict[int, float | None], second: dict[int, float | None]) -> np.ndarray:
    """(N, 2) values of the seeds that both have."""
    both = [(first[seed], second[seed]) for seed in first if second.get(seed) is not None]
    return np.array([pair for pair in both if pair[0] is not None], dtype=float).reshape(-1, 2)


def ratio(first: dict[int, float | None], second: dict[int, float | None]) -> str:
    """Ratio of the means, with the interval of a bootstrap over pairs."""
    pairs = paired(first, second)
    if len(pairs) == 0 or pairs[:, 1].mean() == 0.0:
        return ""
    drawn = stream(0, "bootstrap").integers(0, len(pairs), (9999, len(pairs)))
    means = pairs[drawn].mean(axis=1)
    low, high = np.quantile(means[:, 0] / np.maximum(means[:, 1], 1e-12), [0.025, 0.975])
    return f"{pairs[:, 0].mean() / pairs[:, 1].mean():.2f} ({low:.2f}-{high:.2f})"


def times(shares: Sequence[int], fields: int, seed: int) -> None:
    """Times of planning calls and node rates."""
    warm_up(*TIMED)
    print("Times in ms: median of the first path; median / p95 / p99 / worst of whole calls.\n")
    print("| goal, ice | planner | first path | whole call | CPU median | nodes |")
    print("|---|---|---|---|---|---|", flush=True)
    for distance in (8.0, 38.0):
        for ice in shares:
            worlds = starts(fields, seed, ice, {"goal_distance": distance})
            for name in TIMED:
                cells = row(make_planner(name), worlds)
                print(f"| {distance + 1:.0f} m, {ice} % | `{name}` | {cells} |", flush=True)
    print("\n| search of the lattice to the end, 50 %, 39 m | nodes | nodes a second |")
    print("|---|---|---|")
    worlds = starts(3, seed, 50, {"goal_distance": 38.0})
    for title, config in (
        ("`ship-lattice`", ShipLatticeConfig()),
        ("`ship-lattice-published`", ShipLatticeConfig.published()),
    ):
        print(f"| {title} | {rate(worlds, config)} |", flush=True)


def starts(
    fields: int, seed: int, ice: int, variations: dict[str, float], preset: str = "benchmark"
) -> list[World]:
    """The worlds at the start of some episodes."""
    task = ShipIceTask(preset=preset, variations={"concentration": ice / 100.0, **variations})
    return [task.start(stream(seed + k, "layout")) for k in range(fields)]


def row(planner: object, worlds: list[World]) -> str:
    """First path, whole call, CPU time and nodes; the second call on each world counts."""
    walls, firsts, cpus, nodes = [], [], [], []
    for world in worlds:
        for _ in range(2):
            cpu, wall = time.process_time(), time.perf_counter()
            result = planner.plan(world)  # type: ignore[attr-defined]
            took = time.process_time() - cpu, time.perf_counter() - wall
        cpus.append(1e3 * took[0])
        walls.append(1e3 * took[1])
        firsts.append(1e3 * result.stats.first_solution_s)
        nodes.append(result.stats.nodes)
    whole = [np.median(walls), *np.percentile(walls, [95.0, 99.0]), max(walls)]
    return (
        f"{np.nanmedian(firsts):.1f} | {' / '.join(f'{value:.1f}' for value in whole)} "
        f"| {np.median(cpus):.1f} | {np.median(nodes):.0f}"
    )


def rate(worlds: list[World], config: ShipLatticeConfig) -> str:
    """Nodes of exhaustive searches, and how many are expanded in a second of CPU time."""
    total, seconds = 0, 0.0
    for world in worlds:
        radius = turning_radius(world.robot, config.turn_fraction)
        builder = LatticeBuilder(
            world, config, radius=radius, side=0.0, floe_costs=partial(floe_costs, config)
        )
        star, _ = open_search(builder.build(), builder)
        star.lattice = star.lattice._replace(inflation=0.0)
        began = time.process_time()
        star.run(10**9)
        seconds += time.process_time() - began
        total += star.expanded
    return f"{total / len(worlds):.0f} | {total / seconds:,.0f}"


def picture(file: Path, seed: int) -> None:
    """Draw the first plan of every planner on one field of 30 %."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    (world,) = starts(1, seed, 30, {})
    figure, axes = plt.subplots(figsize=(6.4, 5.4), dpi=110)
    outlines = [world.movables.outline_world(k) for k in range(len(world.movables))]
    floes = PolyCollection(outlines, facecolor="#dce6ee", edgecolor="#9fb2c0", linewidth=0.5)
    axes.add_collection(floes)
    hulls = PolyCollection(world.robot_outline_world(), facecolor="#444444", zorder=5)
    axes.add_collection(hulls)
    names = [name for name in POLICIES if name not in ("geometric-rrt", "ship-predictive-network")]
    for name, color, dashes in zip(names, SERIES, DASHES, strict=False):
        plan = make_planner(name).plan(world).plan
        if plan is not None:
            line = {"color": color, "linestyle": dashes, "linewidth": 1.8}
            axes.plot(*plan.poses[:, :2].T, label=name, **line)
    axes.axhline(9.0, color="#666666", linestyle="--", linewidth=0.8)
    axes.set(aspect="equal", xlim=world.static.bounds[[0, 2]], ylim=(0.0, 9.6))
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, 1.13), ncols=3, frameon=False)
    figure.savefig(file, bbox_inches="tight")


if __name__ == "__main__":
    main()
