"""The sequencing solver: exact times, proofs, and gaps on public instances, as Markdown.

    python -m benchmarks.accuracy.gtsp FOLDER [--seeds 3] [--cpu] [--only exact proofs ...]

FOLDER holds `*.gtsp` and `best_known.csv` (columns instance, nodes, clusters, best_known).
Push-like and unstructured instances are made here, and with `--only families` those of
`gtsp_instances`, four of each from `--family-seed` on. Their gaps are to the cheapest tour that
any run of this command has found; it is kept in `reference/gtsp_families.json`. Times are
wall-clock; the load of the machine is printed. With --cpu all of them, the budgets too, are of
processor time, so that other programs matter less: the solver has one thread.
"""

from __future__ import annotations

import csv
import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.accuracy.gtsp_instances import FAMILIES, SIZES, instance, pushes
from benchmarks.reporting import command_line
from pushplan.gtsp import (
    GtspConfig,
    TourStatus,
    read_gtsp,
    solve_gtsp,
)
from pushplan.world import Deadline

KNOWN = Path(__file__).parents[1] / "reference" / "gtsp_families.json"
FIRST_SEED = 3000
"""Settings were chosen on seeds from 1000 on."""
PARTS = ("exact", "proofs", "unstructured", "public", "families", "large")
PROOF_SECONDS = 10.0
SEARCH_SHARE = 0.02
"""Of these seconds, for the search before the proof."""


def timed(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def exact(seeds: int) -> None:
    print("| exact: boxes x 16 pushes and a start | median | lower quartile |\n|---|---|---|")
    for boxes in (10, 12, 13, 15):
        times = []
        for seed in range(FIRST_SEED, FIRST_SEED + max(seeds, 5)):
            costs, clusters = pushes(boxes, 16, np.random.default_rng(seed))
            config = GtspConfig(method="exact")
            times.append(timed(lambda c=costs, g=clusters, k=config: solve_gtsp(c, g, config=k)))
        low, middle = np.percentile(times, (25, 50)) * 1e3
        print(f"| {boxes} | {middle:.0f} ms | {low:.0f} ms |", flush=True)


def proofs(seeds: int) -> None:
    """20 boxes: when the optimum was found, when it was proven."""
    found = []
    proven = []
    late = 0
    missed = 0
    for seed in range(FIRST_SEED, FIRST_SEED + max(seeds, 20)):
        costs, clusters = pushes(20, 16, np.random.default_rng(seed))
        config = GtspConfig(method="search", lower_bound=True, proof_fraction=1.0 - SEARCH_SHARE)
        tour = solve_gtsp(costs, clusters, stop=Deadline(PROOF_SECONDS), config=config)
        if tour.status is not TourStatus.OPTIMAL:
            missed += 1
            continue
        searched = SEARCH_SHARE * PROOF_SECONDS
        found.append(tour.stats.best_s)
        proven.append(tour.stats.wall_time_s - searched)
        late += tour.stats.best_s > searched + 0.02
    print("\n| 20 boxes x 16 pushes | median | lower quartile | worst |\n|---|---|---|---|")
    for name, times in (("optimum found after", found), ("certificate takes", proven)):
        if times:
            low, middle = np.percentile(times, (25, 50))
            print(f"| {name} | {middle:.3f} s | {low:.3f} s | {max(times):.2f} s |")
    print(
        f"\n{len(found)} proven within {PROOF_SECONDS:g} s, {missed} not; in {late} of them the "
        f"search of {SEARCH_SHARE * PROOF_SECONDS:.1f} s had missed the optimum.",
        flush=True,
    )


def unstructured(seeds: int) -> None:
    print("\n| 20 clusters x 16 nodes, costs 0-999 drawn at random | 1 s | 10 s |\n|---|---|---|")
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        costs = np.random.default_rng(seed).integers(0, 1000, (320, 320))
        clusters = [range(16 * c, 16 * c + 16) for c in range(20)]
        rows = [solve_gtsp(costs, clusters, stop=Deadline(s)).cost for s in (1.0, 10.0)]
        print(f"| seed {seed} | {rows[0]:g} | {rows[1]:g} |", flush=True)


def public(folder: Path, seeds: int) -> None:
    with (folder / "best_known.csv").open() as file:
        known = {row["instance"]: float(row["best_known"]) for row in csv.DictReader(file)}
    print("\n| instance | best known | gap at 1 s (mean, worst) | at 10 s (mean, worst) |")
    print("|---|---|---|---|")
    all_gaps: dict[float, list[float]] = {1.0: [], 10.0: []}
    for name, best in known.items():
        instance = read_gtsp(folder / f"{name}.gtsp")
        cells = []
        for seconds, gaps in all_gaps.items():
            own = []
            for seed in range(FIRST_SEED, FIRST_SEED + seeds):
                rng = np.random.default_rng(seed)
                stop = Deadline(seconds)
                tour = solve_gtsp(instance.costs, instance.clusters, stop=stop, rng=rng)
                own.append(100.0 * (tour.cost / best - 1.0))
            gaps += own
            cells.append(f"{np.mean(own):.2f} %, {max(own):.2f} %")
        print(f"| {name} | {best:g} | {' | '.join(cells)} |", flush=True)
    means = [f"{np.mean(gaps):.3f} %, {max(gaps):.2f} %" for gaps in all_gaps.values()]
    print(f"| all | | {' | '.join(means)} |", flush=True)


def families(first: int, seeds: int, budgets: list[float]) -> None:
    """Gaps on generated instances; writes down tours that are cheaper than those known."""
    known: dict[str, float] = json.loads(KNOWN.read_text()) if KNOWN.exists() else {}
    costs: dict[tuple[str, float], list[tuple[str, float]]] = {}
    for family in FAMILIES:
        for made in range(first, first + len(SIZES)):
            name = f"{family}-{made}"
            (arcs, clusters) = instance(family, made)
            for seconds in budgets:
                for seed in range(FIRST_SEED, FIRST_SEED + seeds):
                    rng = np.random.default_rng(seed)
                    stop = Deadline(seconds)
                    cost = solve_gtsp(arcs, clusters, stop=stop, rng=rng).cost
                    known[name] = min(cost, known.get(name, cost))
                    costs.setdefault((family, seconds), []).append((name, cost))
    KNOWN.write_text(json.dumps(dict(sorted(known.items())), indent=1) + "\n")
    print(f"\n| family | {' | '.join(f'gap at {s:g} s (mean, worst)' for s in budgets)} |")
    print("|---|" + "---|" * len(budgets))
    total: dict[float, list[float]] = {seconds: [] for seconds in budgets}
    for family in FAMILIES:
        cells = []
        for seconds, every in total.items():
            gaps = [100.0 * (cost / known[name] - 1.0) for name, cost in costs[family, seconds]]
            every += gaps
            cells.append(f"{np.mean(gaps):.2f} %, {max(gaps):.2f} %")
        print(f"| {family} | {' | '.join(cells)} |")
    means = [f"{np.mean(gaps):.2f} %, {max(gaps):.2f} %" for gaps in total.values()]
    print(f"| all | {' | '.join(means)} |", flush=True)


def large() -> None:
    """Ten times 20 boxes, with 40 pushes each: 8001 nodes."""
    costs, clusters = pushes(200, 40, np.random.default_rng(FIRST_SEED))
    print("\n| 200 boxes x 40 pushes | cost | wall time |\n|---|---|---|")
    for seconds in (1.0, 10.0):
        tour = solve_gtsp(costs, clusters, stop=Deadline(seconds))
        print(f"| {seconds:g} s | {tour.cost:.2f} | {tour.stats.wall_time_s:.3f} s |", flush=True)


def main() -> None:
    parser = command_line(__doc__, seeds=3)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cpu", action="store_true", help="processor time instead of wall-clock")
    parser.add_argument("--family-seed", type=int, default=13000)
    parser.add_argument("--budgets", type=float, nargs="+", default=[1.0, 10.0], help="families")
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    options = parser.parse_args()
    if options.cpu:
        time.perf_counter = time.process_time
    clock = "processor time" if options.cpu else "wall-clock time"
    print(f"Load of the machine at the start: {os.getloadavg()[0]:.1f}; {clock}\n", flush=True)
    parts: dict[str, Callable[[], None]] = {
        "exact": lambda: exact(options.seeds),
        "proofs": lambda: proofs(options.seeds),
        "unstructured": lambda: unstructured(options.seeds),
        "public": lambda: public(options.folder, options.seeds),
        "families": lambda: families(options.family_seed, options.seeds, options.budgets),
        "large": large,
    }
    for name in options.only:
        parts[name]()


if __name__ == "__main__":
    main()
