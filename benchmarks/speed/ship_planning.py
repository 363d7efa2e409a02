"""Times of planning calls of the ship planners, without a stop rule.

    python -m benchmarks.speed.ship_planning [--scenes 20] [--ice 10,30]
    python -m benchmarks.speed.ship_planning --sweeps [--scenes 3]

First plan of an episode in Ship-Ice 2D, 9 and 39 m from the goal line. With --sweeps: the ratio of
the time of a prediction through concave floes to that through their convex hulls.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from benchmarks.reporting import command_line, head, percentiles, row, write
from pushplan.envs.tasks.ship_ice import ShipIceTask
from pushplan.interaction.ice_interaction import IceInteraction
from pushplan.motion.speed_profile import turning_radius
from pushplan.motion.state_lattice.lattice_builder import LatticeBuilder
from pushplan.motion.state_lattice.lattice_search import open_search
from pushplan.planners import make_planner
from pushplan.planners.ship_lattice import ShipLatticeConfig
from pushplan.planners.ship_lattice.ship_lattice import floe_costs
from pushplan.world import Movables, Planner, World, stream
from pushplan.world.checks import FloatArray

BASE = "ship-lattice-published"
TIMED = ("skeleton", BASE, "ship-lattice-quick", "ship-lattice", "ship-predictive")
COLUMNS = ("first path", "whole call", "CPU median", "nodes")
ICE = (10, 20, 30, 40, 50)
SWEEPS = 5  # of each world, of which the quickest counts


def times(shares: Sequence[int], fields: int, seed: int) -> None:
    """Times of planning calls and node rates."""
    write("Times in ms: median of the first path; median / p95 / p99 / worst of whole calls.\n")
    head("goal, ice", "planner", *COLUMNS)
    for distance in (8.0, 38.0):
        for ice in shares:
            worlds = starts(fields, seed, ice, {"goal_distance": distance})
            for name in TIMED:
                times_of = call_times(make_planner(name), worlds)
                row(f"{distance + 1:.0f} m, {ice} %", f"`{name}`", *times_of)
    write("")
    head("search of the lattice to the end, 50 %, 39 m", "nodes", "nodes a second")
    worlds = starts(3, seed, 50, {"goal_distance": 38.0})
    for title, config in (
        ("`ship-lattice`", ShipLatticeConfig()),
        ("`ship-lattice-published`", ShipLatticeConfig.published()),
    ):
        row(title, *rate(worlds, config))


def sweeps(shares: Sequence[int], fields: int, seed: int) -> None:
    """CPU times of predictions through concave floes and through their hulls, in turns."""
    head("ice", "floes", "parts of a floe", "concave [ms]", "hulls [ms]", "ratio")
    for ice in shares:
        parts = []
        times = np.full((fields, 2), np.inf)
        for k, world in enumerate(starts(fields, seed, ice, {"floes": "real"})):
            floes = world.movables
            outlines = [floes.outline_world(i) for i in range(len(floes))]
            hulls = replace(world, movables=Movables.from_polygons(outlines, density=1.0))
            parts.append((len(floes), len(floes.part_offsets) / len(floes)))
            for _ in range(SWEEPS):
                for i, one in enumerate((world, hulls)):
                    began = time.process_time()
                    IceInteraction().sweep(one, winding_path(world))
                    times[k, i] = min(times[k, i], time.process_time() - began)
        count, of_one = np.mean(parts, axis=0)
        concave, convex = 1e3 * times.mean(axis=0)
        ratio = f"{concave / convex:.2f}"
        row(f"{ice} %", f"{count:.0f}", f"{of_one:.1f}", f"{concave:.1f}", f"{convex:.1f}", ratio)


def winding_path(world: World) -> FloatArray:
    """Poses (400, 3) from the start to the end of the channel, to and fro by 1.5 m."""
    x, y, heading = world.robot_pose
    along = np.linspace(0.0, float(world.static.bounds[3]) - y - 2.0, 400)
    turns = heading - np.arctan(0.5 * np.cos(along / 3.0))
    return np.stack([x + 1.5 * np.sin(along / 3.0), y + along, turns], axis=1)


def starts(fields: int, seed: int, ice: int, variations: dict[str, Any]) -> list[World]:
    """The worlds at the start of some episodes."""
    task = ShipIceTask(variations={"concentration": ice / 100.0, **variations})
    return [task.start(stream(seed + k, "layout")) for k in range(fields)]


def rate(worlds: list[World], config: ShipLatticeConfig) -> tuple[str, str]:
    """Nodes of exhaustive searches, and how many are expanded in a second of CPU time."""
    total = 0
    seconds = 0.0
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
    return f"{total / len(worlds):.0f}", f"{total / seconds:,.0f}"


def call_times(planner: Planner, worlds: list[World]) -> list[str]:
    """First path, whole call, CPU time and nodes; the second call on each world counts."""
    walls = []
    firsts = []
    cpus = []
    nodes = []
    for world in worlds:
        for _ in range(2):
            cpu = time.process_time()
            wall = time.perf_counter()
            result = planner.plan(world)
            took = time.process_time() - cpu, time.perf_counter() - wall
        cpus.append(1e3 * took[0])
        walls.append(1e3 * took[1])
        firsts.append(1e3 * result.stats.first_solution_s)
        nodes.append(result.stats.nodes)
    middle = (np.nanmedian(firsts), np.median(cpus))
    first, cpu_median = (f"{value:.1f}" for value in middle)
    return [first, " / ".join(percentiles(walls)), cpu_median, f"{np.median(nodes):.0f}"]


def main() -> None:
    """Print the tables of times."""
    parser = command_line(__doc__, scenes=20, seed=0)
    parser.add_argument("--sweeps", action="store_true", help="time predictions, not planners")
    parser.add_argument("--ice", default=",".join(map(str, ICE)), help="concentrations [%%]")
    given = parser.parse_args()
    measure = sweeps if given.sweeps else times
    measure([int(text) for text in given.ice.split(",")], given.scenes, given.seed)


if __name__ == "__main__":
    main()
